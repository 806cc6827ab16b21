"""Patch of the plane through which a bifurcation curve passes: the orbits on both sides, glued.

On the curve a segment has the duration 0. Beyond it the itinerary has no such segment, or contact
and drift change in the other order, with a segment of its own that begins with the duration 0.
Both sides have the same orbit at one point of the curve. Each is unique there and nearby, so they
have the same orbits along the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from capsule_sym import InvalidInput
from capsule_sym._enclosures.interface import (
    Ball,
    Shooting,
    Tube,
    Unproved,
    arb,
    ball,
    beyond,
    enclose,
)
from capsule_sym._orbits.interface import around, swap_segment
from capsule_sym.results import Itinerary
from paper.proofs.curve_sides import WithoutSegment, WithSegment
from paper.proofs.parts import Patch

_SHARE = 0.56  # of the longest duration at a corner: more than half of all durations of the patch


class Guess(NamedTuple):
    """Equations of a motion at a patch's corner, and their columns."""

    shooting: Shooting
    columns: list[Ball]

    @property
    def itinerary(self) -> Itinerary:
        """The motion's itinerary."""
        return self.shooting.itinerary

    def duration(self, itinerary: Itinerary, segment: int) -> float:
        """Duration of a segment of an itinerary that is a rotation of this one."""
        n = len(itinerary)
        shift = next(k for k in range(n) if itinerary.rotated(k).fields == self.itinerary.fields)
        return float(self.columns[self.shooting.durations[(segment - shift) % n]])


def named(itinerary: Itinerary) -> str:
    """Name of an itinerary among the results."""
    over = f" over {itinerary.period_number}" if itinerary.period_number > 1 else ""
    return f"{itinerary}{over}"


def prove_curve(patch: Patch, guesses: Sequence[Guess]) -> str:
    """Itineraries of the stable orbits on both sides of a curve through a patch, by alpha.

    Raises Unproved if it is not proved that all of the patch, but for the curve, has one of them.
    """
    groups: dict[Itinerary, list[Guess]] = {}
    for one in guesses:
        groups.setdefault(one.itinerary.cyclic, []).append(one)
    if len(groups) != 2:
        raise Unproved("search", f"{len(groups)} itineraries at the corners")
    near, far = sorted(groups.values(), key=lambda group: -len(group[0].itinerary))
    event, segment = _event(patch, near, far[0].itinerary.cyclic)
    (alpha, _), (wide, radius) = patch.middle, patch.radii
    curve, end = _with_segment(event, segment, near, radius).prove_side()
    sign = 1 if end.mid() > curve.mid() else -1
    edge, opposite = (ball(alpha) + ball(wide) * side for side in (sign, -sign))
    _covered(sign * (end - edge))
    other = beyond(event, segment)
    shooting, columns, kept = other
    if len(kept) == len(event.shooting.itinerary):
        given = {shooting.durations[segment]: 0.0, shooting.parameter("gamma"): 0.0}
        same = enclose(shooting, columns, given)
        if not same.holds(columns):
            raise Unproved("gluing", "the sides are not seen to have the same orbit on the curve")
        _, end = _with_segment(same, segment, far, radius).prove_side()
        _covered(sign * (opposite - end))
    else:
        low = min(float(x.lower()) for x in (curve, opposite))
        high = max(float(x.upper()) for x in (curve, opposite))
        radii = (high - low) / 2 * (1 + 1e-3), radius
        there = WithoutSegment(event, segment, other, (low + high) / 2, radii)
        there.prove_side(curve, opposite, -sign)
    names = named(event.shooting.itinerary), named(shooting.itinerary)
    return " | ".join(names[::-sign])


def _covered(beyond: Ball) -> None:
    """Raise Unproved if orbits are not seen to reach beyond an edge of the patch."""
    if not beyond > 0:
        raise Unproved("coverage", "not all of the patch is reached from the curve")


def _with_segment(
    event: Tube, segment: int, guesses: Sequence[Guess], radius: float
) -> WithSegment:
    """Orbits from the curve on, to those at the corners."""
    itinerary = event.shooting.itinerary
    longest = max(one.duration(itinerary, segment) for one in guesses)
    return WithSegment(event, segment, _SHARE * longest, radius)


def _event(patch: Patch, guesses: Sequence[Guess], other: Itinerary) -> tuple[Tube, int]:
    """Orbit with a segment of duration 0 at the patch's gamma, and that segment.

    Beyond it is the `other` itinerary.
    """
    shooting, columns = min(guesses, key=lambda one: min(_durations(one)))
    itinerary, n = shooting.itinerary, len(shooting.itinerary)
    if n < 3 or len(other) < 2:
        raise Unproved("search", "an itinerary without switches")
    for _, segment in sorted(zip(_durations(Guess(shooting, columns)), range(n), strict=True)):
        try:
            beyond = Itinerary.of(_beyond(itinerary, segment), itinerary.period_number).cyclic
        except InvalidInput:
            continue
        if beyond == other:
            column, gamma = shooting.durations[segment], shooting.parameter("gamma")
            guess = list(columns)
            guess[column], guess[gamma] = arb(0), ball(patch.middle[1])
            return enclose(shooting, guess, {column: 0.0, gamma: 0.0}), segment
    raise Unproved("search", "the itineraries do not differ in one segment")


def _durations(one: Guess) -> list[float]:
    return [float(one.columns[at]) for at in one.shooting.durations]


def _beyond(itinerary: Itinerary, segment: int) -> list[int]:
    """Fields beyond the curve on which a segment has the duration 0."""
    n = len(itinerary)
    exchange = swap_segment(itinerary, np.ones(n + 4), segment)
    if exchange is not None:
        return list(exchange.itinerary.fields)
    before, _, after = around(itinerary, segment)
    gone = {segment, (segment + 1) % n} if before == after else {segment}
    return [field for k, field in enumerate(itinerary.fields) if k not in gone]
