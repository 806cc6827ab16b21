"""Basin of a motion, its boundary on a line of states, and the edge state on the boundary.

A run from the boundary stays on it and tends to a saddle, the edge state. It is followed between a
run that returns to the motion and one that is lost; bisection restores their distance whenever it
has grown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Arrivals, known_orbits
from capsule_sym._attractors.neighbourhoods import NONE, run_rows
from capsule_sym._map.steady import LONGEST
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import newton_orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit

SHARE = 0.1
"""Share of the time left for runs side by side, since those the core cannot decide need more."""
# Excitation periods after which a run counts as lost: at first, and to confirm it.
_FIRST, _LAST = 128, 1024
_LOOKS = 4, 4, 8  # excitation periods of the first tests for the return of a run
_TIGHT, _APART = 1e-12, 1e-6  # distances of two runs along the boundary over the motion's size
_REPEATED = 1e-4  # the same at which the edge state repeats well enough for Newton's method
_ALONG = 256, 40  # excitation periods that the two runs are followed at a time, and how often


class Basin:
    """Basin of a stable periodic motion.

    `others` are known attractors; unknown ones are found by the runs that lead to them. A run has
    to return within `periods` excitation periods; None means 1024 and the time in which the motion
    attracts by e^20. Times are within the motion's period, from 0 to `length`; all quantities are
    dimensionless. Raises InvalidInput as `Destinations` does.
    """

    def __init__(self, orbit: Orbit, others: Sequence[Orbit], periods: int | None) -> None:
        self.known = known_orbits([orbit, *others], share=SHARE)
        self.orbit, number = whole_orbit(orbit), len(self.known.cycles[0][0].states)
        slow = 20 * number / -math.log(max(abs(orbit.multipliers[0]), 1e-3))
        self.periods = math.ceil(_LAST + slow) if periods is None else periods
        self.patience = min(math.ceil(_FIRST + slow), self.periods)
        """Excitation periods after which a run counts as lost, at most `periods`."""
        self.near = 0.0
        """Distance from the motion within which runs certainly return."""
        self.parameters, self.period = orbit.parameters, orbit.parameters.period
        self.length = self.period * number
        self._trajectory = self.orbit.trajectory()
        self.size = 1 + float(abs(self.state(np.linspace(0, self.length, 256))).max())

    def state(self, times: Vector) -> Vector:
        """States of the motion at times, (n,), shape (n, 3)."""
        first, end = self._trajectory.span
        inside = np.where(times < first, times + self.length, times)
        found: Vector = self._trajectory(np.clip(inside, first, end))
        return found

    def returns(self, times: ArrayLike, states: Vector) -> Vector:
        """Excitation periods until runs from states, (n, 3), return, inf if lost; (n,).

        A run whose end is unknown, as the core cannot decide it, counts as one that returns.
        """
        found, left, done = np.zeros(len(states)), np.arange(len(states)), 0
        ends, phases, marks = states, np.mod(times, self.period), self.known.cycles[0][0]
        for length in _LOOKS:
            rows = self.known.rows.repeat(len(ends), axis=0)
            run = run_rows(rows, ends, phases, length, self.known.scene, share=SHARE)
            found[left] = done = done + length
            open_ = run.success & (marks.distance(run.states) > self.near)
            left, ends, phases = left[open_], run.states[open_], np.zeros(int(open_.sum()))
        groups, most = np.zeros(len(ends), np.intp), max(2, self.patience - done)
        came = self.known.destination(groups, Arrivals.begun(ends), phases, most)
        late = came.repeats | (came.periods >= most - 1)
        gone = (came.numbers > 0) | ((came.numbers == NONE) & late)
        found[left] = np.where(gone, np.inf, done + came.periods)
        return found

    def lost(self, times: ArrayLike, states: Vector) -> NDArray[np.bool_]:
        """True for runs from states at times that are lost; (n,)."""
        return np.isinf(self.returns(times, states))

    def stays_lost(self, times: Vector, states: Vector) -> bool:
        """True if a run that counts as lost does not return in all its periods either.

        Otherwise the patience is raised.
        """
        patience, self.patience = self.patience, self.periods
        lost = patience == self.periods or bool(self.lost(times, states).all())
        self.patience = patience if lost else min(4 * patience, self.periods)
        return lost

    def edge_state(self, time: float, inside: Vector, outside: Vector) -> Orbit | None:
        """Periodic orbit to which the boundary between two states leads; None if there is none.

        It is unstable in one direction.
        """
        rows, scene = self.known.rows.repeat(2, axis=0), self.known.scene
        path, (length, rounds) = list[Vector](), _ALONG
        for _ in range(rounds):
            line = float(np.linalg.norm(outside - inside))
            if not line:  # both stick, in the same state
                break
            ends = bisect(partial(self.lost, time), inside, outside, _TIGHT * self.size / line)
            phases = np.mod([time, time], self.period)
            pair = run_rows(rows, ends, phases, length, scene, keep="stroboscopic", share=SHARE)
            if not pair.success.all():
                break
            marks, time = pair.kept.reshape(2, -1, 3), 0.0
            apart = abs(marks[0] - marks[1]).max(axis=1) > _APART * self.size
            last = max(1, int(apart.argmax()) if apart.any() else len(marks[0]) - 1)
            path += [*marks[0, 1:last]]
            inside, outside = marks[:, last]
            orbit = self._closed(np.array(path))
            if orbit is not None:
                return orbit
        return None

    def _closed(self, path: Vector) -> Orbit | None:
        """Saddle that states at phase 0, (n, 3), pass; None if they nearly repeat at none."""
        for number in range(1, min(LONGEST, len(path) - 1) + 1):
            change = abs(path[number:] - path[:-number]).max(axis=1)
            if change.min() <= _REPEATED * self.size:
                at = int((change <= _REPEATED * self.size).argmax())
                orbit = newton_orbit(self.parameters, path[at], number)
                if orbit is not None and abs(orbit.multipliers[0]) > 1 > abs(orbit.multipliers[1]):
                    return orbit
        return None


def bisect(
    lost: Callable[[Vector], NDArray[np.bool_]], inside: Vector, outside: Vector, width: float
) -> Vector:
    """Neighbours on a line of which the first returns and the second is lost, (2, k).

    The start of the line, (k,), returns, and its end is lost; the neighbours are a share `width` of
    the line apart. Of several boundaries the first one among the points tried counts.
    """
    low, high, line = 0.0, 1.0, outside - inside
    while high - low > width:
        shares = np.linspace(low, high, 17)  # as many between them as fill two lanes
        gone = lost(inside + shares[1:-1, None] * line)
        first = int(np.append(gone, True).argmax())
        low, high = shares[first : first + 2].tolist()
    return inside + np.array([[low], [high]]) * line
