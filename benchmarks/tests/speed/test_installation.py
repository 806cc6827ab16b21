"""`installation`: what it counts, and the lines that it prints."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.speed import installation
from benchmarks.speed.commands import installation as command
from benchmarks.speed.goals import Goal

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="processor times of children")


def test_the_time_is_that_of_a_process_and_of_what_it_starts(tmp_path: Path) -> None:
    burn = "import time\nwhile time.process_time() < 0.4: pass"
    child = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {burn!r}])"
    assert installation._processor_time("-c", child, at=tmp_path) >= 0.4
    with pytest.raises(RuntimeError, match="out\nwrong"):
        installation._processor_time(
            "-c", "import sys; print('out'); sys.exit('wrong')", at=tmp_path
        )


def test_what_is_built_from_is_what_is_under_version_control(tmp_path: Path) -> None:
    installation._copy(tmp_path / "copy")
    assert (tmp_path / "copy/capsule_sym/generated").is_symlink()
    assert not (tmp_path / "copy/.venv").exists()


def test_the_command_prints_each_goal(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [Goal("an installation", 61.5, "s", "<=", 60.0)]
    monkeypatch.setattr(installation, "goals", lambda paper: iter(found))
    printed = CliRunner().invoke(command, ["--paper"])
    assert printed.exit_code == 0
    assert all(word in printed.stdout for word in ("an installation", "61.5", "<= 60", "no"))
