import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

Command = Callable[..., subprocess.CompletedProcess[str]]

# Wall-clock limits on single examples measure how busy the machine is, not the code.
settings.register_profile("capsule-sym", deadline=None)
settings.load_profile("capsule-sym")


def call(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "capsule_sym", *arguments],
        capture_output=True,
        encoding="utf-8",
        check=False,
        cwd=cwd,
    )


@pytest.fixture(scope="session")
def command() -> Command:
    """Runs `capsule-sym` as a process of its own."""
    return call
