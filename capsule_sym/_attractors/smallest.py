"""Search for the smallest knock after which a motion is lost.

Knocks at all times of the motion's period are sampled on a sphere in the state space. The sphere
shrinks to the smallest knock that loses the motion. Samples are drawn all over the sphere, near the
best knock, and near those from which the motion takes longest to return: they are next to the
boundary of its basin. The best knock is polished by samples next to it, at distances of all orders.
At the end smaller samples are tried again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import Basin, bisect
from capsule_sym._orbits.shooting.orbit import Orbit

ACCURACY = 1e-4
"""Relative accuracy of a minimal shock."""
WIDTH = 0.01 * ACCURACY
"""Relative distance of two knocks between which the boundary is."""
_GENERATION = 768  # knocks at once, some 0.1 s
_LARGEST = 4.0  # radius, over the motion's size, up to which knocks are tried by default
_SMALLEST = 2.0**-10  # the same of the first sphere, from which it doubles
_QUIET = 3 * _GENERATION  # knocks in a row that return, before the best one is polished
_BESIDE = 192  # knocks of a generation next to the best one, some 30 ms
_EARLIER = 8  # best knocks whose differences are directions
_STILL = 12  # of these generations in a row without a smaller knock, after which it is polished
_RAYS = 24  # knocks of a generation that are shortened, some of which are nearer to the boundary
_NEAR = 0.1  # share of the smallest knock within which a run has returned, far below a loss
_SLOWEST = 0.06  # share of a generation with the longest returns, some fifty
_ASIDE = 0.1  # distance in direction and angle of time, within which the best knock is searched
_LEAST, _DEEPEST = ACCURACY, 0.7  # least and largest share by which knocks are smaller
_SPREAD = -4.0, -0.3  # logarithms of distances at which knocks are drawn near others, of all orders
_CLOSE = -5.0, -1.0  # the same next to the best one


class ShockStatus(StrEnum):
    """Status of a minimal shock."""

    #: The boundary leads to a periodic edge state, and no knock that was tried is smaller.
    FOUND = "found"
    #: The boundary has no periodic edge state and may be fractal: the smallest knock tried.
    SAMPLED = "sampled"
    #: No knock up to the largest loses the motion.
    NOT_LOST = "not-lost"
    #: The time limit was reached: the smallest knock so far.
    TIME_LIMIT = "time-limit"


class KnockSearch:
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
        self.units, self.basin, self.samples = units, basin, samples
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
        """Grow a sphere until a knock loses the motion, shrink it, and polish the smallest knock.

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

    def _polish(self) -> None:
        """Try knocks next to the best one, smaller by a hair, until none loses the motion.

        Half of them are moved along the differences of earlier ones, which lie along the edges of
        the boundary.
        """
        still, earlier = 0, list[Vector]()
        while still < _STILL:
            assert self.best is not None
            before, best = self.radius, _resized(self.best[None], 1.0)
            earlier = [*earlier[-_EARLIER:], best[0]]
            points = self._near(best.repeat(_BESIDE, 0), _CLOSE)
            along = best - np.array(earlier)[self.random.integers(len(earlier), size=_BESIDE // 2)]
            points[::2] += self.random.normal(size=(_BESIDE // 2, 1)) * along
            self._try(_resized(points, 1.0), np.full(_BESIDE, self.radius * (1 - WIDTH)))
            still = 0 if self.radius < before * (1 - 2 * WIDTH) else still + 1

    def starts(self, points: Vector) -> tuple[Vector, Vector]:
        """Times within the motion's period, (n,), and states after knocks at them, (n, 3).

        A knock is a point: its time, in excitation periods, and m components; `units`, (3, m), has
        the change of the state by each of them. Points are (n, 1 + m).
        """
        times = np.mod(points[:, 0] * self.basin.period, self.basin.length)
        return times, self.basin.state(times) + points[:, 1:] @ self.units.T

    def lost(self, points: Vector) -> NDArray[np.bool_]:
        """True for knocks after which the motion is lost, (n,)."""
        return self.basin.lost(*self.starts(points))

    def _try(self, points: Vector, radii: Vector) -> Vector:
        """Try knocks of size 1 at other sizes; excitation periods until runs return."""
        self.tried += len(points)
        points = _resized(points, radii)
        waits = self.basin.returns(*self.starts(points))
        self._take(points[np.isinf(waits)])
        return waits

    def _take(self, lost: Vector) -> None:
        """Take the least knock in the directions of some that lose the motion."""
        while len(lost):
            lost = lost[np.argsort(sizes(lost), kind="stable")][:_RAYS]
            motion, width = _resized(lost, np.zeros(len(lost))), np.full(len(lost), WIDTH)
            ends = bisect(self.lost, motion, lost, width, every=False)[1]
            least = ends[[sizes(ends).argmin()]]
            if self.basin.stays_lost(*self.starts(least)):
                self.best, self.radius = least[0], float(sizes(least)[0])
                self.basin.near = self.near * self.radius
                break
            lost = lost[self.lost(lost)]

    def _all_over(self, count: int) -> Vector:
        """Knocks of size 1 at uniform random times and directions."""
        points = self.random.normal(size=(count, 1 + self.units.shape[1]))
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
        about = self._near(about, _SPREAD)
        return np.concatenate([self._all_over(count - 2 * third), about])

    def _near(self, points: Vector, spread: tuple[float, float]) -> Vector:
        """Knocks of size 1 near others, at distances whose logarithms are spread evenly."""
        far = 10 ** self.random.uniform(*spread, points.shape)
        # A turn of the forcing by one radian counts as a change of direction by one radian.
        far = far * np.append(1 / math.tau, np.ones(points.shape[1] - 1))
        return _resized(points + far * self.random.normal(size=points.shape), 1.0)


def sizes(points: Vector) -> Vector:
    """Sizes of knocks, (n,)."""
    found: Vector = np.linalg.norm(points[:, 1:], axis=1)
    return found


def _resized(points: Vector, radii: Vector | float) -> Vector:
    """Knocks at the same times and in the same directions, of other sizes."""
    factors = radii / sizes(points)
    return np.column_stack([points[:, 0], points[:, 1:] * factors[:, None]])
