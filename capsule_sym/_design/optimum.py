"""Result of an optimisation: parameters, metrics, conditions of the optimum, and status."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from capsule_sym._design.polish import BASIN, KINK, LOST
from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.stationary import LocalOptimum
from capsule_sym._errors import Status
from capsule_sym._map.result import Result, brief, by_fields
from capsule_sym._orbits.quantities import of, units_in
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import names_of
from capsule_sym._systems import System, values_of
from capsule_sym._units import METRIC_UNITS


@dataclass(frozen=True, eq=False)
class Constraint:
    """Constraint at an optimum: its slack and multiplier.

    `multiplier` is the gain of the metric per unit by which the limit is relaxed; 0 if the
    constraint is not active. `text` is the limit with the metric or variable that it bounds.
    `slack` is the distance from it, 0 or more where it holds, in the unit of what it bounds: SI for
    a device, else dimensionless.
    """

    text: str
    slack: float
    multiplier: float
    active: bool
    __repr__ = by_fields


@dataclass(frozen=True, eq=False)
class Optimum(Result):
    """Best parameters for a metric of the steady motion, with the active constraints.

    In SI units if the system is a device, else dimensionless.
    """

    metric: str
    """Name of the optimised metric."""
    maximised: bool
    """True if it is maximised; else it is minimised."""
    system: System
    """All parameters at the optimum."""
    over: dict[str, float] = field(default_factory=dict)
    """Variables at the optimum."""
    value: float = math.nan
    """Metric at the optimum."""
    metrics: dict[str, float] = field(default_factory=dict)
    """All metrics."""
    status: Status = Status.NO_MOTION
    """Status of the optimisation."""
    message: str = ""
    """Status as a sentence."""
    residual: float = math.nan
    """Largest residual of the Karush-Kuhn-Tucker conditions and of active limits. The derivatives
    of the Lagrangian by the variables are multiplied by their ranges, over the metric's variation
    within the bounds."""
    constraints: tuple[Constraint, ...] = ()
    """Constraints, that of the stability, if there is one, last.

    Each has its `text`, `slack`, `multiplier`, and whether it is `active`. The slack is the
    distance from the limit, 0 or more where it holds, in the unit of what it bounds; the multiplier
    is the gain of the metric per unit by which the limit is relaxed."""
    bounds: dict[str, float] = field(default_factory=dict)
    """Variables at a bound, with the gain of the metric per unit by which the bound is relaxed."""
    slopes: dict[str, float] = field(default_factory=dict)
    """Derivatives of the optimal value by each fixed parameter."""
    orbit: Orbit | None = None
    """Closed motion; None without one."""
    itinerary: tuple[str, ...] = ()
    """Itinerary of the motion."""
    multiplier: float = math.nan
    """Largest modulus of a Floquet multiplier; at 1 the motion is lost or bifurcates."""
    border: tuple[str, ...] | None = None
    """Itineraries beside the optimum, its own first, "" where the motion is lost; None if it is on
    no border."""
    bifurcation: str = ""
    """Bound of the best: a basin boundary, a kink, or a bifurcation; else empty."""
    limit: float = math.nan
    """Limit of the metric there; at a loss of stability a solved optimum keeps a margin from it."""
    statistics: dict[str, int] = field(default_factory=dict)
    """Number of searches and of points of all surveys; empty for a point of a front."""
    _recorded = (
        "metric maximised value over metrics itinerary residual constraints bounds slopes "
        "multiplier border bifurcation limit statistics"
    )

    def __repr__(self) -> str:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.over.items())
        kind = "greatest" if self.maximised else "least"
        return brief(self, f"{kind} {self.metric} {self.value:.6g} at {where}, {self.status}")

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as JSON has it: None stands for a number that is not finite.

        `parameters` are those of the system at the optimum. `units` has the SI units of metrics,
        parameters and start of a device, and is empty without one.
        """
        more = {"parameters": values_of(self.system), "units": units_in(self.system)}
        return super().to_dict() | more


def optimum_of(best: LocalOptimum) -> Optimum:
    """Result of a local optimum, without statistics."""
    program, place, count = best.program, best.place, len(best.program.texts)
    system, sign, unit = program.system_at(place.u), program.sign, program.unit
    metrics = of(place.motion.metrics, system)
    status, message = _status(best)
    slopes = place.objective_by - best.multipliers @ place.slacks_by
    slacks = place.slacks[:count] * program.sizes
    if program.margin is not None:  # on a piece it is squared
        slacks[-1] = 1 - program.margin - place.motion.multiplier
    forces = best.multipliers[:count] * unit / program.sizes
    ranges = program.high - program.low
    return Optimum(
        metric=program.name,
        maximised=sign < 0,
        system=system,
        over={name: float(getattr(system, name)) for name in program.names},
        value=sign * unit * place.objective + 0.0,  # 0 without a sign
        metrics={name: float(metrics[name].value) for name in METRIC_UNITS},
        status=status,
        message=message,
        residual=best.residual,
        constraints=tuple(
            Constraint(text, float(slack), float(force), bool(force > 0))
            for text, slack, force in zip(program.texts, slacks, forces, strict=True)
        ),
        bounds={
            name: max(float(best.bounds[i]), 0.0) * unit / float(ranges[i])
            for i, name in enumerate(program.names)
            if place.u[i] in (0.0, 1.0)
        },
        slopes={
            name: sign * unit * float(slopes[k])
            for k, name in enumerate(names_of(system))
            if name not in program.names
        },
        orbit=place.motion.orbit,
        itinerary=place.motion.itinerary,
        multiplier=place.motion.multiplier,
        border=best.border if best.kkt_satisfied and best.border else None,
        bifurcation=best.bifurcation,
        limit=sign * unit * best.limit,
    )


def _status(best: LocalOptimum) -> tuple[Status, str]:
    """Status of the result, and a sentence."""
    if not best.kkt_satisfied:
        message = "the best place found does not satisfy the conditions of an optimum"
        return Status.NOT_CONVERGED, message
    limit = f"{best.program.sign * best.program.unit * best.limit:.9g}"
    messages = {
        "": "an optimum on a border: it is worse on each side",
        BASIN: f"bounded by a basin boundary, beyond which the start settles elsewhere, at {limit}",
        KINK: "bounded by borders that meet: no better place was found",
        LOST: f"bounded by a change of itinerary beyond which the motion is lost, at {limit}",
    }
    stability = f"bounded by a border of stability, {best.bifurcation}, with the limit {limit}"
    if best.bifurcation or best.border:
        return Status.OPTIMAL_AT_BORDER, messages.get(best.bifurcation, stability)
    return Status.OPTIMAL, "the conditions of an optimum hold"


def failed_limits(program: Program, place: Place) -> str:
    """Failing limits of a place and their violations, the worst first."""
    return " and ".join(
        f"{program.texts[k]} by {-place.slacks[k] * program.sizes[k]:.3g}"
        for k in np.argsort(place.slacks)
        if place.slacks[k] < -KEPT
    )
