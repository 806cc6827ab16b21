"""A command in a terminal of its own: what stands on its screen, and its exit status."""

import os
import re
import select
import subprocess
import sys
import termios
import time
from pathlib import Path
from typing import NamedTuple

_ROWS = 50
_PATIENCE = 120  # seconds after which a command hangs; none takes nearly as long
_CTRL_C = b"\x03"
# Makes the terminal the one that controls the process, so that Ctrl-C reaches it.
_START = (
    "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
)
_ESCAPE = re.compile(r"\x1b\[([?0-9;]*)([A-Za-z])")
_COLOUR = re.compile(r"\x1b\[[0-9;]*(3[0-7]|38|9[0-7])[0-9;]*m")


class Shown(NamedTuple):
    """What a command left: its exit status, all that it wrote, and the lines of the screen."""

    status: int
    written: str
    lines: list[str]

    @property
    def coloured(self) -> bool:
        """Whether anything was written in colour."""
        return _COLOUR.search(self.written) is not None

    @property
    def cursor_is_shown(self) -> bool:
        """Whether the cursor, if it was hidden, was shown again."""
        return self.written.rfind("\x1b[?25h") >= self.written.rfind("\x1b[?25l")


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
    here, there = os.openpty()
    termios.tcsetwinsize(here, (_ROWS, columns))
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    environment |= {"TERM": "xterm-256color", "PYTHONUTF8": "1"} | (
        {} if colour else {"NO_COLOR": "1"}
    )
    process = subprocess.Popen(
        [sys.executable, "-c", _START, *arguments],
        stdin=there,
        stdout=there,
        stderr=there,
        start_new_session=True,
        env=environment,
        cwd=cwd,
    )
    os.close(there)
    written, deadline = b"", time.monotonic() + _PATIENCE
    try:
        while chunk := _read(here, deadline):
            written += chunk
            if interrupt_at and re.search(interrupt_at, written.decode("utf-8", "replace")):
                os.write(here, _CTRL_C)
                interrupt_at = None
        status = process.wait(max(1, deadline - time.monotonic()))
    finally:
        process.kill()
        process.wait()
        os.close(here)
    text = written.decode("utf-8", "replace")
    assert interrupt_at is None, f"{interrupt_at} was never written: {text}"
    return Shown(status, text, screen(text))


def _read(terminal: int, deadline: float) -> bytes:
    """The next bytes; none when every process has closed the terminal."""
    if not select.select([terminal], [], [], max(0, deadline - time.monotonic()))[0]:
        raise TimeoutError(f"a command hung for {_PATIENCE} seconds")
    try:
        return os.read(terminal, 65536)
    except OSError:  # how Linux says that the other end is closed
        return b""


def screen(text: str) -> list[str]:
    """The lines that stand on an endless screen in the end, without empty ones below them."""
    lines, row, column = [""], 0, 0
    while text:
        if escape := _ESCAPE.match(text):
            text = text[escape.end() :]
            count = int(escape[1]) if escape[1].isdigit() else 1
            if escape[2] == "A":
                row = max(0, row - count)
            elif escape[2] == "K" and escape[1] == "2":
                lines[row] = ""
            elif escape[2] not in "mhl":
                raise ValueError(f"an escape sequence that is not known: {escape[0]!r}")
            continue
        letter, text = text[0], text[1:]
        if letter == "\n":
            row += 1
            lines += [""] * (row + 1 - len(lines))
        elif letter == "\r":
            column = 0
        else:
            lines[row] = lines[row][:column].ljust(column) + letter + lines[row][column + 1 :]
            column += 1
    lines = [line.rstrip() for line in lines]
    while lines and not lines[-1]:
        lines.pop()
    return lines
