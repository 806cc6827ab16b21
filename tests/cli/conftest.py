import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

Command = Callable[..., subprocess.CompletedProcess[str]]


def call(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "capsule_sym", *arguments],
        capture_output=True,
        encoding="utf-8",
        check=False,
        cwd=cwd,
        timeout=300,
    )


@pytest.fixture(scope="session")
def command() -> Command:
    """Runs `capsule-sym` as a process of its own."""
    return call


@dataclass(frozen=True)
class PaperRun:
    done: subprocess.CompletedProcess[str]
    results: Path


@pytest.fixture(scope="session")
def paper_run(tmp_path_factory: pytest.TempPathFactory) -> PaperRun:
    """One whole `capsule-sym paper`, where older results stand in the way."""
    directory = tmp_path_factory.mktemp("paper")
    results = directory / "results" / "paper"
    results.mkdir(parents=True)
    (results / "cases.csv").write_text("older results\n")
    return PaperRun(call("paper", cwd=directory), results)
