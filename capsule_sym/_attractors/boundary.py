"""Basin of a motion, its boundary on a line of states, and the edge state on the boundary.

A run from the boundary stays on it and tends to a saddle, the edge state. It is tracked between a
run that returns to the motion and one that is lost; bisection restores their distance whenever it
has grown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Destinations
from capsule_sym._attractors.neighbourhoods import NONE, run_rows, stroboscopic
from capsule_sym._map.many import Trajectories
from capsule_sym._map.steady import LONGEST
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import newton_orbit, solve_orbit
from capsule_sym._orbits.shooting.symmetry import same, whole_orbit

_PERIODS, _SLOW = 1024, 20.0  # of a run, plus the time in which the motion attracts by e^20
_PATIENCE, _QUICK = 128, 4.0  # the same, after which a run counts as lost at first
_FASTEST = 1e-3  # multiplier below which its size has no effect
_LOOKS = (4, 4, 8)  # excitation periods between tests for the return of a run
_ARRIVED = 1e-9  # distance, over the motion's size, at which a run has returned
_MOST_LEARNED = 16  # attempts to solve for the attractors of lost runs
_SECTIONS = 15  # states at once between two sides of a boundary
_TIGHT = 1e-12  # distance, over the size, of two sides, above that at which rounding decides
_APART = 1e-6  # distance, over the size, at which two runs beside the boundary are apart
_REPEATED = 1e-4  # the same, at which the edge state repeats well enough for Newton's method
_CLOSED = 1e-2  # the same, from which Newton's method may converge to it
_ROUNDS, _ALONG = 40, 256  # bisections along the edge, excitation periods between two


class Basin:
    """Basin of a stable periodic motion.

    `others` are known attractors. A run has to return within `periods` excitation periods; None
    means 1024 and the time in which the motion attracts by e^20. Times are within the motion's
    period, from 0 to `length`; all quantities are dimensionless. Raises InvalidInput as
    `Destinations` does.
    """

    def __init__(self, orbit: Orbit, others: Sequence[Orbit], periods: int | None) -> None:
        self.destinations = Destinations([orbit, *others])
        largest = float(abs(orbit.multipliers[0]))
        self.rate = -math.log(max(largest, _FASTEST)) / orbit.itinerary.period_number
        """Attraction rate of the motion, per excitation period."""
        self.periods = math.ceil(_PERIODS + _SLOW / self.rate) if periods is None else periods
        self.patience = min(math.ceil(_PATIENCE + _QUICK / self.rate), self.periods)
        self.near = 0.0
        self.orbit = self.destinations.orbits[0]
        self.parameters, self.marks = self.orbit.parameters, stroboscopic(self.orbit)
        self._row = np.array([[*self.parameters.to_dict().values()]])
        self.period = self.parameters.period
        self.length = self.period * self.orbit.itinerary.period_number
        self._trajectory, self._learned = self.orbit.trajectory(), 0
        first, end = self._trajectory.span
        times = np.linspace(first, end, 256)
        self.size = 1 + float(abs(self._trajectory(times)).max())

    def state(self, times: Vector) -> Vector:
        """States of the motion at times, (n,), shape (n, 3)."""
        first, end = self._trajectory.span
        inside = np.where(times < first, times + self.length, times)
        found: Vector = self._trajectory(np.clip(inside, first, end))
        return found

    def phases(self, times: Vector) -> Vector:
        """Phases of the forcing at times, (n,)."""
        phases = np.mod(times, self.period)
        return np.where(phases < self.period, phases, 0.0)

    def holds(self, times: Vector, states: Vector, patience: int | None = None) -> Vector:
        """Excitation periods until runs from states, (n, 3), return, inf if lost; (n,).

        A run has returned within the distance `near` of the motion, or by the test of
        `Destinations`. It is followed for `patience` periods, by default those of the basin.
        """
        found, left = np.full(len(states), np.inf), np.arange(len(states))
        ends, phases, done = states, self.phases(times), 0
        for length in _LOOKS if self.near else ():
            ends = self.run(phases, ends, length).states
            done += length
            apart = self.distance(ends)
            here = apart <= self.near
            found[left[here]] = done + self._ahead(apart[here])
            left, ends, phases = left[~here], ends[~here], np.zeros(int((~here).sum()))
            if not left.size:
                return found
        patience = patience or self.patience
        while left.size and done < patience:
            length = min(max(done, _LOOKS[-1]), patience - done) if self.near else patience - done
            came = self.destinations.arrivals(ends, phases, max(2, length))
            apart = self.distance(came.states)
            back = (came.numbers == 0) | (apart <= max(self.near, _ARRIVED * self.size))
            found[left[back]] = done + came.periods[back] + self._ahead(apart[back])
            # A run that repeats itself may be on an edge state, which it leaves after a long time.
            open_ = ~back & (came.numbers == NONE)
            self._learn(came.states[open_ & came.repeats])
            open_ &= self.destinations.neighbourhoods.contain(came.states) == NONE
            left, ends, phases = left[open_], came.states[open_], np.zeros(int(open_.sum()))
            done += int(came.periods[open_].min(initial=patience))
        return found

    def _ahead(self, apart: Vector) -> Vector:
        """Periods since a run was within `near` of its motion, from distances at a test, (n,)."""
        least = _ARRIVED * self.size
        found: Vector = np.log(np.maximum(apart, least) / max(self.near, least)) / self.rate
        return np.minimum(found, 0.0)

    def lost(self, times: Vector, states: Vector) -> NDArray[np.bool_]:
        """True for runs from states at times that are lost within all their periods; (n,)."""
        return np.isinf(self.holds(times, states, self.periods))

    def wait_longer(self) -> None:
        """Raise the patience, after a run that counted as lost has returned."""
        self.patience = min(4 * self.patience, self.periods)

    def distance(self, states: Vector) -> Vector:
        """Distance of states at phase 0, (n, 3), from the motion's nearest state there; (n,)."""
        apart: Vector = np.linalg.norm(states[:, None] - self.marks, axis=2).min(axis=1)
        return apart

    def run(
        self, phases: Vector, states: Vector, periods: int, keep: str = "final"
    ) -> Trajectories:
        """Runs from states at phases for so many excitation periods."""
        rows = np.repeat(self._row, len(states), axis=0)
        return run_rows(rows, states, phases, periods, self.parameters.scene, keep=keep)

    def attractor(self, time: float, state: Vector) -> Orbit | None:
        """Attractor of a run; None if it settles on none within the periods."""
        phase = self.phases(np.array([time]))
        number = int(self.destinations.of(state[None], phase, self.periods)[0])
        return None if number == NONE else self.destinations.orbits[number]

    def _learn(self, ends: Vector) -> None:
        """Solve for attractors on which runs repeat, so that later runs end there early."""
        while len(ends) and self._learned < _MOST_LEARNED:
            self._learned += 1
            orbit = solve_orbit(self.parameters, ends[0].tolist(), periods=256)
            ends = ends[1:]
            known = self.destinations.orbits
            if orbit.success and not any(same(orbit, one) for one in known):
                self.destinations = Destinations([*known, orbit])
                ends = ends[self.destinations.neighbourhoods.contain(ends) == NONE]

    def narrow(self, time: float, inside: Vector, outside: Vector) -> tuple[Vector, Vector]:
        """Two near states on a line of which the first returns and the second is lost.

        `inside`, (3,), returns and `outside`, (3,), is lost. Of several boundaries between them it
        is the one nearest to `inside` among the states tried.
        """
        shares = np.arange(1, _SECTIONS + 1)[:, None] / (_SECTIONS + 1)
        while abs(outside - inside).max() > _TIGHT * self.size:
            between = inside + (outside - inside) * shares
            line = np.vstack([inside, between, outside])
            lost = self.lost(np.full(_SECTIONS, time), between)
            i = int(lost.argmax()) if lost.any() else _SECTIONS
            if np.array_equal(line[i], inside) and np.array_equal(line[i + 1], outside):
                break  # they are neighbours
            inside, outside = line[i], line[i + 1]
        return inside, outside

    def edge_state(self, time: float, inside: Vector, outside: Vector) -> Orbit | None:
        """Periodic orbit to which the boundary between two states leads; None if there is none.

        It is unstable in one direction.
        """
        path = list[Vector]()
        phase = self.phases(np.array([time, time]))
        for _ in range(_ROUNDS):
            inside, outside = self.narrow(float(phase[0]), inside, outside)
            pair = self.run(phase, np.array([inside, outside]), _ALONG, "stroboscopic")
            beside = np.array([pair[0], pair[1]])
            apart = abs(beside[0] - beside[1]).max(axis=1) > _APART * self.size
            last = max(1, int(apart.argmax()) if apart.any() else len(apart) - 1)
            path += [*beside[0, 1:last]]
            inside, outside = beside[:, last]
            phase = np.zeros(2)
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
                if orbit is None or not is_saddle(orbit):
                    return None
                apart = abs(stroboscopic(whole_orbit(orbit)) - path[-1]).max(axis=1).min()
                return orbit if apart <= _CLOSED * self.size else None
        return None


def is_saddle(orbit: Orbit) -> bool:
    """True if an orbit is unstable in one direction."""
    sizes = abs(orbit.multipliers)
    return bool(sizes[0] > 1 > sizes[1])
