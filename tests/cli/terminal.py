"""A command in a terminal of its own: what stands on its screen, and its exit status."""

import os
import re
import sys
from pathlib import Path
from typing import NamedTuple

import pexpect
import pyte

_ROWS = 500  # enough for all that any command writes
_PATIENCE = 120  # seconds after which a command hangs; none takes nearly as long
_COLOUR = re.compile(r"\x1b\[[0-9;]*(3[0-8]|9[0-7])[0-9;]*m")


class Shown(NamedTuple):
    """Result of a command: exit status, all output, and the final screen."""

    status: int
    written: str
    lines: list[str]
    cursor: bool

    @property
    def coloured(self) -> bool:
        """True if anything was written in colour."""
        return _COLOUR.search(self.written) is not None


def in_terminal(
    *arguments: str,
    columns: int = 80,
    colour: bool = True,
    cwd: Path | None = None,
    interrupt_at: str | None = None,
) -> Shown:
    """Run Python with the arguments in a pseudo-terminal to its end.

    Ctrl-C is typed once `interrupt_at`, a regular expression, matches what was written.
    """
    # Whoever runs the tests may have said how wide and how coloured its own terminal is.
    told = ("NO_COLOR", "FORCE_COLOR", "COLUMNS", "LINES")
    environment = {k: v for k, v in os.environ.items() if k not in told}
    environment |= {"TERM": "xterm-256color", "PYTHONUTF8": "1"}
    environment |= {} if colour else {"NO_COLOR": "1"}
    child = pexpect.spawn(
        sys.executable,
        list(arguments),
        timeout=_PATIENCE,
        cwd=cwd,
        env=environment,
        encoding="utf-8",
        dimensions=(_ROWS, columns),
    )
    written = ""
    try:
        if interrupt_at:
            child.expect(interrupt_at)
            written = child.before + child.after
            child.sendintr()
        child.expect(pexpect.EOF)
        written += child.before
    finally:
        child.close(force=True)
    screen = pyte.Screen(columns, _ROWS)
    pyte.Stream(screen).feed(written)
    lines = [line.rstrip() for line in screen.display]
    while lines and not lines[-1]:
        lines.pop()
    status = child.exitstatus if child.signalstatus is None else -child.signalstatus
    return Shown(status, written, lines, not screen.cursor.hidden)
