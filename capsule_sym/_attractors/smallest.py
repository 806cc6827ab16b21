"""Search for the smallest knock after which a motion is lost.

Knocks at all times of the motion's period are sampled on spheres in the state space. The sphere
grows until knocks lose the motion; each part of the boundary that is found is followed to its
smallest knock, by random changes at distances of all orders. At the end smaller samples are tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Arrivals, known_orbits
from capsule_sym._attractors.neighbourhoods import NONE, SHARE, states_at
from capsule_sym._errors import Status
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit

ACCURACY = 1e-4
"""Relative accuracy of a minimal shock."""
WIDTH = 0.01 * ACCURACY
"""Relative distance of two knocks between which the boundary is."""
# Excitation periods after which a run counts as lost, besides those in which the motion attracts by
# e^20: at first, and to confirm it.
_FIRST, _LAST = 128, 1024
_GENERATION = 768  # knocks at once, some 0.1 s
_BEYOND = 1.25  # size, over the smallest one found, of knocks that show other parts of the boundary
_PARTS, _APART = 5, 0.3  # largest number of these parts, and distance of their directions
_COARSE = 1e-3  # share by which knocks of other parts become smaller, before the best is chosen
_STILL, _LAST_BEST = 12, 8  # generations in a row that end a polish; best knocks it learns from


class KnockSearch:
    """Search for the smallest knock, whose components have the `units`, (3, m).

    A knock is a point: its time, in excitation periods, and m components. Points are (n, 1 + m).
    A run has to return within `periods` excitation periods; None means 1024 and the time in which
    the motion attracts by e^20. Raises InvalidInput for an orbit that is not stable.
    """

    def __init__(
        self, orbit: Orbit, units: Vector, largest: float | None, periods: int | None, seed: int
    ) -> None:
        self.units, self.random = units, np.random.default_rng(seed)
        self.known = known_orbits([orbit], share=SHARE)
        self.turns, self.period = len(self.known.cycles[0][0].states), orbit.parameters.period
        slow = 20 * self.turns / -math.log(max(abs(orbit.multipliers[0]), 1e-3))
        self.periods = math.ceil(_LAST + slow) if periods is None else periods
        self.patience = min(math.ceil(_FIRST + slow), self.periods)
        """Excitation periods after which a run counts as lost, at most `periods`."""
        self.orbit = whole_orbit(orbit)
        self.motion = self.orbit.trajectory()
        times = np.linspace(0, self.turns * self.period, 256)
        unit = (1 + abs(states_at(self.motion, times)).max()) / abs(units).max()
        self.largest = 4 * float(unit) if largest is None else float(largest)
        self.radius = min(2.0**-10 * float(unit), self.largest)
        self.best: Vector | None = None
        """Smallest knock so far, as a point."""
        self.tried, self.status = 0, Status.TIME_LIMIT

    def run(self, samples: int, report: Callable[[str], object]) -> None:
        """Grow a sphere until a knock loses the motion, and polish the smallest knocks found.

        Smaller knocks are tried until `samples` in a row return. Sets the status. Raises TimeUp if
        the present watch is over.
        """
        while (first := self._smallest(self._all_over(_GENERATION), self.radius)) is None:
            report(f"knocks of {self.radius:.3g}")
            if self.radius >= self.largest:
                self.status = Status.NOT_LOST
                return
            self.radius = min(2 * self.radius, self.largest)
        known = [first, self._polish(first[None], _COARSE)]
        points = resized(self._all_over(4 * _GENERATION), _BEYOND * self.radius)
        points = points[self.lost(points)]
        while len(known) <= 2 * _PARTS and len(points := self._apart(points, known)):
            report(f"a knock of {self.radius:.6g}: looking for nearer points of the boundary")
            known += [points[0], self._polish(points, _COARSE)]
        self._polish(min(known, key=lambda one: float(sizes(one)))[None], WIDTH)
        left = samples
        while left > 0:
            report(f"a knock of {self.radius:.6g}: trying smaller ones")
            count = min(left, _GENERATION)
            shares = np.exp(self.random.uniform(math.log(ACCURACY), math.log(0.7), count))
            smaller = self._smallest(self._all_over(count), self.radius * (1 - shares))
            if smaller is not None:
                self._polish(smaller[None], WIDTH)
            left = left - count if smaller is None else samples
        self.status = Status.FOUND

    def starts(self, points: Vector) -> tuple[Vector, Vector, Vector]:
        """Times within the motion's period, (n,), states before and after knocks, (n, 3)."""
        times = np.mod(points[:, 0], self.turns) * self.period
        before = states_at(self.motion, times)
        return times, before, before + points[:, 1:] @ self.units.T

    def lost(self, points: Vector) -> NDArray[np.bool_]:
        """True for knocks after which the motion is lost, (n,).

        A run that does not finish, as the core cannot decide it or the time is over, counts as one
        that returns.
        """
        times, _, states = self.starts(points)
        runs, row = Arrivals.begun(states), np.zeros(len(points), np.intp)
        self.known.destination(row, runs, np.mod(times, self.period), self.patience)
        return np.asarray((runs.numbers > 0) | ((runs.numbers == NONE) & ~runs.undecided))

    def stays_lost(self, points: Vector) -> bool:
        """True if runs that count as lost do not return in all their periods either.

        Otherwise the patience is raised.
        """
        patience, self.patience = self.patience, self.periods
        if lost := patience == self.periods or bool(self.lost(points).all()):
            self.patience = patience
        return lost

    def _all_over(self, count: int) -> Vector:
        """Knocks of size 1 at uniform random times and directions."""
        points = self.random.normal(size=(count, 1 + self.units.shape[1]))
        points[:, 0] = self.random.uniform(0, self.turns, count)
        return resized(points, 1.0)

    def _apart(self, points: Vector, known: list[Vector]) -> Vector:
        """Knocks whose times and directions are not near to those of known ones."""
        apart: Any = abs(resized(points, 1.0)[:, None] - resized(np.array(known), 1.0))
        apart[..., 0] %= self.turns
        apart[..., 0] = np.minimum(apart[..., 0], self.turns - apart[..., 0])
        return np.asarray(points[apart.max(axis=2).min(axis=1) > _APART])

    def _polish(self, points: Vector, width: float) -> Vector:
        """Smallest knock near the least of some, by random changes in generations.

        It ends after 12 generations in a row, 3 if `width` is not WIDTH, that do not make the knock
        smaller by more than a share of twice `width`. Half of the changes have a part along the
        differences of the last knocks, which lie along the edges of the boundary. A simplex search
        sticks at such edges. If none of the knocks loses the motion, it is the first one.
        """
        if (best := self._smallest(points, sizes(points), width)) is None:
            return np.asarray(points[0])
        trail, still, count = [best], 0, _GENERATION // 4
        while still < (_STILL if width == WIDTH else _STILL // 4):
            radius, way = sizes(best), resized(best[None], 1.0)
            far = 10 ** self.random.uniform(-5, -1, (count, len(best)))
            far[:, 0] /= math.tau  # a radian of the forcing counts as one of direction
            points = way + far * self.random.normal(size=far.shape)
            last = self.random.choice(resized(np.array(trail[-_LAST_BEST:]), 1.0), count // 2)
            points[::2] += self.random.normal(size=(count // 2, 1)) * (way - last)
            found = self._smallest(points, radius * (1 - width), width)
            nearer = found is not None and sizes(found) < radius * (1 - 2 * width)
            still = 0 if nearer else still + 1
            if found is not None:
                best = found
                trail.append(best)
        return best

    def _smallest(
        self, points: Vector, radii: Vector | float, width: float = WIDTH
    ) -> Vector | None:
        """Least knock found that loses the motion, at the times and in the directions of points.

        Those that lose it at the sizes `radii` are bisected, within a share `width`. None if there
        are none. `best` and `radius` become those of the knock if it is smaller than `best`.
        """
        self.tried += len(points)
        best: Vector | None = None
        points = resized(points, radii)
        lost = points[self.lost(points)]
        while len(lost):
            least = self._bisected(lost[sizes(lost).argmin()], width)
            if self.stays_lost(least[None]):
                best, size = least, float(sizes(least))
                if self.best is None or size < self.radius:
                    self.best, self.radius = best, size
                lost = resized(lost, size * (1 - 2 * width))
            lost = lost[self.lost(lost)]
        return best

    def _bisected(self, outside: Vector, width: float) -> Vector:
        """Knock next to the boundary in the direction of one outside, which loses the motion.

        It loses the motion too; one smaller by at most a share `width` of `outside` does not.
        """
        low, high, points = 0.0, 1.0, outside[None]
        while high - low > width:
            shares = np.linspace(low, high, 17)  # the 15 between fit into two times 8 lanes
            points = resized(outside[None].repeat(16, axis=0), shares[1:] * sizes(outside))
            first = int(np.append(self.lost(points[:-1]), True).argmax())
            low, high, points = shares[first], shares[first + 1], points[first:]
        return np.asarray(points[0])


def sizes(points: Vector) -> Vector:
    """Sizes of knocks, (n, 1 + m), shape (n,), or of one."""
    return np.asarray(np.linalg.norm(points[..., 1:], axis=-1))


def resized(points: Vector, radii: Vector | float) -> Vector:
    """Knocks at the same times and in the same directions, of other sizes."""
    factors = radii / sizes(points)
    return np.column_stack([points[:, 0], points[:, 1:] * factors[:, None]])
