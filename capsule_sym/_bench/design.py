"""What the design of a device asks for: metrics of every cell, derivatives of a run.

Each part of `PARTS` yields goals with what was reached. Times are processor time, the best of the
repeats.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import process_time

import numpy as np

from capsule_sym._bench.goals import Goal
from capsule_sym._design.sensitivities import sensitivities
from capsule_sym._map import simulate
from capsule_sym._parameters import Parameters
from capsule_sym._sweeps.axes import Axis
from capsule_sym._sweeps.cells import compute
from capsule_sym._sweeps.sweep import Sweep

_PERIODS = 100  # excitation periods of a cell of the chart, and of a run


def best(call: Callable[[], object], repeats: int) -> float:
    """Seconds of processor time that a call takes, the least of the repeats."""
    times = []
    for _ in range(repeats):
        begin = process_time()
        call()
        times.append(process_time() - begin)
    return min(times)


def cells(quick: bool, repeats: int) -> Iterator[Goal]:
    """A chart of the case study with all that is computed of a periodic motion."""
    rows, columns = (32, 2) if quick else (128, 8)
    alpha, gamma = np.linspace(0.02, 2.0, rows), np.geomspace(1.0, 5.0, columns)
    chart = Sweep(
        (Axis.of("alpha", alpha), Axis.of("gamma", gamma)),
        periods=_PERIODS,
        compute=("itinerary", "progression", "multipliers", "energies", "forces"),
        chunk=(rows, columns),
    )
    rate = chart.size * _PERIODS / best(lambda: compute(chart), repeats)
    what = "sweep cell with all metrics and multipliers"
    yield Goal(what, rate / 1e6, "million periods/s and core", ">=", 0.5)


def derivatives(quick: bool, repeats: int) -> Iterator[Goal]:
    """A run with its segments, and with all derivatives of its switches and of its last state."""
    periods = _PERIODS if quick else 10 * _PERIODS
    parameters = Parameters(alpha=1.2)
    run = simulate(parameters, periods=periods)
    end = [periods * parameters.period]
    plain = best(lambda: simulate(parameters, periods=periods), 3 * repeats)
    more = best(lambda: sensitivities(run, end), 3 * repeats)
    what = "run with all sensitivities against plain run"
    yield Goal(what, (plain + more) / plain, "times", "<=", 5.0)


PARTS = (cells, derivatives)


def goals(quick: bool, repeats: int) -> Iterator[Goal]:
    """All of them, part by part as they come."""
    for part in PARTS:
        yield from part(quick, repeats)
