"""What an optimisation found, and how sure it is of that."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.borders import Distance, distances
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.polish import BASIN, KINK, NOT_LED, Rest
from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.quantities import System, of, values_of
from capsule_sym._map.result import Result
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneDevice, names_of
from capsule_sym._units import METRIC_UNITS

Vector = NDArray[np.float64]


class OptimumStatus(StrEnum):
    """How an optimisation ended."""

    #: The conditions of an optimum hold, inside the bounds or where bounds and limits hold it.
    OPTIMAL = "optimal"
    #: The best is at a border beyond which it gets worse or is lost: a change of itinerary, a
    #: border of stability, or of what the starts lead to: see `bifurcation` and `limit`.
    OPTIMAL_AT_BORDER = "optimal-at-border"
    #: The best that was found can be bettered: no place is known to which the starts lead.
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
class Optimum(Result):
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
    sides: tuple[float, ...] | None = None
    """There the metric's slopes away from the border into both sides, along its normal, by the
    scaled variables, each less what active constraints let it gain: both point downhill."""
    bifurcation: str = ""
    """What bounds the best where the motion is lost or loses its stability beyond; else empty."""
    limit: float = math.nan
    """The value that is approached at such a border; not reached if a margin is kept to it."""
    statistics: dict[str, int] = field(default_factory=dict)
    """Evaluations, starts that were followed, and cells of the survey."""
    _good = (OptimumStatus.OPTIMAL, OptimumStatus.OPTIMAL_AT_BORDER)
    _recorded = (
        "metric maximised value over metrics itinerary residual constraints bounds slopes "
        "multiplier tightest border sides bifurcation limit statistics"
    )

    def __repr__(self) -> str:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.over.items())
        kind = "greatest" if self.maximised else "least"
        return f"<Optimum: {kind} {self.metric} {self.value:.6g} at {where}, {self.status}>"

    def to_dict(self) -> dict[str, Any]:
        """The result by name, of numbers, texts, lists and dicts."""
        device = isinstance(self.system, SceneDevice)
        units = {name: unit.name for name, unit in METRIC_UNITS.items()} if device else {}
        return super().to_dict() | {"parameters": values_of(self.system), "units": units}


def optimum_of(rest: Rest) -> Optimum:
    """The result of a place that was found, by words and numbers."""
    program, found, place, sides = rest.program, rest.found, rest.found.place, rest.sides
    asked = rest.asked
    system, sign, unit = program.system_at(place.u), program.sign, program.unit
    metrics = of(place.motions[0].metrics, program.scenarios[0].system(system))
    value = sign * unit * place.worst + 0.0  # 0 has no sign
    status, message = _told(rest)
    slopes = (
        sign * unit * (found.weights @ place.objective_by - found.multipliers @ place.slacks_by)
    )
    held = zip(
        product(
            range(len(program.scenarios)), zip(program.texts, program.sizes.tolist(), strict=True)
        ),
        place.slacks[:asked].tolist(),
        found.multipliers[:asked].tolist(),
        strict=True,
    )
    constraints = [
        Constraint(text, slack * size, multiplier * unit / size, multiplier > 0, scenario)
        for (scenario, (text, size)), slack, multiplier in held
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
            name: float(slopes[k])
            for k, name in enumerate(names_of(system))
            if name not in program.names
        },
        orbits=tuple(motion.orbit for motion in place.motions if motion.orbit is not None),
        itinerary=place.motions[0].itinerary,
        multiplier=max(motion.multiplier for motion in place.motions),
        tightest=_tightest(program, place),
        border=tuple(side.name for side in sides) if rest.whole and sides else None,
        sides=tuple(unit * side.slope for side in sides) if rest.whole and sides else None,
        bifurcation=rest.bifurcation,
        limit=sign * unit * rest.limit,
    )


def _told(rest: Rest) -> tuple[OptimumStatus, str]:
    """How it ended, as a status and a sentence."""
    if not rest.whole:
        message = "the best that was found does not satisfy the conditions of an optimum"
        if rest.bifurcation == NOT_LED:
            message = "the best motion that was found is not one that the starts lead to"
        return OptimumStatus.NOT_CONVERGED, message
    limit = f"{rest.program.sign * rest.program.unit * rest.limit:.9g}"
    messages = {
        "": "an optimum on a border: on each side it gets worse away from it",
        BASIN: f"bounded by a basin boundary, beyond which the starts lead elsewhere, at {limit}",
        KINK: "bounded by borders that meet: of many places beside it none is better",
    }
    stability = f"bounded by a border of stability, {rest.bifurcation}, with the limit {limit}"
    if rest.bifurcation or rest.sides:
        return OptimumStatus.OPTIMAL_AT_BORDER, messages.get(rest.bifurcation, stability)
    return OptimumStatus.OPTIMAL, "the conditions of an optimum hold"


def _tightest(program: Program, place: Place) -> Tightest:
    """The inequality of a scenario's motion that the variables reach first, to first order."""
    nearest = NOWHERE._replace(distance=np.inf, value=np.inf)
    for which, motion in enumerate(place.motions):
        for far, one in _reached(program, place.u, which, motion):
            if far < nearest.distance and motion.orbit is not None:
                name = one.inequality.named(motion.orbit.itinerary)
                nearest = Tightest(name, float(one.inequality.value), far)
    return nearest


def failed_limits(program: Program, place: Place) -> str:
    """Which limits of a place fail, and by how much, the worst first."""
    count, named = len(program.texts), []
    for k in np.argsort(place.slacks).tolist():
        if place.slacks[k] < -KEPT:
            text = program.texts[k % count]
            named.append(f"{text} by {-place.slacks[k] * program.sizes[k % count]:.3g}")
    return " and ".join(named)


def _reached(
    program: Program, u: Vector, which: int, motion: Motion
) -> Iterator[tuple[float, Distance]]:
    """The borders of a scenario's motion, with how far the variables have to go, to first order."""
    for one in distances(motion.orbit):
        by = program.by_u(program.by_all(u, program.scenarios[which], one.by))
        slope = float(np.linalg.norm(by))
        value = float(one.inequality.value)
        yield value / slope if slope else np.inf, one
