"""Progress in one line on stderr if it is a terminal, and Ctrl-C while it is there."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from capsule_sym._native import Watch

_Item = TypeVar("_Item")
_PAUSE = 0.1  # seconds between two texts


def track(items: Iterable[_Item], text: str, total: float) -> Iterator[_Item]:
    """Yield the items, and show how many of `total` are done."""
    with reporting(text) as report:
        for done, item in enumerate(items):
            report(done, total)
            yield item


@contextmanager
def reporting(text: str, limit: Watch | None = None) -> Iterator[Callable[..., None]]:
    """One line, which is removed at the end; yields the function that updates it.

    It is called as report(said) or report(done, total), and `TOLD` holds it meanwhile. With a limit
    the first Ctrl-C ends the work like a time limit, the next at once. The work itself must have
    `limit.left` as its time limit.
    """
    import signal

    from capsule_sym._native.watch import TOLD, Watch

    terminal, begin, due = sys.stderr.isatty(), perf_counter(), 0.0

    def show(line: str) -> None:
        if terminal:
            # The cursor waits at the left, where the ^C of the terminal is written over.
            width = get_terminal_size().columns - 1
            print(f"\r{line[:width]:{width}}\r", end="", file=sys.stderr, flush=True)

    def report(said: str | float, total: float | None = None) -> None:
        nonlocal due
        if terminal and (now := perf_counter()) >= due:
            told = said if isinstance(said, str) else f"{said:,} of {total:,}"
            show(f"{text}: {told} ({now - begin:.0f} s)")
            due = now + _PAUSE

    def stop(*_: object) -> None:
        signal.signal(signal.SIGINT, before)
        Watch.interrupted = True
        limit.stop()  # type: ignore[union-attr]

    token, before = TOLD.set(report), signal.getsignal(signal.SIGINT)
    if limit is not None:
        signal.signal(signal.SIGINT, stop)
    try:
        show(text)
        yield report
    finally:
        show("")
        TOLD.reset(token)
        if limit is not None:
            Watch.interrupted = False
            signal.signal(signal.SIGINT, before)
