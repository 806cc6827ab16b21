"""What an optimisation found, and how sure it is of that."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

from capsule_sym._design.quantities import System, record, values_of
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import METRIC_UNITS, PhysicalParameters


class OptimumStatus(StrEnum):
    """How an optimisation ended."""

    #: A place that satisfies the conditions of an optimum.
    OPTIMAL = "optimal"
    #: One on a border between itineraries, where the gradients of both sides point to it.
    OPTIMAL_AT_BORDER = "optimal-at-border"
    #: The best that was found does not satisfy them.
    NOT_CONVERGED = "not-converged"
    #: No place within the bounds satisfies all constraints.
    INFEASIBLE = "infeasible"
    #: No start leads to a periodic motion.
    NO_MOTION = "no-motion"
    #: The metric is the same everywhere, as a speed is if the mass does not reach the spring.
    FLAT = "flat"
    #: The time is over: the place is the best that was found.
    TIME_LIMIT = "time-limit"


@dataclass(frozen=True, eq=False)
class Constraint:
    """A constraint at an optimum: how far it is from its limit, and what it costs.

    `multiplier` is how much the metric would gain by for each unit that the limit is let out; 0
    where the constraint does not hold the optimum. `scenario` counts starts and tolerances.
    """

    text: str
    slack: float
    multiplier: float
    active: bool
    scenario: int = 0


class Tightest(NamedTuple):
    """An inequality of the itinerary, its value, and to first order its distance.

    The value is dimensionless; the itinerary changes where it is 0. The distance is in shares of
    the variables' ranges.
    """

    inequality: str
    value: float
    distance: float


NOWHERE = Tightest("", math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best parameters for a metric of the steady motion, and what holds them there.

    All is in SI units where the system is a device, else dimensionless.
    """

    metric: str
    """What was optimised, in words."""
    maximised: bool
    """Whether it is greatest; else least."""
    system: System
    """The parameters at the optimum, those that were fixed among them."""
    over: dict[str, float] = field(default_factory=dict)
    """The variables there."""
    value: float = math.nan
    """The metric there, of the worst scenario."""
    metrics: dict[str, float] = field(default_factory=dict)
    """All metrics of the first scenario there."""
    status: OptimumStatus = OptimumStatus.NO_MOTION
    """How it ended."""
    message: str = ""
    """The same as a sentence."""
    residual: float = math.nan
    """Largest residual of the conditions of Karush, Kuhn and Tucker: of the derivatives of the
    Lagrangian by the variables, each times its range, over how much the metric varies within the
    bounds; and of active limits."""
    constraints: tuple[Constraint, ...] = ()
    """The constraints that were asked for, in the order of scenarios."""
    bounds: dict[str, float] = field(default_factory=dict)
    """Variables at a bound, with the gain of the metric for each unit that the bound is let out."""
    slopes: dict[str, float] = field(default_factory=dict)
    """How the optimum moves with each fixed parameter: the derivative of the optimal value."""
    orbits: tuple[Orbit, ...] = ()
    """The closed motion of each scenario; empty where there is none."""
    itinerary: tuple[str, ...] = ()
    """The itinerary of the first."""
    multiplier: float = math.nan
    """Largest modulus of a Floquet multiplier: at 1 the motion is lost or bifurcates."""
    tightest: Tightest = NOWHERE
    """The change of itinerary that the variables reach first."""
    border: tuple[str, ...] | None = None
    """The itineraries to both sides where the optimum is on a border between them."""
    sides: tuple[float, float] | None = None
    """There the metric's slopes away from the border into both sides, along its normal, by the
    scaled variables, each less what active constraints let it gain: both point downhill."""
    statistics: dict[str, int] = field(default_factory=dict)
    """Evaluations, starts that were followed, and cells of the survey."""

    @property
    def success(self) -> bool:
        """Whether the conditions of an optimum hold, as `status` and `message` say."""
        return self.status in (OptimumStatus.OPTIMAL, OptimumStatus.OPTIMAL_AT_BORDER)

    def __repr__(self) -> str:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.over.items())
        kind = "greatest" if self.maximised else "least"
        return f"<Optimum: {kind} {self.metric} {self.value:.6g} at {where}, {self.status}>"

    def to_dict(self) -> dict[str, Any]:
        """The results by name, of numbers, texts and lists."""
        device = isinstance(self.system, PhysicalParameters)
        units = {name: unit.name for name, unit in METRIC_UNITS.items()} if device else {}
        return (
            record(self, "metric maximised success status message value over")
            | {"parameters": values_of(self.system)}
            | record(self, "metrics")
            | {"units": units}
            | record(self, "itinerary residual constraints bounds slopes multiplier tightest")
            | record(self, "border sides statistics")
        )
