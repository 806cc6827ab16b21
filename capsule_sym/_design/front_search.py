"""Search for a Pareto front: the best of one metric with a bound on the other, point by point.

A survey shows the approximate front. The next point is searched in the middle of the widest step,
from the survey and from both of its ends. Where nothing is found, the step is a gap. A step to
another branch is halved until it is short. The points kept at the end are polished.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.front import Front, FrontPart
from capsule_sym._design.front_points import SAME, FrontPoint, FrontPoints, active_constraints
from capsule_sym._design.front_survey import FrontSurvey
from capsule_sym._design.optimum import Optimum, optimum_of
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit
from capsule_sym._design.search import Optimisation
from capsule_sym._design.stationary import SOLVED
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._processes import sobol

_CELLS = 4  # times as many places of both metrics as of one: a front is longer than a point
_STARTS = 2  # places of the survey from which a point is searched: two branches may compete
_SHORT = 0.2  # of the ranges, over the number of points: a tenth of the mean step
_FAR = 0.1  # share of each range: twice the mean step of 20 points, more may be another branch
_ATTEMPTS = 2  # searches for each point of the front, at most: so it ends


class FrontSearch(FrontPoints):
    """Search for the points of a front, from its ends inwards."""

    def __init__(self, program: Program, cost: Function, count: int) -> None:
        """`count` points are wanted of a program against a cost."""
        self.searches = Optimisation(program), Optimisation(replace(program, function=cost, sign=1))
        super().__init__(count)
        self.short, self.missed, self.done = _SHORT / count, 0, False

    @property
    def program(self) -> Program:
        """Problem of the first metric."""
        return self.searches[0].program

    @property
    def names(self) -> tuple[str, str]:
        """Names of both metrics."""
        first, second = (one.program.name for one in self.searches)
        return first, second

    def run(self, samples: int, seed: int) -> None:
        """Find the ends, the approximate front between them, and the points."""
        for one in self.searches:
            one.run(samples, seed)
        if all(self.has_motions(one.result) for one in self.searches):
            self.overview(_CELLS * samples, seed)
            best, least = (one.result for one in self.searches)
            self.ends = self.end(least, 1), self.end(best, 0)
            for column, end in enumerate(reversed(self.ends)):
                if not math.isfinite(end.both[1 - column]):
                    other, own = self.names[1 - column], self.names[column]
                    allowed = f"finite where {own} is best, as by a limit such as 'speed >= 0.01'"
                    raise InvalidInput(("against", "metric")[column], other, allowed)
            self.between()
        self.done = True

    def overview(self, samples: int, seed: int) -> None:
        """Survey both metrics; what betters an optimum is searched and polished, too."""
        self.survey = FrontSurvey(self.searches[0].program, self.searches[1].program, seed)
        self.survey.look(sobol(len(self.program.names), samples, seed))
        for one in self.searches:
            self.survey.look(one.survey.cells.u)
        self.survey.evolve()
        for column, one in enumerate(self.searches):
            begin = map(one.program.begin, self.survey.starts(column, math.inf, 1))
            places = [*filter(None, map(one.descend, begin))]
            one.polish(places)
            one.found = one.conclude(places)

    def between(self) -> None:
        """Find the points between the ends, if there are any."""
        low, high = (np.array(end.both) for end in self.ends)
        same = np.isclose(low, high, SOLVED, 0.0)
        if same.any() or high[0] > low[0] or high[1] < low[1]:
            self.ends = (self.ends[int(high[0] < low[0] and not same[0])],)
            return
        self.ranges = abs(high - low)
        for end in self.ends:
            self.survey.add(end.u[None], np.array([end.both]))
        self.fill()
        self.survey.evolve()
        self.improve()
        self.fill()
        self.found = [point for point in self.thinned if point not in self.ends]
        for i, point in enumerate(self.found):
            self.program.tell(f"point {i + 1} of {len(self.found)}")
            self.polish(point)

    def fill(self) -> None:
        """Find points in the middle of the widest steps, and halve steps to another branch."""
        self.gaps = [pair for pair in self.gaps if all(one in self.undominated for one in pair)]
        for _ in range(_ATTEMPTS * self.count):
            points = self.undominated
            self.missed = max(0, self.count - len(points))
            pairs = [pair for pair in pairwise(points) if not self.gap(*pair)]
            pairs = [pair for pair in pairs if self.length(*pair) >= self.short]
            pairs = [pair for pair in pairs if self.missed or self.apart(*pair)]
            if not pairs:
                self.missed = 0
                break
            pair = max(pairs, key=lambda pair: self.length(*pair))
            self.program.tell(f"search between {len(points)} points of {self.count}")
            self.divide(*pair)
            if len(self.undominated) == len(points) and not self.gap(*pair):
                self.gaps.append(pair)
        self.gaps = [pair for pair in self.gaps if self.worse(*pair, SAME)]
        steps = pairwise(self.undominated)
        self.gaps += [pair for pair in steps if not self.gap(*pair) and self.apart(*pair)]

    def divide(self, low: FrontPoint, high: FrontPoint) -> None:
        """Find a point between two, or the gap between them."""
        ways = (np.array(high.both) - low.both) / self.ranges
        column = int(ways[1] > -ways[0])  # the metric that changes more defines the point better
        bound = (low.both[column] + high.both[column]) / 2
        point, sides = self.best(1 - column, bound, (low, high)), [low, high]
        if point is not None:
            self.add(point)
            sides[1 - column] = point
            if bound - point.both[column] <= SAME * self.ranges[column]:
                return
            # In a gap: slightly better than one end is the other end.
            wanted = point.both[1 - column] - 2 * SAME * self.ranges[1 - column]
            other = self.best(column, wanted, (low, high))
            if other is not None:
                self.add(other)
                sides[column] = other
        if self.length(*sides) > self.short:
            self.gaps.append((sides[0], sides[1]))

    def best(self, column: int, bound: float, near: Sequence[FrontPoint] = ()) -> FrontPoint | None:
        """Best of a metric with the other at most at a bound, both in the sense of minimisation.

        Searches begin at the best places of the survey, and at points near to it.
        """
        begin = self.survey.starts(column, bound, _STARTS)
        begin += [one.u for one in near if all(abs(one.u - u).max() > _FAR for u in begin)]
        search = Optimisation(self.bounded(column, bound))
        ends = [search.descend(search.program.begin(u)) for u in begin]
        kept = [end for end in ends if end is not None and not end.beyond]
        if not kept:
            return None
        place = min(kept, key=lambda end: end.worst)
        both = self.both(place.u, place.motions)
        return FrontPoint(place.u, both, place.motions, both[1] if column else bound)

    def add(self, point: FrontPoint) -> None:
        """Keep a point, also as a start of other searches."""
        self.found.append(point)
        self.survey.add(point.u[None], np.array([point.both]))

    def improve(self) -> None:
        """Search again for points that places of the survey better."""
        for point in self.undominated[1:-1]:
            within = self.survey.both[:, 1] <= point.both[1]
            least = self.survey.both[within, 0].min(initial=math.inf)
            if least < point.both[0] - SAME / 10 * self.ranges[0]:
                better = self.best(0, point.both[1])
                self.found += [better] if better else []

    def bounded(self, column: int, bound: float) -> Program:
        """Problem of the best of a metric with the other within a bound, over its range."""
        other, program = self.searches[1 - column].program, self.searches[column].program
        sign = "<=" if other.sign > 0 else ">="
        text = f"{other.name} {sign} {other.sign * bound:.6g}"
        limit = Limit(text, other.function, other.sign * bound, -other.sign)
        return replace(
            program,
            progress=None,
            again=False,
            limits=(*program.limits, limit),
            limit_units=(*program.limit_units, float(self.ranges[1 - column])),
        )

    def polish(self, point: FrontPoint, precise: bool = True) -> None:
        """Solve for the conditions of a point, or else give its multipliers to first order."""
        search = Optimisation(self.bounded(0, point.bound))
        place = search.program.place(point.u, point.motions)
        assert place is not None
        if precise:
            optimum = optimum_of(search.solved(place) or search.bounded(place))
        else:
            optimum = search.rough(place)
        self.complete(point, optimum)

    def end(self, optimum: Optimum, column: int) -> FrontPoint:
        """Optimum of a metric as an end of the front; that of the second claims nothing else."""
        point = FrontPoint(np.empty(0), (math.nan, math.nan))
        self.complete(point, optimum)
        if column:
            point.optimum = replace(
                optimum,
                metric=self.names[0],
                maximised=self.program.sign < 0,
                value=self.program.sign * point.both[0],
                constraints=tuple(replace(one, multiplier=math.nan) for one in optimum.constraints),
                bounds=dict.fromkeys(optimum.bounds, math.nan),
                slopes={},
            )
        return point

    def complete(self, point: FrontPoint, optimum: Optimum) -> None:
        """Complete a point by its optimum."""
        motions = tuple(Motion(one.parameters, None, orbit=one) for one in optimum.orbits)
        point.u = self.program.u_of(optimum.system)
        point.both, point.optimum = self.both(point.u, motions), optimum
        held = len(self.program.limits)
        if not math.isnan(point.bound):
            # All scenarios have this bound: it is relaxed for all of them.
            each = optimum.constraints[held :: held + 1 + (self.program.margin is not None)]
            point.slope = sum(one.multiplier for one in each) or math.nan
        point.active = active_constraints(optimum, held)

    def both(self, u: Vector, motions: tuple[Motion, ...]) -> tuple[float, float]:
        """Both metrics in the sense of minimisation, each for the worst of the scenarios."""
        first, second = (
            replace(one.program, unit=1.0, limits=(), limit_units=(), margin=None).at(u, motions)
            for one in self.searches
        )
        return first.worst, second.worst

    def apart(self, low: FrontPoint, high: FrontPoint) -> bool:
        """True if two points are on different branches: drives between distant ones are worse."""
        far = abs(low.u - high.u).max() > _FAR
        return bool(far) and self.worse(low, high, self.length(low, high))

    def worse(self, low: FrontPoint, high: FrontPoint, by: float) -> bool:
        """True if a drive between those of two points is worse, by a share of a range."""
        both = self.survey.values(np.linspace(low.u, high.u, 5)[1:-1])
        return not bool(np.all(both <= np.maximum(low.both, high.both) + by * self.ranges))

    def has_motions(self, optimum: Optimum) -> bool:
        """True if an optimum has the orbits of all scenarios, and is within the limits."""
        every = len(optimum.orbits) == len(self.program.scenarios)
        return every and optimum.status is not Status.INFEASIBLE

    def parts(self, points: Sequence[FrontPoint]) -> tuple[FrontPart, ...]:
        """Parts of a front with these points."""
        parts, first, begins = list[FrontPart](), 0, f"the least {self.names[1]}"
        greatest = "greatest" if self.program.sign < 0 else "least"
        for i, (low, high) in enumerate(pairwise(points)):
            if self.gap(low, high):
                ends = f"{self.names[0]} is {greatest}: {low.active}"
                if not math.isnan(low.slope):
                    ends = "another branch is better from there on"
                parts.append(FrontPart(first, i, begins, ends))
                first, begins = i + 1, "better than the branch before from there on"
        last = FrontPart(first, len(points) - 1, begins, f"the {greatest} {self.names[0]}")
        return (*parts, last) if points else ()

    @property
    def result(self) -> Front:
        """Front with the points found."""
        points, status, message = self._conclusion()
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

    def _conclusion(self) -> tuple[list[FrontPoint], Status, str]:
        """Points to give, their status, and a message."""
        best, least = (one.result for one in self.searches)
        if not self.ends and self.done:
            end = least if self.has_motions(best) else best
            return [], end.status, end.message
        if not self.ends:
            ends = [self.end(best, 0)] if self.has_motions(best) else []
            return ends, Status.TIME_LIMIT, "time limit reached: ends are missing"
        kept = self.thinned
        for point in kept:
            if point.optimum is None:
                self.polish(point, precise=False)
        if len(kept) == 1:
            return kept, Status.OPTIMAL, "one point is best in both metrics"
        found, parts = counted(len(kept), "point"), len(self.parts(kept))
        if not self.done:
            message = f"time limit reached: {found} of {self.count} were found"
            return kept, Status.TIME_LIMIT, message
        if parts > 1:
            found += f" in {parts} parts"
        rough = sum(not one.optimum.success for one in kept if one.optimum is not None)
        lacks = [f"{rough} of them are not proved optima"] if rough else []
        lacks += [f"{self.missed} were not found"] if self.missed else []
        if lacks:
            return kept, Status.NOT_CONVERGED, f"{found}: {' and '.join(lacks)}"
        return kept, Status.OPTIMAL, found
