"""Search for the smallest knock after which a motion is lost.

Knocks at all times of the motion's period are sampled on a sphere in the state space. The sphere
shrinks to the smallest knock that loses the motion. Samples are drawn all over the sphere, near the
best knock, and near those from which the motion takes longest to return: they are next to the
boundary of its basin. From the best knock the boundary is followed downhill. At the end smaller
samples are tried again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import Basin, bisect
from capsule_sym._attractors.nearest import ACCURACY, WIDTH, Knocks, nearest, sizes
from capsule_sym._orbits.shooting.orbit import Orbit

_GENERATION = 768  # knocks at once, some 0.1 s
_LARGEST = 4.0  # radius, over the motion's size, up to which knocks are tried by default
_SMALLEST = 2.0**-10  # the same of the first sphere, from which it doubles
_QUIET = 3 * _GENERATION  # knocks in a row that return, before the boundary is followed
_RAYS = 24  # knocks of a generation that are shortened, some of which are nearer to the boundary
_NEAR = 0.1  # share of the smallest knock within which a run has returned, far below a loss
_SLOWEST = 0.06  # share of a generation with the longest returns, some fifty
_ASIDE = 0.1  # distance in direction and angle of time, within which the best knock is searched
_LEAST, _DEEPEST = ACCURACY, 0.7  # least and largest share by which knocks are smaller
_SPREAD = -4.0, -0.3  # logarithms of distances at which knocks are drawn near others, of all orders


class ShockStatus(StrEnum):
    """Status of a minimal shock."""

    #: The boundary is smooth or has a kink at the knock, and none next to it is smaller.
    FOUND = "found"
    #: The boundary has no periodic edge state and may be fractal: the smallest knock tried.
    SAMPLED = "sampled"
    #: No knock up to the largest loses the motion.
    NOT_LOST = "not-lost"
    #: The time limit was reached: the smallest knock so far.
    TIME_LIMIT = "time-limit"


class Search:
    """Search for the smallest knock, whose components have the `units`, (3, m)."""

    def __init__(
        self,
        basin: Basin,
        units: Vector,
        largest: float | None,
        samples: int,
        seed: int,
        progress: Callable[[str], object] | None,
    ) -> None:
        self.knocks, self.basin, self.samples = Knocks(basin, units), basin, samples
        self.random, self.report = np.random.default_rng(seed), progress or (lambda said: None)
        unit = basin.size / float(abs(units).max())
        self.near = _NEAR * float(abs(units).sum(axis=0).min())
        self.largest = _LARGEST * unit if largest is None else float(largest)
        self.radius = min(_SMALLEST * unit, self.largest)
        self.best: Vector | None = None
        """Smallest knock so far, as a point."""
        self.edge: Orbit | None = None
        self.tried, self.status = 0, ShockStatus.TIME_LIMIT

    def run(self) -> None:
        """Grow a sphere until a knock loses the motion, shrink it, and follow the boundary inwards.

        This is repeated while a smaller knock is found that loses the motion. Then the boundary is
        followed to its edge state.
        """
        self._grow()
        if self.best is None:
            self.status = ShockStatus.NOT_LOST
            return
        self._shrink(_QUIET)
        while True:
            self.report(f"a knock of {self.radius:.6g}: looking for nearer points of the boundary")
            self._take(nearest(self.knocks, self.best)[None])
            self.report(f"a knock of {self.radius:.6g}: trying smaller ones")
            if not self._shrink(self.samples):
                break
        self.report(f"a knock of {self.radius:.6g}: looking for its edge state")
        self.basin.patience = self.basin.periods
        ends = np.stack([self.best, self.best])
        ends[0, 1:] *= 1 - 2 * WIDTH
        (time, _), states = self.knocks.starts(ends)
        self.edge = self.basin.edge_state(float(time), *states)
        self.status = ShockStatus.SAMPLED if self.edge is None else ShockStatus.FOUND

    def _grow(self) -> None:
        """Try larger and larger knocks, until some lose the motion."""
        while True:
            self.report(f"knocks of {self.radius:.3g}")
            self._try(self._all_over(_GENERATION), np.full(_GENERATION, self.radius))
            if self.best is not None or self.radius >= self.largest:
                break
            self.basin.near = self.near * self.radius
            self.radius = min(2 * self.radius, self.largest)

    def _shrink(self, enough: int) -> bool:
        """Try smaller knocks until so many in a row return; True if one does not."""
        points, waits = self._all_over(_GENERATION), np.zeros(_GENERATION)
        left, first = enough, self.radius
        while left > 0:
            count, before = min(left, _GENERATION), self.radius
            points = self._next(points, waits, count)
            shares = np.exp(self.random.uniform(math.log(_LEAST), math.log(_DEEPEST), count))
            waits = self._try(points, self.radius * (1 - shares))
            left -= count
            if self.radius < before:
                left = enough
                self.report(f"a knock of {self.radius:.6g}")
        return self.radius < first

    def _try(self, points: Vector, radii: Vector) -> Vector:
        """Try knocks of size 1 at other sizes; excitation periods until runs return."""
        self.tried += len(points)
        points = _resized(points, radii)
        waits = self.basin.returns(*self.knocks.starts(points))
        self._take(points[np.isinf(waits)])
        return waits

    def _take(self, lost: Vector) -> None:
        """Take the least knock in the directions of some that lose the motion."""
        while len(lost):
            lost = lost[np.argsort(sizes(lost), kind="stable")][:_RAYS]
            motion, width = _resized(lost, np.zeros(len(lost))), np.full(len(lost), WIDTH)
            ends = bisect(self.knocks.lost, motion, lost, width, every=False)[1]
            least = ends[[sizes(ends).argmin()]]
            if self.basin.stays_lost(*self.knocks.starts(least)):
                self.best, self.radius = least[0], float(sizes(least)[0])
                self.basin.near = self.near * self.radius
                break
            lost = lost[self.knocks.lost(lost)]

    def _all_over(self, count: int) -> Vector:
        """Knocks of size 1 at uniform random times and directions."""
        points = self.random.normal(size=(count, 1 + self.knocks.units.shape[1]))
        points[:, 0] = self.random.uniform(0, self.basin.length / self.basin.period, count)
        return _resized(points, 1.0)

    def _next(self, points: Vector, waits: Vector, count: int) -> Vector:
        """Knocks of size 1: all over, near the best, and near those with the longest returns."""
        assert self.best is not None
        best, third = _resized(self.best[None], 1.0), count // 3
        # Knocks next to the best one have the longest returns of all.
        apart, turn = points - best, self.basin.length / self.basin.period
        apart[:, 0] = math.tau * (np.mod(apart[:, 0] / turn + 0.5, 1) - 0.5)
        order = np.argsort(np.where(abs(apart).max(axis=1) > _ASIDE, -waits, 0), kind="stable")
        slowest = order[: 1 + int(_SLOWEST * len(waits))]
        about = np.concatenate([best.repeat(third, 0), points[self.random.choice(slowest, third)]])
        spread = 10 ** self.random.uniform(*_SPREAD, (2 * third, 1))
        # A turn of the forcing by one radian counts as a change of direction by one radian.
        spread = spread * np.append(1 / math.tau, np.ones(len(best[0]) - 1))
        about += spread * self.random.normal(size=about.shape)
        return np.concatenate([self._all_over(count - 2 * third), _resized(about, 1.0)])


def _resized(points: Vector, radii: Vector | float) -> Vector:
    """Knocks at the same times and in the same directions, of other sizes."""
    factors = radii / sizes(points)
    return np.column_stack([points[:, 0], points[:, 1:] * factors[:, None]])
