"""Pareto front of two metrics: points of which none is better in one and as good in the other.

Cells of a survey show the approximate front. A point of it is the best of one metric with a bound
on the other, searched from the most promising cells. A bound that is not active is in a gap of the
front: the gap is enclosed from both sides, and no further point is searched in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.counts import POINTS
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.front import Front, FrontPart
from capsule_sym._design.optimise import checked_survey, program_of
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.polish import BASIN, KINK
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, System, function_of
from capsule_sym._design.survey import Survey
from capsule_sym._design.tradeoffs import Tradeoffs
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._native import Watch

_NEARER = (0.03, 0.01, 0.003)  # of the bounds: distances of cells around the points found
_AROUND = 8  # cells around each point, each time
_CLIMBERS = 6  # searches side by side with a bound
_BETWEEN = 7  # drives between neighbouring points
_FAR = 0.1  # of the bounds, between neighbouring points that may be on different branches
_TINY = 1e-3  # least width of a gap, in the metrics' ranges
_SAME = 1e-6  # least difference of points, in a metric's range on the front
_LEFT = "another branch is better from there on"
_TAKEN = "better than the branch before from there on"


def pareto(
    metric: str | Function,
    against: str | Function,
    over: Mapping[str, Sequence[float]],
    base: System | None = None,
    *,
    points: int = 50,
    maximise: bool = True,
    subject_to: Sequence[object] = (),
    margin: float | None = None,
    starts: Sequence[Sequence[float]] = ((0.0, 0.0, 0.0),),
    tolerances: Mapping[str, float] | None = None,
    samples: int = 256,
    seed: int = 0,
    follow: int = 3,
    max_seconds: float = SEARCH_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Front:
    """Pareto front of a metric to maximise, or minimise, against one to minimise.

    About `points` points are spaced evenly along it, between its two ends, the optima of either
    metric. Where neighbouring motions are worse in both metrics the front has a gap: its `parts`
    have the endpoints and their reasons. All else is as in `optimise`, including the units. After
    `max_seconds` the front has the points found so far.

    Raises InvalidInput as `optimise` does, and where one metric is best and the other not finite.
    """
    check_count("points", points, *POINTS)
    survey = checked_survey(samples, seed, follow)
    program = program_of(
        metric, over, base, maximise, subject_to, margin, starts, tolerances, progress
    )
    cost = function_of("against", against, program.system)
    fronts = _Fronts(program, cost, points)
    with Watch(checked_seconds(max_seconds)):
        fronts.run(survey)
    return fronts.result


class _Point(NamedTuple):
    """Optimum, both of its metrics in the sense of minimisation, and the front's slope there."""

    optimum: Optimum
    both: tuple[float, float]
    slope: float
    held: str
    """Active constraints besides the bound on the other metric."""


class _Gap(NamedTuple):
    """Gap: last point of a part, first point of the next, and the reasons."""

    last: _Point
    first: _Point
    ends: str
    begins: str


class _Fronts:
    def __init__(self, program: Program, cost: Function, points: int) -> None:
        self.program, self.cost, self.count = program, cost, points
        other = replace(program, function=cost, sign=1)
        self.optimisers = tuple(Optimiser(one, precise=False) for one in (program, other))
        self.ends: tuple[_Point, ...] = ()
        self.found: list[_Point] = []
        self.gaps: list[_Gap] = []
        self.missed = 0
        """Number of bounds without an optimum."""
        self.ranges = np.ones(2)
        self.done = False

    def run(self, survey: Survey) -> None:
        """Find the ends, the cells between them, and the points."""
        for one in self.optimisers:
            one.run(survey)
        self.cells = Tradeoffs([one.program for one in self.optimisers])
        best, least = (one.result for one in self.optimisers)
        whole = all(map(self.whole, (best, least)))
        if whole and self.between(self.point(least, 1), self.point(best, 0)):
            self.cells.look_around(survey)
            low, high = self.bettered(1, self.ends[0]), self.bettered(0, self.ends[1])
            if self.between(low, high):
                self.fill(low, high, self.count - 2)
                self.mend()
                self.complete()
                self.part()
        self.done = True

    def between(self, low: _Point, high: _Point) -> bool:
        """Set the ends and the ranges; True if a front is between them."""
        for column, end in enumerate((high, low)):
            if not math.isfinite(end.both[1 - column]):
                other, own = self.names[1 - column], self.names[column]
                allowed = f"finite where {own} is best, as by a limit such as 'speed >= 0.01'"
                raise InvalidInput(("against", "metric")[column], other, allowed)
        known = self.ends
        self.ends = low, high
        for end in self.ends:
            if end not in known:
                self.add(end)
        gained = low.both[0] - high.both[0], high.both[1] - low.both[1]
        if min(gained) <= 0:
            return False
        self.ranges = np.array(gained)
        return True

    def bettered(self, column: int, end: _Point) -> _Point:
        """The best of a metric, from the best cell if it is better."""
        i = int(np.argmin(self.cells.both[:, column]))
        if self.cells.both[i, column] > end.both[column] - _SAME * self.ranges[column]:
            return end
        optimiser = Optimiser(self.optimisers[column].program, precise=False)
        optimum = optimiser.from_place(self.cells.u[i], np.inf)
        if optimum is None or not self.whole(optimum):
            return end
        return min(end, self.point(optimum, column), key=lambda point: point.both[column])

    def add(self, point: _Point) -> None:
        """Keep a point, also as a start of other searches."""
        self.found.append(point)
        self.cells.add(self.program.u_of(point.optimum.system)[None], np.array([point.both]))

    def fill(self, low: _Point, high: _Point, count: int) -> None:
        """Find about `count` points between two, evenly along the front, none in its gaps."""
        if count < 1 or self.near(low, high):
            return
        ways = (np.array(high.both) - low.both) / self.ranges
        # The metric that changes more defines the point better.
        column = int(ways[1] > -ways[0])
        share = (count + 1) // 2 / (count + 1)
        if column == 0:
            share = 1 - share if count % 2 == 0 else share
        bound = low.both[column] + share * (high.both[column] - low.both[column])
        self.program.tell(f"point {len(self.found) + 1} of {self.count}")
        beside = high if column == 0 else low
        point = self.best(1 - column, bound, beside)
        if point is None:
            self.missed += 1
            return
        first = last = point
        slack = bound - point.both[column] > _SAME * self.ranges[column]
        if slack and point.optimum.success and point.optimum.bifurcation not in (BASIN, KINK):
            # In a gap: slightly better than one end is the other end.
            wanted = point.both[1 - column] - _SAME * self.ranges[1 - column]
            other = self.best(column, wanted, high if column else low)
            if other is None:
                self.missed += 1
                return
            if self.length(point, other) > _TINY:
                first, last = (point, other) if column else (other, point)
        first = low if self.near(low, first) else first
        last = high if self.near(high, last) else last
        new = {id(one): one for one in (first, last) if one is not low and one is not high}
        if not new and first is last:
            self.missed += 1  # the search returned to an end
            return
        for one in new.values():
            self.add(one)
        if first is not last:
            self.gaps.append(_Gap(first, last, self.told(first, 0), self.told(last, 1)))
        lengths = self.length(low, first), self.length(last, high)
        count -= len(new)
        before = round(count * lengths[0] / (sum(lengths) or 1.0))
        known = len(self.found)
        self.fill(low, first, before)
        self.fill(last, high, count - max(before, len(self.found) - known))

    def told(self, point: _Point, column: int) -> str:
        """Reason why a part ends, or begins, at the best point of a metric."""
        if not math.isnan(point.slope):
            return _TAKEN if column else _LEFT
        greatest = "greatest" if self.program.sign * (1 - 2 * column) < 0 else "least"
        return f"{self.names[column]} is {greatest}: {point.held}"

    def mend(self) -> None:
        """Improve the points that cells around them dominate, or the branch of the point before."""
        kept = self.undominated
        places = np.array([self.program.u_of(point.optimum.system) for point in kept])
        for reach in _NEARER:
            self.cells.look_near(places, reach, _AROUND * len(places))
        for i, point in enumerate(kept):
            cheaper = np.flatnonzero(self.cells.both[:, 1] <= point.both[1])
            best = cheaper[np.argmin(self.cells.both[cheaper, 0])]
            if self.cells.both[best, 0] < point.both[0] - _SAME * self.ranges[0]:
                self.mended(point, self.cells.u[best])
            elif i and abs(places[i] - places[i - 1]).max() > _FAR:
                self.mended(point, places[i - 1])

    def complete(self) -> None:
        """Find points on the longest steps, in place of those that others dominate."""
        kept = self.undominated
        for _ in range(self.count - len(kept) if len(kept) > 1 else 0):
            steps = [
                (self.length(*pair) if self.gap_after(kept, i) is None else 0.0, i)
                for i, pair in enumerate(pairwise(kept))
            ]
            i = max(steps)[1]
            self.fill(kept[i], kept[i + 1], 1)
            kept = self.undominated

    def mended(self, point: _Point, u: Vector) -> None:
        """Replace a point by one next to a better place, also in gaps."""
        first = any(gap.first is point for gap in self.gaps)
        better = self.search(int(first), point.both[1 - first], u, point)
        if better is not None:
            self.add(better)
            self.gaps = [
                gap._replace(
                    last=better if gap.last is point else gap.last,
                    first=better if gap.first is point else gap.first,
                )
                for gap in self.gaps
            ]

    def part(self) -> None:
        """Find gaps between neighbouring points on different branches."""
        kept = self.undominated
        places = [self.program.u_of(point.optimum.system) for point in kept]
        for i, (one, other) in enumerate(pairwise(kept)):
            apart = places[i + 1] - places[i]
            if abs(apart).max() < _FAR or self.gap_after(kept, i) is not None:
                continue
            shares = np.linspace(0, 1, _BETWEEN + 2)[1:-1, None]
            both = self.cells.look(places[i] + shares * apart)
            nearest = np.array(one.both) + shares * (np.array(other.both) - one.both)
            worse = np.sum((both - nearest[: len(both)]) / self.ranges, axis=1)
            if len(worse) < _BETWEEN or worse.max() > self.length(one, other):
                self.gaps.append(_Gap(one, other, _LEFT, _TAKEN))

    def length(self, low: _Point, high: _Point) -> float:
        """Length of the front between two points, in ranges of its metrics."""
        return float(np.sum(abs(np.array(high.both) - low.both) / self.ranges))

    def near(self, one: _Point, other: _Point) -> bool:
        """True if two points are equal."""
        return self.length(one, other) < 3 * _SAME

    def best(self, column: int, bound: float, beside: _Point) -> _Point | None:
        """Best of a metric with the other at most at a bound, both in the sense of minimisation.

        Searches begin at cells, and at the point `beside` if it is on another branch.
        """
        goal = np.full(2, bound)
        goal[column] = min(self.cells.within(column, bound))
        self.cells.climb(column, goal, self.ranges, _CLIMBERS)
        begin = self.cells.starts(column, bound, self.ranges)
        u = self.program.u_of(beside.optimum.system)
        if all(abs(u - one).max() > _FAR for one in begin):
            begin.append(u)
        best: _Point | None = None
        for u in begin:
            best = self.search(column, bound, u, best) or best
        return best

    def search(
        self, column: int, bound: float, u: Vector, known: _Point | None = None
    ) -> _Point | None:
        """The same next to a place; None if it is not better than a known one."""
        program = self.cells.held(column, bound, self.ranges)
        level = np.inf if known is None else known.both[column] / program.unit
        optimum = Optimiser(program, precise=False).from_place(u, level)
        if optimum is None or not self.whole(optimum):
            return None
        point = self.point(optimum, column, len(self.program.limits))
        return point if known is None or point.both[column] < known.both[column] else None

    def point(self, optimum: Optimum, column: int, before: int | None = None) -> _Point:
        """Optimum of a metric as a point of the front; `before` limits precede its bound."""
        both = self.worst(optimum, 0), self.worst(optimum, 1)
        slope, reason = math.nan, _reason(optimum, before)
        if before is not None:
            # All scenarios have this bound: it is relaxed for all of them.
            count = before + 1 + (self.program.margin is not None)
            gained = sum(one.multiplier for one in optimum.constraints[before::count])
            slope = (1 / gained if column else gained) if gained else math.nan
        if column:
            # A decrease of the cost by another constraint is worth the slope, at the same cost.
            held = [replace(one, multiplier=one.multiplier * slope) for one in optimum.constraints]
            sign = self.program.sign
            optimum = replace(
                optimum,
                metric=self.names[0],
                maximised=sign < 0,
                value=sign * both[0],
                constraints=tuple(held),
                bounds={name: by * slope for name, by in optimum.bounds.items()},
                slopes={}
                if math.isnan(slope)
                else {name: sign * by * slope for name, by in optimum.slopes.items()},
            )
        return _Point(optimum, both, slope, reason)

    @property
    def names(self) -> tuple[str, str]:
        """Names of both metrics."""
        first, second = (one.program.name for one in self.optimisers)
        return first, second

    def worst(self, optimum: Optimum, column: int) -> float:
        """Metric in the sense of minimisation, for the worst of the scenarios of an optimum."""
        motions = tuple(Motion(one.parameters, None, orbit=one) for one in optimum.orbits)
        program = self.optimisers[column].program
        plain = replace(program, unit=1.0, limits=(), limit_units=(), margin=None)
        return plain.at(plain.u_of(optimum.system), motions).worst

    def whole(self, point: Optimum) -> bool:
        """True if a point has the orbits of all scenarios, and is within the limits."""
        infeasible = point.status is OptimumStatus.INFEASIBLE
        return len(point.orbits) == len(self.program.scenarios) and not infeasible

    @property
    def result(self) -> Front:
        """Front with the points found."""
        best, least = (one.result for one in self.optimisers)
        if not self.ends:
            if not self.done:
                ends = [self.point(best, 0)] if self.whole(best) else []
                message = "time limit reached: ends are missing"
                return self.front(ends, OptimumStatus.TIME_LIMIT, message)
            end = least if self.whole(best) else best
            return self.front([], end.status, end.message)
        kept = self.undominated
        if len(kept) == 1:
            return self.front(kept, OptimumStatus.OPTIMAL, "one point is best in both metrics")
        told = counted(len(kept), "point")
        if not self.done:
            message = f"time limit reached: {told} of {self.count} were found"
            return self.front(kept, OptimumStatus.TIME_LIMIT, message)
        parts = len(self.parts(kept))
        if parts > 1:
            told += f" in {parts} parts"
        rough = sum(not point.optimum.success for point in kept)
        lacks = [f"{rough} of them are not proved optima"] if rough else []
        lacks += [f"{self.missed} were not found"] if self.missed else []
        if lacks:
            message = f"{told}: {' and '.join(lacks)}"
            return self.front(kept, OptimumStatus.NOT_CONVERGED, message)
        return self.front(kept, OptimumStatus.OPTIMAL, told)

    @property
    def undominated(self) -> list[_Point]:
        """Points that no other point dominates."""
        kept = list[_Point]()
        for point in sorted([*self.ends, *self.found], key=lambda point: point.both[::-1]):
            if not kept or point.both[0] < kept[-1].both[0] - _SAME * self.ranges[0]:
                kept.append(point)
        return kept

    def gap_after(self, points: Sequence[_Point], i: int) -> _Gap | None:
        """Gap between a point and the next one, if there is one."""
        for gap in self.gaps:
            if gap.last is points[i] or gap.first is points[i + 1]:
                return gap
        return None

    def parts(self, points: Sequence[_Point]) -> tuple[FrontPart, ...]:
        """Parts of a front with these points."""
        parts, first, begins = list[FrontPart](), 0, f"the least {self.names[1]}"
        for i in range(len(points) - 1):
            if (gap := self.gap_after(points, i)) is not None:
                parts.append(FrontPart(first, i, begins, gap.ends))
                first, begins = i + 1, gap.begins
        greatest = "greatest" if self.program.sign < 0 else "least"
        ends = f"the {greatest} {self.names[0]}"
        return (*parts, FrontPart(first, len(points) - 1, begins, ends)) if points else ()

    def front(self, points: Sequence[_Point], status: OptimumStatus, message: str) -> Front:
        """Result with these points."""
        return Front(
            metrics=self.names,
            maximised=self.program.sign < 0,
            points=tuple(point.optimum for point in points),
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
