"""Processors of this process, and work that Ctrl-C must not interrupt or that would lose it."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from capsule_sym._arrays import Matrix


def processors() -> int:
    """Number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def deferred() -> Iterator[None]:
    """Context of work that Ctrl-C must not interrupt, such as drawing: its handler runs afterwards.

    Also for calls of libraries that drop exceptions, and with them the interrupt. It changes
    nothing in threads other than the main one, and where Ctrl-C has no handler.
    """
    came: list[Any] = []
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield  # it comes to the main thread alone
        return
    signal.signal(signal.SIGINT, lambda *at: came.append(at))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if came:
            handler(*came[0])


def sobol(dimension: int, count: int, seed: int) -> Matrix:
    """Points of a scrambled Sobol sequence in the unit cube, shape (count, dimension)."""
    with deferred():  # SciPy loads the sequence's table in code that drops exceptions
        from scipy.stats import qmc

        sequence = qmc.Sobol(dimension, rng=seed)
        found: Matrix = sequence.random_base2(int(count - 1).bit_length())[:count]
    return found
