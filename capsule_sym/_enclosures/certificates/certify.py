"""Certificates of orbits, bifurcations and runs, for `checker` to accept or reject.

A statement is written in one way, which `certificates.schema.json` gives and the checker demands:
numbers rounded to 30 decimals, exact ones without zeros at their end, and an orbit from its switch
of least phase on.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from capsule_sym._enclosures.certificates.checker import VERSION
from capsule_sym._enclosures.numbers.balls import Ball, Matrix, Unproved, arb, ball, precision
from capsule_sym._enclosures.orbits.events import Proved, prove_event
from capsule_sym._enclosures.orbits.krawczyk import Tube, enclose
from capsule_sym._enclosures.orbits.proof import guess_of, held, prove_admissible, shooting_of
from capsule_sym._enclosures.orbits.stability import characteristic, monodromy
from capsule_sym._enclosures.passage.runs import enclose_run, exactly
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory
from capsule_sym._map.checks import checked_seconds
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.bifurcations import Bifurcation, CurvePoint
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import CAPSULE, Scene

_BITS, _BITS_A_SEGMENT, _PLACES = 256, 4, 30


def _written(tube: Tube, parameters: Mapping[str, str], first: int) -> dict[str, Any]:
    """Entries of an orbit from the segment `first` on; without a switch, from the angle 0 on."""
    shooting, hull = tube.shooting, tube.hull()
    n, durations = len(shooting.itinerary), [hull[at] for at in shooting.durations]
    states, angle = [node.state for node in tube.wide.nodes], "0"
    if n == 1:
        left = (2 * arb.pi() - hull[shooting.angle]) / shooting.parameters(hull)["omega"]
        states = [tube.wide.fields[0].flow(left) * states[0]]
    else:
        angle = rounded(2 * arb.pi() * _turn(tube, first))
    order = [(first + k) % n for k in range(n)]
    return {
        "fields": [shooting.itinerary.fields[k] for k in order],
        "periods": shooting.itinerary.period_number,
        "parameters": {k: v for k, v in parameters.items() if k not in shooting.varied},
        "angle": angle,
        "durations": [rounded(durations[k]) for k in order],
        "states": [_told(states[k]) for k in order],
    }


def _turn(tube: Tube, segment: int) -> Ball:
    """Phase at which a segment begins, as a share of a turn."""
    hull, shooting = tube.hull(), tube.shooting
    spent = sum((hull[at] for at in shooting.durations[:segment]), arb(0))
    turn = hull[shooting.angle] + shooting.parameters(hull)["omega"] * spent
    turn /= 2 * arb.pi()
    return turn - turn.floor()


def _first(tube: Tube, still: Sequence[int] = ()) -> int:
    """Segment that begins at the least phase; of two that begin together, that of duration 0."""
    after = {(s + 1) % len(tube.shooting.itinerary) for s in still}
    segments = [k for k in range(len(tube.shooting.itinerary)) if k not in after]
    return min(segments, key=lambda k: float(_turn(tube, k)))


def _decimals(scene: Scene, values: Iterable[float]) -> dict[str, str]:
    """Parameters by name, as the decimals as which the doubles print.

    Raises InvalidInput for another scene than that for which certificates are written.
    """
    if scene != CAPSULE:
        raise InvalidInput("scene", scene.name, CAPSULE.name)
    given = zip(PARAMETERS, values, strict=True)
    return {name: _shortest(exactly(value)) for name, value in given}


def _shortest(text: str) -> str:
    """Exact decimal without zeros at its end."""
    short = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if short == "-0" else short


@np.errstate(under="ignore")
def certify_orbit(orbit: Orbit, *, max_seconds: float = math.inf) -> dict[str, Any]:
    """Certificate of an orbit: existence, uniqueness nearby, itinerary, and whether it is stable.

    The orbit is enclosed in ball arithmetic. Then every event function is proved positive inside
    its segment. The Floquet multipliers are proved to be inside the unit circle, or one outside it.
    The orbit is one of the paper's scene; its parameters are the decimals as which their doubles
    print. The extra `symbolic` is needed.

    Parameters
    ----------
    orbit : Orbit
        The orbit, as `solve_orbit` gives; dimensionless. Its numbers are the guess of the proof.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    dict
        The certificate, of kind "orbit": `fields`, `periods`, `parameters`, `angle`, `durations`,
        `states` and `stable`. Numbers but `fields` and `periods` are decimals as texts,
        dimensionless, `angle` in radians. It can be written as JSON.

    Raises
    ------
    Unproved
        With the step that failed, and after `max_seconds`. The statement may still hold. It is an
        ArithmeticError.
    InvalidInput
        For an orbit of another scene, one that was not found, and a time that is not allowed.

    Notes
    -----
    Existence and uniqueness follow by Krawczyk's method for the equations of the orbit, with 256
    bits, and stability by Jury's conditions. The system is that of Eqs. (7)-(12) of the paper.

    See Also
    --------
    check_certificate : independent check of the certificate.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> certificate = cs.certify_orbit(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    >>> print(certificate["kind"], certificate["fields"], certificate["stable"])
    orbit [1, 2, 5, 4] True
    >>> print(certificate["durations"][0])
    0.981818749997849077221677549776
    """
    orbit = whole_orbit(orbit)
    parameters = _decimals(orbit.scene, orbit.values)
    with Watch(checked_seconds(max_seconds)), precision(_BITS):
        shooting = shooting_of(orbit.itinerary, orbit.values, (), parameters)
        tube = enclose(shooting, guess_of(shooting, orbit), held(shooting))
        prove_admissible(tube)
        jury = characteristic(monodromy(tube.wide)).jury
        stable = all(value > 0 for value in jury)
        if not (stable or any(value < 0 for value in jury)):
            raise Unproved("stability", "a multiplier is not seen to be off the unit circle")
        return {"kind": "orbit", **_written(tube, parameters, _first(tube)), "stable": stable}
    raise Unproved("certificate", "the time was over before the orbit was proved")


@np.errstate(under="ignore")
def certify_bifurcation(
    found: Bifurcation | CurvePoint,
    *,
    max_seconds: float = math.inf,
) -> tuple[dict[str, Any], Proved]:
    """Certificate of a bifurcation with a segment of duration 0, and the proved event.

    Alpha is solved for. The other parameters are those of the bifurcation or of the curve's point:
    the decimals as which their doubles print. The orbit is one of the paper's scene. The extra
    `symbolic` is needed.

    Parameters
    ----------
    found : Bifurcation or CurvePoint
        Bifurcation of a branch in alpha, or point of a curve; dimensionless. Its numbers are the
        guess of the proof.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    certificate : dict
        The certificate, of kind "bifurcation", as in `certify_orbit`, but without `stable`. `free`
        has alpha, `still` the index of the segment of duration 0, from 0, in a list.
    event : Proved
        The proved event: its `type`, `line` and `order` of contact. In balls, `values` has alpha,
        `multipliers` the characteristic polynomials on both sides, and `coefficient` the change of
        alpha over duration^order at the duration 1e-12. To that order, and without `ties`, it is
        the `growth` of the bifurcation's `normal_form`.

    Raises
    ------
    Unproved
        With the step that failed, for a smooth bifurcation, for one of two segments that are each
        other's mirror image, for a branch in another parameter, and after `max_seconds`. It is an
        ArithmeticError.
    InvalidInput
        For an orbit of another scene, and a time that is not allowed.

    See Also
    --------
    continue_orbit : branch with its bifurcations.
    check_certificate : independent check of the certificate.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.9)), "alpha", 1.0, points=4)
    >>> certificate, event = cs.certify_bifurcation(branch.at("AS1"))
    >>> print(certificate["free"]["alpha"])
    0.940998003446078071890892524918
    >>> print(event.type, event.line, event.order)
    adding-sliding L2^(2) 2
    """
    if found.segment is None:
        raise Unproved("type", f"{_named(found)} has no segment of duration 0")
    free, orbit = found.parameter if isinstance(found, Bifurcation) else "alpha", found.orbit
    parameters = _decimals(orbit.scene, orbit.values)
    if free != "alpha":
        raise Unproved("certificate", "the checker solves for alpha only")
    with Watch(checked_seconds(max_seconds)), precision(_BITS):
        event = prove_event(orbit, (found.segment,), (free,), parameters)
        n, first = len(orbit.itinerary), _first(event.tube, event.segments)
        return {
            "kind": "bifurcation",
            **_written(event.tube, parameters, first),
            "free": {name: rounded(value) for name, value in event.values.items()},
            "still": [(found.segment - first) % n],
        }, event
    raise Unproved("certificate", "the time was over before the bifurcation was proved")


@np.errstate(under="ignore")
def certify_run(trajectory: Trajectory, *, max_seconds: float = math.inf) -> dict[str, Any]:
    """Certificate of a run to the end of a period: itinerary, switches, and final state.

    Each switch is enclosed and proved to be the first event. The start is given by the decimals as
    which its doubles print. The run is one of the paper's scene. The extra `symbolic` is needed.

    Parameters
    ----------
    trajectory : Trajectory
        Run that ends with a period, with its segments (`keep="segments"`), as `simulate` gives;
        dimensionless.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    dict
        The certificate, of kind "run": `fields`, `periods`, `parameters`, `angle`, `durations`,
        `states` and the state at the `end`. Numbers but `fields` and `periods` are decimals as
        texts, dimensionless, `angle` in radians.

    Raises
    ------
    Unproved
        With the segment that is not the next one, if the run did not finish or does not end with a
        period, and after `max_seconds`. It is an ArithmeticError.
    InvalidInput
        For a run of another scene, if segments were not kept, and for a time that is not allowed.

    See Also
    --------
    check_certificate : independent check of the certificate.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> certificate = cs.certify_run(cs.simulate(cs.Parameters(alpha=0.9), periods=1))
    >>> print(certificate["kind"], certificate["periods"], certificate["fields"])
    run 1 [2, 5, 4, 5, 2, 3, 6, 4]
    >>> print([text[:10] for text in certificate["end"]])
    ['1.02752353', '-0.3684343', '0.35221837']
    """
    with Watch(checked_seconds(max_seconds)):
        given = trajectory.parameters
        parameters = _decimals(given.scene, (getattr(given, name) for name in PARAMETERS))
        passage = enclose_run(trajectory)
        segments, (begin, start) = trajectory.segments, trajectory.origin
        if segments[-1].end.phase != 0:
            raise Unproved("certificate", "the run does not end with a period")
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
                "durations": [rounded(h - g) for g, h in pairwise(instants)],
                "states": [
                    [_shortest(exactly(x)) for x in start],
                    *map(_told, passage.states[1:-1]),
                ],
                "end": _told(passage.state),
            }
    raise Unproved("certificate", "the time was over before every switch was proved")


def _told(state: Matrix) -> list[str]:
    return [rounded(state[row, 0]) for row in range(3)]


def _decimal_of(value: Fraction) -> str:
    """Fraction as a decimal, if it is one."""
    places = next(k for k in range(2000) if 10**k % value.denominator == 0)
    whole = Decimal(value.numerator * 10**places // value.denominator)
    return _shortest(format(whole.scaleb(-places), "f"))


def rounded(value: Ball) -> str:
    """Narrow ball as the decimal to which all its numbers round; raises Unproved."""
    whole = (value * arb(10) ** _PLACES + arb("0.5")).floor().unique_fmpz()
    if whole is None:
        raise Unproved("certificate", f"not known to {_PLACES} decimals")
    digits = str(abs(int(whole))).rjust(_PLACES + 1, "0")
    return f"{'-' if int(whole) < 0 else ''}{digits[:-_PLACES]}.{digits[-_PLACES:]}"


def file_of(held: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Content of a file of certificates; the checker rejects one without any."""
    return {"version": VERSION, "certificates": [*held]}


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
    found: Iterable[Certified], limit: Watch
) -> tuple[list[dict[str, Any]], list[str]]:
    """Certificates of orbits, bifurcations and runs, and the reason for each that is not proved.

    Parameters are the decimals that doubles print as. Each certificate is there once. Raises
    InvalidInput for one of another scene, and for a run whose segments were not kept.
    """
    proved, failed = [], []
    for one in found:
        try:
            if limit.over:
                raise Unproved("certificate", "the time was over")
            if isinstance(one, Orbit):
                proved.append(certify_orbit(one, max_seconds=limit.left))
            elif isinstance(one, Trajectory):
                proved.append(certify_run(one, max_seconds=limit.left))
            else:
                proved.append(certify_bifurcation(one, max_seconds=limit.left)[0])
        except Unproved as error:
            failed.append(f"{_named(one)}: {error}")
    return [one for k, one in enumerate(proved) if one not in proved[:k]], failed
