"""The best trade-offs between two metrics: none of them is better in one and as good in the other.

The second metric is held below one bound after another while the first is optimised, each time from
the optimum before: the multiplier of the bound is the slope of the front.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.optimise import named, program_of
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.program import Program
from capsule_sym._design.quantities import Function, Limit, System, function_of, number
from capsule_sym._errors import InvalidInput
from capsule_sym._map.labelled import Labelled

_BETTER = 1e-9  # share of the first metric by which one point counts as better than another
Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Front(Labelled):
    """Points of a Pareto front, by increasing second metric: `points` (n,), each an `Optimum`.

    In SI units where the system is a device, else dimensionless.
    """

    metrics: tuple[str, str]
    """What is optimised, and what it costs."""
    maximised: bool
    """Whether the first is to be great; the second is always to be small."""
    points: tuple[Optimum, ...]
    costs: Vector
    """The second metric, shape (n,)."""
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
        # The ends have no bound on the second metric, and so no slope.
        bounds = [
            next((one for one in point.constraints if one.text.startswith(f"{second} <= ")), None)
            for point in self.points
        ]
        return {
            first: self.values,
            second: self.costs,
            **{name: np.array([point.over[name] for point in self.points]) for name in names},
            "slope": np.array([bound.multiplier if bound else np.nan for bound in bounds]),
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
        return {
            "metrics": list(self.metrics),
            "maximised": self.maximised,
            "success": self.success,
            "status": str(self.status),
            "message": self.message,
            "points": [
                point.to_dict() | {"cost": float(cost)}
                for point, cost in zip(self.points, self.costs, strict=True)
            ],
            "statistics": self.statistics,
        }


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
) -> Front:
    """The Pareto front of a metric that is to be great, or small, against one that is to be small.

    Between its two ends, the optima of either metric, `against` is held below bounds that are
    evenly apart, `points` in all, and `metric` is optimised. All else is as in `optimise`,
    the units too. Where
    neighbouring motions are worse both ways a bound has no point of its own: the front jumps.

    Raises InvalidInput as `optimise` does.
    """
    if isinstance(points, bool) or not isinstance(points, int) or points < 2:
        raise InvalidInput("points", points, "a whole number >= 2")
    if isinstance(samples, bool) or not isinstance(samples, int) or samples < 1:
        raise InvalidInput("samples", samples, "a whole number >= 1")
    program = program_of(metric, over, base, maximise, subject_to, margin, starts, tolerances or {})
    cost = function_of("against", against, program.system)
    return _Fronts(program, cost, (named(metric), named(against))).run(points, samples, seed)


class _Fronts:
    def __init__(self, program: Program, cost: Function, names: tuple[str, str]) -> None:
        self.program, self.cost, self.names = program, cost, names

    def run(self, points: int, samples: int, seed: int) -> Front:
        """The ends, and the points between them from either end."""
        best = Optimiser(self.program, self.names[0]).run(samples, seed)
        least_program = replace(self.program, function=self.cost, sign=1)
        least = Optimiser(least_program, self.names[1]).run(samples, seed)
        for end in (best, least):
            if not end.orbits or end.status is OptimumStatus.INFEASIBLE:
                return self.front([], end.status, end.message)
        low, high = least.value, self.cost_of(best)
        if not high > low:
            return self.front([best], OptimumStatus.OPTIMAL, "one point is best in both metrics")
        bounds = np.linspace(low, high, points)
        # At the least cost itself the bound leaves no room: the end is the optimum of the cost.
        found = [None, *self.swept(bounds[1:-1][::-1], best)[::-1], best]
        # The cost has no slope at its own optimum: the way back begins at the point next to it.
        known = [i for i, point in enumerate(found) if point is not None]
        again = self.swept(bounds[known[0] + 1 : -1], found[known[0]] or best)
        back = [*found[: known[0] + 1], *again, best]
        sign = self.program.sign
        chosen: list[Optimum] = [self.as_end(least)]
        for one, other in zip(found[1:], back[1:], strict=True):
            both = [point for point in (one, other) if point is not None]
            if both:
                chosen.append(min(both, key=lambda point: sign * point.value))
        kept = self.undominated(chosen)
        whole = len(kept) == points and all(point.success for point in kept)
        message = f"{len(kept)} points"
        if not whole:
            message += f" of {points}: the others are worse in both metrics, or not found"
        both_ends = best.success and least.success
        status = OptimumStatus.OPTIMAL if both_ends else OptimumStatus.NOT_CONVERGED
        return self.front(kept, status, message)

    def as_end(self, least: Optimum) -> Optimum:
        """The optimum of the cost, told as a point of the front."""
        found = of_first(least, self.program)
        return replace(least, metric=self.names[0], maximised=self.program.sign < 0, value=found)

    def swept(self, bounds: Vector, begin: Optimum) -> list[Optimum | None]:
        """The optimum at each bound, each from the one before."""
        found: list[Optimum | None] = []
        last = begin
        for bound in bounds.tolist():
            limit = Limit(f"{self.names[1]} <= {bound:.6g}", self.cost, bound, -1)
            program = replace(self.program, limits=(*self.program.limits, limit))
            point = Optimiser(program, self.names[0]).from_place(self.place(last))
            found.append(point)
            last = point or last
        return found

    def place(self, point: Optimum) -> Vector:
        """The scaled variables of a point."""
        program = self.program
        values = np.array(list(point.over.values()))
        return np.clip((values - program.low) / (program.high - program.low), 0.0, 1.0)

    def cost_of(self, point: Optimum) -> float:
        """The second metric of a point, of its worst scenario's motion told first."""
        metrics = point.metrics | {
            name: getattr(point.system, name) for name in type(point.system).__slots__
        }
        return number(self.cost(metrics))[0]

    def undominated(self, points: Sequence[Optimum]) -> list[Optimum]:
        """The points than which no other is better in one metric and as good in the other."""
        sign, kept = self.program.sign, list[Optimum]()
        for point in sorted(points, key=self.cost_of):
            if not kept or sign * point.value < sign * kept[-1].value - _BETTER * abs(point.value):
                kept.append(point)
        return kept

    def front(self, points: Sequence[Optimum], status: OptimumStatus, message: str) -> Front:
        return Front(
            metrics=self.names,
            maximised=self.program.sign < 0,
            points=tuple(points),
            costs=np.array([self.cost_of(point) for point in points]),
            success=bool(points) and status is OptimumStatus.OPTIMAL,
            status=status,
            message=message,
        )


def of_first(point: Optimum, program: Program) -> float:
    """The objective's metric at a point that was found for another one."""
    metrics = point.metrics | {
        name: getattr(point.system, name) for name in type(point.system).__slots__
    }
    return number(program.function(metrics))[0]
