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
from capsule_sym._attractors.boundary import Basin, bisect
from capsule_sym._errors import Status

ACCURACY = 1e-4
"""Relative accuracy of a minimal shock."""
WIDTH = 0.01 * ACCURACY
"""Relative distance of two knocks between which the boundary is."""
_GENERATION = 768  # knocks at once, some 0.1 s
_FEW = 64  # knocks that show one part of the boundary
_BEYOND = 1.25  # size, over the smallest one found, of knocks that show other parts of the boundary
_PARTS, _APART = 5, 0.3  # largest number of these parts, and distance of their directions
_COARSE = 1e-3  # share by which knocks of other parts become smaller, before the best is chosen
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
        self.tried, self.status = 0, Status.TIME_LIMIT

    def run(self) -> None:
        """Grow a sphere until a knock loses the motion, and polish the smallest knocks found.

        Smaller knocks are tried until `samples` in a row return.
        """
        while (first := self._smallest(self._all_over(_GENERATION), self.radius)) is None:
            self.report(f"knocks of {self.radius:.3g}")
            if self.radius >= self.largest:
                self.status = Status.NOT_LOST
                return
            self.basin.near = self.near * self.radius
            self.radius = min(2 * self.radius, self.largest)
        known = [first, self._polish(first, _COARSE)]
        points = resized(self._all_over(4 * _GENERATION), _BEYOND * self.radius)
        points = points[self.lost(points)]
        while len(known) <= 2 * _PARTS and len(points := self._apart(points, known)):
            some = points[:_FEW]
            if (other := self._smallest(some, sizes(some), _COARSE)) is None:
                break
            known += [other, self._polish(other, _COARSE)]
        self._polish(min(known, key=lambda one: float(sizes(one[None])[0])), WIDTH)
        left = self.samples
        while left > 0:
            self.report(f"a knock of {self.radius:.6g}: trying smaller ones")
            count = min(left, _GENERATION)
            shares = np.exp(self.random.uniform(math.log(ACCURACY), math.log(0.7), count))
            smaller = self._smallest(self._all_over(count), self.radius * (1 - shares))
            if smaller is not None:
                self._polish(smaller, WIDTH)
            left = left - count if smaller is None else self.samples
        self.status = Status.FOUND

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

    def _apart(self, points: Vector, known: list[Vector]) -> Vector:
        """Knocks whose times and directions are not near to those of known ones."""
        apart: Any = abs(resized(points, 1.0)[:, None] - resized(np.array(known), 1.0))
        apart[..., 0] %= self.turn
        apart[..., 0] = np.minimum(apart[..., 0], self.turn - apart[..., 0])
        found: Vector = points[apart.max(axis=2).min(axis=1) > _APART]
        return found

    def _polish(self, best: Vector, width: float) -> Vector:
        """Smallest knock next to one: random changes, while a smaller one loses the motion.

        A change counts if it makes the knock smaller by more than a share `width`. Half of the
        changes are along the differences of the last knocks, which lie along the edges of the
        boundary. A simplex search sticks at such edges.
        """
        found = self._smallest(best[None], sizes(best[None]), width)
        best = best if found is None else found
        trail, still, count = [best], 0, _GENERATION // 4
        while still < (_STILL if width == WIDTH else _STILL // 4):
            radius, way = float(sizes(best[None])[0]), resized(best[None], 1.0)
            self.report(f"a knock of {radius:.6g}: looking for nearer points of the boundary")
            far = 10 ** self.random.uniform(-5, -1, (count, len(best)))
            far[:, 0] /= math.tau  # a radian of the forcing counts as one of direction
            points = way + far * self.random.normal(size=far.shape)
            along = way - self.random.choice(resized(np.array(trail[-_LAST:]), 1.0), count // 2)
            points[::2] += self.random.normal(size=(count // 2, 1)) * along
            found = self._smallest(points, radius * (1 - width), width)
            nearer = found is not None and sizes(found[None])[0] < radius * (1 - 2 * width)
            still = 0 if nearer else still + 1
            if found is not None:
                best = found
                trail.append(best)
        return best

    def _smallest(
        self, points: Vector, radii: Vector | float, width: float = WIDTH
    ) -> Vector | None:
        """Least knock, in the directions of knocks at other sizes that lose the motion, or None."""
        self.tried += len(points)
        best: Vector | None = None
        points = resized(points, radii)
        lost = points[self.lost(points)]
        while len(lost):
            outside = lost[sizes(lost).argmin()]
            inside = resized(outside[None], 0.0)[0]
            least = bisect(self.lost, inside, outside, width)[[1]]
            if self.basin.stays_lost(*self.starts(least)):
                best, size = least[0], float(sizes(least)[0])
                if self.best is None or size < self.radius:
                    self.best, self.radius, self.basin.near = best, size, self.near * size
                lost = resized(lost, size * (1 - 2 * width))
            lost = lost[self.lost(lost)]
        return best


def sizes(points: Vector) -> Vector:
    """Sizes of knocks, (n,)."""
    found: Vector = np.linalg.norm(points[:, 1:], axis=1)
    return found


def resized(points: Vector, radii: Vector | float) -> Vector:
    """Knocks at the same times and in the same directions, of other sizes."""
    factors = radii / sizes(points)
    return np.column_stack([points[:, 0], points[:, 1:] * factors[:, None]])
