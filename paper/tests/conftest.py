from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from capsule_sym._cli import _status
from paper.__main__ import group


@pytest.fixture
def inside_paper(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs `python -m paper` within this process."""

    def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
        monkeypatch.chdir(cwd)
        capsys.readouterr()
        status = _status([*arguments], group)
        return subprocess.CompletedProcess(arguments, status, *capsys.readouterr())

    return run
