"""Basin of a motion, and its boundary on a line of states."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Arrivals, known_orbits
from capsule_sym._attractors.neighbourhoods import NONE, run_rows
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit

SHARE = 0.1
"""Share of the time left for runs side by side, since those the core cannot decide need more."""
# Excitation periods after which a run counts as lost: at first, and to confirm it.
_FIRST, _LAST = 128, 1024
_LOOKS = 4, 4, 8  # excitation periods of the first tests for the return of a run


class Basin:
    """Basin of a stable periodic motion.

    `others` are known attractors; unknown ones are found by the runs that lead to them. A run has
    to return within `periods` excitation periods; None means 1024 and the time in which the motion
    attracts by e^20. Times are within the motion's period, from 0 to `length`; all quantities are
    dimensionless. Raises InvalidInput as `known_orbits` does.
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

    def lost(self, times: ArrayLike, states: Vector) -> NDArray[np.bool_]:
        """True for runs from states, (n, 3), that do not return; (n,).

        A run whose end is unknown, as the core cannot decide it, counts as one that returns.
        """
        found, left, done = np.zeros(len(states), bool), np.arange(len(states)), 0
        ends, phases, marks = states, np.mod(times, self.period), self.known.cycles[0][0]
        for length in _LOOKS:
            rows = self.known.rows.repeat(len(ends), axis=0)
            run = run_rows(rows, ends, phases, length, self.known.scene, share=SHARE)
            done += length
            open_ = run.success & (marks.distance(run.states) > self.near)
            left, ends, phases = left[open_], run.states[open_], np.zeros(int(open_.sum()))
        groups, most = np.zeros(len(ends), np.intp), max(2, self.patience - done)
        came = self.known.destination(groups, Arrivals.begun(ends), phases, most)
        late = came.repeats | (came.periods >= most - 1)
        found[left] = (came.numbers > 0) | ((came.numbers == NONE) & late)
        return found

    def stays_lost(self, times: Vector, states: Vector) -> bool:
        """True if a run that counts as lost does not return in all its periods either.

        Otherwise the patience is raised.
        """
        patience, self.patience = self.patience, self.periods
        lost = patience == self.periods or bool(self.lost(times, states).all())
        self.patience = patience if lost else min(4 * patience, self.periods)
        return lost


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
