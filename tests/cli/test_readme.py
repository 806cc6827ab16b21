"""Outputs shown in the README; that of the main job is in test_paper."""

import subprocess
import sys

import pytest

from tests.examples import README, shown


def test_the_two_commands_open_it() -> None:
    opening = README.text.split("```")[1].splitlines()
    assert [line.split("#")[0].strip() for line in opening] == ["sh", "make paper", "make test"]
    assert README.text.index("```") < 40


@pytest.mark.parametrize("block", README.blocks("python"))
def test_its_python_prints_what_it_says(block: str) -> None:
    done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True)
    assert done.stderr == ""
    assert done.stdout.splitlines() == shown(block)
    assert len(block.splitlines()) - len(shown(block)) <= 10


@pytest.mark.parametrize("line", README.console)
def test_its_commands_print_what_it_shows(line: str, command, tmp_path) -> None:
    prompt, program, *arguments = line.split()
    assert (prompt, program) == ("$", ".venv/bin/capsule-sym")
    README.assert_shown(line, command(*arguments, cwd=tmp_path).stdout)
