"""Cells of a survey with two metrics, from which searches of their trade-offs start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.climb import climb
from capsule_sym._design.overview import overview
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Limit
from capsule_sym._design.survey import Survey, Surveyor, spread
from capsule_sym._native import check_time, core_of

_CELLS = 4  # factor of the cells of a survey, with both metrics
_CHILDREN = 1  # factor of the cells around the front in each round
_REACHES = (0.1, 0.03, 0.01)  # of the bounds: distances of these cells, round by round
_LAYERS = 3  # fronts, each without the ones before, that get cells around them
_GOALS, _CLIMBERS = 6, 24  # trade-offs that searches try to better, and how many of each
_STEPS = 12  # of each
_WAYS = (0.5, 0.75, 0.9, 1.0)  # of their ways, where starts may lead to better motions
_APART = 0.05  # of the bounds, between starts of searches with one bound
_PROMISING = 0.005  # of the ranges: largest difference of a start from the best one
_STARTS = 2  # number of starts with one bound


class Tradeoffs:
    """Cells `u` (n, k) with `both` metrics (n, 2), in the sense of minimisation."""

    def __init__(self, programs: Sequence[Program]) -> None:
        self.programs, program = programs, programs[0]
        self.u, self.both = np.empty((0, len(program.names))), np.empty((0, 2))
        self.draw = np.random.default_rng(0)

    def look_around(self, survey: Survey) -> None:
        """Run cells within the bounds, then nearer and nearer to the best trade-offs."""
        self.draw = np.random.default_rng(survey.seed)
        self.look(spread(self.u.shape[1], _CELLS * survey.samples, survey.seed))
        if len(front := self.edge(1)):
            both = self.both[front[::-1]]
            ranges = np.maximum(np.ptp(both, axis=0), 1e-300)
            far = np.append(0.0, np.cumsum(abs(np.diff(both, axis=0) / ranges).sum(axis=1)))
            for share in (np.arange(_GOALS) + 0.5) / _GOALS:
                goal = both[np.searchsorted(far, share * far[-1])]
                self.climb(0, goal, ranges, _CLIMBERS)
        for reach in _REACHES:
            self.look_near(self.u[self.edge()], reach, _CHILDREN * survey.samples)

    def held(self, column: int, bound: float, ranges: Vector) -> Program:
        """Problem of the best of a metric with the other within a bound, over its range."""
        other, program = self.programs[1 - column], self.programs[column]
        sign = "<=" if other.sign > 0 else ">="
        text = f"{other.name} {sign} {other.sign * bound:.6g}"
        limit = Limit(text, other.function, other.sign * bound, -other.sign)
        return replace(
            program,
            progress=None,
            limits=(*program.limits, limit),
            limit_units=(*program.limit_units, float(ranges[1 - column])),
        )

    def climb(self, column: int, goal: Vector, ranges: Vector, count: int) -> None:
        """Run cells on the ways of searches that better one metric of a goal, from cells near it.

        They are near if none of both metrics is much worse.
        """
        program = self.held(column, float(goal[1 - column]), ranges)
        if core_of(program.system.scene) is None:
            return
        program = replace(program, unit=float(ranges[column]))
        apart = 0.5 * len(self.u) ** (-1 / self.u.shape[1])
        order = np.argsort(((self.both - goal) / ranges).max(axis=1), kind="stable")
        u = self.distant(order, apart, count)
        found = overview(program, u)
        check_time()
        known = np.flatnonzero(np.isfinite(found.worst)).tolist()
        begin = Surveyor(program).closed(u, found, known)
        ends = climb(program, begin, _STEPS, apart / 2)
        self.look(np.vstack([begin.u + share * (ends.u - begin.u) for share in _WAYS]))

    def look_near(self, u: Matrix, reach: float, count: int) -> None:
        """Run cells around places, at most at the distance `reach`."""
        near = u[np.arange(count) % len(u)]
        self.look(np.clip(near + reach * self.draw.uniform(-1, 1, near.shape), 0.0, 1.0))

    def look(self, u: Matrix) -> Matrix:
        """Run cells, keep those within the limits, and return both metrics of these."""
        program, cost = self.programs
        limits = *program.limits, Limit("", cost.function, 0.0, -1)
        found = overview(replace(program, limits=limits), u)
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

    def edge(self, layers: int = _LAYERS) -> NDArray[np.intp]:
        """Cells dominated by few others: the first fronts, one behind another."""
        left, chosen = np.lexsort(self.both.T), list[NDArray[np.intp]]()
        for _ in range(layers):
            before = np.minimum.accumulate(np.append(np.inf, self.both[left, 0]))[:-1]
            front = self.both[left, 0] < before
            chosen, left = [*chosen, left[front]], left[~front]
        return np.concatenate(chosen)

    def within(self, column: int, bound: float) -> Vector:
        """A metric of the cells with the other within a bound."""
        found: Vector = self.both[self.both[:, 1 - column] <= bound, column]
        return found

    def starts(self, column: int, bound: float, ranges: Vector) -> list[Vector]:
        """Starts for the best of a metric with the other within a bound."""
        within = np.flatnonzero(self.both[:, 1 - column] <= bound)
        worse = self.both[within, column] / ranges[column]
        order = np.argsort(worse, kind="stable")
        order = order[worse[order] <= worse.min(initial=np.inf) + _PROMISING]
        return list(self.distant(within[order], _APART, _STARTS))

    def distant(self, order: NDArray[np.intp], apart: float, most: int) -> Matrix:
        """The first cells in an order that are distant from each other, (n, k)."""
        chosen = list[int]()
        for i in order.tolist():
            if len(chosen) == most:
                break
            if np.all(abs(self.u[chosen] - self.u[i]).max(axis=1) > apart):
                chosen.append(i)
        found: Matrix = self.u[chosen]
        return found
