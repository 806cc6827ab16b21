"""The README's blocks, and the comparison of what they show with what comes out."""

import re
from pathlib import Path

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The texts of the fenced blocks in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.M | re.S)


CONSOLE = {block.splitlines()[0]: block.splitlines()[1:] for block in blocks("console")}
"""Lines shown, by the line of their command."""

MAIN_JOB = "$ make paper"


def assert_shown(command: str, output: str) -> None:
    """The lines shown below a command are those of its output, but for what `...` leaves out."""
    lines = iter([line.rstrip() for line in output.splitlines()])
    skipping = False
    for line in CONSOLE[command]:
        if line == "...":
            skipping = True
        elif skipping:
            assert line in lines  # advances to the first line that is equal
            skipping = False
        else:
            assert line == next(lines)
    assert skipping or not any(lines)
