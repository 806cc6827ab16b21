"""The second checker, put to what the first one accepts and refuses."""

from __future__ import annotations

from types import ModuleType

import pytest

from paper.proofs import second_checker
from paper.tests.proofs.test_checker_tampered import *  # noqa: F403
from paper.tests.proofs.test_checker_terms import *  # noqa: F403
from tests.enclosures import certified
from tests.enclosures.test_checker_orbits import *  # noqa: F403 - the same tests
from tests.enclosures.test_run_certificates import *  # noqa: F403

pytestmark = pytest.mark.long


@pytest.fixture
def module() -> ModuleType:
    """The checker."""
    return second_checker


@pytest.fixture
def few() -> int:
    """Number of a kind and a certificate."""
    return 1


@pytest.fixture(autouse=True)
def second(monkeypatch: pytest.MonkeyPatch) -> None:
    """Puts certificates to the second checker, where the tests name none."""
    monkeypatch.setattr(certified, "checker", second_checker)
