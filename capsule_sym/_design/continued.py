"""Continuation of one motion to many parameter sets at once, along straight lines."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.settled import Settled, attracting
from capsule_sym._map.many import simulate_many
from capsule_sym._native import check_time
from capsule_sym._orbits.metrics.many import Performances, performance_many
from capsule_sym._parameters import Scene

_STEPS = 2, 32  # of a line; the finer ones if the coarse ones lose the motion
_FAR = 0.1  # of a motion's size: a larger distance from the predicted state is another motion
_SAME = 1e-6  # of a motion's size, between two equal ones


def continued(
    own: Settled, row: Vector, found: Settled, rows: Matrix
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks (n,): motions that are the nominal one continued, and sets where that one exists.

    `own` has the nominal motion, at the parameters `row`; `found` the motions at `rows`, (n, k).
    The nominal motion exists at a set if Newton's method continues it along the straight line of
    parameters, through stable or unstable orbits, to a stable one.
    """
    number, scene = int(own.period_numbers[0]), own.found.scene
    there, states = np.zeros(len(rows), bool), np.full((len(rows), 3), np.nan)
    for steps in _STEPS:
        left = np.flatnonzero(~there)
        if len(left):
            there[left], states[left] = _stepped(own.found, number, row, rows[left], steps, scene)
    kept, same = np.zeros(len(rows), bool), np.flatnonzero(there & (found.period_numbers == number))
    if len(same):
        marks = simulate_many(
            rows[same], states[same], periods=number, keep="stroboscopic", scene=scene
        )
        each = marks.kept.reshape(len(same), number + 1, 3)
        apart = abs(each - found.found.states[same, None]).max(axis=2).min(axis=1)
        kept[same] = apart <= _SAME * (1 + abs(each).max(axis=(1, 2)))
    return kept, there


def _stepped(
    own: Performances, number: int, row: Vector, rows: Matrix, steps: int, scene: Scene
) -> tuple[NDArray[np.bool_], Matrix]:
    """Continuation of a motion in so many steps: mask of success, and final states."""
    begin = _closed(row[None], own.states[:1], number, scene)
    states, by = (
        np.repeat(part[:1], len(rows), axis=0) for part in (begin.states, begin.by_parameter)
    )
    alive = np.ones(len(rows), bool)
    ahead = (rows - row) / steps
    for step in range(1, steps + 1):
        check_time()
        some = np.flatnonzero(alive)
        if not len(some):
            break
        at = rows[some] if step == steps else row + step * ahead[some]
        guess = states[some] + np.einsum("nij,nj->ni", by[some], ahead[some])
        found = _closed(at, guess, number, scene)
        far = abs(found.states - guess).max(axis=1) / (1 + abs(guess).max(axis=1))
        good = (attracting(found) if step == steps else found.closed) & (far <= _FAR)
        alive[some[~good]] = False
        states[some[good]], by[some[good]] = found.states[good], found.by_parameter[good]
    return alive, states


def _closed(rows: Matrix, states: Matrix, number: int, scene: Scene) -> Performances:
    """Motions closed near states, with a second try where the first one has other switches."""
    how: dict[str, Any] = {"gradients": True, "scene": scene}
    found = performance_many(rows, states, number, **how)
    open_ = np.flatnonzero(~found.closed & np.isfinite(found.states).all(axis=1))
    if len(open_):
        again = performance_many(rows[open_], found.states[open_], number, **how)
        found.records[open_], found.fields[open_] = again.records, again.fields
    return found
