"""Search for the smallest knock after which a motion is lost.

Knocks at all times of the motion's period are sampled on spheres in the state space. The sphere
shrinks to the smallest knock that loses the motion. New samples are drawn all over the sphere, near
the best knock, and near those from which the motion takes longest to return: they are next to the
boundary of its basin. From the best knock the boundary leads to its edge state, which gives the
nearest point (`nearest`). At the end samples within that distance are tried again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import Basin
from capsule_sym._attractors.nearest import Place, Surface, nearest
from capsule_sym._orbits.shooting.orbit import Orbit

_GENERATION = 768  # knocks at once
_LARGEST = 4.0  # radius, over the motion's size, up to which knocks are tried by default
_SMALLEST = 2.0**-10  # the same for the first knocks
_CLOSE = 1e-3  # share of the radius that a generation has to gain, while only samples are used
_QUIET = 3  # generations without a gain, before the boundary is evaluated
_FINEST = 1e-5  # the same gain, if the boundary has no edge state
_RAYS, _ON_RAY = 24, 7  # knocks of a generation that are shortened, and states on each at once
_NEAR = 0.1  # share of the smallest knock, in its largest weight, within which a run has returned
_SLOWEST = 0.06  # share of a generation with the longest returns
_ASIDE = 0.1  # distance from the best knock, in direction and angle of time
_LEAST = 1e-6  # least share of the radius by which the last knocks are smaller
_DEEPEST = 0.7  # largest share of the radius by which knocks are smaller
_RIVALS_FROM, _LARGER = 3072, 1.3  # knocks, and their ratio to the best one, at which rivals begin
_RIVALS, _CHILDREN, _STEPS = 16, 16, 30  # rivals, knocks about each at a time, and repetitions
_WIDE = 0.3  # first spread of these
_ROUNDS = 8  # largest number of rounds: an edge state, then a nearer boundary
BESIDE = 1e-9
"""Share of the radius on both sides of which the boundary is confirmed."""


class ShockStatus(StrEnum):
    """Status of a minimal shock."""

    #: The boundary is smooth or has a kink at the knock, and none next to it is smaller.
    FOUND = "found"
    #: The boundary has no periodic edge state and may be fractal: the smallest knock tried, within
    #: 0.1 %.
    SAMPLED = "sampled"
    #: No knock up to the largest loses the motion.
    NOT_LOST = "not-lost"
    #: The time limit was reached: the smallest knock so far.
    TIME_LIMIT = "time-limit"


class Search:
    """Search for the smallest knock."""

    def __init__(
        self,
        basin: Basin,
        knocks: Vector,
        largest: float | None,
        samples: int,
        seed: int,
        progress: Callable[[str], object] | None,
    ) -> None:
        self.basin, self.knocks, self.samples = basin, knocks, samples
        self.random, self.say = np.random.default_rng(seed), progress or (lambda said: None)
        self.unit = basin.size / float(abs(knocks).max())
        self.near = _NEAR * float(abs(knocks).sum(axis=0).min())
        self.largest = _LARGEST * self.unit if largest is None else float(largest)
        self.gain = _CLOSE
        self.best: Place | None = None
        self.edge: Orbit | None = None
        self.attractor: Orbit | None = None
        self.tried, self.radius, self.status = 0, 0.0, ShockStatus.TIME_LIMIT

    def run(self) -> None:
        """Search until no sampled knock is smaller."""
        if not self._grow():
            self.status = ShockStatus.NOT_LOST
            return
        for _ in range(_ROUNDS):
            self._shrink(_CLOSE)
            self.say(f"a knock of {self.radius:.6g}: looking for its edge state")
            if not self._close():
                self._shrink(_FINEST)
            self.say(f"a knock of {self.radius:.6g}: trying smaller ones")
            if not self._rival() and not self._smaller():
                break
        assert self.best is not None
        one = np.array([self.best.time]), self.best.direction[None]
        beyond = self._states(*one, (1 + BESIDE) * self.radius)
        self.attractor = self.basin.attractor(self.best.time, beyond[0])
        self.status = ShockStatus.SAMPLED if self.edge is None else ShockStatus.FOUND

    def _states(self, times: Vector, directions: Vector, radii: Vector | float) -> Vector:
        """States after knocks, (n, 3)."""
        sized = directions * np.reshape(radii, (-1, 1))
        moved: Vector = self.basin.state(times) + sized @ self.knocks.T
        return moved

    def _holds(self, times: Vector, directions: Vector, radii: Vector | float) -> Vector:
        self.tried += len(times)
        return self.basin.holds(times, self._states(times, directions, radii))

    def _all_over(self, count: int) -> tuple[Vector, Vector]:
        """Uniform random times and directions."""
        times = self.random.uniform(0, self.basin.length, count)
        directions = self.random.normal(size=(count, self.knocks.shape[1]))
        return times, directions / np.linalg.norm(directions, axis=1)[:, None]

    def _about(self, times: Vector, directions: Vector) -> tuple[Vector, Vector]:
        """Random times and directions near given ones, at distances of all orders."""
        return self._spread_by(times, directions, 10 ** self.random.uniform(-4, -0.3, len(times)))

    def _spread_by(
        self, times: Vector, directions: Vector, spread: Vector
    ) -> tuple[Vector, Vector]:
        """Random times and directions near given ones, with a spread (n,)."""
        times = times + spread * self.basin.period / 6 * self.random.normal(size=len(times))
        directions = directions + spread[:, None] * self.random.normal(size=directions.shape)
        times = np.mod(times, self.basin.length)
        return times, directions / np.linalg.norm(directions, axis=1)[:, None]

    def _grow(self) -> bool:
        """Try larger and larger knocks; returns True once some lose the motion."""
        radius = min(_SMALLEST * self.unit, self.largest)
        while True:
            times, directions = self._all_over(_GENERATION)
            lost = np.isinf(self._holds(times, directions, radius))
            self.radius = radius
            self.say(f"knocks of {radius:.3g}")
            if lost.any() and self._shorten(
                times[lost], directions[lost], np.full(lost.sum(), radius)
            ):
                return True
            if radius >= self.largest:
                return False
            self.basin.near = self.near * radius
            radius = min(2 * radius, self.largest)

    def _shrink(self, gain: float) -> None:
        """Try generations of smaller knocks until several find none that loses the motion."""
        times, directions, holds = *self._all_over(_GENERATION), np.zeros(_GENERATION)
        self.gain, silent = gain, 0
        while silent < _QUIET:
            times, directions = self._next(times, directions, holds, _GENERATION)
            radii = self.radius * (1 - self._shares(gain, _GENERATION))
            holds = self._holds(times, directions, radii)
            lost = np.isinf(holds)
            before, silent = self.radius, silent + 1
            if lost.any() and self._shorten(times[lost], directions[lost], radii[lost]):
                silent = 0 if self.radius < (1 - gain / 2) * before else silent
                self.say(f"a knock of {self.radius:.6g}")

    def _next(
        self, times: Vector, directions: Vector, holds: Vector, count: int
    ) -> tuple[Vector, Vector]:
        """Next generation: all over, near the best, and near those with the longest returns."""
        assert self.best is not None
        third = count // 3
        best = np.full(third, self.best.time), np.tile(self.best.direction, (third, 1))
        # Knocks next to the best one have the longest returns of all.
        apart = self._apart(times, directions, self.best)
        order = np.argsort(np.where(apart > _ASIDE, -holds, 0), kind="stable")
        chosen = self.random.choice(order[: int(_SLOWEST * len(holds))], third)
        parts = (
            self._all_over(count - 2 * third),
            self._about(*best),
            self._about(times[chosen], directions[chosen]),
        )
        return np.concatenate([t for t, _ in parts]), np.concatenate([d for _, d in parts])

    def _shares(self, least: float, count: int) -> Vector:
        """Random shares by which knocks are smaller than the best one, of all orders, (count,)."""
        return 10 ** self.random.uniform(math.log10(least), math.log10(_DEEPEST), count)

    def _shorten(self, times: Vector, directions: Vector, radii: Vector) -> bool:
        """Take the smallest knock along directions that loses the motion; True if one does."""
        least = np.argsort(radii, kind="stable")[:_RAYS]
        times, directions, radii = times[least], directions[least], radii[least]
        while len(times):
            radius, i = self._first_lost(times, directions, radii)
            place = Place(float(times[i]), directions[i], radius)
            if self._is_lost(place, radius):
                self._take(place)
                return True
            if self.basin.patience == self.basin.periods:
                return False
            self.basin.wait_longer()
            lost = np.isinf(self._holds(times, directions, radii))
            times, directions, radii = times[lost], directions[lost], radii[lost]
        return False

    def _first_lost(self, times: Vector, directions: Vector, high: Vector) -> tuple[float, int]:
        """Smallest radius at which a motion is lost along directions, and its index.

        The motion is lost at the radii `high`.
        """
        low, rows = np.zeros(len(times)), np.arange(len(times))
        while (high - low).max() > self.gain / 10 * high.min():
            shares = np.arange(_ON_RAY + 2) / (_ON_RAY + 1)
            radii = low[:, None] + (high - low)[:, None] * shares
            holds = self._holds(
                np.repeat(times, _ON_RAY),
                np.repeat(directions, _ON_RAY, axis=0),
                radii[:, 1:-1].ravel(),
            )
            lost = np.isinf(holds).reshape(len(times), _ON_RAY)
            first = np.where(lost.any(axis=1), lost.argmax(axis=1), _ON_RAY)
            low, high = radii[rows, first], radii[rows, first + 1]
        i = int(high.argmin())
        return float(high[i]), i

    def _is_lost(self, place: Place, radius: float) -> bool:
        """True if a motion is lost, in all its periods, by a knock of a place's direction."""
        time = np.array([place.time])
        states = self._states(time, place.direction[None], radius)
        return bool(self.basin.lost(time, states)[0])

    def _take(self, place: Place) -> None:
        self.best, self.radius, self.edge = place, place.radius, None
        self.basin.near = self.near * place.radius

    def _close(self) -> bool:
        """Take the nearest point of the boundary at the best knock, from its edge state."""
        for _ in range(_ROUNDS):
            assert self.best is not None
            time, along = self.best.time, self.knocks @ self.best.direction
            origin = self.basin.state(np.array([time]))[0]
            ends = (origin + share * self.radius * along for share in (1 - 2 * _CLOSE, 1))
            inside, outside = self.basin.narrow(time, *ends)
            edge = self.basin.edge_state(time, inside, outside)
            if edge is None:
                return False
            component = int(abs(along).argmax())
            radius = float((outside - origin)[component] / along[component])
            surface = Surface(self.basin, edge, self.knocks)
            found = nearest(surface, self.best._replace(radius=radius), self.random)
            if not self._is_lost(found, found.radius * (1 - BESIDE)):
                break
            # Another part of the boundary is in front of this one.
            times, directions = np.array([found.time]), found.direction[None]
            if not self._shorten(times, directions, np.array([found.radius * (1 - BESIDE)])):
                return False
        else:
            return False
        if not self._is_lost(found, found.radius * (1 + BESIDE)):
            return False
        self._take(found)
        self.edge = edge
        return True

    def _rival(self) -> bool:
        """Follow other parts of the boundary; take one that is nearer, if there is any.

        Each starts where a larger knock loses the motion, far from the others.
        """
        times, directions = self._all_over(_RIVALS_FROM)
        lost = np.isinf(self._holds(times, directions, _LARGER * self.radius))
        if not lost.any():
            return False
        assert self.best is not None
        times, directions = times[lost], directions[lost]
        apart, chosen = self._apart(times, directions, self.best), list[int]()
        while len(chosen) < min(_RIVALS, len(times)):
            chosen.append(int(apart.argmax()))
            last = Place(float(times[chosen[-1]]), directions[chosen[-1]], 0.0)
            apart = np.minimum(apart, self._apart(times, directions, last))
        times, directions = times[chosen], directions[chosen]
        radii, spread = np.full(len(chosen), _LARGER * self.radius), np.full(len(chosen), _WIDE)
        rows = np.arange(len(chosen))
        for _ in range(_STEPS):
            shape = len(chosen), _CHILDREN
            t, d = self._spread_by(
                np.repeat(times, _CHILDREN),
                np.repeat(directions, _CHILDREN, axis=0),
                np.repeat(spread, _CHILDREN),
            )
            shares = 1 - self._shares(_CLOSE / 10, len(t)).reshape(shape) * spread[:, None]
            tried = radii[:, None] * shares
            better = np.isinf(self._holds(t, d, tried.ravel())).reshape(shape)
            first = np.where(better, tried, np.inf).argmin(axis=1)
            gained = better.any(axis=1)
            here = (rows * _CHILDREN + first)[gained]
            times[gained], directions[gained] = t[here], d[here]
            radii[gained] = tried.ravel()[here]
            spread = np.minimum(_WIDE, spread * np.where(gained, 1.2, 0.6))
        nearer = radii < (1 - self._least) * self.radius
        return self._shorten(times[nearer], directions[nearer], radii[nearer])

    @property
    def _least(self) -> float:
        """Least share by which a final knock has to be smaller than the best one."""
        return _CLOSE if self.edge is None else _LEAST

    def _apart(self, times: Vector, directions: Vector, place: Place) -> Vector:
        """Distances from a place, in direction and angle of time, (n,)."""
        turn = abs(times - place.time) / self.basin.length
        angle = math.tau * np.minimum(turn, 1 - turn)
        found: Vector = np.linalg.norm(directions - place.direction, axis=1) + angle
        return found

    def _smaller(self) -> bool:
        """Try knocks within the best one; take the smallest that loses the motion, if any."""
        times, directions = self._all_over(_GENERATION)
        holds, left = np.zeros(_GENERATION), self.samples
        while left > 0:
            count = min(left, _GENERATION)
            times, directions = self._next(times, directions, holds, count)
            radii = self.radius * (1 - self._shares(self._least, count))
            holds = self._holds(times, directions, radii)
            lost = np.isinf(holds)
            if lost.any() and self._shorten(times[lost], directions[lost], radii[lost]):
                return True
            left -= count
        return False
