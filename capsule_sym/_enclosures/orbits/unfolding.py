"""How the segment that is inserted at a bifurcation grows: the coefficient of its normal form.

Beside the bifurcation alpha is a function of the segment's duration h, and
alpha - alpha* = c h^order to leading order: linear where two guards meet, quadratic where one is
touched, so that h grows like a square root. What is enclosed is (alpha - alpha*)/h^order at a small
h, where the same orbit is proved to go on from h = 0; it is c up to the order of h.
"""

from __future__ import annotations

from capsule_sym._enclosures.numbers.balls import Ball, Unproved, arb
from capsule_sym._enclosures.orbits.krawczyk import Tube, enclose
from capsule_sym._enclosures.orbits.proof import held

AHEAD = 1e-12  # of the duration; its square is far above the roundings


def growth(tube: Tube, segment: int, order: int, name: str) -> Ball:
    """The coefficient of an event's tube for the parameter `name`; raises Unproved.

    It is a ball without 0: it is proved that the segment is there on one side only, and on which.
    """
    shooting, event = tube.shooting, tube.hull()
    column, at = shooting.durations[segment], shooting.parameter(name)
    between, ahead = list(event), list(event)
    between[column], ahead[column] = arb(AHEAD) / 2, arb(AHEAD)
    fixed = held(shooting)
    whole = enclose(shooting, between, {**fixed, column: AHEAD / 2 * (1 + 2.0**-50)})
    there = enclose(shooting, ahead, {**fixed, column: 0.0}).hull()
    if not (whole.holds(event) and whole.holds(there)):
        raise Unproved("unfolding", "the orbit with a short segment is not seen to be the event's")
    found = (there[at] - event[at]) / ahead[column] ** order
    if found.contains(0):
        raise Unproved("unfolding", "on which side the segment is inserted is open")
    return found
