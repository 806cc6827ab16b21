"""Times of a device's design: metrics of cells, derivatives, optima, fits.

Each part of `PARTS` yields goals with what was reached. Times are processor time, the best of the
repeats.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

from benchmarks.speed.goals import Goal
from capsule_sym import (
    Parameters,
    continue_attractors,
    fit,
    optimise,
    pareto,
    performance_many,
    run_sweep,
    sensitivities,
    simulate,
    simulate_many,
    solve_orbit,
)
from capsule_sym.inputs import Axis, Sweep
from capsule_sym.orbits import solve_itinerary
from capsule_sym.results import Itinerary

_SEGMENTS = ((100, 0.01), (400, 0.03), (1600, 0.5), (4096, 3.0))  # of an itinerary, and seconds
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
    rows, columns = (128 if quick else 1024), 8
    alpha, gamma = np.linspace(0.02, 2.0, rows), np.geomspace(1.0, 5.0, columns)
    chart = Sweep(
        (Axis.of("alpha", alpha), Axis.of("gamma", gamma)),
        periods=_PERIODS,
        compute=("itinerary", "progression", "multipliers", "energies", "forces"),
        chunk=(rows, columns),
    )

    def run() -> None:
        with TemporaryDirectory() as folder:
            run_sweep(chart, Path(folder, "chart"), workers=1)

    rate = chart.size * _PERIODS / best(run, repeats)
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


_BOUNDS = {"alpha": (0.1, 2.0), "omega": (0.5, 1.5), "delta": (0.0, 0.5)}
_COLD = "from capsule_sym import optimise; optimise('speed_per_work', {bounds!r})"


def optima(quick: bool, repeats: int) -> Iterator[Goal]:
    """The most economical drive, in a process that has imported nothing, and a Pareto front."""
    code = _COLD.format(bounds=_BOUNDS)
    times = []
    for _ in range(repeats):
        before = os.times()
        # In a session of its own, Ctrl-C is for this process alone, which ends that one.
        subprocess.run([sys.executable, "-c", code], check=True, start_new_session=True)
        after = os.times()
        spent = after.children_user - before.children_user
        times.append(spent + after.children_system - before.children_system)
    yield Goal("optimum over alpha, omega, delta, a new process", min(times), "s", "<=", 2.0)
    found = optimise("speed_per_work", _BOUNDS)
    yield Goal("residual of its conditions", found.residual, "", "<=", 1e-9)
    side = 20 if quick else 100
    beyond = _best_cell(side) - found.value
    yield Goal("what a cell of a survey gains over it", beyond, f"of {side**3:,}", "<=", 0.0)
    points = 5 if quick else 50
    begin = process_time()
    pareto("speed", "cost_of_transport", _BOUNDS, points=points)
    spent = process_time() - begin
    yield Goal(f"Pareto front, {points} points", spent, "s", "<=", 10.0)


def _best_cell(side: int) -> float:
    """The greatest progression per work of a grid of side^3 cells, each from rest, settled."""
    best_one = 0.0
    usual = np.array(list(Parameters().to_dict().values()))
    alpha, omega, delta = (np.linspace(*ends, side) for ends in _BOUNDS.values())
    for one in omega:  # the core takes runs of one frequency side by side
        rows = np.tile(usual, (side * side, 1))
        rows[:, 0], rows[:, 1], rows[:, 2] = np.repeat(alpha, side), one, np.tile(delta, side)
        ended = simulate_many(rows, periods=_PERIODS)
        found = performance_many(rows, ended.states, forces=False)
        stable = found.closed & (abs(found.multipliers[:, 0]) < 1) & (found["work"] > 0)
        ratio = abs(found["progression"][stable]) / found["work"][stable]
        best_one = max(best_one, float(ratio.max(initial=0.0)))
    return best_one


def fits(quick: bool, repeats: int) -> Iterator[Goal]:
    """Four parameters and the start from noisy positions of both bodies, 1,000 times each."""
    names = ("alpha", "zeta", "beta", "gamma")
    truth, start = Parameters(0.83, 0.8, 0.03, 0.06, 1.7, 3.3), (0.1, 0.2, 0.3)
    true = [*(getattr(truth, name) for name in names), *start]
    guess = truth.replace(alpha=0.85, zeta=0.055, beta=1.65, gamma=3.2)
    draw, times, within = np.random.default_rng(0), list[float](), 0
    sets = 10 if quick else 200
    for _ in range(sets):
        t = np.concatenate([[0.0], np.sort(draw.uniform(0, 60, 999))])
        x_r, _, _, x_c = simulate(truth, start, periods=8)(t, position=True).T
        noise = 0.005 * draw.normal(size=(2, 1000))
        data = {"t": t, "x_m": x_r + x_c + noise[0], "x_c": x_c + noise[1]}
        begin = process_time()
        found = fit(data, guess, (*names, "x_r", "v_r", "v_c"), state=(0.12, 0.15, 0.25))
        times.append(process_time() - begin)
        off = np.array(list(found.values.values())) - true
        within += bool(np.all(abs(off) < 3 * np.array(list(found.standard_errors.values()))))
    yield Goal("fit of 4 parameters and the start to 2,000 samples", min(times), "s", "<=", 1.0)
    share = 100 * within / sets
    yield Goal(f"of {sets} fits, all 7 within 3 standard errors", share, "%", ">=", 95.0)


def itineraries(quick: bool, repeats: int) -> Iterator[Goal]:
    """Orbits of long itineraries, solved from a guess beside them."""
    orbit = solve_orbit(Parameters(alpha=0.7))
    for count, goal in _SEGMENTS[:2] if quick else _SEGMENTS:
        times = count // len(orbit.itinerary)
        long = Itinerary(times * orbit.itinerary.segments, times)
        z = np.array([*orbit.z[:4], *(times * orbit.z[4:].tolist())])
        z *= 1 + 1e-9 * np.sin(np.arange(len(z)))
        taken = best(partial(solve_itinerary, orbit.parameters, long, z.tolist()), repeats)
        yield Goal(f"orbit of {count:,} segments by its itinerary", taken, "s", "<=", goal)


def attractors(quick: bool, repeats: int) -> Iterator[Goal]:
    """All attractors along a parameter, where they are born and die, by two threads."""
    values, starts = (10, 40) if quick else (100, 400)
    system = Parameters(omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    box = {"x_r": (-2.0, 2.0), "v_r": (-2.0, 2.0)}
    given = system, "alpha", np.linspace(0.5, 4.0, values), box
    begin = process_time()
    found = continue_attractors(*given, count=starts, threads=2)
    taken = process_time() - begin
    what = f"attractors at {values} values from {starts} starts each, both cores"
    yield Goal(what, taken, "s", "<=", 20.0)
    located = sum(one.bifurcation is not None for one in found.changes)
    share = 100 * located / len(found.changes)
    yield Goal(f"of {len(found.changes)} births and deaths, located", share, "%", ">=", 100.0)


PARTS = (cells, derivatives, optima, fits, itineraries, attractors)


def goals(quick: bool, repeats: int) -> Iterator[Goal]:
    """All of them, part by part as they come."""
    for part in PARTS:
        yield from part(quick, repeats)
