"""Changes of an itinerary where an inequality fails: segments inserted, removed or swapped.

Close to a tangency, a landing on the edge of stick, or a corner, the failing guard determines the
inserted segment. The event is the orbit on which that segment has the duration 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import (
    BEFORE_END,
    DURATION,
    EDGE,
    KINKS,
    LANDING,
    MINIMUM,
    Inequality,
)
from capsule_sym._orbits.shooting.equations import ShootingSystem, Vector
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift, field_of, level
from capsule_sym._parameters import Scene

NO_DURATION = 1e-9  # largest duration of a segment that counts as 0


class Exchange(NamedTuple):
    """Another itinerary for the same orbit, its unknowns, and the new indices of the segments.

    `kept` has for every segment of the old itinerary its index in `itinerary`; None if the segment
    no longer exists.
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
) -> tuple[Exchange, int]:
    """Itinerary with one or two segments of duration 0 where an inequality is 0, and their index.

    It is an `Exchange`, and the index that of the first. `z` may be an estimate; `system` is near
    it. Raises InvalidInput if the fields are no itinerary.
    """
    fields, i, zero = itinerary.fields, failed.segment, numbers.number(0)
    f, following = fields[i], itinerary.neighbour(i + 1)
    if failed.kind in (LANDING, EDGE, BEFORE_END):
        between = _between(itinerary, system, failed, f, following)
        gone = len(between)
        longer = _itinerary((*fields[: i + 1], *between, *fields[i + 1 :]), itinerary)
        kept = tuple(k + gone * (k > i) for k in range(len(itinerary)))
        return Exchange(longer, np.array([*z[: 5 + i], *(gone * [zero]), *z[5 + i :]]), kept), i + 1
    comes = _comes(itinerary.scene, f, failed.guard)
    if itinerary.segments[0].guard is None:
        x_r, v_r = _inside(numbers, system, 0, failed.time)
        angle = system.flows[0].angle + system.flows[0].c.omega * failed.time
        start = np.array([x_r, v_r, z[2], angle, zero, z[4]])
        return Exchange(_itinerary((comes, f), itinerary), start, (1,)), 0
    longer = _itinerary((*fields[:i], f, comes, f, *fields[i + 1 :]), itinerary)
    rest = z[4 + i] - failed.time
    durations = [*z[4 : 4 + i], failed.time, zero, rest, *z[5 + i :]]
    kept = tuple(k + 2 * (k > i) for k in range(len(itinerary)))
    return Exchange(longer, np.array([*z[:4], *durations]), kept), i + 1


def _between(
    itinerary: Itinerary, system: ShootingSystem, failed: Inequality, f: int, following: int
) -> tuple[int, ...]:
    """Fields inserted between two others where a landing, or a condition at an edge, fails."""
    scene, ways = itinerary.scene, (drift(f, itinerary.scene), drift(following, itinerary.scene))
    slips = 1 if failed.guard is Guard.UPPER else -1
    if failed.kind == LANDING:
        return (_like(scene, f, drift=0 if ways[1] else -ways[0]),)
    if failed.kind == EDGE and ways[0]:
        if sticks_before_edge(system, failed.segment):
            return (_like(scene, f, drift=0),)
        slips = -ways[0]
    elif failed.kind == EDGE:
        return (_like(scene, following, drift=0 if ways[1] else slips),)
    # A slip before the edge continues beyond it, unless such a slip follows.
    before = _like(scene, f, drift=slips)
    return (before,) if ways[1] == slips else (before, _like(scene, following, drift=slips))


def sticks_before_edge(system: ShootingSystem, segment: int) -> bool:
    """True if a drift that stopped at the end of its segment would stick there."""
    flow = system.flows[segment]
    c, (x_r, v_r, _) = flow.c, flow.end
    pull = c.pull(x_r, x_r - c.own_stop(), v_r)
    return all(c.friction_guard(sign, pull) > 0 for sign in (1, -1))


def _like(scene: Scene, field: int, *, touches: int | None = None, drift: int | None = None) -> int:
    """Field equal to another one, except for the given contact or drift."""
    known = scene.facts.FIELDS[field]
    touches, drift = known[0] if touches is None else touches, known[1] if drift is None else drift
    return field_of(scene, touches, drift, level(field, scene))


def _comes(scene: Scene, field: int, guard: Guard | None) -> int:
    """Field that a segment of F`field` touches if this guard has a minimum of 0."""
    if guard is Guard.GAP:
        return _like(scene, field, touches=0 if contact(field, scene) else 1)
    if guard is Guard.BACK:
        return _like(scene, field, touches=2)
    if guard is Guard.DRIFT:
        return _like(scene, field, drift=0)
    return _like(scene, field, drift=1 if guard is Guard.UPPER else -1)


def swap_segment(
    itinerary: Itinerary, z: Vector, segment: int, system: ShootingSystem | None = None
) -> Exchange | None:
    """Itinerary with the two switches at a segment of duration 0 in the other order.

    One of contact, drift and the drive's level changes at its start, others at its end. None in
    other cases, if a slip meets an edge at which the pull on the capsule jumps, and if two segments
    vanish there. If the drive reacts, `system` decides if a drift that lands before the edge
    reverses.
    """
    scene, fields = itinerary.scene, itinerary.fields
    if _pair(itinerary, z, segment) is not None:
        return None
    before, during, after = (_parts(scene, field) for field in around(itinerary, segment))
    first = {k for k in range(3) if before[k] != during[k]}
    second = {k for k in range(3) if during[k] != after[k]}
    comes = [b + a - d for b, d, a in zip(before, during, after, strict=True)]
    if (first, second) == ({1}, {1, 2}) and before[1] == -after[1]:
        comes[1] = before[1]  # beyond the edge that breaks rest, the drift reverses
    elif first & second:
        return None
    if scene.facts.REACTS and {1, 2} in (first | second, first, second):
        if len(first) == len(second) and not before[1]:
            return None
        if first == {2}:  # before the edge the drift lands, and sticks or reverses
            if system is None or sticks_before_edge(system, segment - 1):
                comes[1] = 0
            elif not after[1]:
                return _turned_round(itinerary, z, segment, before, after)
    passed = field_of(scene, *comes)
    if segment == 0 and before[2] > after[2]:  # the orbit starts on the other side of a rise
        z = z.copy()
        z[3] = z[3] + math.tau * (comes[2] - during[2])
    other = _itinerary((*fields[:segment], passed, *fields[segment + 1 :]), itinerary)
    return Exchange(other, z, tuple(range(len(itinerary))))


def _turned_round(
    itinerary: Itinerary,
    z: Vector,
    segment: int,
    before: tuple[int, int, int],
    after: tuple[int, int, int],
) -> Exchange:
    """Itinerary in which a drift reverses before an edge, and lands beyond it at once."""
    scene, fields = itinerary.scene, itinerary.fields
    pair = (field_of(scene, part[0], -before[1], part[2]) for part in (before, after))
    other = _itinerary((*fields[:segment], *pair, *fields[segment + 1 :]), itinerary)
    kept = tuple(k + (k > segment) for k in range(len(itinerary)))
    return Exchange(other, np.insert(z, 5 + segment, z[4 + segment]), kept)


def _parts(scene: Scene, field: int) -> tuple[int, int, int]:
    """Contact, drift and level of a field."""
    return contact(field, scene), drift(field, scene), level(field, scene)


def remove_segment(
    numbers: Backend, itinerary: Itinerary, z: Vector, system: ShootingSystem, segment: int
) -> tuple[Exchange, Inequality]:
    """Itinerary without a segment of duration 0, and its inequality that is 0 on this orbit.

    It begins at the segment before. Equal neighbours become one segment; a pair of slip and rest
    goes as a whole. Raises InvalidInput if the remaining fields are no itinerary.
    """
    n, (before, _, after) = len(itinerary), around(itinerary, segment)
    pair = _pair(itinerary, z, segment)
    if pair is not None:
        return _without_pair(numbers, itinerary, z, system, pair)
    merged = before == after
    if n == 2 and merged:
        return _alone(numbers, itinerary, system, segment)
    turned = rotated(numbers, itinerary, z, system, segment - 1)
    fields, z = turned.itinerary.fields, turned.z
    gone = 2 if merged else 1
    if merged:
        durations = [z[4] + z[5] + z[6], *z[7:]]
        kind, guard = MINIMUM, turned.itinerary.segments[0].guard
    else:
        durations = [z[4], *z[6:]]
        kind, guard = LANDING, None
        scene = itinerary.scene
        levels, ways = zip(*((level(f, scene), drift(f, scene)) for f in fields[:3]), strict=True)
        if levels[0] != levels[-1]:
            kind, guard = EDGE, Guard.DRIFT
            if not ways[0]:
                guard = Guard.UPPER if sum(ways) > 0 else Guard.LOWER
    places = [None, None, None, *range(1, n - 2)] if merged else [0, None, *range(1, n - 1)]
    kept = tuple(places[k] for k in turned.kept if k is not None)
    shorter = _itinerary((fields[0], *fields[1 + gone :]), itinerary)
    inequality = Inequality(kind, 0, guard, numbers.number(0), z[4])
    return Exchange(shorter, np.array([*z[:4], *durations]), kept), inequality


def zero_segments(itinerary: Itinerary, z: Vector, segment: int) -> tuple[int, ...]:
    """Segment of duration 0, or two: a slip before an edge or a stop, and its rest beyond."""
    first = _pair(itinerary, z, segment)
    return (segment,) if first is None else (first, (first + 1) % len(itinerary))


def is_kink(itinerary: Itinerary, vanishing: tuple[int, ...]) -> bool:
    """True if two segments of duration 0 are a slip that starts without a jump of the pull."""
    jumps = itinerary.scene.facts.REACTS and itinerary.segments[vanishing[0]].guard is Guard.EDGE
    return len(vanishing) > 1 and not jumps


def _pair(itinerary: Itinerary, z: Vector, segment: int) -> int | None:
    """First of two segments of zero duration, a slip before an edge or a stop and its rest."""
    n, scene = len(itinerary), itinerary.scene
    for k in (segment, segment - 1):
        both = itinerary.segments[k], itinerary.segments[(k + 1) % n]
        way = drift(both[0].field, scene)
        if (
            n > 3
            and both[0].guard in KINKS
            and way
            and drift(itinerary.neighbour(k % n - 1), scene) != way
            and both[1].guard is Guard.DRIFT
            and max(z[4 + k % n], z[4 + (k + 1) % n]) < NO_DURATION
        ):
            return k % n
    return None


def _without_pair(
    numbers: Backend, itinerary: Itinerary, z: Vector, system: ShootingSystem, first: int
) -> tuple[Exchange, Inequality]:
    """Itinerary without such a pair, as in `remove_segment`.

    A drift before it that is at rest after it continues beyond the edge, and lands there at once.
    """
    scene, n = itinerary.scene, len(itinerary)
    turned = rotated(numbers, itinerary, z, system, first - 1)
    fields, z = turned.itinerary.fields, turned.z
    ways = drift(fields[0], scene), drift(fields[1], scene)
    lands = ways[0] and not drift(fields[3], scene)
    between = (_like(scene, fields[3], drift=ways[0]),) if lands else ()
    durations = [z[4], *(len(between) * [numbers.number(0)]), *z[7:]]
    gone = 2 - len(between)
    places = [0, None, None, *range(3 - gone, n - gone)]
    kept = tuple(places[k] for k in turned.kept if k is not None)
    shorter = _itinerary((fields[0], *between, *fields[3:]), itinerary)
    guard = Guard.UPPER if ways[1] > 0 else Guard.LOWER
    kind, guard = (EDGE, Guard.DRIFT) if ways[0] else (BEFORE_END, guard)
    if lands:
        held = Inequality(DURATION, 1, None, numbers.number(0), z[4])
    else:
        held = Inequality(kind, 0, guard, numbers.number(0), z[4])
    return Exchange(shorter, np.array([*z[:4], *durations]), kept), held


def _alone(
    numbers: Backend, itinerary: Itinerary, system: ShootingSystem, segment: int
) -> tuple[Exchange, Inequality]:
    """Itinerary of the one other segment, from the forcing angle 0."""
    flow, guard = system.flows[1 - segment], itinerary.segments[1 - segment].guard
    _, angle = numbers.turns(flow.angle % numbers.full_turn)
    wait = (numbers.full_turn - angle) / flow.c.omega
    x_r, v_r = _inside(numbers, system, 1 - segment, wait)
    zero = numbers.number(0)
    alone = _itinerary((flow.segment.field,), itinerary)
    change = Exchange(alone, np.array([x_r, v_r, zero, zero, flow.h]), (None, None))
    # A touch of the guard before or after is reduced to the period from the angle 0.
    turns = math.floor((flow.h - wait) / flow.h)
    if itinerary.mirrored and turns % 2:
        guard = itinerary.image(itinerary.segments[1 - segment]).guard
    return change, Inequality(MINIMUM, 0, guard, zero, flow.h - wait - turns * flow.h)


def rotated(
    numbers: Backend, itinerary: Itinerary, z: Vector, system: ShootingSystem, segment: int
) -> Exchange:
    """The same orbit from another segment on; with edges, at an angle of the first turn."""
    n = len(itinerary)
    segment %= n
    flow = system.flows[segment]
    angle = flow.angle - itinerary.turns(segment) * numbers.full_turn
    start = np.array([*flow.start, angle, *z[4 + segment :], *z[4 : 4 + segment]])
    return Exchange(itinerary.rotated(segment), start, tuple((k - segment) % n for k in range(n)))


def _inside(
    numbers: Backend, system: ShootingSystem, segment: int, h: Number
) -> tuple[Number, Number]:
    """x_r and v_r at a duration h after a segment's start."""
    flow = system.flows[segment]
    values = numbers.kernels.flow(flow.c, flow.closed, h)
    return flow.closed.x_r + numbers.number(values[0]), numbers.number(values[1])


def _itinerary(fields: tuple[int, ...], like: Itinerary) -> Itinerary:
    return Itinerary.of(fields, like.period_number, like.mirrored, like.scene)
