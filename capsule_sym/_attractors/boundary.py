"""Basin of a motion, its boundary on rays of states, and the edge state on the boundary.

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
from capsule_sym._map.many import Trajectories
from capsule_sym._map.steady import LONGEST
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import newton_orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit

# Excitation periods of a run, plus those in which the motion attracts by e^20, within rounding.
_PERIODS, _DIGITS = 1024, 20.0
SHARE = 0.1  # of the time left, for runs side by side, since those the core cannot decide need more
_FIRST_PATIENCE = 128  # excitation periods after which a run counts as lost at first
_LOOKS = (4, 4, 8)  # excitation periods of the first tests for the return of a run
_SECTIONS = np.arange(1, 16) / 16  # of an interval of radii, as many states as fill two lanes
_TIGHT = 1e-12  # distance, over the motion's size, of two runs that follow the boundary
_APART = 1e-6  # the same at which they have parted
_REPEATED = 1e-4  # the same at which the edge state repeats well enough for Newton's method
_ROUNDS, _ALONG = 40, 256  # times that the two are brought together, excitation periods between


class Basin:
    """Basin of a stable periodic motion.

    `others` are known attractors; unknown ones are found by the runs that lead to them. A run has
    to return within `periods` excitation periods; None means 1024 and the time in which the motion
    attracts by e^20. Times are within the motion's period, from 0 to `length`; all quantities are
    dimensionless. Raises InvalidInput as `Destinations` does.
    """

    def __init__(self, orbit: Orbit, others: Sequence[Orbit], periods: int | None) -> None:
        self.known = known_orbits([orbit, *others], share=SHARE)
        self.orbit, self.marks = whole_orbit(orbit), self.known.cycles[0][0].states
        slow = _DIGITS * len(self.marks) / -math.log(max(abs(orbit.multipliers[0]), 1e-3))
        self.periods = math.ceil(_PERIODS + slow) if periods is None else periods
        self.patience = min(math.ceil(_FIRST_PATIENCE + slow), self.periods)
        """Excitation periods after which a run counts as lost, at most `periods`."""
        self.near = 0.0
        """Distance from the motion within which runs certainly return."""
        self.parameters, self.period = orbit.parameters, orbit.parameters.period
        self.length = self.period * len(self.marks)
        self._trajectory = self.orbit.trajectory()
        times = np.linspace(0, self.length, 256)
        self.size = 1 + float(abs(self.state(times)).max())

    def state(self, times: Vector) -> Vector:
        """States of the motion at times, (n,), shape (n, 3)."""
        first, end = self._trajectory.span
        inside = np.where(times < first, times + self.length, times)
        found: Vector = self._trajectory(np.clip(inside, first, end))
        return found

    def phases(self, times: ArrayLike) -> Vector:
        """Phases of the forcing at times, (n,) or a number."""
        phases = np.mod(times, self.period)
        return np.where(phases < self.period, phases, 0.0)

    def returns(self, times: ArrayLike, states: Vector) -> Vector:
        """Excitation periods until runs from states, (n, 3), return, inf if lost; (n,).

        A run whose end is unknown, as the core cannot decide it, counts as one that returns.
        """
        found, left, done = np.zeros(len(states)), np.arange(len(states)), 0
        ends, phases = states, self.phases(times)
        for length in _LOOKS:
            run, done = self.run(phases, ends, length), done + length
            apart = np.linalg.norm(run.states[:, None] - self.marks, axis=2).min(axis=1)
            found[left], open_ = done, (apart > self.near) & run.success
            left, ends, phases = left[open_], run.states[open_], np.zeros(int(open_.sum()))
        groups, most = np.zeros(len(ends), np.intp), max(2, self.patience - done)
        came = self.known.destination(groups, Arrivals.begun(ends), phases, most)
        stays = came.repeats | (came.periods >= most - 1)
        gone = (came.numbers > 0) | ((came.numbers == NONE) & stays)
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

    def run(
        self, phases: Vector, states: Vector, periods: int, keep: str = "final"
    ) -> Trajectories:
        """Runs from states at phases for so many excitation periods."""
        rows = np.tile([*self.parameters.to_dict().values()], (len(states), 1))
        scene = self.parameters.scene
        return run_rows(rows, states, phases, periods, scene, keep=keep, share=SHARE)

    def edge_state(self, time: float, inside: Vector, outside: Vector) -> Orbit | None:
        """Periodic orbit to which the boundary between two states leads; None if there is none.

        It is unstable in one direction.
        """
        path, phase = list[Vector](), self.phases(np.full(2, time))
        for _ in range(_ROUNDS):
            lost = partial(self.lost, phase[0])
            width = np.array([_TIGHT * self.size / np.linalg.norm(outside - inside)])
            inside, outside = bisect(lost, inside[None], outside[None], width)[:, 0]
            pair = self.run(phase, np.array([inside, outside]), _ALONG, "stroboscopic")
            if not pair.success.all():
                break
            marks = pair.kept.reshape(2, -1, 3)
            apart = abs(marks[0] - marks[1]).max(axis=1) > _APART * self.size
            last = max(1, int(apart.argmax()) if apart.any() else len(marks[0]) - 1)
            path += [*marks[0, 1:last]]
            (inside, outside), phase = marks[:, last], np.zeros(2)
            orbit = self._closed(np.array(path))
            if orbit is not None:
                return orbit
        return None

    def _closed(self, path: Vector) -> Orbit | None:
        """Orbit on which states at phase 0, (n, 3), end; None if they do not repeat."""
        for number in range(1, min(LONGEST, len(path) // 2) + 1):
            change = abs(path[-number:] - path[-2 * number : len(path) - number]).max()
            if change <= _REPEATED * self.size:
                orbit = newton_orbit(self.parameters, path[-1], number)
                sizes = np.zeros(2) if orbit is None else abs(orbit.multipliers)
                return orbit if sizes[0] > 1 > sizes[1] else None
        return None


def bisect(
    lost: Callable[[Vector], NDArray[np.bool_]],
    inside: Vector,
    outside: Vector,
    width: Vector,
    every: bool = True,
) -> Vector:
    """Pairs of neighbours on n lines of which the first returns and the second is lost, (2, n, k).

    The starts of the lines, (n, k), return, and their ends are lost; the neighbours are `width`,
    (n,), of the line apart. Of several boundaries on a line the first one among the points tried
    counts. Without `every` only the line on which it comes first is followed to the end.
    """
    low, high, lines = np.zeros(len(inside)), np.ones(len(inside)), outside - inside
    size = np.linalg.norm(lines, axis=1)
    while True:
        left = (high - low > width) & (every | (low * size < (high * size).min()))
        if not left.any():
            found: Vector = inside + np.stack([low, high])[..., None] * lines
            return found
        shares = low[left, None] + (high - low)[left, None] * _SECTIONS
        points = inside[left, None] + shares[..., None] * lines[left, None]
        gone = lost(points.reshape(-1, points.shape[-1])).reshape(shares.shape)
        gone = np.column_stack([gone, np.ones(len(gone), bool)])
        ends, rows = np.column_stack([low[left], shares, high[left]]), np.arange(len(gone))
        first = gone.argmax(axis=1)
        low[left], high[left] = ends[rows, first], ends[rows, first + 1]
