"""Points of a Pareto front: those that are worth it, evenly spaced, with gaps between them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.optimum import Optimum

SAME = 1e-3
"""Least difference of two points in both metrics, a share of the ranges of the front."""


@dataclass(eq=False)
class FrontPoint:
    """Point of a front, with both of its metrics in the sense of minimisation."""

    u: Vector
    both: tuple[float, float]
    motions: tuple[Motion, ...] = ()
    bound: float = math.nan
    """Bound on the second metric, with which the first one is best."""
    optimum: Optimum | None = None
    slope: float = math.nan
    """The front's slope there."""
    active: str = ""
    """Active constraints besides the bound on the other metric."""


class FrontPoints:
    """Points of a front between its ends, and the gaps between its parts."""

    def __init__(self, count: int) -> None:
        """`count` points are wanted."""
        self.count, self.ranges = count, np.ones(2)
        self.ends: tuple[FrontPoint, ...] = ()
        self.found: list[FrontPoint] = []
        self.gaps: list[tuple[FrontPoint, FrontPoint]] = []
        """Last point of a part and first point of the next."""

    def length(self, low: FrontPoint, high: FrontPoint) -> float:
        """Length of the front between two points, in ranges of its metrics."""
        return float(np.sum(abs(np.array(high.both) - low.both) / self.ranges))

    def gap(self, low: FrontPoint, high: FrontPoint) -> bool:
        """True if the step between two points is within a gap, and has its middle."""
        near = SAME * self.ranges[1]
        return any(
            one.both[1] - near < low.both[1] <= (one.both[1] + other.both[1]) / 2 <= high.both[1]
            and high.both[1] < other.both[1] + near
            for one, other in self.gaps
        )

    @property
    def undominated(self) -> list[FrontPoint]:
        """Points that no other betters; between the ends each step is worth it in both metrics."""
        kept = list[FrontPoint]()
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
    def thinned(self) -> list[FrontPoint]:
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


def active_constraints(optimum: Optimum, count: int) -> str:
    """Active bounds, borders, and first `count` constraints of an optimum, as a text."""
    active = [f"{name} at its bound" for name, by in optimum.bounds.items() if by > 0]
    active += [one.text for one in optimum.constraints[:count] if one.active]
    if optimum.bifurcation or optimum.border is not None:
        active.append(optimum.bifurcation or "the itinerary changes")
    return " and ".join(active) or "a smooth optimum"
