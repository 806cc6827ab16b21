"""Two bifurcations at once: points of codimension two in balls, and that their curves cross."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from capsule_sym import Parameters, continue_bifurcation
from capsule_sym._enclosures.interface import (
    NEAR,
    Ball,
    Proved,
    Tube,
    Unproved,
    beyond,
    enclose,
    held,
    matrix,
    precision,
    prove_event,
)
from capsule_sym._orbits.interface import CROSSING
from capsule_sym.results import CodimensionTwoPoint
from paper.proofs.decimals import decimal
from paper.proofs.intervals import approximate

FREE = ("alpha", "gamma")
_BITS = 320
_BETWEEN, _RANGES = 3.2, ((1.5, 1.65), (3.0, 3.3))  # of the curve on which both points lie


@dataclass(frozen=True)
class ProvedPoint:
    """An orbit with two segments of duration 0, alone in its tube, and the curves that cross there.

    `slopes` are d alpha/d gamma of the curve of each segment, in the itinerary without the other
    one: balls that are apart.
    """

    event: Proved
    slopes: tuple[Ball, Ball]


def prove_codimension_two(found: CodimensionTwoPoint, exact: Mapping[str, Any]) -> ProvedPoint:
    """Prove a point of a curve where a second segment has duration 0; raises Unproved."""
    segments = [i for i, h in enumerate(found.orbit.durations) if h == 0]
    if len(segments) != 2:
        raise Unproved("type", f"{len(segments)} segments have the duration 0")
    orbit = found.orbit
    with precision(_BITS):
        event = prove_event(orbit, segments, FREE, exact)
        first, second = segments
        slopes = _slope(event.tube, first, second), _slope(event.tube, second, first)
        if slopes[0].overlaps(slopes[1]):
            raise Unproved("transversality", "the curves are not seen to cross")
        return ProvedPoint(event, slopes)


def _slope(tube: Tube, segment: int, gone: int) -> Ball:
    """The slope d alpha/d gamma of the curve of a segment, in the itinerary without the other."""
    less, columns, kept = beyond(tube, gone)
    if segment not in kept:
        raise Unproved("transversality", "without one segment there is not the other")
    alpha, gamma = (less.parameter(name) for name in FREE)
    given = {**held(less), less.durations[kept.index(segment)]: 0.0, gamma: NEAR}
    found = enclose(less, columns, given)
    if not found.holds(columns):
        raise Unproved("transversality", "the orbit is not seen to be that of the other side")
    by, size = found.wide.by, len(found.solved)
    solved = matrix(
        size,
        size,
        ((i, k, by[i, at]) for i in range(size) for k, at in enumerate(found.solved)),
    )
    drive = matrix(size, 1, ((i, 0, by[i, gamma]) for i in range(size)))
    return -solved.solve(drive)[found.solved.index(alpha), 0]


def record(one: ProvedPoint) -> dict[str, Any]:
    """A point as plain data: alpha and gamma are decimals right to their last digit."""
    values = one.event.values
    with precision(_BITS):
        return {
            "type": one.event.type,
            "line": one.event.line,
            **{name: decimal(value) for name, value in values.items()},
            "radius": max(float(value.rad()) for value in values.values()),
            "slopes": [float(slope) for slope in one.slopes],
        }


def section4(exact: Mapping[str, str]) -> list[ProvedPoint]:
    """Mass ratios at which the order of Section 4's last three bifurcations changes.

    Raises Unproved if one of the two is not proved.
    """
    found, _ = approximate(Parameters(gamma=_BETWEEN), float(Fraction(1, 1000)), 2.0)
    (crossing,) = (one for one in found if one.type == CROSSING)
    curve = continue_bifurcation(crossing, "gamma", _RANGES)
    return [prove_codimension_two(one, exact) for one in curve.codimension_two]
