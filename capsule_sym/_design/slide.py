"""The last place to which starts lead, on a way downhill along limits.

Where the objective decreases towards a basin boundary along an active limit, the best is where the
two meet. The way follows the limit with the derivatives of the motion; the step to its end is
halved until it is short.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._design.led import led_to
from capsule_sym._design.program import Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._map.labelled import package
from capsule_sym._map.many import simulate_many
from capsule_sym._native import check_time

_TURNS = 6  # ways one after another, each with its limits
_FIRST, _LONGEST, _LAST = 1e-3, 0.02, 1e-8  # of the bounds: steps
_ACTIVE = 1e-6  # slack of an active limit
_PRECISE = 1e-9  # the same, after a correction
_RUN = 256  # excitation periods at least of a run, after which another is to come nearer
_NEAR = 1e-2  # distance of a run from a motion it comes to, over the motion's size
_CORRECTIONS = 3
_LEVEL = 1e-6  # slope, of the objective's own, that counts as none
_BETTER = 1e-9  # units of the objective, that a way has to gain


class _Way(NamedTuple):
    """Direction downhill, and the slacks that stay as they are."""

    along: Vector
    held: NDArray[np.intp]


def slid(program: Program, place: Place) -> Place:
    """The end of a way downhill from a place, as far as the starts lead to its motions."""
    first, own = place, replace(program, again=False)
    for _ in range(_TURNS):
        end = _slid(own, place)
        if end.worst > place.worst - _BETTER:
            break
        place = end
    return place if place is first or led_to(program, place) else first


def room(place: Place) -> int:
    """Number of directions in which a boundary beside a place may extend."""
    bounds = (place.u <= 0.0) | (place.u >= 1.0)
    return max(0, len(place.u) - int(bounds.sum()) - int((place.slacks < _ACTIVE).sum()) - 1)


def _slid(program: Program, place: Place) -> Place:
    """The end of a way on which the limits do not change."""
    way, step, grows = _way(program, place), _FIRST, True
    first = way
    while way is not None and step > _LAST:
        check_time()
        there = _moved(program, place, way, step)
        if there is not None and there.worst < place.worst and _led(program, there):
            place, way = there, _way(program, there)
            if first is None or way is None or not np.array_equal(way.held, first.held):
                break
        else:
            grows = False
        step = min(2 * step, _LONGEST) if grows else step / 2
    return place


def _way(program: Program, place: Place) -> _Way | None:
    """The steepest way downhill within the bounds and active limits; None if there is none."""
    slope = program.by_u(place.objective_by)[int(np.argmax(place.objective))]
    near = np.flatnonzero(place.slacks < _ACTIVE)
    sides = np.diag((place.u <= 0.0).astype(float) - (place.u >= 1.0))
    rows = np.vstack([program.by_u(place.slacks_by[near]), sides])
    forces, left = package("scipy.optimize").nnls(rows.T, slope)
    size = float(np.linalg.norm(slope))
    if not left > _LEVEL * size:
        return None
    return _Way((forces @ rows - slope) / left, near[forces[: len(near)] > 0])


def _led(program: Program, place: Place) -> bool:
    """True if runs from the starts come nearer and nearer to the motions of a place."""
    systems = program.systems_at(place.u)
    for scenario, system, motion in zip(program.scenarios, systems, place.motions, strict=True):
        if motion.found is None:
            return led_to(program, place)
        own = dimensionless(system)
        row, state = np.array([[*own.to_dict().values()]]), np.array([scenario.state])
        length = -(-_RUN // motion.period_number) * motion.period_number
        off, near = np.inf, _NEAR * (1 + abs(motion.state).max())
        for _ in range(2):
            run = simulate_many(row, state, 0.0, length, scene=own.scene)
            state, before, off = run.states, off, float(abs(run.states[0] - motion.state).max())
            if not run.success[0]:
                return False
        if not (off < _NEAR * near or off < min(before, near)):
            return False
    return True


def _moved(program: Program, place: Place, way: _Way, step: float) -> Place | None:
    """The place after a step, back on the limits; None if it is beyond others."""
    u = np.clip(place.u + step * way.along, 0.0, 1.0)
    for _ in range(_CORRECTIONS):
        there = program.beside(place, u)
        if there is None or abs(there.slacks[way.held]).max(initial=0.0) < _PRECISE:
            break
        rows = program.by_u(there.slacks_by[way.held])
        u = np.clip(u - np.linalg.lstsq(rows, there.slacks[way.held], rcond=1e-6)[0], 0.0, 1.0)
    return None if there is None or there.beyond else there
