"""When work that takes long is to stop."""

from __future__ import annotations

import math
from time import perf_counter

import numpy as np


class Watch:
    """A time limit, and a flag that any thread or signal handler may set, for calls of the core.

    The core looks at it every few milliseconds, also in threads that Ctrl-C does not reach. What
    it stops can go on, from where its results say that it came to. One watch may serve many calls
    and threads. `seconds` are those of the clock, from now on.
    """

    def __init__(self, seconds: float = math.inf) -> None:
        self.deadline = perf_counter() + seconds
        self.flag = np.zeros(1, np.intc)

    def stop(self) -> None:
        """Stops what is watched, and whatever is still to come."""
        self.flag[0] = 1

    @property
    def over(self) -> bool:
        """Whether the time is over, or `stop` was called."""
        return bool(self.flag[0]) or perf_counter() > self.deadline

    @property
    def left(self) -> float:
        """Seconds that are left, above 0, as the limit of a call that takes no watch."""
        return 5e-324 if self.over else max(self.deadline - perf_counter(), 5e-324)
