"""Survey of two metrics: places from which searches of their trade-offs start.

The places that no other betters in both metrics have children. A child differs from one of them,
drawn evenly along the approximate front, by a share of the difference to another one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix
from capsule_sym._design.cells import evaluate
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Limit
from capsule_sym._native import check_time

_GENERATIONS, _CHILDREN = 12, 256  # of an evolution, and of a generation
_STEPS = -4.0, -0.5  # powers of ten: steps of a child, of a difference of places or of the range
_DRAWN = 0.5  # share of the places, at random, whose front has children: it differs each time


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
        both = np.column_stack([found.objective, -found.slacks[:, self.count]])
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
            step = 10 ** self.draw.uniform(*_STEPS, one.shape) * self.draw.normal(size=one.shape)
            alone = self.draw.uniform(size=one.shape) < 1 / one.shape[1]
            self.look(np.clip(one + step * np.where(alone, 1.0, two - one), 0.0, 1.0))

    def front(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        """Those of some places that no other of them betters, by their second metric."""
        order = places[np.lexsort(self.both[places].T)]
        before = np.minimum.accumulate(np.append(np.inf, self.both[order, 0]))[:-1]
        found: NDArray[np.intp] = order[self.both[order, 0] < before]
        return found

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
