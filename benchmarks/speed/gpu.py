"""Runs on a graphics card beside one core of the processor: speed, and whether results agree."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.hardcases.starts import random_start
from capsule_sym._map.many import simulate_many
from capsule_sym._native import core_on
from capsule_sym._parameters import CAPSULE
from capsule_sym._sweeps.axes import Axis
from capsule_sym._sweeps.cells import compute
from capsule_sym._sweeps.sweep import Sweep

PERIODS = 100
SHARE = 100  # every so many-th run of the card's is computed by the core as well
METRICS = ("itinerary", "progression", "energies", "forces")


class OnCard(NamedTuple):
    """A measurement: how many runs, in how many seconds, and how they compare."""

    what: str
    device: str
    runs: int
    rate: float
    """Million excitation periods a second."""
    goal: float
    handed_back: float
    """Share of the runs that the card leaves to the core, in percent."""
    worse: int
    """Runs, of those that the core computes as well, that end elsewhere by more than 1e-9."""


def figures(quick: bool) -> Iterator[OnCard]:
    """Each measurement on the card; raises InvalidInput without one. The first launch is before."""
    card, shorter = core_on("gpu", CAPSULE), 100 if quick else 1
    base = np.array([*CAPSULE.Parameters().to_dict().values()])
    alphas = np.tile(base, (10**6 // shorter, 1))
    alphas[:, 0] = np.linspace(0.01, 2.0, len(alphas))
    _ends(alphas[:1], 0.0, 0.0, "gpu")
    yield _measured(card, "final states over alpha", alphas, 0.0, 0.0, 100.0)

    chart = _chart(1000 // (10 if quick else 1), METRICS)
    yield _swept(card, "the same with metrics, a chart", chart, 20.0)
    yield _swept(card, "chart of itineraries", _chart(chart.shape[0], ("itinerary",)), np.nan)

    random = Random("gpu")
    hard = [random_start(random).start for _ in range(10**6 // shorter)]
    rows = np.array([[*start.parameters.to_dict().values()] for start in hard])
    states, phases = np.array([s.state for s in hard]), np.array([s.phase for s in hard])
    yield _measured(card, "starts near tangencies", rows, states, phases, np.nan)


def _chart(side: int, quantities: tuple[str, ...]) -> Sweep:
    alpha, gamma = np.linspace(0.02, 2.0, side), np.geomspace(1.0, 5.0, side)
    axes = Axis.of("alpha", alpha), Axis.of("gamma", gamma)
    return Sweep(axes, periods=PERIODS, compute=quantities, chunk=(side, side))


def _ends(rows: NDArray[Any], states: Any, phases: Any, device: str) -> NDArray[np.float64]:
    return simulate_many(rows, states, phases, PERIODS, device=device).states


def _measured(
    card: Any, what: str, rows: NDArray[Any], states: Any, phases: Any, goal: float
) -> OnCard:
    before, begin = card.handed_back, perf_counter()
    found = _ends(rows, states, phases, "gpu")
    rate = len(rows) * PERIODS / (perf_counter() - begin) / 1e6
    back = 100.0 * (card.handed_back - before) / len(rows)
    few = slice(None, None, SHARE)
    begun, at = (part[few] if np.ndim(part) else part for part in (states, phases))
    off = abs(_ends(rows[few], begun, at, "cpu") - found[few]).max(axis=1)
    return OnCard(what, card.card.name, len(rows), rate, goal, back, int((off > 1e-9).sum()))


def _swept(card: Any, what: str, chart: Sweep, goal: float) -> OnCard:
    before, begin = card.handed_back, perf_counter()
    found = compute(chart, device="gpu").columns
    rate = chart.size * PERIODS / (perf_counter() - begin) / 1e6
    back = 100.0 * (card.handed_back - before) / chart.size
    rows = chart.shape[0] // 10
    part = Sweep((Axis("alpha", ("alpha",), chart.axes[0].values[::10]), chart.axes[1]),
                 periods=PERIODS, compute=chart.compute)  # fmt: skip
    same = compute(part).columns["itinerary"].reshape(rows, -1)
    other = found["itinerary"].reshape(chart.shape)[::10] != same
    return OnCard(what, card.card.name, chart.size, rate, goal, back, int(other.sum()))
