"""Pareto front as a result: its points, its connected parts, and their tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._design.optimum import Optimum
from capsule_sym._errors import Status, counted
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, brief, by_fields


class FrontPart(NamedTuple):
    """Connected part of a front: its first and last point."""

    first: int
    last: int

    def __repr__(self) -> str:
        return by_fields(self)


@dataclass(frozen=True, eq=False)
class Front(Result, Labelled):
    """Points of a Pareto front, by increasing second metric: `points` (n,), each an `Optimum`.

    The point of least cost is the optimum of the second metric, the others are optima of the first.
    In SI units if the system is a device, else dimensionless.
    """

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
    """Parts of the front, each with the numbers of its `first` and `last` point.

    Drives between those of two parts are worse."""
    status: Status
    """Status of the front."""
    message: str
    """Status as a sentence."""
    _recorded = "metrics maximised parts statistics"

    @property
    def success(self) -> bool:
        """True if both ends were found, and every point is an optimum."""
        return bool(self.points) and super().success

    def __repr__(self) -> str:
        first, second = self.metrics
        points = counted(len(self.points), "point")
        return brief(self, f"{points}, {self.status}", f"of {first} against {second}")

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Points as columns: metrics, variables, slope, part of the front, and the solution."""
        first, second = self.metrics
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

    @property
    def statistics(self) -> dict[str, int]:
        """Number of points, and of evaluations."""
        taken = sum(point.statistics.get("evaluations", 0) for point in self.points)
        return {"points": len(self.points), "evaluations": taken}

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts."""
        both = zip(self.points, self.values.tolist(), self.costs.tolist(), strict=True)
        points = [point.to_dict() | {"value": value, "cost": cost} for point, value, cost in both]
        return super().to_dict() | {"points": points}
