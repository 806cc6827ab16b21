"""Certificates of orbits, bifurcations and runs, for `checker` to accept or reject.

Every number is written with as many digits as are correct within 0.2 units of the last one. The
checker reads it as all numbers within 0.3 units, so each digit counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any

from capsule_sym._enclosures.numbers.balls import (
    Matrix,
    Unproved,
    arb,
    ball,
    decimal,
    precision,
)
from capsule_sym._enclosures.orbits.events import Event, prove_event
from capsule_sym._enclosures.orbits.krawczyk import Tube
from capsule_sym._enclosures.orbits.proof import guess_of, prove, shooting_of
from capsule_sym._enclosures.orbits.stability import prove_stable
from capsule_sym._enclosures.passage.runs import enclose_run, exactly
from capsule_sym._map import Trajectory
from capsule_sym._map.checks import checked_seconds
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation, CurvePoint
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.orbit import Orbit

_BITS, _BITS_A_SEGMENT = 256, 4


def _written(tube: Tube, parameters: Mapping[str, str], stable: bool) -> dict[str, Any]:
    shooting, hull = tube.shooting, tube.hull()
    return {
        "fields": list(shooting.itinerary.fields),
        "periods": shooting.itinerary.period_number,
        "parameters": {k: v for k, v in parameters.items() if k not in shooting.varied},
        "angle": decimal(hull[shooting.angle]),
        "durations": [decimal(hull[at]) for at in shooting.durations],
        "states": [_told(node.state) for node in tube.wide.nodes],
        "stable": stable,
    }


def _decimals(values: Iterable[float], exact: Mapping[str, str] | None) -> dict[str, str]:
    """Parameters by name: those in `exact`, or the decimals as which the doubles print."""
    given = zip(PARAMETERS, values, strict=True)
    return {name: (exact or {}).get(name, exactly(value)) for name, value in given}


def certify_orbit(
    orbit: Orbit, exact: Mapping[str, str] | None = None, *, max_seconds: float = math.inf
) -> dict[str, Any]:
    """Certificate of an orbit: existence, uniqueness, itinerary, and stability if it is stable.

    The parameters are the decimals that its doubles print as, or those in `exact`. Raises Unproved
    with the step that failed, and after `max_seconds`.
    """
    parameters = _decimals(orbit.values, exact)
    with Watch(checked_seconds(max_seconds)), precision(_BITS):
        shooting = shooting_of(orbit.itinerary, orbit.values, (), parameters)
        guess = guess_of(shooting, orbit)
        tube = prove(shooting, guess, {}, stable=False)
        try:
            stable = bool(prove_stable(tube.wide))
        except Unproved:
            stable = False
        return {"kind": "orbit", **_written(tube, parameters, stable)}
    raise Unproved("certificate", "the time was over before the orbit was proved")


def certify_bifurcation(
    found: Bifurcation | CurvePoint,
    exact: Mapping[str, str] | None = None,
    *,
    max_seconds: float = math.inf,
) -> tuple[dict[str, Any], Event]:
    """Certificate of a bifurcation with a segment of duration 0, and the proved event.

    Alpha is solved for. The other parameters are those of the bifurcation or of the curve's point,
    as in `certify_orbit`. Raises Unproved with the step that failed, for a smooth bifurcation, for
    a branch in another parameter, and after `max_seconds`.
    """
    if found.segment is None:
        raise Unproved("type", f"{_named(found)} has no segment of duration 0")
    free = found.parameter if isinstance(found, Bifurcation) else "alpha"
    if free != "alpha":
        raise Unproved("certificate", "the checker solves for alpha only")
    orbit = found.orbit
    parameters = _decimals(orbit.values, exact)
    with Watch(checked_seconds(max_seconds)), precision(_BITS):
        event = prove_event(orbit, (found.segment,), (free,), parameters)
        values = {name: decimal(value) for name, value in event.values.items()}
        return {
            "kind": "bifurcation",
            # Beside what the checker proves: these follow from the segments next to that of
            # duration 0.
            "about": {
                "type": event.type,
                "line": event.line,
                "order": event.order,
                "coefficient": event.coefficient and decimal(event.coefficient),
                "multipliers": [
                    {"trace": one.trace.str(30), "minors": one.minors.str(30)}
                    for one in event.multipliers
                ],
            },
            **_written(event.tube, parameters, stable=False),
            "free": values,
            "still": [found.segment],
        }, event
    raise Unproved("certificate", "the time was over before the bifurcation was proved")


def certify_run(
    trajectory: Trajectory,
    exact: Mapping[str, str] | None = None,
    *,
    max_seconds: float = math.inf,
) -> dict[str, Any]:
    """Certificate of a run to the end of a period: itinerary, switches, and final state.

    Start and parameters are the decimals that its doubles print as, or those in `exact` by name.
    Raises Unproved with the segment that is not the next one, and after `max_seconds`.
    """
    with Watch(checked_seconds(max_seconds)):
        return _certified_run(trajectory, exact)
    raise Unproved("certificate", "the time was over before every switch was proved")


def _certified_run(trajectory: Trajectory, exact: Mapping[str, str] | None) -> dict[str, Any]:
    passage = enclose_run(trajectory, exact)
    segments, (begin, start) = trajectory.segments, trajectory.origin
    if segments[-1].end.phase != 0:
        raise Unproved("certificate", "the run does not end with a period")
    given = trajectory.parameters.to_dict()
    parameters = _decimals((given[name] for name in PARAMETERS), exact)
    angle = Fraction(parameters["omega"]) * Fraction(exactly(begin.phase))
    with precision(_BITS + _BITS_A_SEGMENT * len(segments)):
        periods = int(segments[-1].end.period - begin.period)
        total = (2 * periods * arb.pi() - ball(angle)) / ball(parameters["omega"])
        instants = [arb(0), *passage.times, total]
        return {
            "kind": "run",
            "fields": [one.field for one in segments],
            "periods": periods,
            "parameters": parameters,
            "angle": _decimal_of(angle),
            "durations": [decimal(h - g) for g, h in pairwise(instants)],
            "states": [[exactly(x) for x in start], *map(_told, passage.states[1:-1])],
            "end": _told(passage.state),
            "stable": False,
        }


def _told(state: Matrix) -> list[str]:
    return [decimal(state[row, 0]) for row in range(3)]


def _decimal_of(value: Fraction) -> str:
    """Fraction as a decimal, if it is one."""
    places = next(k for k in range(2000) if 10**k % value.denominator == 0)
    return format(Decimal(value.numerator * 10**places // value.denominator).scaleb(-places), "f")


Certified = Orbit | Bifurcation | CurvePoint | Trajectory


def _named(one: Certified) -> str:
    if isinstance(one, Orbit):
        return str(one.itinerary)
    if isinstance(one, Trajectory):
        return "the run"
    if isinstance(one, CurvePoint):
        return f"the point {', '.join(map(repr, one.values))} of a curve"
    return f"{one.type} {one.value!r}"


def certificates(
    found: Iterable[Certified], limit: Watch, exact: Mapping[str, str] | None = None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Certificates of orbits, bifurcations and runs, and the reason for each missing one.

    Parameters are the decimals in `exact` by name, or those that doubles print as.
    """
    proved, failed = [], []
    for one in found:
        try:
            if limit.over:
                raise Unproved("certificate", "the time was over")
            if isinstance(one, Orbit):
                proved.append(certify_orbit(one, exact, max_seconds=limit.left))
            elif isinstance(one, Trajectory):
                proved.append(certify_run(one, exact, max_seconds=limit.left))
            else:
                proved.append(certify_bifurcation(one, exact, max_seconds=limit.left)[0])
        except Unproved as error:
            failed.append(f"{_named(one)}: {error}")
    return proved, failed
