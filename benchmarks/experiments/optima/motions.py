"""Metrics of the motions that a start leads to, by runs and stroboscopic repeats alone.

This is the judge's own: nothing of what optimises is imported. A run continues until its transients
have decayed; the motion on which it repeats itself is closed by the core, and counts if it is
stable and the run comes closer to it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym import performance_many, simulate_many
from capsule_sym._orbits.interface import METRICS
from capsule_sym._parameters import CAPSULE, Scene

LONGEST = 16  # excitation periods of the longest motion
LENGTHS = (16, 32, 64, 128, 256, 512)  # excitation periods of runs by their damping
DECAY, LONG_DECAY = 5.0, 20.0  # e-foldings of the linear transients within them
REPEATED, NEAR, ON = 1e-2, 1e-3, 1e-7  # distances over the size of a motion
MORE = (16, 64, 256)  # periods of a motion after which a run is to be closer to it
STILL = 1e-12  # progression of a motion that goes nowhere
Vector = NDArray[np.float64]


class Motions(NamedTuple):
    """Of n runs the metrics by name and the largest multiplier; nan where none has settled."""

    metrics: dict[str, Vector]
    multiplier: Vector
    state: Vector
    period_number: NDArray[np.int64]


def settled(
    rows: Vector, start: tuple[float, ...], sure: bool = False, scene: Scene = CAPSULE
) -> Motions:
    """The motions of rows of parameters, from a start.

    Runs are as long as transients take by damping alone, short for a survey; where it has to be
    `sure` they are long, and have to come closer to the motion if they are not on it yet.
    """
    count = len(rows)
    found = np.full((count, len(METRICS)), np.nan)
    multiplier, states = np.full(count, np.nan), np.full((count, 3), np.nan)
    numbers = np.zeros(count, np.int64)
    omega, zeta = (rows[:, scene.facts.PARAMETERS.index(name)] for name in ("omega", "zeta"))
    needed = (LONG_DECAY if sure else DECAY) * omega / (math.tau * zeta)
    length = np.array(LENGTHS)[np.searchsorted(LENGTHS[:-1], needed)]
    ends = np.full((count, 3), np.nan)
    for one in np.unique(length).tolist():
        at = np.flatnonzero(length == one)
        run = simulate_many(rows[at], start, periods=one, scene=scene)
        ends[at[run.success]] = run.states[run.success]

    def close(at: NDArray[Any], number: int) -> None:
        closed = performance_many(rows[at], ends[at], number, scene=scene)
        largest = abs(closed.multipliers[:, 0])
        size = 1 + abs(ends[at]).max(axis=1)
        off = abs(closed.states - ends[at]).max(axis=1) / size
        good = closed.closed & (largest < 1) & (off < REPEATED)
        good &= np.isfinite(closed.values).all(axis=1)
        if sure and (slow := np.flatnonzero(good & (off > ON))).size:
            state, before = ends[at[slow]], off[slow]
            closer = np.zeros(len(slow), bool)
            for more in MORE:
                run = simulate_many(rows[at[slow]], state, periods=more * number, scene=scene)
                after = abs(closed.states[slow] - run.states).max(axis=1) / size[slow]
                closer |= (before < NEAR) & (after < before)
                if closer.all():
                    break
                state, before = run.states, after
            good[slow] = closer
        found[at[good]], multiplier[at[good]] = closed.values[good], largest[good]
        states[at[good]], numbers[at[good]] = closed.states[good], number

    left = np.flatnonzero(np.isfinite(ends[:, 0]))
    if left.size:
        close(left, 1)
    left = left[numbers[left] == 0]
    if left.size:
        run = simulate_many(
            rows[left], ends[left], periods=2 * LONGEST, keep="stroboscopic", scene=scene
        )
        marks = run.kept.reshape(len(left), -1, 3)
        changes = np.stack(
            [abs(marks[:, -1] - marks[:, -1 - k]).max(axis=1) for k in range(1, LONGEST + 1)]
        )
        best = changes.argmin(axis=0) + 1
        for number in range(2, LONGEST + 1):
            # A multiple of the period number repeats as well: the smallest that does so counts.
            near = changes[number - 1] <= np.maximum(10 * changes.min(axis=0), 1e-6)
            chosen = left[near & (numbers[left] == 0) & (best % number == 0)]
            if chosen.size:
                close(chosen, number)
    return Motions(_named(found, rows, scene), multiplier, states, numbers)


def _named(found: Vector, rows: Vector, scene: Scene) -> dict[str, Vector]:
    """METRICS (n, 7) and what is derived from them, as the documentation defines it."""
    own = dict(zip(scene.facts.PARAMETERS, rows.T, strict=True)) | dict(
        zip(METRICS, found.T, strict=True)
    )
    for name in ("velocity", "progression"):
        own[name] = np.where(abs(own["progression"]) < STILL, 0 * own[name], own[name])
    way, nowhere = abs(own["progression"]), np.full(len(rows), np.inf)
    forward, backward = (own.get(scene.facts.BOUNDS.get(sign), nowhere) for sign in (1, -1))
    bound = np.where(own["progression"] < 0, backward, forward)
    with np.errstate(divide="ignore", invalid="ignore"):
        own["speed"] = abs(own["velocity"])
        own["power"] = own["work"] * own["omega"] / math.tau
        own["speed_per_work"] = np.where(own["work"] > 0, way / own["work"], 0 * way)
        own["cost_of_transport"] = np.where(way == 0, np.inf, own["work"] / (bound * way))
    return own


def stays(row: Vector, start: tuple[float, ...], motion: Motions, scene: Scene) -> bool:
    """True if a run of 20,000 periods from the start ends on its motion, or still comes closer."""
    number = int(motion.period_number[0])
    offs, state = [], np.array(start)
    for _ in range(2):
        length = 10_000 // number * number
        run = simulate_many(row[None], state, periods=length, scene=scene)
        state = run.states[0]
        offs.append(abs(state - motion.state[0]).max() / (1 + abs(state).max()))
    return bool(offs[1] < ON or (offs[1] < offs[0] < NEAR))
