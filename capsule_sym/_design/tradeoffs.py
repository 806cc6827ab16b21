"""Cells of a survey with two metrics, from which searches of their trade-offs start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.overview import overview
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit
from capsule_sym._design.survey import Survey, spread
from capsule_sym._native import check_time

_CELLS = 4  # factor of the cells of a survey, with both metrics
_CHILDREN = 2  # factor of the cells around the front in each round
_REACHES = (0.1, 0.03, 0.01)  # of the bounds: distances of these cells, round by round
_LAYERS = 3  # fronts, each without the ones before, that get cells around them
_APART = 0.05  # of the bounds, between starts of searches with one bound
_PROMISING = 0.005  # of the ranges: largest difference of a start from the best one
_STARTS = 2  # number of starts with one bound
Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


class Tradeoffs:
    """Cells `u` (n, k) with `both` metrics (n, 2), in the sense of minimisation."""

    def __init__(self, program: Program, cost: Function) -> None:
        self.program, self.cost = program, cost
        self.u, self.both = np.empty((0, len(program.names))), np.empty((0, 2))
        self.draw = np.random.default_rng(0)

    def look_around(self, survey: Survey) -> None:
        """Run cells within the bounds, then nearer and nearer to the best trade-offs."""
        self.draw = np.random.default_rng(survey.seed)
        self.look(spread(len(self.program.names), _CELLS * survey.samples, survey.seed))
        for reach in _REACHES:
            self.look_near(self.u[self.edge()], reach, _CHILDREN * survey.samples)

    def look_near(self, u: Matrix, reach: float, count: int) -> None:
        """Run cells around places, at most at the distance `reach`."""
        near = u[np.arange(count) % len(u)]
        self.look(np.clip(near + reach * self.draw.uniform(-1, 1, near.shape), 0.0, 1.0))

    def look(self, u: Matrix) -> Matrix:
        """Run cells, keep those within the limits, and return both metrics of these."""
        limits = *self.program.limits, Limit("", self.cost, 0.0, -1)
        found = overview(replace(self.program, limits=limits), u, self.program.scenarios)
        check_time()
        both: Matrix = np.column_stack([found.worst, -found.slacks[:, -1]])
        good = np.isfinite(both).all(axis=1)
        good &= found.slacks[:, :-1].min(axis=1, initial=np.inf) >= 0
        both = both[good]
        self.add(u[good], both)
        return both

    def add(self, u: Matrix, both: Matrix) -> None:
        """Keep cells (n, k) with both metrics (n, 2)."""
        self.u, self.both = np.vstack([self.u, u]), np.vstack([self.both, both])

    def edge(self) -> NDArray[np.intp]:
        """Cells dominated by few others: the first fronts, one behind another."""
        left, chosen = np.lexsort(self.both.T), list[NDArray[np.intp]]()
        for _ in range(_LAYERS):
            before = np.minimum.accumulate(np.append(np.inf, self.both[left, 0]))[:-1]
            front = self.both[left, 0] < before
            chosen, left = [*chosen, left[front]], left[~front]
        return np.concatenate(chosen)

    def starts(self, column: int, bound: float, ranges: Vector) -> list[Vector]:
        """Starts for the best of a metric with the other within a bound."""
        within = np.flatnonzero(self.both[:, 1 - column] <= bound)
        worse = self.both[within, column] / ranges[column]
        chosen = list[Vector]()
        for i in np.argsort(worse, kind="stable").tolist():
            if len(chosen) == _STARTS or worse[i] > worse.min() + _PROMISING:
                break
            u = self.u[within[i]]
            if all(abs(u - one).max() > _APART for one in chosen):
                chosen.append(u)
        return chosen
