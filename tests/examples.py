"""The examples of the README and of the documentation, and what is shown of their output."""

import re
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).parents[1]


class Page:
    """A page of Markdown: its text, its fenced blocks, and the commands it shows."""

    def __init__(self, path: Path) -> None:
        self.name = path.relative_to(ROOT).as_posix()
        self.text = path.read_text(encoding="utf-8")

    def blocks(self, language: str) -> list[str]:
        """The texts of the fenced blocks in a language."""
        return re.findall(rf"^```{language}\n(.*?)^```$", self.text, re.M | re.S)

    @cached_property
    def console(self) -> dict[str, list[str]]:
        """Lines shown, by the line of their command."""
        return {block.splitlines()[0]: block.splitlines()[1:] for block in self.blocks("console")}

    def assert_shown(self, command: str, output: str) -> None:
        """The lines below a command are those of its output, but for what `...` leaves out."""
        lines = iter([line.rstrip() for line in output.splitlines()])
        skipping = False
        for line in self.console[command]:
            if line == "...":
                skipping = True
            elif skipping:
                assert line in lines  # advances to the first line that is equal
                skipping = False
            else:
                assert line == next(lines)
        assert skipping or not any(lines)


def shown(block: str) -> list[str]:
    """Output that a block of Python announces, in comments on lines of their own."""
    return [line.removeprefix("# ") for line in block.splitlines() if line.startswith("# ")]


README = Page(ROOT / "README.md")
PAGES = [
    Page(path) for home in ("docs", "paper/pages") for path in sorted((ROOT / home).rglob("*.md"))
]

MAIN_JOB = "$ make paper"
