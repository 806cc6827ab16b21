"""Minimal shocks against random knocks: `python -m benchmarks shocks`.

Each motion gets a million knocks; none may be smaller than the minimal shock by 1e-4 of it and lose
the motion. `simulate_many` runs them, and their ends are compared with a run that has settled long
before; no code is shared with the search. Motions in the file of results are not repeated.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym import Parameters, minimal_shock, simulate, simulate_many, solve_orbit
from capsule_sym.results import Orbit, Trajectory

NAMES = ("alpha", "omega", "delta", "zeta", "beta", "gamma")
# Parameters, and the start (x_r, v_r) from which the motion is reached.
MOTIONS = (
    ((2.8, 0.4, 0.02, 0.01, 5.0, 5.0), (0.0, 0.0)),
    ((2.8, 0.4, 0.02, 0.01, 5.0, 5.0), (1.0, 1.0)),
    ((1.0663, 2.1903, 0.6909, 0.029, 28.0035, 6.8652), (0.0, 0.0)),
    ((2.2411, 0.8814, 0.3788, 0.0933, 29.5245, 3.9208), (0.0, 0.0)),
    ((2.717, 2.4224, 0.6463, 0.07556, 9.2553, 0.71764), (0.0, 0.0)),
    ((0.4348, 2.2333, 0.2969, 0.0372, 14.773, 0.5173), (0.0, 0.0)),
    ((2.0473, 2.4739, 0.7928, 0.0366, 13.3038, 4.9875), (0.0, 0.0)),
    ((2.8338, 2.3949, 0.1743, 0.0719, 17.6103, 7.1095), (0.0, 0.0)),
    ((0.4069, 1.5158, 0.3783, 0.0156, 20.3159, 6.8947), (0.0, 0.0)),
    ((0.4504, 1.3857, 0.6834, 0.0792, 20.8794, 6.8539), (0.0, 0.0)),
    ((0.3364, 2.3862, 0.2044, 0.0254, 18.7293, 2.0233), (0.0, 0.0)),
    ((0.7398, 2.3088, 0.3522, 0.0118, 10.2546, 3.3732), (0.0, 0.0)),
)
_AT_ONCE = 20_000
_LOOKS, _MOST = 25, 40  # excitation periods between looks, and how many of these
_BACK = 1e-3  # distance at which a run is back: all that are as near come back
_SMALLER = 1e-4
Vector = NDArray[np.float64]
State = tuple[float, float, float]


def settled(parameters: Any, start: State, number: int) -> tuple[Trajectory, Vector]:
    """A run over so many periods of the motion that a start leads to, and its states at phase 0."""
    end = simulate(parameters, start, periods=4000).final[1]
    run = simulate(parameters, end, periods=number)
    return run, np.array(run.stroboscopic, dtype=float)


def lost(orbit: Orbit, start: State, size: float, count: int, seed: int) -> int:
    """Number of random knocks, of at most a given size, that lose the motion of a start."""
    period, number = orbit.parameters.period, orbit.itinerary.period_number
    random = np.random.default_rng(seed)
    run, marks = settled(orbit.parameters, start, number)
    row = np.array([[*orbit.parameters.to_dict().values()]])
    found = 0
    for first in range(0, count, _AT_ONCE):
        n = min(_AT_ONCE, count - first)
        times = random.uniform(0, number * period, n)
        knocks = random.normal(size=(n, 3))
        sizes = size * np.where(random.random(n) < 0.5, 1.0, random.random(n))
        states = run(times) + (sizes / np.linalg.norm(knocks, axis=1))[:, None] * knocks
        phases = times % period
        for _ in range(_MOST):
            states = simulate_many(
                np.repeat(row, len(states), axis=0), states, phases, _LOOKS
            ).states
            near = np.linalg.norm(states[:, None] - marks, axis=2).min(axis=1)
            states = states[near > min(_BACK, size / 50)]
            phases = np.zeros(len(states))
            if not len(states):
                break
        found += len(states)
    return found


def check(motions: int, knocks: int, out: Path) -> int:
    """Print a line for each motion; how many are lost after a smaller knock."""
    done = json.loads(out.read_text()) if out.exists() else {}
    out.parent.mkdir(parents=True, exist_ok=True)
    bad = 0
    for values, (x_r, v_r) in MOTIONS[:motions]:
        name = f"{values} from {x_r:g}, {v_r:g}, {knocks} knocks"
        if name not in done:
            orbit = solve_orbit(
                Parameters(**dict(zip(NAMES, values, strict=True))), (x_r, v_r, 0.0)
            )
            begun = time.process_time()
            shock = minimal_shock(orbit)
            seconds = time.process_time() - begun
            smaller = lost(orbit, (x_r, v_r, 0.0), (1 - _SMALLER) * shock.size, knocks, 1)
            done[name] = [shock.size, str(shock.status), smaller, seconds]
            out.write_text(json.dumps(done, indent=1))
        size, status, smaller, seconds = done[name]
        bad += smaller > 0
        print(f"{name}: {size:.9g}, {status}, {smaller} smaller, {seconds:.1f} s", flush=True)
    print(f"{bad} motions are lost after a smaller knock")
    return bad
