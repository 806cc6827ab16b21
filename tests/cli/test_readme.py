"""What the README shows is what comes out; that of its main job is in test_paper."""

import subprocess
import sys

import pytest

from tests.cli.readme import CONSOLE, MAIN_JOB, README, assert_shown, blocks


def test_the_two_commands_open_it() -> None:
    opening = README.split("```")[1].splitlines()
    assert [line.split("#")[0].strip() for line in opening] == ["sh", "make paper", "make test"]
    assert README.index("```") < 40


@pytest.mark.parametrize("block", blocks("python"))
def test_its_python_prints_what_it_says(block: str) -> None:
    shown = [line.removeprefix("# ") for line in block.splitlines() if line.startswith("# ")]
    done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True)
    assert done.stderr == ""
    assert done.stdout.splitlines() == shown
    assert len(block.splitlines()) - len(shown) <= 10


@pytest.mark.parametrize("line", [line for line in CONSOLE if line != MAIN_JOB])
def test_its_commands_print_what_it_shows(line: str, command, tmp_path) -> None:
    prompt, program, *arguments = line.split()
    assert (prompt, program) == ("$", ".venv/bin/capsule-sym")
    [device] = blocks("toml")
    (tmp_path / "device.toml").write_text(device)
    assert_shown(line, command(*arguments, cwd=tmp_path).stdout)
