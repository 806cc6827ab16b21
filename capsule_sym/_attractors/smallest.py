"""Search for the smallest knock after which a motion is lost.

Knocks at all times of the motion's period are sampled on a sphere in the state space. The sphere
shrinks to the smallest knock that loses the motion. That is polished by samples next to it, at
distances of all orders. At the end smaller samples are tried again.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import Basin, bisect
from capsule_sym._errors import Status
from capsule_sym._orbits.shooting.orbit import Orbit

ACCURACY = 1e-4
"""Relative accuracy of a minimal shock."""
WIDTH = 0.01 * ACCURACY
"""Relative distance of two knocks between which the boundary is."""
_GENERATION = 768  # knocks at once, some 0.1 s
_QUIET = 3 * _GENERATION  # knocks in a row that return, before the best one is polished
_STILL, _LAST = 12, 8  # generations in a row that end a polish; best knocks of which it learns
_LARGEST = 4.0  # radius, over the motion's size, up to which knocks are tried by default


class KnockSearch:
    """Search for the smallest knock, whose components have the `units`, (3, m).

    A knock is a point: its time, in excitation periods, and m components. Points are (n, 1 + m).
    """

    def __init__(
        self,
        basin: Basin,
        units: Vector,
        largest: float | None,
        samples: int,
        seed: int,
        progress: Callable[[str], object] | None,
    ) -> None:
        self.units, self.basin, self.samples = units, basin, samples
        self.turn = basin.length / basin.period
        self.random, self.report = np.random.default_rng(seed), progress or (lambda said: None)
        unit = basin.size / float(abs(units).max())
        self.largest = _LARGEST * unit if largest is None else float(largest)
        self.radius = min(2.0**-10 * unit, self.largest)
        # Within a tenth of the smallest knock, at any time, a run has returned.
        self.near = 0.1 * float(abs(units).sum(axis=0).min())
        self.best: Vector | None = None
        """Smallest knock so far, as a point."""
        self.trail: list[Vector] = []
        """Smallest knocks in the order in which they were found."""
        self.edge: Orbit | None = None
        self.tried, self.status = 0, Status.TIME_LIMIT

    def run(self) -> None:
        """Grow a sphere until a knock loses the motion, shrink it, and polish the smallest knock.

        This is repeated while a smaller knock is found that loses the motion. Then the boundary is
        followed to its edge state.
        """
        while self.best is None:
            self.report(f"knocks of {self.radius:.3g}")
            self._try(self._all_over(_GENERATION), self.radius)
            if self.best is None and self.radius >= self.largest:
                self.status = Status.NOT_LOST
                return
            if self.best is None:
                self.basin.near = self.near * self.radius
                self.radius = min(2 * self.radius, self.largest)
        self._shrink(_QUIET)
        while True:
            self.report(f"a knock of {self.radius:.6g}: looking for nearer points of the boundary")
            self._polish()
            self.report(f"a knock of {self.radius:.6g}: trying smaller ones")
            if not self._shrink(self.samples):
                break
        self.report(f"a knock of {self.radius:.6g}: looking for its edge state")
        self.basin.patience = self.basin.periods
        ends = np.stack([self.best, self.best])
        ends[0, 1:] *= 1 - 2 * WIDTH
        (time, _), states = self.starts(ends)
        self.edge = self.basin.edge_state(float(time), *states)
        self.status = Status.SAMPLED if self.edge is None else Status.FOUND

    def starts(self, points: Vector) -> tuple[Vector, Vector]:
        """Times within the motion's period, (n,), and states after knocks at them, (n, 3)."""
        times = np.mod(points[:, 0] * self.basin.period, self.basin.length)
        return times, self.basin.state(times) + points[:, 1:] @ self.units.T

    def lost(self, points: Vector) -> NDArray[np.bool_]:
        """True for knocks after which the motion is lost, (n,)."""
        return self.basin.lost(*self.starts(points))

    def _all_over(self, count: int) -> Vector:
        """Knocks of size 1 at uniform random times and directions."""
        points = self.random.normal(size=(count, 1 + self.units.shape[1]))
        points[:, 0] = self.random.uniform(0, self.turn, count)
        return resized(points, 1.0)

    def _near(self, points: Vector, least: float, most: float) -> Vector:
        """Knocks of size 1 near others, at distances of all orders from 10^least to 10^most."""
        far = 10 ** self.random.uniform(least, most, points.shape)
        far[:, 0] /= math.tau  # a radian of the forcing counts as one of direction
        return resized(points + far * self.random.normal(size=points.shape), 1.0)

    def _shrink(self, enough: int) -> bool:
        """Try smaller knocks until so many in a row return; True if one does not.

        A third is drawn all over, one near the best, and one near the others with the longest
        returns: they are next to the boundary of the basin.
        """
        points, waits = self._all_over(_GENERATION), np.zeros(_GENERATION)
        left, first = enough, self.radius
        while left > 0:
            assert self.best is not None
            count, before = min(left, _GENERATION), self.radius
            best, third = resized(self.best[None], 1.0), count // 3
            apart = points - best
            apart[:, 0] = (apart[:, 0] + self.turn / 2) % self.turn - self.turn / 2
            # Knocks within a tenth of the best one have the longest returns of all.
            waits[abs(apart).max(axis=1) < 0.1] = 0
            slowest = self.random.choice(np.argsort(-waits)[: count // 16 + 1], third)
            near = self._near(np.concatenate([best.repeat(third, 0), points[slowest]]), -4, -0.3)
            points = np.concatenate([self._all_over(count - 2 * third), near])
            shares = np.exp(self.random.uniform(math.log(ACCURACY), math.log(0.7), count))
            waits = self._try(points, self.radius * (1 - shares))
            left = enough if self.radius < before else left - count
        return self.radius < first

    def _polish(self) -> None:
        """Try knocks next to the best one, smaller by a hair, until none loses the motion.

        Half of them are moved along the differences of the last ones, which lie along the edges of
        the boundary. A simplex search sticks at such edges.
        """
        still, count = 0, _GENERATION // 4
        while still < _STILL:
            assert self.best is not None
            before, best = self.radius, resized(self.best[None], 1.0)
            last = resized(np.array(self.trail[-_LAST:]), 1.0)
            points = self._near(best.repeat(count, axis=0), -5, -1)
            along = best - self.random.choice(last, count // 2)
            points[::2] += self.random.normal(size=(count // 2, 1)) * along
            self._try(points, self.radius * (1 - WIDTH))
            still = 0 if self.radius < before * (1 - 2 * WIDTH) else still + 1

    def _try(self, points: Vector, radii: Vector | float) -> Vector:
        """Excitation periods until runs return from knocks at other sizes, inf if lost.

        Of those that are lost the least knock in their directions is taken.
        """
        self.tried += len(points)
        points = resized(points, radii)
        waits = self.basin.returns(*self.starts(points))
        lost = points[np.isinf(waits)]
        while len(lost):
            outside = lost[sizes(lost).argmin()]
            inside = resized(outside[None], 0.0)[0]
            least = bisect(self.lost, inside, outside, WIDTH)[[1]]
            if self.basin.stays_lost(*self.starts(least)):
                self.best, self.radius = least[0], float(sizes(least)[0])
                self.trail.append(self.best)
                self.basin.near = self.near * self.radius
                self.report(f"a knock of {self.radius:.6g}")
                lost = resized(lost, self.radius * (1 - 2 * WIDTH))
            lost = lost[self.lost(lost)]
        return waits


def sizes(points: Vector) -> Vector:
    """Sizes of knocks, (n,)."""
    found: Vector = np.linalg.norm(points[:, 1:], axis=1)
    return found


def resized(points: Vector, radii: Vector | float) -> Vector:
    """Knocks at the same times and in the same directions, of other sizes."""
    factors = radii / sizes(points)
    return np.column_stack([points[:, 0], points[:, 1:] * factors[:, None]])
