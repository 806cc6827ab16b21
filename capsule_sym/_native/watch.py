"""Time limits of long work, and its interruption."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextvars import ContextVar, Token
from time import perf_counter
from types import TracebackType

_LONGEST = 1e9  # seconds; longer waits are cut to this


class TimeUp(Exception):
    """Raised in work limited by a watch when its time is over."""

    def __init__(self, watch: Watch) -> None:
        super().__init__("the time is over")
        self.watch = watch


class Watch:
    """Time limit for calls of the core, and a stop flag that any thread or signal handler may set.

    The core checks both every few milliseconds, also in threads that Ctrl-C does not reach; it does
    not see `interrupted`. Stopped work can be resumed from its results. One watch may serve many
    calls and threads. `seconds` are seconds of wall time, from now on.

    In `with Watch(seconds):` all work that calls `check_time` is limited to that time, and to the
    time of enclosing blocks. If its own limit ends the work, the block is left and execution
    continues after it.
    """

    interrupted = False
    """True if all watches are over: Ctrl-C ends the work, and a command shows partial results."""

    def __init__(self, seconds: float = math.inf) -> None:
        self.deadline = perf_counter() + seconds
        self._outer: Token[Watch] | None = None
        self.flag = memoryview(bytearray(4)).cast("i")  # an int of C

    def stop(self) -> None:
        """Stop the watched work, and all later work of this watch."""
        self.flag[0] = 1

    @property
    def stopped(self) -> bool:
        """True if `stop` was called."""
        return bool(self.flag[0])

    @property
    def over(self) -> bool:
        """True if the time is over, or `stop` was called."""
        return self.stopped or Watch.interrupted or perf_counter() > self.deadline

    @property
    def left(self) -> float:
        """Seconds left, above 0 and finite, as the limit of a call that takes no watch."""
        return 5e-324 if self.over else min(max(self.deadline - perf_counter(), 5e-324), _LONGEST)

    def __enter__(self) -> Watch:
        around = present()
        tighter = self if self.deadline < around.deadline else around
        self._outer = _PRESENT.set(tighter)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> bool:
        if self._outer is not None:
            _PRESENT.reset(self._outer)
        return isinstance(error, TimeUp) and error.watch is self


_ENDLESS = Watch()
_PRESENT: ContextVar[Watch] = ContextVar("watch", default=_ENDLESS)


def present() -> Watch:
    """Watch of the present work: of enclosing ones the first to end; an endless one outside."""
    return _PRESENT.get()


def check_time() -> None:
    """Raise TimeUp if the present watch is over."""
    watch = present()
    if watch.over:
        raise TimeUp(watch)


def silent(said: str) -> None:
    """Progress of work whose progress nobody wants to see."""


TOLD: ContextVar[Callable[[str], object]] = ContextVar("told", default=silent)
"""Receives progress messages of long work."""
