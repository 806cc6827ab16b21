"""Motions are proved in ball arithmetic, as by the command `verify`."""

import pytest

from capsule_sym._commands.verify import prove_motions


@pytest.fixture(scope="session", autouse=True)
def _motions() -> None:
    prove_motions()
