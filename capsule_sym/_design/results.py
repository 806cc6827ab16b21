"""The result that an optimisation gives of a place that it found."""

from __future__ import annotations

import numpy as np

from capsule_sym._design.borders import Kink, reached
from capsule_sym._design.optimum import NOWHERE, Constraint, Optimum, OptimumStatus, Tightest
from capsule_sym._design.program import KEPT, WHOLE, Place, Program
from capsule_sym._design.quantities import of
from capsule_sym._design.stationary import SOLVED, Stationary
from capsule_sym._parameters import METRIC_UNITS, names_of


def optimum_of(program: Program, name: str, found: Stationary, kink: Kink | None) -> Optimum:
    """The result of a place that was found, by words and numbers."""
    place = found.place
    system, sign, unit = program.system_at(place.u), program.sign, program.unit
    metrics = of(place.motions[0].metrics, program.scenarios[0].system(system))
    value = sign * unit * place.worst + 0.0  # 0 has no sign
    status, message = OptimumStatus.OPTIMAL, "the conditions of an optimum hold"
    if kink is not None:
        status = OptimumStatus.OPTIMAL_AT_BORDER
        message = "an optimum on a border: the gradients of both sides point to it"
    elif not (found.residual < SOLVED and found.minimal):
        status = OptimumStatus.NOT_CONVERGED
        message = "the best that was found does not satisfy the conditions of an optimum"
    whole = program.at(place.u, place.motions, WHOLE)
    slopes = (
        sign * unit * (found.weights @ whole.objective_by - found.multipliers @ whole.slacks_by)
    )
    if kink is not None:
        slopes = slopes - sign * unit * found.border * kink.border_by
    slacks, multipliers = (
        row.reshape(len(program.scenarios), -1) for row in (place.slacks, found.multipliers)
    )
    constraints = [
        Constraint(
            text=text,
            slack=float(slacks[s, i] * size),
            multiplier=float(multipliers[s, i] * unit / size),
            active=bool(multipliers[s, i] > 0),
            scenario=s,
        )
        for s in range(len(program.scenarios))
        for i, (text, size) in enumerate(zip(program.texts, program.sizes, strict=True))
    ]
    ranges = program.high - program.low
    return Optimum(
        metric=name,
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
        border=None
        if kink is None
        else tuple(" ".join(side.motions[kink.which].itinerary) for side in kink.sides),
        sides=None if kink is None else (unit * kink.slopes[0], unit * kink.slopes[1]),
    )


def _tightest(program: Program, place: Place) -> Tightest:
    """The inequality of a scenario's motion that the variables reach first, to first order."""
    nearest = NOWHERE._replace(distance=np.inf, value=np.inf)
    for which, motion in enumerate(place.motions):
        for far, one in reached(program, place.u, which, motion):
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
