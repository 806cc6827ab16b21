"""Result of an optimisation, and its certainty."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._design.borders import distances
from capsule_sym._design.polish import BASIN, KINK, LocalOptimum
from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.quantities import System, of, values_of
from capsule_sym._errors import Status
from capsule_sym._map.result import Result, brief, by_fields
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneDevice, names_of
from capsule_sym._units import METRIC_UNITS


@dataclass(frozen=True, eq=False)
class Constraint:
    """Constraint at an optimum: its slack and multiplier.

    `multiplier` is the gain of the metric per unit by which the limit is relaxed; 0 if the
    constraint is not active. `text` is the limit with the metric or variable that it bounds.
    `slack` is the distance from it, 0 or more where it holds, in the unit of the metric: SI for a
    device, else dimensionless. `scenario` counts combinations of start and tolerances from 0.
    """

    text: str
    slack: float
    multiplier: float
    active: bool
    scenario: int = 0
    __repr__ = by_fields


class Tightest(NamedTuple):
    """Inequality of the itinerary, its value, and its distance to first order.

    The value is dimensionless; the itinerary changes where it is 0. The distance is in shares of
    the variables' ranges.
    """

    inequality: str
    value: float
    distance: float

    def __repr__(self) -> str:
        return by_fields(self)


NOWHERE = Tightest("", math.nan, math.nan)


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
    """Metric at the optimum, for the worst scenario."""
    metrics: dict[str, float] = field(default_factory=dict)
    """All metrics of the first scenario."""
    status: Status = Status.NO_MOTION
    """Status of the optimisation."""
    message: str = ""
    """Status as a sentence."""
    residual: float = math.nan
    """Largest residual of the Karush-Kuhn-Tucker conditions and of active limits. The derivatives
    of the Lagrangian by the variables are multiplied by their ranges, over the metric's variation
    within the bounds."""
    constraints: tuple[Constraint, ...] = ()
    """Constraints, in the order of scenarios."""
    bounds: dict[str, float] = field(default_factory=dict)
    """Variables at a bound, with the gain of the metric per unit by which the bound is relaxed."""
    slopes: dict[str, float] = field(default_factory=dict)
    """Derivatives of the optimal value by each fixed parameter."""
    orbits: tuple[Orbit, ...] = ()
    """Closed motion of each scenario; empty without motions."""
    itinerary: tuple[str, ...] = ()
    """Itinerary of the first scenario."""
    multiplier: float = math.nan
    """Largest modulus of a Floquet multiplier; at 1 the motion is lost or bifurcates."""
    tightest: Tightest = NOWHERE
    """Change of itinerary that is nearest in the variables."""
    border: tuple[str, ...] | None = None
    """Itineraries on both sides, if the optimum is on a border between them."""
    sides: tuple[float, ...] | None = None
    """Slopes of the metric away from that border into both sides, along its normal. They are by the
    scaled variables, less the gain that active constraints allow: both point downhill."""
    bifurcation: str = ""
    """Bound of the best where the motion is lost or loses stability; else empty."""
    limit: float = math.nan
    """Limit value at such a border; a margin keeps the optimum away from it."""
    statistics: dict[str, int] = field(default_factory=dict)
    """Number of evaluations, followed starts, and cells of the survey."""
    _recorded = (
        "metric maximised value over metrics itinerary residual constraints bounds slopes "
        "multiplier tightest border sides bifurcation limit statistics"
    )

    def __repr__(self) -> str:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.over.items())
        kind = "greatest" if self.maximised else "least"
        return brief(self, f"{kind} {self.metric} {self.value:.6g} at {where}, {self.status}")

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts."""
        device = isinstance(self.system, SceneDevice)
        units = {name: unit.name for name, unit in METRIC_UNITS.items()} if device else {}
        return super().to_dict() | {"parameters": values_of(self.system), "units": units}


def optimum_of(best: LocalOptimum) -> Optimum:
    """Result of a place."""
    program, found, place, sides = best.program, best.found, best.found.place, best.sides
    count = best.n_constraints
    system, sign, unit = program.system_at(place.u), program.sign, program.unit
    metrics = of(place.motions[0].metrics, program.scenarios[0].system(system))
    value = sign * unit * place.worst + 0.0  # 0 without a sign
    status, message = _status(best)
    slopes = found.weights @ place.objective_by - found.multipliers @ place.slacks_by
    scenarios = len(program.scenarios)
    sizes = np.tile(program.sizes, scenarios)
    slacks, forces = place.slacks[:count] * sizes, found.multipliers[:count] * unit / sizes
    constraints = [
        Constraint(text, float(slack), float(force), bool(force > 0), scenario)
        for (scenario, text), slack, force in zip(
            product(range(scenarios), program.texts), slacks, forces, strict=True
        )
    ]
    ranges = program.high - program.low
    return Optimum(
        metric=program.name,
        maximised=sign < 0,
        system=system,
        over={name: float(getattr(system, name)) for name in program.names},
        value=value,
        metrics={name: float(metrics[name].value) for name in METRIC_UNITS},
        status=status,
        message=message,
        residual=found.residual,
        constraints=tuple(constraints),
        bounds={
            name: float(abs(found.bounds[i])) * unit / float(ranges[i])
            for i, name in enumerate(program.names)
            if place.u[i] in (0.0, 1.0)
        },
        slopes={
            name: sign * unit * float(slopes[k])
            for k, name in enumerate(names_of(system))
            if name not in program.names
        },
        orbits=tuple(motion.orbit for motion in place.motions if motion.orbit is not None),
        itinerary=place.motions[0].itinerary,
        multiplier=max(motion.multiplier for motion in place.motions),
        tightest=_tightest(program, place),
        border=tuple(side.name for side in sides) if best.kkt_satisfied and sides else None,
        sides=tuple(unit * side.slope for side in sides) if best.kkt_satisfied and sides else None,
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
        BASIN: f"bounded by a basin boundary, beyond which the starts settle elsewhere, at {limit}",
        KINK: "bounded by borders that meet: none of many places beside it is better",
    }
    stability = f"bounded by a border of stability, {best.bifurcation}, with the limit {limit}"
    if best.bifurcation or best.sides:
        return Status.OPTIMAL_AT_BORDER, messages.get(best.bifurcation, stability)
    return Status.OPTIMAL, "the conditions of an optimum hold"


def _tightest(program: Program, place: Place) -> Tightest:
    """Nearest inequality of a scenario's motion in the variables, to first order."""
    nearest = NOWHERE._replace(distance=np.inf, value=np.inf)
    for scenario, motion in zip(program.scenarios, place.motions, strict=True):
        for one in distances(motion.orbit):
            by = program.by_u(program.by_all(place.u, scenario, one.by))
            slope, value = float(np.linalg.norm(by)), float(one.inequality.value)
            far = value / slope if slope else np.inf
            if far < nearest.distance and motion.orbit is not None:
                name = one.inequality.named(motion.orbit.itinerary)
                nearest = Tightest(name, value, far)
    return nearest


def failed_limits(program: Program, place: Place) -> str:
    """Failing limits of a place and their violations, the worst first."""
    count, named = len(program.texts), []
    for k in np.argsort(place.slacks).tolist():
        if place.slacks[k] < -KEPT:
            text = program.texts[k % count]
            named.append(f"{text} by {-place.slacks[k] * program.sizes[k % count]:.3g}")
    return " and ".join(named)
