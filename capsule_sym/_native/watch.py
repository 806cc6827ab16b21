"""When work that takes long is to stop."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextvars import ContextVar, Token
from time import perf_counter
from types import TracebackType

import numpy as np

_LONGEST = 1e9  # seconds, over which none is waited for


class TimeUp(Exception):
    """Raised in work that a watch limits, where its time is over."""

    def __init__(self, watch: Watch) -> None:
        super().__init__("the time is over")
        self.watch = watch


class Watch:
    """A time limit, and a flag that any thread or signal handler may set, for calls of the core.

    The core looks at it every few milliseconds, also in threads that Ctrl-C does not reach. What
    it stops can go on, from where its results say that it came to. One watch may serve many calls
    and threads. `seconds` are those of the clock, from now on.

    In `with Watch(seconds):` all work that calls `check_time` has no more time than that, nor than
    what is around it; where that is what ends it, the block is left, and what follows it is run.
    """

    interrupted = False
    """Whether all watches are over: so Ctrl-C ends work of which a command shows what is done."""

    def __init__(self, seconds: float = math.inf) -> None:
        self.deadline = perf_counter() + seconds
        self._outer: Token[Watch] | None = None
        self.flag = np.zeros(1, np.intc)

    def stop(self) -> None:
        """Stops what is watched, and whatever is still to come."""
        self.flag[0] = 1

    @property
    def stopped(self) -> bool:
        """Whether `stop` was called."""
        return bool(self.flag[0])

    @property
    def over(self) -> bool:
        """Whether the time is over, or `stop` was called."""
        return self.stopped or Watch.interrupted or perf_counter() > self.deadline

    @property
    def left(self) -> float:
        """Seconds that are left, above 0 and finite, as the limit of a call that takes no watch."""
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
    """The watch of the work that is done here, of those around it the one that ends first."""
    return _PRESENT.get()


def check_time() -> None:
    """Raises TimeUp where the present watch is over."""
    watch = present()
    if watch.over:
        raise TimeUp(watch)


TOLD: ContextVar[Callable[[str], object]] = ContextVar("told", default=lambda said: None)
"""Takes what work that takes long says of itself."""
