"""Survey of two metrics: places from which searches of their trade-offs start.

The places that few others better in both metrics have children: two places, drawn evenly along the
approximate front, share their variables, which are moved by a share of the difference of both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import evaluate
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Limit
from capsule_sym._design.survey import APART
from capsule_sym._native import check_time

_GENERATIONS, _CHILDREN = 12, 256  # of an evolution, and of a generation
_DRAWN = 0.5  # share of the places, at random, whose front has children: it differs each time
_CROSSED = 0.25  # share of a child's variables that are the second place's
_OF_DIFFERENCE = -3.0, -0.5  # powers of ten: steps of a child, of the difference of both places
_OF_BOUNDS = -4.0, -1.0  # the same of a step of one variable on the average, of each range


class FrontSurvey:
    """Places `u` (n, k) within the limits with `both` metrics (n, 2), to be minimised."""

    def __init__(self, first: Program, second: Program, seed: int) -> None:
        limit = Limit("", second.function, 0.0, -second.sign)
        self.count = len(first.limits)
        self.program = replace(
            first, limits=(*first.limits, limit), limit_units=(*first.limit_units, 1.0)
        )
        self.u, self.both = np.empty((0, len(first.names))), np.empty((0, 2))
        self.draw = np.random.default_rng(seed)

    def values(self, u: Matrix) -> Matrix:
        """Both metrics (n, 2) of places; infinite beyond limits."""
        found = evaluate(self.program, u)
        check_time()
        both = np.column_stack([found.worst, -found.slacks[:, self.count]])
        slacks = np.delete(found.slacks, self.count, axis=1)
        both[slacks.min(axis=1, initial=np.inf) < 0] = np.inf
        return both

    def look(self, u: Matrix) -> None:
        """Evaluate places, and keep those within the limits."""
        both = self.values(u)
        good = np.isfinite(both).all(axis=1)
        self.add(u[good], both[good])

    def add(self, u: Matrix, both: Matrix) -> None:
        """Keep places (n, k) with both metrics (n, 2)."""
        self.u, self.both = np.vstack([self.u, u]), np.vstack([self.both, both])

    def evolve(self) -> None:
        """Evaluate children of the best trade-offs, generation by generation."""
        for _ in range(_GENERATIONS if len(self.u) else 0):
            one, two = self._parents(), self._parents()
            u = np.where(self.draw.uniform(size=one.shape) < _CROSSED, two, one)
            u += self._normal(_OF_DIFFERENCE, one.shape) * (two - one)
            alone = self.draw.uniform(size=one.shape) < 1 / one.shape[1]
            self.look(np.clip(u + alone * self._normal(_OF_BOUNDS, one.shape), 0.0, 1.0))

    def front(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        """Those of some places that no other of them betters, by their second metric."""
        order = places[np.lexsort(self.both[places].T)]
        before = np.minimum.accumulate(np.append(np.inf, self.both[order, 0]))[:-1]
        found: NDArray[np.intp] = order[self.both[order, 0] < before]
        return found

    def starts(self, column: int, bound: float, most: int) -> list[Vector]:
        """Best places of a metric with the other within a bound, distant from each other."""
        within = np.flatnonzero(self.both[:, 1 - column] <= bound)
        chosen = list[Vector]()
        for u in self.u[within[np.argsort(self.both[within, column], kind="stable")]]:
            if len(chosen) < most and all(abs(u - one).max() > APART for one in chosen):
                chosen.append(u)
        return chosen

    def _normal(self, powers: tuple[float, float], shape: tuple[int, ...]) -> Matrix:
        """Normal random numbers, their deviations spread evenly between powers of ten."""
        return self.draw.normal(0.0, 10 ** self.draw.uniform(*powers, size=shape))

    def _parents(self) -> Matrix:
        """Places (count, k) drawn evenly along the front of some of the places."""
        some = self.draw.permutation(len(self.u))[: max(1, int(_DRAWN * len(self.u)))]
        front = self.front(some)
        both = self.both[front]
        steps = abs(np.diff(both, axis=0)) / (np.ptp(both, axis=0) + (np.ptp(both, axis=0) == 0))
        length = np.append(0.0, np.cumsum(steps.sum(axis=1)))
        at = self.draw.uniform(0.0, length[-1], size=_CHILDREN)
        nearest = np.round(np.interp(at, length, np.arange(len(front)))).astype(int)
        found: Matrix = self.u[front[nearest]]
        return found
