"""Places of a survey with two metrics, from which searches of their trade-offs start.

The places that few others better in both metrics have children: two places, drawn evenly along the
approximate front, share their variables, which are moved by a share of the difference of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import evaluate
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Limit
from capsule_sym._native import check_time
from capsule_sym._processes import sobol

_GENERATIONS, _CHILDREN = 12, 256  # of an evolution, and of a generation
_LAYERS = 4  # fronts, each without the ones before, whose places have children
_CROSSED = 0.25  # share of a child's variables that are the second place's
_OF_DIFFERENCE = -3.0, -0.5  # powers of ten: steps of a child, of the difference of both places
_OF_BOUNDS = -4.0, -1.0  # the same of a step of one variable on the average, of the bounds
_REFINED, _AROUND = 4, 16  # times, and places around a best one each time, for each variable
_APART = 0.05  # of the bounds, between two starts of searches


class Tradeoffs:
    """Places `u` (n, k) within the limits with `both` metrics (n, 2), to be minimised."""

    def __init__(self, first: Program, second: Program) -> None:
        limit = Limit("", second.function, 0.0, -second.sign)
        self.count = len(first.limits)
        self.program = replace(
            first, limits=(*first.limits, limit), limit_units=(*first.limit_units, 1.0)
        )
        self.u, self.both = np.empty((0, len(first.names))), np.empty((0, 2))
        self.draw = np.random.default_rng(0)

    def survey(self, samples: int, seed: int) -> None:
        """Evaluate places all over the bounds."""
        self.draw = np.random.default_rng(seed)
        self.look(sobol(self.u.shape[1], samples, seed))

    def evolve(self) -> None:
        """Evaluate children of the best trade-offs, generation by generation."""
        for _ in range(_GENERATIONS if len(self.u) else 0):
            one, two = self.along(_CHILDREN), self.along(_CHILDREN)
            u = np.where(self.draw.uniform(size=one.shape) < _CROSSED, two, one)
            u += self.normal(_OF_DIFFERENCE, one.shape) * (two - one)
            alone = self.draw.uniform(size=one.shape) < 1 / one.shape[1]
            self.look(np.clip(u + alone * self.normal(_OF_BOUNDS, one.shape), 0.0, 1.0))

    def normal(self, powers: tuple[float, float], shape: tuple[int, ...]) -> Matrix:
        """Normal random numbers, their deviations spread evenly between powers of ten."""
        return self.draw.normal(0.0, 10 ** self.draw.uniform(*powers, size=shape))

    def along(self, count: int) -> Matrix:
        """Places (count, k) drawn evenly along one of the first fronts."""
        front = self.front(int(self.draw.integers(_LAYERS)))
        both = self.both[front]
        steps = abs(np.diff(both, axis=0)) / (np.ptp(both, axis=0) + (np.ptp(both, axis=0) == 0))
        length = np.append(0.0, np.cumsum(steps.sum(axis=1)))
        at = self.draw.uniform(0.0, length[-1], size=count)
        nearest = np.round(np.interp(at, length, np.arange(len(front)))).astype(int)
        found: Matrix = self.u[front[nearest]]
        return found

    def refine(self, costs: Sequence[float]) -> None:
        """Evaluate places around the best one of each cost."""
        for _ in range(_REFINED):
            if best := [u for cost in costs for u in self.starts(0, cost, 1)]:
                u = np.repeat(best, _AROUND * self.u.shape[1], axis=0)
                self.look(np.clip(u + self.normal(_OF_BOUNDS, u.shape), 0.0, 1.0))

    def look(self, u: Matrix) -> None:
        """Evaluate places, and keep those within the limits."""
        both = self.values(u)
        good = np.isfinite(both).all(axis=1)
        self.add(u[good], both[good])

    def values(self, u: Matrix) -> Matrix:
        """Both metrics (n, 2) of places; infinite beyond limits."""
        found = evaluate(self.program, u)
        check_time()
        both = np.column_stack([found.worst, -found.slacks[:, self.count]])
        slacks = np.delete(found.slacks, self.count, axis=1)
        both[slacks.min(axis=1, initial=np.inf) < 0] = np.inf
        return both

    def add(self, u: Matrix, both: Matrix) -> None:
        """Keep places (n, k) with both metrics (n, 2)."""
        self.u, self.both = np.vstack([self.u, u]), np.vstack([self.both, both])

    def front(self, behind: int = 0) -> NDArray[np.intp]:
        """Places that no other betters, by their second metric; or the front so far behind."""
        left = np.lexsort(self.both.T)
        while True:
            before = np.minimum.accumulate(np.append(np.inf, self.both[left, 0]))[:-1]
            ahead = self.both[left, 0] < before
            if not behind or ahead.all():
                found: NDArray[np.intp] = left[ahead]
                return found
            left, behind = left[~ahead], behind - 1

    def least(self, column: int, bound: float) -> float:
        """Least value of a metric with the other within a bound."""
        within = self.both[:, 1 - column] <= bound
        return float(self.both[within, column].min(initial=np.inf))

    def starts(self, column: int, bound: float, most: int) -> list[Vector]:
        """Best places of a metric with the other within a bound, distant from each other."""
        within = np.flatnonzero(self.both[:, 1 - column] <= bound)
        chosen = list[Vector]()
        for u in self.u[within[np.argsort(self.both[within, column], kind="stable")]]:
            if all(abs(u - one).max() > _APART for one in chosen):
                chosen.append(u)
            if len(chosen) == most:
                break
        return chosen
