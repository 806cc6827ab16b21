"""Growth of the time of this map in C with periods, batch, threads, stiffness and frequency."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from statistics import median
from typing import NamedTuple

import numpy as np

from capsule_sym import Parameters, simulate, simulate_many

_BATCH_PERIODS = 10
_COUNTED = 20  # excitation periods of which switches are counted


class Growth(NamedTuple):
    """Time of one call for `runs` runs of `periods` each."""

    against: str
    """Varied quantity: "periods", "batch", "threads", "beta" or "omega"."""
    value: float
    runs: int
    periods: int
    threads: int
    us_per_period: float
    """Wall time by periods of all runs, median of the repeats."""
    switches_per_period: float | None
    """Of the run from rest, where one run is made."""


def growth(repeats: int, most: int, advance: Callable[[], None]) -> list[Growth]:
    """Times with up to `most` periods of one run, and as many runs; `advance` after each."""
    found = []
    for against, value, p, runs, periods, threads in plan(most):
        amplitudes = np.linspace(0.002, 2.0, runs).tolist() if runs > 1 else [p.alpha]
        systems = [p.replace(alpha=alpha) for alpha in amplitudes]
        spent = []
        for _ in range(repeats):
            begin = time.perf_counter()
            simulate_many(systems, periods=periods, threads=threads)
            spent.append(time.perf_counter() - begin)
        each = None
        if runs == 1:
            each = len(simulate(p, periods=_COUNTED).switches) / _COUNTED
        us = median(spent) / runs / periods * 1e6
        found.append(Growth(against, value, runs, periods, threads, us, each))
        advance()
    return found


def plan(most: int) -> Iterator[tuple[str, float, Parameters, int, int, int]]:
    """Varied quantity and its value, parameters, runs, periods and threads of every call."""
    p = Parameters()
    decades = [10**k for k in range(7) if 10**k <= most]
    yield from (("periods", n, p, 1, n, 1) for n in decades[1:])
    yield from (("batch", n, p, n, _BATCH_PERIODS, 1) for n in decades)
    yield from (("threads", n, p, min(1000, most), 100, n) for n in (1, 2))
    yield from (
        ("beta", beta, p.replace(beta=beta), 1, 1000, 1) for beta in (0.0, 1e-3, 1.5, 1e3, 1e6)
    )
    for omega in (1e-2, 0.1, 0.8, 10.0, 100.0):
        # A faster excitation is as much stronger as makes the motion switch all the same.
        alpha = p.alpha * max(1.0, (omega / p.omega) ** 2)
        yield "omega", omega, p.replace(omega=omega, alpha=alpha), 1, 1000, 1
