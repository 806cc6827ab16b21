"""Runs on a graphics card beside the processor: speed, what is handed back, and what differs."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.hardcases.starts import random_start
from benchmarks.speed.goals import Goal
from capsule_sym._map.many import simulate_many
from capsule_sym._native import core_on
from capsule_sym._parameters import CAPSULE
from capsule_sym._sweeps.axes import Axis
from capsule_sym._sweeps.cells import compute
from capsule_sym._sweeps.sweep import Sweep

PERIODS = 100
METRICS = ("itinerary", "progression", "energies", "forces")
RATE = "million periods/s"


def goals(quick: bool) -> Iterator[Goal]:
    """Figures of the card and what they have to be; raises InvalidInput without a card."""
    side = 100 if quick else 1000
    base = np.array([*CAPSULE.Parameters().to_dict().values()])
    rows = np.tile(base, (side**2, 1))
    rows[:, 0] = np.linspace(0.01, 2.0, len(rows))
    list(ends("first launch", rows[:1], 0.0, 0.0, np.nan))  # compiles
    yield from ends("final states over alpha", rows, 0.0, 0.0, 100.0)
    yield from chart("chart with metrics", side, METRICS, 20.0)
    yield from chart("chart of itineraries", side, ("itinerary",), np.nan)
    random = Random("gpu")
    hard = [random_start(random).start for _ in range(side**2)]
    rows = np.array([[*start.parameters.to_dict().values()] for start in hard])
    states, phases = np.array([s.state for s in hard]), np.array([s.phase for s in hard])
    yield from ends("starts near tangencies", rows, states, phases, np.nan)


def ends(what: str, rows: Any, states: Any, phases: Any, goal: float) -> Iterator[Goal]:
    """Rate of runs, and the number of those that end elsewhere on the processor."""
    begin = perf_counter()
    found = simulate_many(rows, states, phases, PERIODS, device="gpu").states
    yield Goal(what, len(rows) * PERIODS / (perf_counter() - begin) / 1e6, RATE, ">=", goal)
    off = abs(simulate_many(rows, states, phases, PERIODS).states - found).max(axis=1)
    yield Goal(what, float((off > 1e-9).sum()), "ends off by more than 1e-9", "<=", 0.0)


def chart(what: str, side: int, quantities: tuple[str, ...], goal: float) -> Iterator[Goal]:
    """Rate of a chart, the share handed back, and the number of cells with another itinerary."""
    axes = Axis.linear("alpha", 0.02, 2.0, side), Axis.log("gamma", 1.0, 5.0, side)
    sweep = Sweep(axes, periods=PERIODS, compute=quantities, chunk=(side, side))
    card = core_on("gpu", CAPSULE)
    before, begin = card.handed_back, perf_counter()
    found = compute(sweep, device="gpu").columns
    yield Goal(what, sweep.size * PERIODS / (perf_counter() - begin) / 1e6, RATE, ">=", goal)
    back = 100.0 * (card.handed_back - before) / sweep.size
    yield Goal(what, back, "% handed back", "<=", 1.0)
    other = found["itinerary"] != compute(sweep).columns["itinerary"]
    yield Goal(what, float(other.sum()), "cells of another itinerary", "<=", 0.0)
