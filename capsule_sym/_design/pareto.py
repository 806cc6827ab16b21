"""The best trade-offs between two metrics: none of them is better in one and as good in the other.

The second metric is held below one bound after another while the first is optimised, each time from
the optimum before: the multiplier of the bound is the slope of the front.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.counts import POINTS
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.optimise import checked_survey, program_of
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit, System, function_of, record
from capsule_sym._design.survey import Survey
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._map.labelled import Labelled
from capsule_sym._native import Watch

_BETTER = 1e-9  # share of the first metric by which one point counts as better than another
Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Front(Labelled):
    """Points of a Pareto front, by increasing second metric: `points` (n,), each an `Optimum`.

    The first is the optimum of the second metric: its residual is of that one's conditions, and it
    has no multipliers and slopes of the first metric.

    In SI units where the system is a device, else dimensionless.
    """

    metrics: tuple[str, str]
    """What is optimised, and what it costs."""
    maximised: bool
    """Whether the first is to be great; the second is always to be small."""
    points: tuple[Optimum, ...]
    costs: Vector
    """The second metric, of the worst scenario, shape (n,)."""
    slopes: Vector
    """What the first metric gains by for each unit more of the second, shape (n,); nan at both
    ends, which no bound on the second metric holds."""
    success: bool
    """Whether both ends were found, and a point for every bound between them."""
    status: OptimumStatus
    """How it ended."""
    message: str
    """The same as a sentence."""
    dimension = "point"

    def __repr__(self) -> str:
        first, second = self.metrics
        return f"<Front of {first} against {second}: {len(self.points)} points, {self.status}>"

    @property
    def values(self) -> Vector:
        """The first metric, shape (n,)."""
        return np.array([point.value for point in self.points])

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The points as columns: both metrics, variables, slope of the front, itinerary, status."""
        first, second = self.metrics
        names = list(self.points[0].over) if self.points else []
        return {
            first: self.values,
            second: self.costs,
            **{name: np.array([point.over[name] for point in self.points]) for name in names},
            "slope": self.slopes,
            "residual": np.array([point.residual for point in self.points]),
            "itinerary": np.array([" ".join(point.itinerary) for point in self.points], np.str_),
            "status": np.array([str(point.status) for point in self.points], np.str_),
        }

    def attributes(self) -> dict[str, Any]:
        """How the front ended."""
        return {"status": str(self.status), "message": self.message}

    @property
    def statistics(self) -> dict[str, int]:
        """How many points there are, and how many evaluations they took."""
        taken = sum(point.statistics.get("evaluations", 0) for point in self.points)
        return {"points": len(self.points), "evaluations": taken}

    def to_dict(self) -> dict[str, Any]:
        """The results by name, of numbers, texts and lists."""
        pairs = zip(self.points, self.costs.tolist(), strict=True)
        points = [point.to_dict() | {"cost": cost} for point, cost in pairs]
        told = record(self, "metrics maximised success status message")
        return told | {"points": points, "statistics": self.statistics}


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

    Between its two ends, the optima of either metric, `against` is held below bounds that are
    evenly apart, `points` in all, and `metric` is optimised. All else is as in `optimise`,
    the units too. Where
    neighbouring motions are worse both ways a bound has no point of its own: the front jumps.
    After `max_seconds` the front has the points that were found.

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
    """An optimum, the second metric of its worst scenario, and the slope of the front there."""

    optimum: Optimum
    cost: float
    slope: float = math.nan


class _Fronts:
    def __init__(self, program: Program, cost: Function, points: int) -> None:
        self.program, self.cost, self.count = program, cost, points
        self.names = program.name, self.costs.name
        self.first, self.second = Optimiser(program), Optimiser(self.costs)
        self.bounds = np.empty(0)
        self.ends: tuple[_Point, _Point] | None = None
        self.found: list[list[_Point]] = []
        """The points at each bound, the lowest first, from either end."""
        self.done = False

    def run(self, survey: Survey) -> None:
        """The ends, and the points between them from either end."""
        self.first.run(survey)
        self.second.run(survey)
        best, least = self.first.result, self.second.result
        self.program = self.first.program  # in the units that its survey found
        if all(self.whole(end) for end in (best, least)):
            begin = self.point(best)
            self.ends = self.as_end(least), begin
            self.bounds = np.linspace(least.value, begin.cost, self.count)[1:-1]
            self.found = [[] for _ in self.bounds]
            if begin.cost > least.value:
                # At the least cost itself the bound leaves no room, and the cost has no slope at
                # its own optimum: the way back begins at the point next to it.
                self.sweep(range(len(self.bounds))[::-1], begin)
                known = next((i for i, points in enumerate(self.found) if points), None)
                if known is not None:
                    self.sweep(range(known + 1, len(self.bounds)), self.found[known][0])
        self.done = True

    @property
    def result(self) -> Front:
        """The front with the points that were found."""
        best, least = self.first.result, self.second.result
        if self.ends is None:
            if not self.done:
                ends = [self.point(best)] if self.whole(best) else []
                message = "the time is over: ends are missing"
                return self.front(ends, OptimumStatus.TIME_LIMIT, message)
            end = least if self.whole(best) else best
            return self.front([], end.status, end.message)
        cheapest, begin = self.ends
        if not begin.cost > cheapest.cost:
            return self.front([begin], OptimumStatus.OPTIMAL, "one point is best in both metrics")
        sign = self.program.sign
        chosen = [
            min(points, key=lambda point: sign * point.optimum.value)
            for points in self.found
            if points
        ]
        kept = self.undominated([cheapest, *chosen, begin])
        told = f"{len(kept)} points"
        if not self.done:
            message = f"the time is over: {told} of {self.count} were found"
            return self.front(kept, OptimumStatus.TIME_LIMIT, message)
        if len(kept) < self.count or not all(point.optimum.success for point in kept):
            told += f" of {self.count}: the others are worse in both metrics, or not found"
        both = best.success and least.success
        return self.front(
            kept, OptimumStatus.OPTIMAL if both else OptimumStatus.NOT_CONVERGED, told
        )

    def as_end(self, least: Optimum) -> _Point:
        """The optimum of the cost, told as a point of the front.

        What holds it there is the cost's: the first metric has no multipliers and no slopes.
        """
        unheld = [replace(one, multiplier=math.nan) for one in least.constraints]
        optimum = replace(
            least,
            metric=self.names[0],
            maximised=self.program.sign < 0,
            value=self.program.sign * self.worst(least, self.program),
            constraints=tuple(unheld),
            bounds=dict.fromkeys(least.bounds, math.nan),
            slopes={},
        )
        return _Point(optimum, least.value)

    def point(self, optimum: Optimum, slope: float = math.nan) -> _Point:
        """An optimum with what it costs."""
        return _Point(optimum, self.worst(optimum, self.costs), slope)

    @property
    def costs(self) -> Program:
        """The second metric as what is to be least."""
        return replace(self.program, function=self.cost, sign=1)

    def worst(self, optimum: Optimum, program: Program) -> float:
        """A program's function, by its sign, in the worst of the scenarios of an optimum."""
        motions = tuple(Motion(one.parameters, None, orbit=one) for one in optimum.orbits)
        plain = replace(program, unit=1.0, limits=(), limit_units=(), margin=None)
        return plain.at(program.u_of(optimum.system), motions).worst

    def sweep(self, places: Sequence[int], begin: _Point) -> None:
        """Add the optimum at each of some bounds, each from the one before."""
        last, before = begin.optimum, len(self.program.limits)
        for k, i in enumerate(places, 1):
            bound = float(self.bounds[i])
            self.program.tell(f"point {k} of {len(places)}")
            limit = Limit(f"{self.names[1]} <= {bound:.6g}", self.cost, bound, -1)
            program = replace(
                self.program,
                progress=None,
                limits=(*self.program.limits, limit),
                limit_units=(*self.program.limit_units, abs(bound) or 1.0),
            )
            place = self.program.u_of(last.system)
            point = Optimiser(program).from_place(place)
            if point is not None and self.whole(point):
                # All scenarios have this bound: it is let out for all of them.
                held = point.constraints[before :: len(program.texts)]
                slope = sum(one.multiplier for one in held)
                self.found[i].append(self.point(point, slope))
                last = point

    def whole(self, point: Optimum) -> bool:
        """Whether a point has the orbits of all scenarios, and is within the limits."""
        infeasible = point.status is OptimumStatus.INFEASIBLE
        return len(point.orbits) == len(self.program.scenarios) and not infeasible

    def undominated(self, points: Sequence[_Point]) -> list[_Point]:
        """The points than which no other is better in one metric and as good in the other."""
        sign, kept = self.program.sign, list[_Point]()
        better = _BETTER * self.program.unit
        for point in sorted(points, key=lambda point: point.cost):
            value = sign * point.optimum.value
            if not kept or value < sign * kept[-1].optimum.value - better:
                kept.append(point)
        return kept

    def front(self, points: Sequence[_Point], status: OptimumStatus, message: str) -> Front:
        return Front(
            metrics=self.names,
            maximised=self.program.sign < 0,
            points=tuple(point.optimum for point in points),
            costs=np.array([point.cost for point in points]),
            slopes=np.array([point.slope for point in points]),
            success=bool(points) and status is OptimumStatus.OPTIMAL,
            status=status,
            message=message,
        )
