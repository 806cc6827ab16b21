"""How an itinerary changes where an inequality fails: a segment of duration 0 comes or goes.

Close to a tangency, a landing on the edge of stick, or a corner, the flow leaves no choice: the
segment that comes in is given by the guard that fails, and the itinerary that holds it contains the
event as the orbit on which that segment has the duration 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import LANDING, MINIMUM, Inequality
from capsule_sym._orbits.shooting.equations import ShootingSystem, Vector
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift
from capsule_sym.generated.capsule.facts import FIELD_OF


class Change(NamedTuple):
    """Another itinerary for the same orbit, its unknowns, and where the segments have gone.

    `kept` gives for every segment of the itinerary before its index in `itinerary`; None if it is
    no segment of its own any more.
    """

    itinerary: Itinerary
    z: Vector
    kept: tuple[int | None, ...]


def around(itinerary: Itinerary, segment: int) -> tuple[int, int, int]:
    """Fields of the segments before, at and after an index."""
    return (
        itinerary.neighbour(segment - 1),
        itinerary.fields[segment],
        itinerary.neighbour(segment + 1),
    )


def insert_segment(
    numbers: Backend, itinerary: Itinerary, z: Vector, system: ShootingSystem, failed: Inequality
) -> tuple[Change, int]:
    """The itinerary with the segment inserted where a MINIMUM or LANDING is 0, and that segment.

    `z` may be an estimate; `system` is near it. Raises InvalidInput where the fields are no
    itinerary.
    """
    fields, i, zero = itinerary.fields, failed.segment, numbers.number(0)
    f, following = fields[i], itinerary.neighbour(i + 1)
    if failed.kind == LANDING:
        comes = FIELD_OF[contact(f), 0 if drift(following) else -drift(f)]
        longer = _itinerary((*fields[: i + 1], comes, *fields[i + 1 :]), itinerary)
        kept = tuple(k + (k > i) for k in range(len(itinerary)))
        return Change(longer, np.array([*z[: 5 + i], zero, *z[5 + i :]]), kept), i + 1
    comes = _comes(f, failed.guard)
    if itinerary.segments[0].guard is None:
        x_r, v_r = _inside(numbers, system, 0, failed.time)
        angle = system.flows[0].angle + system.flows[0].c.omega * failed.time
        start = np.array([x_r, v_r, z[2], angle, zero, z[4]])
        return Change(_itinerary((comes, f), itinerary), start, (1,)), 0
    longer = _itinerary((*fields[:i], f, comes, f, *fields[i + 1 :]), itinerary)
    rest = z[4 + i] - failed.time
    durations = [*z[4 : 4 + i], failed.time, zero, rest, *z[5 + i :]]
    kept = tuple(k + 2 * (k > i) for k in range(len(itinerary)))
    return Change(longer, np.array([*z[:4], *durations]), kept), i + 1


def _comes(field: int, guard: Guard | None) -> int:
    """The field that a segment of F`field` touches where this guard has a minimum of 0."""
    if guard is Guard.GAP:
        return FIELD_OF[1 - contact(field), drift(field)]
    if guard is Guard.DRIFT:
        return FIELD_OF[contact(field), 0]
    return FIELD_OF[contact(field), 1 if guard is Guard.UPPER else -1]


def swap_segment(itinerary: Itinerary, z: Vector, segment: int) -> Change | None:
    """The itinerary with contact and drift changed in the other order at a segment of duration 0.

    None unless both change there.
    """
    before, during, after = around(itinerary, segment)
    if contact(before) == contact(after) or drift(before) == drift(after):
        return None
    gap_first = contact(during) != contact(before)
    first, second = (before, after) if gap_first else (after, before)
    comes = FIELD_OF[contact(first), drift(second)]
    fields = itinerary.fields
    other = _itinerary((*fields[:segment], comes, *fields[segment + 1 :]), itinerary)
    return Change(other, z, tuple(range(len(itinerary))))


def remove_segment(
    numbers: Backend, itinerary: Itinerary, z: Vector, system: ShootingSystem, segment: int
) -> tuple[Change, Inequality]:
    """The itinerary without a segment of duration 0, and the inequality that is 0 on this orbit.

    Raises InvalidInput where what is left is no itinerary.
    """
    n, (before, _, after) = len(itinerary), around(itinerary, segment)
    merged = before == after
    if n == 2 and merged:
        return _alone(numbers, itinerary, system, segment)
    turned = rotated(itinerary, z, system, segment - 1)
    fields, z = turned.itinerary.fields, turned.z
    gone = 2 if merged else 1
    if merged:
        durations = [z[4] + z[5] + z[6], *z[7:]]
        kind, guard = MINIMUM, turned.itinerary.segments[0].guard
    else:
        durations = [z[4], *z[6:]]
        kind, guard = LANDING, None
    places = [None, None, None, *range(1, n - 2)] if merged else [0, None, *range(1, n - 1)]
    kept = tuple(places[k] for k in turned.kept if k is not None)
    shorter = _itinerary((fields[0], *fields[1 + gone :]), itinerary)
    inequality = Inequality(kind, 0, guard, numbers.number(0), z[4])
    return Change(shorter, np.array([*z[:4], *durations]), kept), inequality


def _alone(
    numbers: Backend, itinerary: Itinerary, system: ShootingSystem, segment: int
) -> tuple[Change, Inequality]:
    """The itinerary of the one other segment, begun at the forcing angle 0."""
    flow, guard = system.flows[1 - segment], itinerary.segments[1 - segment].guard
    _, angle = numbers.turns(flow.angle % numbers.full_turn)
    wait = (numbers.full_turn - angle) / flow.c.omega
    x_r, v_r = _inside(numbers, system, 1 - segment, wait)
    zero = numbers.number(0)
    alone = _itinerary((flow.segment.field,), itinerary)
    change = Change(alone, np.array([x_r, v_r, zero, zero, flow.h]), (None, None))
    # Of what touches the guard before and after, the itinerary has the part from the angle 0 on.
    turns = math.floor((flow.h - wait) / flow.h)
    if itinerary.mirrored and turns % 2:
        guard = itinerary.segments[1 - segment].image.guard
    return change, Inequality(MINIMUM, 0, guard, zero, flow.h - wait - turns * flow.h)


def rotated(itinerary: Itinerary, z: Vector, system: ShootingSystem, segment: int) -> Change:
    """The same orbit begun at another segment."""
    n = len(itinerary)
    segment %= n
    flow = system.flows[segment]
    start = np.array([*flow.start, flow.angle, *z[4 + segment :], *z[4 : 4 + segment]])
    return Change(itinerary.rotated(segment), start, tuple((k - segment) % n for k in range(n)))


def _inside(
    numbers: Backend, system: ShootingSystem, segment: int, h: Number
) -> tuple[Number, Number]:
    """x_r and v_r at a duration h after a segment's start."""
    flow = system.flows[segment]
    values = numbers.kernels.flow(flow.c, flow.closed, h)
    return flow.closed.x_r + numbers.number(values[0]), numbers.number(values[1])


def _itinerary(fields: tuple[int, ...], like: Itinerary) -> Itinerary:
    return Itinerary.of(fields, like.period_number, like.mirrored)
