"""Survey of two metrics: places from which searches of their trade-offs start.

The places that no other betters in both metrics have children. A child differs from one of them,
drawn evenly along the approximate front, by a share of the difference to another one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix
from capsule_sym._design.cells import Cells, evaluate
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit, named
from capsule_sym._design.survey import Survey

_GENERATIONS, _CHILDREN = 24, 256  # of an evolution, and of a generation
_STEPS = -4.0, -0.5  # powers of ten: steps of a child, of a difference of places or of the range
_DRAWN = 0.5  # share of the places, at random, whose front has children: it differs each time


class FrontSurvey(Survey):
    """Places whose last limit is that the second metric is at most 0."""

    def __init__(self, first: Program, cost: Function, cost_range: float, seed: int) -> None:
        """`cost_range` is the unit of the second metric."""
        self.count, self.draw = len(first.limits), np.random.default_rng(seed)
        limits = (*first.limits, Limit(named(cost), cost, 0.0, -1))
        units = (*first.limit_units, cost_range)
        super().__init__(replace(first, limits=limits, limit_units=units))

    def both(self, cells: Cells) -> Matrix:
        """Both metrics (n, 2) of places, to be minimised; infinite beyond limits."""
        both = np.column_stack([cells.objective, -cells.slacks[:, self.count]])
        beyond = (np.delete(cells.slacks, self.count, axis=1) < 0).any(axis=1)
        both[beyond | ~np.isfinite(both).all(axis=1)] = np.inf
        return both

    def values(self, u: Matrix) -> Matrix:
        """Both metrics (n, 2) of other places."""
        return self.both(evaluate(self.program, u))

    def bounded(self, bound: float) -> Survey:
        """Survey of the first metric, with the second one at most at a bound."""
        program = self.program
        *limits, cost = program.limits
        cost = cost._replace(value=bound, text=f"{cost.text} <= {bound:.6g}")
        found = Survey(replace(program, progress=None, limits=(*limits, cost)))
        slacks = self.cells.slacks + bound * (np.arange(len(program.sizes)) == self.count)
        found.cells = replace(self.cells, slacks=slacks)
        return found

    def evolve(self, generations: int = _GENERATIONS) -> None:
        """Evaluate children of the best trade-offs, generation by generation."""
        for _ in range(generations if len(self.front) else 0):
            one, two = self._parents(), self._parents()
            step = 10 ** self.draw.uniform(*_STEPS, one.shape) * self.draw.normal(size=one.shape)
            alone = self.draw.uniform(size=one.shape) < 1 / one.shape[1]
            self.look(np.clip(one + step * np.where(alone, 1.0, two - one), 0.0, 1.0))

    @property
    def front(self) -> Matrix:
        """Both metrics (n, 2) of the places that no other betters."""
        both = self.both(self.cells)
        return both[trade_offs(both)]

    def _parents(self) -> Matrix:
        """Places (count, k) drawn evenly along the front of some of the places."""
        both = self.both(self.cells)
        some = self.draw.permutation(np.flatnonzero(np.isfinite(both[:, 0])))
        some = some[: max(1, int(_DRAWN * len(some)))]
        front = some[trade_offs(both[some])]
        both = both[front]
        steps = abs(np.diff(both, axis=0)) / (np.ptp(both, axis=0) + (np.ptp(both, axis=0) == 0))
        length = np.append(0.0, np.cumsum(steps.sum(axis=1)))
        at = self.draw.uniform(0.0, length[-1], size=_CHILDREN)
        nearest = np.round(np.interp(at, length, np.arange(len(front)))).astype(int)
        found: Matrix = self.cells.u[front[nearest]]
        return found


def trade_offs(both: Matrix) -> NDArray[np.intp]:
    """Those of places with both metrics (n, 2) that no other betters, by their second metric."""
    order = np.lexsort(both.T)
    before = np.minimum.accumulate(np.append(np.inf, both[order, 0]))[:-1]
    found: NDArray[np.intp] = order[both[order, 0] < before]
    return found
