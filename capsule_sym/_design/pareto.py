"""The best trade-offs between two metrics: none of them is better in one and as good in the other.

Cells of a survey show about where the front is. A point of it is the best of one metric with the
other held within a bound, searched from the cells that promise most. A bound that does not hold its
optimum is in a gap of the front: from both sides of it the gap is closed in, and no more is asked
for there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.counts import POINTS
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.front import Front, FrontPart
from capsule_sym._design.optimise import checked_survey, program_of
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.polish import BASIN, KINK
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit, System, function_of
from capsule_sym._design.survey import Survey
from capsule_sym._design.tradeoffs import Tradeoffs
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._native import Watch

_NEARER = (0.03, 0.01, 0.003)  # the same, from the points that were found
_AROUND = 16  # cells around each point, each time
_BETWEEN = 7  # drives between such
_FAR = 0.1  # of the bounds, between neighbouring points that may be on different branches
_TINY = 1e-3  # of the metrics' ranges, by which a gap is at least wide
_SAME = 1e-6  # of a metric's range on the front, by which points differ
_LEFT = "another branch is better from there on"
_TAKEN = "better than the branch before from there on"
Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


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
    max_seconds: float = math.inf,
    progress: Callable[[str], object] | None = None,
) -> Front:
    """The Pareto front of a metric that is to be great, or small, against one that is to be small.

    About so many `points` lie evenly along it, between its two ends, the optima of either metric.
    Where neighbouring motions are worse both ways the front has a gap: its `parts` say where they
    begin and end, and why. All else is as in `optimise`, the units too. After `max_seconds` the
    front has the points that were found.

    Raises InvalidInput as `optimise` does.
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
    """An optimum, both of its metrics as they are to be small, and the slope of the front there."""

    optimum: Optimum
    both: tuple[float, float]
    slope: float
    held: str
    """What holds it but the bound on the other metric."""

    @property
    def cost(self) -> float:
        """The second metric."""
        return self.both[1]


class _Gap(NamedTuple):
    """A gap: the last point of a part and the first of the next, and why they are."""

    last: _Point
    first: _Point
    ends: str
    begins: str


class _Fronts:
    def __init__(self, program: Program, cost: Function, points: int) -> None:
        self.program, self.cost, self.count = program, cost, points
        self.optimisers = Optimiser(program), Optimiser(replace(program, function=cost, sign=1))
        self.ends: tuple[_Point, ...] = ()
        self.found: list[_Point] = []
        self.gaps: list[_Gap] = []
        self.missed = 0
        """Bounds with which no optimum was found."""
        self.cells = Tradeoffs(program, cost)
        self.ranges = np.ones(2)
        self.done = False

    def run(self, survey: Survey) -> None:
        """The ends, the cells between them, and the points."""
        for one in self.optimisers:
            one.run(survey)
        best, least = (one.result for one in self.optimisers)
        if all(map(self.whole, (best, least))):
            self.ends = self.point(least, 1), self.point(best, 0)
            first, last = (np.array(end.both) for end in self.ends)
            if last[1] > first[1] and last[0] < first[0]:
                self.ranges = abs(last - first)
                for end in self.ends:
                    self.add(end)
                self.cells.look_around(survey)
                self.fill(*self.ends, self.count - 2)
                self.mend()
                self.part()
        self.done = True

    def programs(self, column: int) -> Program:
        """What has the first metric, or the second, as what is to be least, in units."""
        return self.optimisers[column].program

    def add(self, point: _Point) -> None:
        """Keep a point, also as a start of other ones."""
        self.found.append(point)
        self.cells.add(self.program.u_of(point.optimum.system)[None], np.array([point.both]))

    def fill(self, low: _Point, high: _Point, count: int) -> None:
        """Find about `count` points between two, evenly along the front, none in its gaps."""
        if count < 1 or self.near(low, high):
            return
        ways = (np.array(high.both) - low.both) / self.ranges
        # The more a metric changes the better its bound says which point is meant.
        column = int(ways[1] > -ways[0])
        share = (count + 1) // 2 / (count + 1)
        if column == 0:
            share = 1 - share if count % 2 == 0 else share
        bound = low.both[column] + share * (high.both[column] - low.both[column])
        self.program.tell(f"point {len(self.found) + 1} of {self.count}")
        point = self.best(1 - column, bound)
        if point is None:
            self.missed += 1
            return
        first = last = point
        slack = bound - point.both[column] > _SAME * self.ranges[column]
        if slack and point.optimum.success and point.optimum.bifurcation not in (BASIN, KINK):
            # In a gap: a little better than at its one end there is the other one.
            wanted = point.both[1 - column] - _SAME * self.ranges[1 - column]
            other = self.best(column, wanted)
            if other is None:
                self.missed += 1
                return
            if self.length(point, other) > _TINY:
                first, last = (point, other) if column else (other, point)
        first = low if self.near(low, first) else first
        last = high if self.near(high, last) else last
        new = {id(one): one for one in (first, last) if one is not low and one is not high}
        if not new and first is last:
            self.missed += 1  # the search comes back to an end
            return
        for one in new.values():
            self.add(one)
        if first is not last:
            self.gaps.append(_Gap(first, last, self.told(first, 0), self.told(last, 1)))
        lengths = self.length(low, first), self.length(last, high)
        count -= len(new)
        before = round(count * lengths[0] / (sum(lengths) or 1.0))
        self.fill(low, first, before)
        self.fill(last, high, count - before)

    def told(self, point: _Point, column: int) -> str:
        """Why a part ends, or begins, at the best point of a metric."""
        if not math.isnan(point.slope):
            return _TAKEN if column else _LEFT
        greatest = "greatest" if self.program.sign * (1 - 2 * column) < 0 else "least"
        return f"{self.names[column]} is {greatest}: {point.held}"

    def mend(self) -> None:
        """Better the points that cells around them beat."""
        kept = self.undominated([*self.ends, *self.found])
        places = np.array([self.program.u_of(point.optimum.system) for point in kept])
        for reach in _NEARER:
            self.cells.look_near(places, reach, _AROUND * len(places))
        for point in kept:
            cheaper = np.flatnonzero(self.cells.both[:, 1] <= point.both[1])
            best = cheaper[np.argmin(self.cells.both[cheaper, 0])]
            if self.cells.both[best, 0] < point.both[0] - _SAME * self.ranges[0]:
                self.mended(point, self.cells.u[best])

    def mended(self, point: _Point, u: Vector) -> None:
        """Put the point next to a better place beside another one, or in its place in a gap."""
        first = any(gap.first is point for gap in self.gaps)
        better = self.search(int(first), point.both[1 - first], u)
        if better is not None and better.both[first] < point.both[first]:
            self.add(better)
            self.gaps = [
                gap._replace(
                    last=better if gap.last is point else gap.last,
                    first=better if gap.first is point else gap.first,
                )
                for gap in self.gaps
            ]

    def part(self) -> None:
        """Tell where neighbouring points are on different branches: between them all is worse."""
        kept = self.undominated([*self.ends, *self.found])
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
        """Of the front between two points, in ranges of its metrics: that of each step of it."""
        return float(np.sum(abs(np.array(high.both) - low.both) / self.ranges))

    def near(self, one: _Point, other: _Point) -> bool:
        """Whether two points are one."""
        return self.length(one, other) < 3 * _SAME

    def best(self, column: int, bound: float) -> _Point | None:
        """The best of a metric with the other at most at a bound, both as they are to be small."""
        begin = self.cells.starts(column, bound, self.ranges)
        for reach in _NEARER[:2]:
            self.cells.look_near(np.array(begin), reach, _AROUND)
            begin = self.cells.starts(column, bound, self.ranges)
        found = [self.search(column, bound, u) for u in begin]
        whole = [point for point in found if point is not None]
        return min(whole, key=lambda point: point.both[column], default=None)

    def search(self, column: int, bound: float, u: Vector) -> _Point | None:
        """The same next to a place."""
        program, sign = self.programs(column), self.program.sign
        if column == 0:
            held = Limit(f"{self.names[1]} <= {bound:.6g}", self.cost, bound, -1)
        else:
            text = f"{self.names[0]} {'>=' if sign < 0 else '<='} {sign * bound:.6g}"
            held = Limit(text, self.program.function, sign * bound, -sign)
        program = replace(
            program,
            progress=None,
            limits=(*program.limits, held),
            limit_units=(*program.limit_units, float(self.ranges[1 - column])),
        )
        optimum = Optimiser(program).from_place(u)
        if optimum is None or not self.whole(optimum):
            return None
        return self.point(optimum, column, len(self.program.limits))

    def point(self, optimum: Optimum, column: int, before: int | None = None) -> _Point:
        """An optimum of a metric as a point of the front; `before` limits precede its bound."""
        both = self.worst(optimum, 0), self.worst(optimum, 1)
        slope, reason = math.nan, _reason(optimum, before)
        if before is not None:
            # All scenarios have this bound: it is let out for all of them.
            count = before + 1 + (self.program.margin is not None)
            gained = sum(one.multiplier for one in optimum.constraints[before::count])
            slope = (1 / gained if column else gained) if gained else math.nan
        if column:
            # At the same cost, what lowers the cost otherwise gains by the slope.
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
        """Both metrics in words."""
        first, second = (one.program.name for one in self.optimisers)
        return first, second

    def worst(self, optimum: Optimum, column: int) -> float:
        """A metric as it is to be small, in the worst of the scenarios of an optimum."""
        motions = tuple(Motion(one.parameters, None, orbit=one) for one in optimum.orbits)
        plain = replace(self.programs(column), unit=1.0, limits=(), limit_units=(), margin=None)
        return plain.at(plain.u_of(optimum.system), motions).worst

    def whole(self, point: Optimum) -> bool:
        """Whether a point has the orbits of all scenarios, and is within the limits."""
        infeasible = point.status is OptimumStatus.INFEASIBLE
        return len(point.orbits) == len(self.program.scenarios) and not infeasible

    @property
    def result(self) -> Front:
        """The front with the points that were found."""
        best, least = (one.result for one in self.optimisers)
        if not self.ends:
            if not self.done:
                ends = [self.point(best, 0)] if self.whole(best) else []
                message = "the time is over: ends are missing"
                return self.front(ends, OptimumStatus.TIME_LIMIT, message)
            end = least if self.whole(best) else best
            return self.front([], end.status, end.message)
        kept = self.undominated([*self.ends, *self.found])
        if len(kept) == 1:
            return self.front(kept, OptimumStatus.OPTIMAL, "one point is best in both metrics")
        told = f"{len(kept)} points"
        if not self.done:
            message = f"the time is over: {told} of {self.count} were found"
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

    def undominated(self, points: Sequence[_Point]) -> list[_Point]:
        """The points than which no other is better in one metric and as good in the other."""
        kept = list[_Point]()
        for point in sorted(points, key=lambda point: point.both[::-1]):
            if not kept or point.both[0] < kept[-1].both[0] - _SAME * self.ranges[0]:
                kept.append(point)
        return kept

    def gap_after(self, points: Sequence[_Point], i: int) -> _Gap | None:
        """The gap between a point and the next one, if there is one."""
        for gap in self.gaps:
            if gap.last is points[i] or gap.first is points[i + 1]:
                return gap
        return None

    def parts(self, points: Sequence[_Point]) -> tuple[FrontPart, ...]:
        """The parts of a front that has these points."""
        parts, first, begins = list[FrontPart](), 0, f"the least {self.names[1]}"
        for i in range(len(points) - 1):
            if (gap := self.gap_after(points, i)) is not None:
                parts.append(FrontPart(first, i, begins, gap.ends))
                first, begins = i + 1, gap.begins
        greatest = "greatest" if self.program.sign < 0 else "least"
        ends = f"the {greatest} {self.names[0]}"
        return (*parts, FrontPart(first, len(points) - 1, begins, ends)) if points else ()

    def front(self, points: Sequence[_Point], status: OptimumStatus, message: str) -> Front:
        """The result that has these points."""
        return Front(
            metrics=self.names,
            maximised=self.program.sign < 0,
            points=tuple(point.optimum for point in points),
            costs=np.array([point.cost for point in points]),
            slopes=np.array([point.slope for point in points]),
            parts=self.parts(points),
            status=status,
            message=message,
        )


def _reason(optimum: Optimum, before: int | None) -> str:
    """What holds an optimum but a bound on the other metric, which `before` constraints precede."""
    told = [f"{name} at its bound" for name, by in optimum.bounds.items() if by > 0]
    told += [one.text for one in optimum.constraints[:before] if one.active]
    if optimum.bifurcation or optimum.border is not None:
        told.append(optimum.bifurcation or "the itinerary changes")
    return " and ".join(told) or "a smooth optimum"
