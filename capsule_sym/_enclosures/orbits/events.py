"""Bifurcation with a segment of duration 0: existence, type, line and nondegeneracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from capsule_sym._enclosures.numbers.balls import Ball, Matrix, Unproved, arb
from capsule_sym._enclosures.numbers.fields import Field, U, V
from capsule_sym._enclosures.orbits.krawczyk import Tube, enclose
from capsule_sym._enclosures.orbits.proof import (
    guess_of,
    held,
    prove_admissible,
    restarted,
    shooting_of,
)
from capsule_sym._enclosures.orbits.shooting import Shooting
from capsule_sym._enclosures.orbits.stability import Characteristic, characteristic, monodromy
from capsule_sym._enclosures.passage.switches import guard_row, known
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation.kinds import CORNER, GRAZING, sliding
from capsule_sym._orbits.shooting.changes import around, swap_segment
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym.generated.capsule.facts import FIELD_OF

NEAR = 1e-20  # radius of the parameters about an event within which its orbit is unique


AHEAD = 1e-12  # duration at which a coefficient is taken; its square is far above the roundings


@dataclass(frozen=True)
class Proved:
    """A bifurcation whose existence is proved, unique in its tube.

    `values` are balls around the parameters that were solved for. `order` is that of the contact:
    2 where a guard is touched, 1 where two guards vanish together or a force reaches its bound at
    a switch. `other` is the tube of the itinerary on the other side around the same orbit, at which
    the equations are regular, and `multipliers` the characteristic polynomials on both sides.
    `coefficient` is that of `growth_coefficient`: the parameter moves by coefficient times
    duration^order as the segment grows. If several `segments` have the duration 0, `other` and
    `coefficient` are None, and `multipliers` has one polynomial.
    """

    type: str
    line: str
    order: int
    values: dict[str, Ball]
    segments: tuple[int, ...]
    tube: Tube
    other: Tube | None
    multipliers: tuple[Characteristic, ...]
    coefficient: Ball | None


def place(tube: Tube, segment: int) -> tuple[str, str, int]:
    """Type, line and order of contact of the event at a segment of duration 0, proved.

    Raises Unproved if the type has no name, or if the line or its part is not proved.
    """
    itinerary, given = tube.shooting.itinerary, tube.shooting.parameters(tube.hull())
    before, during, after = around(itinerary, segment)
    state = tube.wide.nodes[segment].state
    stick = Field(FIELD_OF[contact(during), 0], given)
    if contact(before) != contact(after):
        guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
        return CORNER, _corner(guards, stick, state), 1
    if contact(during) != contact(before):
        return GRAZING, "L9", 2
    drifts = drift(before), drift(during), drift(after)
    if (kind := sliding(*drifts)) is None:
        raise Unproved("type", f"drifts {', '.join(map(str, drifts))} have no name")
    order = 2 if drifts[0] == drifts[2] else 1
    side = known(itinerary, segment, (segment,)).side
    line = f"L{(1 if side > 0 else 2) + 2 * contact(during)}"
    # The rate of the force in stick, and how far the forcing can change it: L1 to L4 have three
    # parts, where it falls, where its sign is the forcing's, and where it rises.
    rates = guard_row(stick, Guard.LOWER) * stick.A
    free = (rates * state)[0, 0] - rates[0, U] * state[U, 0]
    reach = abs(rates[0, U] * given["alpha"])
    part = 1 if free < -reach else 3 if free > reach else 2
    if part == 2 and not abs(free) < reach:
        raise Unproved("line", f"the part of {line} is open")
    return kind, f"{line}^({part})", order


def _corner(guards: set[Guard | None], stick: Field, state: Matrix) -> str:
    """The line of a corner, by the margins that the force at rest has there."""
    if Guard.UPPER in guards:
        return "O1"
    if Guard.LOWER in guards:
        return "O2"
    v, sides = state[V, 0], (Guard.UPPER, Guard.LOWER)
    upper, lower = ((guard_row(stick, guard) * state)[0, 0] for guard in sides)
    rests = upper > 0 and lower > 0
    found = {
        "L6": v > 0 and rests,
        "L5": v > 0 and upper < 0,
        "L7": v < 0 and rests,
        "L8": v < 0 and lower < 0,
        "L10": v < 0 and upper < 0,
    }
    names = [name for name, holds in found.items() if holds]
    if not names:
        raise Unproved("line", "on which line the corner lies is open")
    return names[0]


def prove_event(
    orbit: Orbit,
    segments: Sequence[int],
    free: Sequence[str],
    exact: Mapping[str, Any] | None = None,
) -> Proved:
    """The bifurcation near an orbit on which `segments` have the duration 0, `free` solved for.

    Existence and uniqueness are proved by Krawczyk's method, every other guard positive along every
    other segment, and the order of contact by the guards after division by their known zeros. For
    one segment also the equations of the other side's itinerary are proved regular, and the
    coefficient for the first of `free` is enclosed. Raises Unproved with the step that failed.
    """
    shooting = shooting_of(orbit.itinerary, orbit.values, free, exact)
    guess = guess_of(shooting, orbit)
    given = {shooting.durations[segment]: 0.0 for segment in segments}
    for at in given:
        guess[at] = arb(0)
    tube = enclose(shooting, guess, given)
    prove_admissible(tube, still=tuple(segments))
    kinds = [place(tube, segment) for segment in segments]
    other = None if len(segments) > 1 else _other(tube, segments[0])
    sides = (tube,) if other is None else (tube, other)
    hull, order = tube.hull(), max(order for _, _, order in kinds)
    return Proved(
        " and ".join(kind for kind, _, _ in kinds),
        " and ".join(line for _, line, _ in kinds),
        order,
        {name: hull[shooting.parameter(name)] for name in free},
        tuple(segments),
        tube,
        other,
        tuple(characteristic(monodromy(side.wide)) for side in sides),
        None if len(segments) > 1 else growth_coefficient(tube, segments[0], order, free[0]),
    )


def beyond(tube: Tube, segment: int) -> tuple[Shooting, list[Ball], list[int]]:
    """Equations of the other side's itinerary, the event's columns for them, and its segments.

    It is the itinerary without the segment; at a corner the one in which contact and drift change
    in the other order. The segments are identified by their places in the event's itinerary.
    """
    shooting = tube.shooting
    itinerary, hull = shooting.itinerary, tube.hull()
    n, nodes = len(itinerary), tube.wide.nodes
    durations = [hull[at] for at in shooting.durations]
    before, _, after = around(itinerary, segment)
    exchange = swap_segment(itinerary, np.ones(n + 4), segment)  # no other one has duration 0
    kept, fields = list(range(n)), list(itinerary.fields)
    if exchange is not None:
        fields = list(exchange.itinerary.fields)
    else:
        gone = {segment}
        if before == after:
            gone.add((segment + 1) % n)
            if n > 2:
                durations[segment - 1] += durations[(segment + 1) % n]
        kept = [k for k in range(n) if k not in gone] or [(segment + 1) % n]
    given = shooting.parameters(hull)
    less = Shooting(
        Itinerary.of([fields[k] for k in kept], itinerary.period_number),
        [given[name] for name in PARAMETERS],
        shooting.varied,
    )
    return less, restarted(shooting, hull, nodes, less, kept, durations), kept


def _other(tube: Tube, segment: int) -> Tube:
    """The equations on the other side, proved regular around the event's orbit."""
    less, columns, _ = beyond(tube, segment)
    radii = {at: NEAR for at in range(less.unknowns, less.columns)}
    try:
        found = enclose(less, columns, {**held(less), **radii})
    except Unproved as error:
        raise Unproved("regularity", f"on the other side, {error.detail}") from error
    if less.itinerary.segments[0].guard is None:
        # Without switches any start on the orbit is equivalent: compare at the tube's angle.
        columns[less.angle] = found.centre[less.angle]
    if not found.holds(columns):
        raise Unproved("regularity", "the event's orbit is not seen to be that of the other side")
    return found


def growth_coefficient(tube: Tube, segment: int, order: int, name: str) -> Ball:
    """Coefficient of an event's normal form for the parameter `name`; raises Unproved.

    Beside the bifurcation the parameter p is a function of the inserted segment's duration h, and
    p - p* = c h^order to leading order: linear where two guards meet, quadratic where one is
    touched, so that h grows like a square root. The ball encloses (p - p*)/h^order at a small h,
    where the same orbit is proved to continue from h = 0. It equals c up to the order of h, and is
    proved not to be 0: so the segment exists on one side only, and the side is known.
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
