"""The result that an optimisation gives of a place that it found."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from capsule_sym._design.borders import distances
from capsule_sym._design.kinks import Kink, by_u
from capsule_sym._design.optimum import Constraint, Optimum, OptimumStatus, Tightest
from capsule_sym._design.program import KEPT, WHOLE, Place, Program
from capsule_sym._design.quantities import System, of
from capsule_sym._design.stationary import SOLVED, Stationary, rough
from capsule_sym._parameters import METRIC_UNITS, names_of


def optimum_of(program: Program, name: str, found: Stationary, kink: Kink | None) -> Optimum:
    """The result of a place that was found, by words and numbers."""
    place = found.place
    system, sign = program.system_at(place.u), program.sign
    value = sign * program.unit * float(place.objective.max()) + 0.0  # 0 has no sign
    status, message = OptimumStatus.OPTIMAL, "the conditions of an optimum hold"
    if kink is not None:
        status = OptimumStatus.OPTIMAL_AT_BORDER
        message = "an optimum on a border: the gradients of both sides point to it"
    elif not (found.residual < SOLVED and found.minimal):
        status = OptimumStatus.NOT_CONVERGED
        message = "the best that was found does not satisfy the conditions of an optimum"
    whole = program.at(place.u, place.motions, WHOLE)
    unit = program.unit
    slopes = (
        sign * unit * (found.weights @ whole.objective_by - found.multipliers @ whole.slacks_by)
    )
    if kink is not None:
        slopes = slopes - sign * unit * found.border * kink.border_by
    count = len(program.texts)
    constraints = [
        Constraint(
            text=text,
            slack=float(place.slacks[s * count + i] * program.sizes[i]),
            multiplier=float(found.multipliers[s * count + i] * unit / program.sizes[i]),
            active=bool(found.multipliers[s * count + i] > 0),
            scenario=s,
        )
        for s in range(len(program.scenarios))
        for i, text in enumerate(program.texts)
    ]
    ranges = program.high - program.low
    return Optimum(
        metric=name,
        maximised=sign < 0,
        system=system,
        over={name: float(getattr(system, name)) for name in program.names},
        value=value,
        metrics=_metrics(place, program.scenarios[0].system(system)),
        success=status in (OptimumStatus.OPTIMAL, OptimumStatus.OPTIMAL_AT_BORDER),
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
        border=None
        if kink is None
        else tuple(" ".join(side.motions[kink.which].itinerary) for side in kink.sides),
        sides=None if kink is None else (unit * kink.slopes[0], unit * kink.slopes[1]),
    )


def _tightest(program: Program, place: Place) -> Tightest:
    """The inequality of a scenario's motion that the variables reach first, to first order."""
    nearest = Tightest("", math.inf, math.inf)
    for which, motion in enumerate(place.motions):
        for one in distances(orbit := motion.orbit):
            assert orbit is not None
            slope = float(np.linalg.norm(by_u(program, place.u, which, one.by)))
            value = float(one.inequality.value)
            far = value / slope if slope else math.inf
            if far < nearest.distance:
                nearest = Tightest(one.inequality.named(orbit.itinerary), value, far)
    return nearest


def infeasible(program: Program, name: str, place: Place) -> Optimum:
    """That no place satisfies the constraints: which fail where the worst fails least."""
    count, named = len(program.texts), []
    for k in np.argsort(place.slacks).tolist():
        if place.slacks[k] < -KEPT:
            text = program.texts[k % count]
            named.append(f"{text} by {-place.slacks[k] * program.sizes[k % count]:.3g}")
    message = f"no place within the bounds was found to satisfy {' and '.join(named)}"
    found = optimum_of(program, name, rough(program, place), None)
    return replace(found, success=False, status=OptimumStatus.INFEASIBLE, message=message)


def nowhere(program: Program, name: str, status: OptimumStatus, message: str) -> Optimum:
    """That there is no place to tell of."""
    return Optimum(name, program.sign < 0, program.system, status=status, message=message)


def _metrics(place: Place, system: System) -> dict[str, float]:
    """All metrics of the first scenario's motion."""
    found = of(place.motions[0].metrics, system)
    return {name: float(found[name].value) for name in METRIC_UNITS}
