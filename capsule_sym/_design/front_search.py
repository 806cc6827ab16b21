"""Search for a Pareto front: the best of one metric with a bound on the other, point by point.

A survey shows the approximate front between its ends, the optima of either metric. The place of the
survey on it that is the farthest from all points and places so far gives the next bound: the point
is the optimum of the first metric, with the second one at most that of the place. It is searched
from two places within this bound that no neighbour betters, and again if a place that was evaluated
later is better.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._design.functions import Function, valued
from capsule_sym._design.optimum import Optimum, optimum_of
from capsule_sym._design.program import Program
from capsule_sym._design.search import Optimisation
from capsule_sym._design.stationary import SOLVED, LocalOptimum
from capsule_sym._design.survey import FrontSurvey, Survey, trade_offs
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, brief, by_fields
from capsule_sym._native import check_time
from capsule_sym._orbits.quantities import of
from capsule_sym._processes import sobol

SAME = 1e-3
"""Least distance of a new place from the points, summed over both metrics, and least difference of
a metric that counts; in ranges of the front."""
_PLACES = 2  # from which a point is searched: where a front jumps, two are nearly as good
_CELLS = 4  # times as many places of both metrics as of one: a front is longer than a point


class FrontPoint(NamedTuple):
    """Point of a front, with both of its metrics in the sense of minimisation."""

    u: Vector
    both: Vector
    optimum: Optimum
    slope: float = math.nan
    """Gain of the first metric per unit of the second; nan if no bound is active."""


class FrontSearch:
    """Search for the points of a front, from its ends inwards."""

    def __init__(self, program: Program, cost: Function, count: int) -> None:
        """At most `count` points are wanted of a program against a cost."""
        other = replace(program, function=cost, sign=1)
        self.searches = Optimisation(Survey(program)), Optimisation(Survey(other))
        self.names = program.name, other.name
        self.count, self.done, self.ranges = count, False, np.ones(2)
        self.points: list[FrontPoint] = []
        """Points by increasing second metric, of which none is better than another."""
        self.breaks: list[int] = []
        """Indices of points after which there is a gap."""

    @property
    def program(self) -> Program:
        """Problem of the first metric."""
        return self.searches[0].program

    def run(self, samples: int, seed: int) -> None:
        """Find the ends, the approximate front between them, and the points."""
        for one in self.searches:
            one.run(samples, seed)
        if all(one.optima for one in self.searches):
            high, low = (self.made(one.optimum) for one in self.searches)
            self.between(low, high, samples, seed)
        self.done = True

    def between(self, low: FrontPoint, high: FrontPoint, samples: int, seed: int) -> None:
        """Find the points between the ends; a single one if an end is the best in both metrics.

        Raises InvalidInput if one metric is not finite where the other is best, and TimeUp.
        """
        for column, end in enumerate((high, low)):
            if not math.isfinite(end.both[1 - column]):
                other, own = self.names[1 - column], self.names[column]
                allowed = f"finite where {own} is best, as by a limit such as 'speed >= 0.01'"
                raise InvalidInput(("against", "metric")[column], other, allowed)
        same = np.isclose(low.both, high.both, SOLVED, 0.0)
        if same.any() or high.both[0] > low.both[0] or high.both[1] < low.both[1]:
            self.points = [high if high.both[0] < low.both[0] and not same[0] else low]
            return
        self.points, self.ranges = [low, high], abs(high.both - low.both)
        cost = self.searches[1].program.function
        self.survey = FrontSurvey(self.program, cost, float(self.ranges[1]), seed)
        self.survey.look(sobol(len(self.program.names), _CELLS * samples, seed))
        self.survey.evolve()
        if len(front := self.survey.front):
            if front[-1, 0] <= high.both[0] + SOLVED:  # as good as the end, at a lower cost
                self.points = [low, self.point(float(front[-1, 1])) or high]
            self.fill()
        for lower, upper, gap in [*zip(self.points, self.points[1:], self.gaps, strict=False)]:
            if gap and np.sum(abs(upper.both - lower.both) / self.ranges) > 2 / self.count:
                self.add(self.point(float(lower.both[1] + upper.both[1]) / 2))
        for one in [*self.points]:
            cheaper = self.survey.front[self.survey.front[:, 1] <= one.both[1], 0]
            if cheaper.min(initial=np.inf) < one.both[0] - SAME * self.ranges[0]:
                self.add(self.point(float(one.both[1])))
        while len(self.points) > self.count:
            both = np.array([one.both for one in self.points])
            self.points.pop(1 + int((abs(both[2:] - both[:-2]) / self.ranges).sum(axis=1).argmin()))
        self.breaks = np.flatnonzero(self.gaps).tolist()

    def fill(self) -> None:
        """Make points, one by one, of the place of the survey's front farthest from all so far."""
        seen = [one.both for one in self.points]
        while len(self.points) < self.count:
            front = self.survey.front
            apart = [(abs(front - both) / self.ranges).sum(axis=1) for both in seen]
            far = np.min(apart, axis=0)
            if far.max() < SAME:
                break
            self.program.progress(f"search between {len(self.points)} points of {self.count}")
            seen.append(front[np.argmax(far)])
            if (found := self.point(float(seen[-1][1]))) is not None:
                seen.append(found.both)
            self.add(found)

    def add(self, point: FrontPoint | None) -> None:
        """Add a point, if it is not None, and drop those that another one betters.

        Its variables become a place of the survey.
        """
        if point is None:
            return
        every = [*self.points, point]
        self.points = [every[i] for i in trade_offs(np.array([one.both for one in every]))]
        self.survey.look(point.u[None])

    def point(self, bound: float) -> FrontPoint | None:
        """Best of the first metric with the second one at most at a bound.

        None if no place within the limits is found. Searches begin at the best two places of the
        survey that no neighbour betters.
        """
        search = Optimisation(self.survey.bounded(bound))
        search.descend_all(_PLACES)
        if not search.kept or search.kept[0].beyond:
            return None
        found = search.solved(search.kept[0]) or search.unsolved(search.kept[0])
        limit = len(self.program.limits)
        return self.made(found, optimum_of(found).constraints[limit].multiplier or math.nan)

    def made(self, found: LocalOptimum, slope: float = math.nan) -> FrontPoint:
        """Optimum as a point of the front."""
        place, problems = found.place, [one.program for one in self.searches]
        every = of(place.motion.metrics, self.program.system_at(place.u))
        both = [valued("metric", one.function, every).value * one.sign for one in problems]
        return FrontPoint(place.u, np.array(both, float), optimum_of(found), slope)

    @property
    def gaps(self) -> NDArray[np.bool_]:
        """True for each pair of next points with a gap between them, shape (points - 1,).

        Of three places evenly between their variables one is then worse than both in a metric.
        """
        u, both = (np.array([getattr(one, name) for one in self.points]) for name in ("u", "both"))
        between = self.survey.values(np.linspace(u[:-1], u[1:], 5)[1:-1].reshape(-1, u.shape[1]))
        check_time()
        worst = np.maximum(both[:-1], both[1:]) + SAME * self.ranges
        return np.asarray((between.reshape(3, -1, 2) > worst).any(axis=(0, 2)))

    @property
    def parts(self) -> tuple[FrontPart, ...]:
        """Parts of the front between its gaps."""
        lasts = [*self.breaks, len(self.points) - 1]
        firsts = [0, *(last + 1 for last in self.breaks)]
        return tuple(map(FrontPart, firsts, lasts)) if self.points else ()

    @property
    def result(self) -> Front:
        """Front with the points found."""
        status, message = self._conclusion()
        return Front(
            metrics=self.names,
            maximised=self.program.sign < 0,
            points=tuple(one.optimum for one in self.points),
            values=np.array([self.program.sign * point.both[0] for point in self.points]) + 0.0,
            costs=np.array([point.both[1] for point in self.points]),
            slopes=np.array([point.slope for point in self.points]),
            parts=self.parts,
            status=status,
            message=message,
        )

    def _conclusion(self) -> tuple[Status, str]:
        """Status and message."""
        found = counted(len(self.points), "point")
        if not self.done:
            return Status.TIME_LIMIT, f"time limit reached: {found} of {self.count} were found"
        if not self.points:
            end = next(one.result for one in self.searches if not one.optima)
            return end.status, end.message
        if len(self.points) == 1:
            return Status.OPTIMAL, "one point is best in both metrics"
        if len(self.parts) > 1:
            found += f" in {len(self.parts)} parts"
        if rough := sum(not one.optimum.success for one in self.points):
            return Status.NOT_CONVERGED, f"{found}: {rough} of them are not proved optima"
        return Status.OPTIMAL, found


class FrontPart(NamedTuple):
    """Connected part of a front: indices of its first and last point, from 0."""

    first: int
    last: int

    def __repr__(self) -> str:
        return by_fields(self)


@dataclass(frozen=True, eq=False)
class Front(Result, Labelled):
    """Points of a Pareto front, by increasing second metric: `points` (n,), each an `Optimum`.

    The point of least cost is the optimum of the second metric; the others, or a single better one,
    are optima of the first.
    In SI units if the system is a device, else dimensionless.
    """

    _of_system = True
    metrics: tuple[str, str]
    """Names of the optimised metric and of its cost."""
    maximised: bool
    """True if the first metric is maximised; the second is always minimised."""
    points: tuple[Optimum, ...]
    values: Vector
    """First metric, shape (n,)."""
    costs: Vector
    """Second metric, shape (n,)."""
    slopes: Vector
    """Gain of the first metric per unit of the second, shape (n,); nan if no bound is active."""
    parts: tuple[FrontPart, ...]
    """Parts of the front, each with the indices of its `first` and `last` point, from 0.

    Parameters between those of two parts are worse. At the status "time-limit" gaps are not known,
    and all points are one part."""
    status: Status
    """Status of the front."""
    message: str
    """Status as a sentence."""
    _recorded = "metrics maximised parts"

    def __repr__(self) -> str:
        first, second = self.metrics
        points = counted(len(self.points), "point")
        return brief(self, f"{points}, {self.status}", f"of {first} against {second}")

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Points as columns: metrics, variables, slope, part of the front, and the solution."""
        first, second = self.metrics
        second += " (cost)" * (first == second)  # of two functions without a name
        names = list(self.points[0].over) if self.points else []
        lengths = [part.last - part.first + 1 for part in self.parts]
        return {
            first: self.values,
            second: self.costs,
            **{name: np.array([point.over[name] for point in self.points]) for name in names},
            "slope": self.slopes,
            "part": np.repeat(np.arange(1, len(lengths) + 1), lengths),
            "residual": np.array([point.residual for point in self.points]),
            "itinerary": np.array([" ".join(point.itinerary) for point in self.points], np.str_),
            "status": np.array([str(point.status) for point in self.points], np.str_),
        }

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts.

        `points` has the record of each optimum, with its `value` and `cost`.
        """
        both = zip(self.points, self.values.tolist(), self.costs.tolist(), strict=True)
        points = [point.to_dict() | {"value": value, "cost": cost} for point, value, cost in both]
        return super().to_dict() | {"points": points}
