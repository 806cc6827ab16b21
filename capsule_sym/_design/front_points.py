"""Points of a Pareto front: those that are worth it, evenly spaced, in parts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.front import Front, FrontPart
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.program import Place, Program

SAME = 1e-3  # of the ranges of the metrics: points that differ less in one are not worth two
"""Least worth of a point."""
_LEFT = "another branch is better from there on"
_TAKEN = "better than the branch before from there on"


@dataclass(eq=False)
class Trade:
    """Point of a front, with both of its metrics in the sense of minimisation."""

    u: Vector
    both: tuple[float, float]
    column: int = 0
    """The metric that is best, with a bound on the other one."""
    search: tuple[Optimiser, Place] | None = None
    """The search that found it, until it is polished."""
    optimum: Optimum | None = None
    slope: float = math.nan
    """The front's slope there."""
    held: str = ""
    """Active constraints besides the bound on the other metric."""


class Points:
    """Points of a front between its ends, and the gaps between its parts."""

    def __init__(self, first: Optimiser, second: Optimiser, count: int) -> None:
        """`count` points are wanted, by optimisers of each metric."""
        self.optimisers, self.count = (first, second), count
        self.ends: tuple[Trade, ...] = ()
        self.found: list[Trade] = []
        self.gaps: list[tuple[Trade, Trade]] = []
        """Last point of a part and first point of the next."""
        self.ranges = np.ones(2)

    @property
    def program(self) -> Program:
        """Problem of the first metric."""
        return self.optimisers[0].program

    @property
    def names(self) -> tuple[str, str]:
        """Names of both metrics."""
        first, second = (one.program.name for one in self.optimisers)
        return first, second

    def length(self, low: Trade, high: Trade) -> float:
        """Length of the front between two points, in ranges of its metrics."""
        return float(np.sum(abs(np.array(high.both) - low.both) / self.ranges))

    def gap(self, low: Trade, high: Trade) -> bool:
        """True if the step between two points is within a gap, and has its middle."""
        near = SAME * self.ranges[1]
        return any(
            one.both[1] - near < low.both[1] <= (one.both[1] + other.both[1]) / 2 <= high.both[1]
            and high.both[1] < other.both[1] + near
            for one, other in self.gaps
        )

    @property
    def undominated(self) -> list[Trade]:
        """Points that no other betters; between the ends each step is worth it in both metrics."""
        kept = list[Trade]()
        for point in sorted([*self.ends, *self.found], key=lambda point: point.both[::-1]):
            if kept:
                gain, more = abs(np.array(point.both) - kept[-1].both) / self.ranges
                if point.both[0] >= kept[-1].both[0] or (gain < SAME and point in self.found):
                    continue
                if min(gain, more) < SAME and kept[-1] in self.found:
                    kept.pop()
            kept.append(point)
        return kept

    @property
    def thinned(self) -> list[Trade]:
        """Points, at most so many as wanted, without those that close the least steps."""
        points = self.undominated
        while len(points) > self.count:
            steps = [
                (self.length(before, after), i + 1)
                for i, (before, one, after) in enumerate(
                    zip(points, points[1:], points[2:], strict=False)
                )
                if not self.gap(before, one) and not self.gap(one, after)
            ]
            if not steps:
                break
            points.pop(min(steps)[1])
        return points

    def end(self, optimum: Optimum, column: int) -> Trade:
        """Optimum of a metric as an end of the front."""
        point = Trade(np.empty(0), (math.nan, math.nan), column)
        self.tell(point, optimum)
        return point

    def tell(self, point: Trade, optimum: Optimum, before: int | None = None) -> None:
        """Complete a point by its optimum; `before` limits precede its bound."""
        motions = tuple(Motion(one.parameters, None, orbit=one) for one in optimum.orbits)
        point.u = self.program.u_of(optimum.system)
        point.both, point.search = self.both(point.u, motions), None
        slope, point.held = math.nan, _reason(optimum, before)
        if before is not None:
            # All scenarios have this bound: it is relaxed for all of them.
            count = before + 1 + (self.program.margin is not None)
            gained = sum(one.multiplier for one in optimum.constraints[before::count])
            slope = (1 / gained if point.column else gained) if gained else math.nan
        if point.column:
            # A decrease of the cost by another constraint is worth the slope, at the same cost.
            held = [replace(one, multiplier=one.multiplier * slope) for one in optimum.constraints]
            sign = self.program.sign
            optimum = replace(
                optimum,
                metric=self.names[0],
                maximised=sign < 0,
                value=sign * point.both[0],
                constraints=tuple(held),
                bounds={name: by * slope for name, by in optimum.bounds.items()},
                slopes={}
                if math.isnan(slope)
                else {name: sign * by * slope for name, by in optimum.slopes.items()},
            )
        point.optimum, point.slope = optimum, slope

    def both(self, u: Vector, motions: tuple[Motion, ...]) -> tuple[float, float]:
        """Both metrics in the sense of minimisation, each for the worst of the scenarios."""
        first, second = (
            replace(one.program, unit=1.0, limits=(), limit_units=(), margin=None).at(u, motions)
            for one in self.optimisers
        )
        return first.worst, second.worst

    def told(self, point: Trade, column: int) -> str:
        """Reason why a part ends, or begins, at the best point of a metric."""
        if not math.isnan(point.slope):
            return _TAKEN if column else _LEFT
        greatest = "greatest" if self.program.sign * (1 - 2 * column) < 0 else "least"
        return f"{self.names[column]} is {greatest}: {point.held}"

    def parts(self, points: Sequence[Trade]) -> tuple[FrontPart, ...]:
        """Parts of a front with these points."""
        parts, first, begins = list[FrontPart](), 0, f"the least {self.names[1]}"
        for i in range(len(points) - 1):
            if self.gap(points[i], points[i + 1]):
                parts.append(FrontPart(first, i, begins, self.told(points[i], 0)))
                first, begins = i + 1, self.told(points[i + 1], 1)
        greatest = "greatest" if self.program.sign < 0 else "least"
        ends = f"the {greatest} {self.names[0]}"
        return (*parts, FrontPart(first, len(points) - 1, begins, ends)) if points else ()

    def front(self, points: Sequence[Trade], status: OptimumStatus, message: str) -> Front:
        """Result with these points."""
        return Front(
            metrics=self.names,
            maximised=self.program.sign < 0,
            points=tuple(one.optimum for one in points if one.optimum is not None),
            costs=np.array([point.both[1] for point in points]),
            slopes=np.array([point.slope for point in points]),
            parts=self.parts(points),
            status=status,
            message=message,
        )


def _reason(optimum: Optimum, before: int | None) -> str:
    """Active constraints of an optimum besides its bound, which `before` constraints precede."""
    told = [f"{name} at its bound" for name, by in optimum.bounds.items() if by > 0]
    told += [one.text for one in optimum.constraints[:before] if one.active]
    if optimum.bifurcation or optimum.border is not None:
        told.append(optimum.bifurcation or "the itinerary changes")
    return " and ".join(told) or "a smooth optimum"
