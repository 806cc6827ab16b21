"""Pareto front of two metrics: points of which none is better in one and as good in the other.

A survey shows the approximate front. A point of it is the best of one metric with a bound on the
other. The next one is searched in the middle of the widest step, from the survey and both points.
If the bound is not active the other metric is minimised there, and both results have a gap between.
A step to another branch is halved until it is short. The points kept at the end are polished.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from capsule_sym._design.counts import POINTS
from capsule_sym._design.front import Front
from capsule_sym._design.front_points import SAME, Points, Trade
from capsule_sym._design.optimise import check_survey, program_of
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit, System, function_of
from capsule_sym._design.tradeoffs import Tradeoffs
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._native import Watch

_CELLS = 4  # times as many places of both metrics as of one
_STARTS = 2  # places of the survey from which a point is searched, besides its neighbours
_EFFORT = 120  # orbits that are solved for, for the conditions of one point
_ROUNDING = 1e-9  # relative difference of metrics at one optimum
_BETTER = 1e-4  # of the range: a place of the survey from which a point is searched again
_SHORT = 0.2  # of a range, over the number of points: a tenth of the mean step between them
_FAR = 0.1  # of the bounds, between drives that may be on different branches
_BETWEEN = np.array([[0.25], [0.5], [0.75]])  # places on the line between two such drives
_ROUNDS = 2  # of finding points and places that better them
_ATTEMPTS = 2  # searches for each point of the front, at most


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
    max_seconds: float = SEARCH_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Front:
    """Pareto front of a metric to maximise, or minimise, against one to minimise.

    About `points` points are spaced evenly along it, between its two ends, the optima of either
    metric. A part of it ends at a gap, in which searches from both sides and the survey find
    nothing, or where another branch becomes better: `parts` have the endpoints and their reasons.
    Otherwise the search is as in `optimise`.

    Parameters
    ----------
    metric : str or callable
        First metric, to maximise or minimise, as in `optimise`. Dimensionless, or in SI units if
        `base` is a device.
    against : str or callable
        Second metric, to minimise, as in `optimise`.
    over : mapping of str to (float, float)
        Bounds (low, high) of each varied parameter: ascending finite numbers within its own range.
        Dimensionless, or in SI units if `base` is a device.
    base : Parameters, PhysicalParameters, or those of another scene, default None
        Values of the other parameters, dimensionless or in SI units. None: those of the case study,
        Parameters().
    points : int, default 50, 2 to 10,000
        Approximate number of points of the front.
    maximise : bool, default True
        True for the greatest first metric, False for the least.
    subject_to : sequence of str or tuple, default ()
        Constraints, each a text such as "peak_force <= 2" or a tuple (metric, "<=" or ">=",
        number). The number has the unit of the metric.
    margin : float, default None, from 0 to below 1
        Least distance of the Floquet multipliers from the unit circle, dimensionless: the modulus
        of each is at most 1 - `margin`. None: no such constraint.
    starts : sequence of (float, float, float), default ((0.0, 0.0, 0.0),), at least one
        States (x_r, v_r, v_c) at phase 0, dimensionless, of size at most 1e20. The motion of a
        start is the one on which it settles. With several starts the worst motion counts.
    tolerances : mapping of str to float, default None
        Tolerances of parameters as shares between 0 and 1, dimensionless: {"mu": 0.1} is 10 %. The
        worst motion counts: at the parameters, and with all of these at the ends of their
        tolerances.
    samples : int, default 256, 1 to 1,000,000
        Number of points of the survey of each metric.
    seed : int, default 0, 0 to 10**12
        Seed of the survey and of the population.
    max_seconds : float, default 600.0, above 0
        Time limit, in seconds of wall time.
    progress : callable, default None
        Function that is called with a text during the search.

    Returns
    -------
    Front
        Points by increasing second metric, each an `Optimum`, with `values`, `costs`, `parts`,
        `status` and `message`. In SI units if `base` is a device, else dimensionless. It has one
        point if one is the best in both metrics. After `max_seconds` it has the points found so
        far.

    Raises
    ------
    InvalidInput
        As in `optimise`, and where one metric is best and the other not finite.

    See Also
    --------
    optimise : optimum of one metric.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> front = cs.pareto("speed", "work", {"alpha": (0.6, 1.2)}, points=2, samples=1)
    >>> for speed, work, point in zip(front.values, front.costs, front.points):
    ...     print(f"speed {speed:.4f}, work {work:.4f} at alpha = {point.over['alpha']:.4f}")
    speed 0.0304, work 0.3860 at alpha = 0.6000
    speed 0.1705, work 2.0065 at alpha = 1.2000
    """
    check_count("points", points, *POINTS)
    check_survey(samples, seed)
    program = program_of(
        metric, over, base, maximise, subject_to, margin, starts, tolerances, progress
    )
    cost = function_of("against", against, program.system)
    fronts = _Fronts(program, cost, points)
    with Watch(checked_seconds(max_seconds)):
        fronts.run(samples, seed)
    return fronts.result


class _Fronts(Points):
    """Search for the points of a front."""

    def __init__(self, program: Program, cost: Function, count: int) -> None:
        other = replace(program, function=cost, sign=1)
        super().__init__(Optimiser(program), Optimiser(other), count)
        self.known: dict[tuple[Trade, Trade], bool] = {}
        """Pairs of points, and whether they are on different branches."""
        self.missed = 0
        """Number of points that were not found."""
        self.short = _SHORT / count
        """Length within which the end of a part is found."""
        self.done = False

    def run(self, samples: int, seed: int) -> None:
        """Find the ends, the approximate front between them, and the points."""
        for one in self.optimisers:
            one.run(samples, seed)
        if all(self.whole(one.result) for one in self.optimisers):
            self.overview(_CELLS * samples, seed)
            best, least = (one.result for one in self.optimisers)
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
        self.cells = Tradeoffs(*(one.program for one in self.optimisers))
        self.cells.survey(samples, seed)
        for one in self.optimisers:
            self.cells.look(one.survey.cells.u)
        self.cells.evolve()
        for column, one in enumerate(self.optimisers):
            begin = map(one.program.begin, self.cells.starts(column, math.inf, 1))
            places, known = [*filter(None, map(one.descend, begin))], len(one.rests)
            one.polish(places)
            if len(one.rests) > known:
                one.found = one.told(places)

    def between(self) -> None:
        """Find the points between the ends, if there are any."""
        low, high = (np.array(end.both) for end in self.ends)
        same = np.isclose(low, high, _ROUNDING, 0.0)
        if same.any() or high[0] > low[0] or high[1] < low[1]:
            self.ends = (self.ends[int(high[0] < low[0] and not same[0])],)
            return
        self.ranges = abs(high - low)
        for end in self.ends:
            self.cells.add(end.u[None], np.array([end.both]))
        for _ in range(_ROUNDS):
            self.fill()
            self.cells.evolve()
            self.mend()
        self.fill()
        self.found = [point for point in self.thinned if point.search]
        for i, point in enumerate(self.found):
            self.program.tell(f"point {i + 1} of {len(self.found)}")
            self.polish(point)

    def fill(self) -> None:
        """Find points in the middle of the widest steps, and halve steps to another branch."""
        points = self.undominated
        self.gaps = [
            pair
            for pair in self.gaps
            if all(min(self.length(end, one) for one in points) < SAME for end in pair)
        ]
        for _ in range(_ATTEMPTS * self.count):
            self.missed = max(0, self.count - len(points))
            steps = [
                (self.length(*pair), i)
                for i, pair in enumerate(pairwise(points))
                if not self.gap(*pair) and (self.missed or self.apart(*pair))
            ]
            width, i = max(steps, default=(0.0, 0))
            if width < self.short:
                self.missed = 0
                break
            self.program.tell(f"search between {len(points)} points of {self.count}")
            pair, before = (points[i], points[i + 1]), len(points)
            self.divide(*pair)
            points = self.undominated
            if len(points) == before and not self.gap(*pair):
                self.gaps.append(pair)
        self.gaps = [pair for pair in self.gaps if self.worse(*pair, SAME)]
        self.gaps += [
            pair for pair in pairwise(points) if not self.gap(*pair) and self.apart(*pair)
        ]

    def add(self, point: Trade) -> None:
        """Keep a point, also as a start of other searches."""
        self.found.append(point)
        self.cells.add(point.u[None], np.array([point.both]))

    def divide(self, low: Trade, high: Trade) -> None:
        """Find a point between two, or the gap between them."""
        ways = (np.array(high.both) - low.both) / self.ranges
        column = int(ways[1] > -ways[0])  # the metric that changes more defines the point better
        bound = (low.both[column] + high.both[column]) / 2
        point = self.best(1 - column, bound, (low, high))
        sides = [low, high]
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

    def best(self, column: int, bound: float, near: Sequence[Trade]) -> Trade | None:
        """Best of a metric with the other at most at a bound, both in the sense of minimisation.

        Searches begin at the best places of the survey, and at points near to it.
        """
        begin = self.cells.starts(column, bound, _STARTS)
        begin += [one.u for one in near if all(abs(one.u - u).max() > _FAR for u in begin)]
        optimiser = Optimiser(self.held(column, bound), _EFFORT)
        ends = [optimiser.descend(optimiser.program.begin(u)) for u in begin]
        kept = [end for end in ends if end is not None and not end.beyond]
        if not kept:
            return None
        place = min(kept, key=lambda end: end.worst)
        return Trade(place.u, self.both(place.u, place.motions), column, (optimiser, place))

    def polish(self, point: Trade) -> None:
        """Solve for the conditions of a point."""
        assert point.search is not None
        optimiser, place = point.search
        rest = optimiser.solved(place) or optimiser.bounded(place, precise=False)
        optimiser.found = optimiser.optimum(rest)
        self.tell(point, optimiser.result, len(self.program.limits))

    def held(self, column: int, bound: float) -> Program:
        """Problem of the best of a metric with the other within a bound, over its range."""
        other, program = self.optimisers[1 - column].program, self.optimisers[column].program
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

    def mend(self) -> None:
        """Search again for points that places of the survey better."""
        points = self.undominated[1:-1]
        self.cells.refine([point.both[1] for point in points])
        for point in points:
            last = self.found[-1].both
            if last[0] < point.both[0] and last[1] <= point.both[1]:
                continue  # bettered by the point found for the one before
            known = self.cells.least(0, point.both[1]) < point.both[0] - _BETTER * self.ranges[0]
            if known and (better := self.best(0, point.both[1], ())):
                self.add(better)

    def apart(self, low: Trade, high: Trade) -> bool:
        """True if two points are on different branches: drives between distant ones are worse."""
        if abs(low.u - high.u).max() <= _FAR:
            return False
        if (low, high) not in self.known:
            self.known[low, high] = self.worse(low, high, self.length(low, high))
        return self.known[low, high]

    def worse(self, low: Trade, high: Trade, by: float) -> bool:
        """True if a drive between those of two points is worse, by a share of a range."""
        both = self.cells.values(low.u + _BETWEEN * (high.u - low.u))
        return not bool(np.all(both <= np.maximum(low.both, high.both) + by * self.ranges))

    def whole(self, point: Optimum) -> bool:
        """True if a point has the orbits of all scenarios, and is within the limits."""
        every = len(point.orbits) == len(self.program.scenarios)
        return every and point.status is not OptimumStatus.INFEASIBLE

    @property
    def result(self) -> Front:
        """Front with the points found."""
        best, least = (one.result for one in self.optimisers)
        if not self.ends:
            if not self.done:
                ends = [self.end(best, 0)] if self.whole(best) else []
                message = "time limit reached: ends are missing"
                return self.front(ends, OptimumStatus.TIME_LIMIT, message)
            end = least if self.whole(best) else best
            return self.front([], end.status, end.message)
        kept = self.thinned
        for point in kept:
            if point.search is not None:
                optimiser, place = point.search
                self.tell(point, optimiser.rough(place), len(self.program.limits))
        if len(kept) == 1:
            return self.front(kept, OptimumStatus.OPTIMAL, "one point is best in both metrics")
        told = counted(len(kept), "point")
        if not self.done:
            message = f"time limit reached: {told} of {self.count} were found"
            return self.front(kept, OptimumStatus.TIME_LIMIT, message)
        parts = len(self.parts(kept))
        if parts > 1:
            told += f" in {parts} parts"
        rough = sum(not one.optimum.success for one in kept if one.optimum is not None)
        lacks = [f"{rough} of them are not proved optima"] if rough else []
        lacks += [f"{self.missed} were not found"] if self.missed else []
        if lacks:
            message = f"{told}: {' and '.join(lacks)}"
            return self.front(kept, OptimumStatus.NOT_CONVERGED, message)
        return self.front(kept, OptimumStatus.OPTIMAL, told)
