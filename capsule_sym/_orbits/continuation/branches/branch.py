"""Branches of periodic orbits in one parameter, as results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.labelled import Labelled
from capsule_sym._orbits.continuation.families.states import Axis, Ending
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation, sorted_multipliers
from capsule_sym._orbits.shooting.admissibility import Inequality
from capsule_sym._orbits.shooting.orbit import Orbit, columns_of

_Point = TypeVar("_Point")


@dataclass(frozen=True)
class BranchPoint:
    """An orbit of a branch, with the tightest of its itinerary's inequalities; dimensionless."""

    value: float
    orbit: Orbit
    admissibility: Inequality

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the orbit, the largest modulus first."""
        return sorted_multipliers(self.orbit)


def ends(points: Sequence[_Point]) -> dict[str, _Point]:
    """The ends of a branch, or its only point, by their labels."""
    return dict(zip(("EP1", "EP2"), points[:: max(1, len(points) - 1)], strict=False))


@dataclass(frozen=True)
class Branch(Labelled):
    """Orbits along a branch and its bifurcations, both in order, and why it ends.

    `axis` has what varies and between which values it is followed, `origin` is the label of the
    bifurcation at which it leaves another branch, such as "PD1", or "PD1/PD2" on a branch that
    itself leaves at PD1; empty for a branch of its own. All values are dimensionless, but of a
    parameter in SI units that others are tied to.
    """

    axis: Axis
    points: tuple[BranchPoint, ...]
    bifurcations: tuple[Bifurcation, ...]
    status: Ending
    message: str
    origin: str = ""
    dimension = "point"

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The points as columns, arrays of shape (n,).

        What varies has its own name; of each orbit there are itinerary, period number,
        progression, start, and the largest modulus of a Floquet multiplier.
        """
        largest = [max(map(abs, point.multipliers), default=0.0) for point in self.points]
        return {
            self.parameter: np.array([float(point.value) for point in self.points]),
            "largest_multiplier": np.array(largest, dtype=float),
            **columns_of([point.orbit for point in self.points]),
        }

    def attributes(self) -> dict[str, Any]:
        """Why the branch ends, and where it leaves another."""
        return {"status": str(self.status), "message": self.message, "origin": self.origin}

    @property
    def success(self) -> bool:
        """Whether the branch ends where it was to end."""
        return self.status is Ending.REACHED

    @property
    def statistics(self) -> dict[str, Any]:
        """How many points there are, and Newton's steps to all of them."""
        steps = sum(point.orbit.iterations for point in self.points)
        return {"points": len(self.points), "iterations": steps}

    @property
    def parameter(self) -> str:
        """What varies."""
        return self.axis.name

    def at(self, label: str) -> Bifurcation | BranchPoint:
        """The bifurcation of this label, such as "PD2"; "EP1" and "EP2" are the branch's ends.

        Raises InvalidInput for a label that the branch does not have.
        """
        named: dict[str, Bifurcation | BranchPoint] = {b.label: b for b in self.bifurcations}
        named |= ends(self.points)
        if label not in named:
            raise InvalidInput("label", label, f"one of {', '.join(named)}")
        return named[label]

    def __repr__(self) -> str:
        ends = " to ".join(f"{p.value:.6g}" for p in (self.points[:1] + self.points[-1:]))
        counts = f"{len(self.points)} points, {len(self.bifurcations)} bifurcations"
        return f"<Branch in {self.parameter} from {ends}: {counts}, ended {self.status}>"
