"""The inequalities of an orbit's itinerary: its motion has that itinerary where all hold."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import SegmentFlow, ShootingSystem
from capsule_sym._orbits.shooting.extrema import extrema, minima
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym.generated.capsule.interface import Quantity

DURATION, MINIMUM, LANDING = "duration", "minimum", "landing"
_ROUNDINGS = 32  # in a duration, of the longest one
_NEAR = 1e-5  # share of a segment within which a minimum is that at its end


class Inequality(NamedTuple):
    """A quantity that is positive where the itinerary is admissible; dimensionless.

    `kind` is "duration": that of segment `segment`; "minimum": the least of guard `guard` at the
    time `time` inside the segment; "landing": where the segment ends with v_c = 0, how far the
    force is within the friction bound if stick follows, or beyond it if the drift is reversed.
    """

    kind: str
    segment: int
    guard: Guard | None
    value: Number
    time: Number

    def named(self, itinerary: Itinerary) -> str:
        """The inequality in words; segments count from 1, where the paper begins an itinerary."""
        what = f" of {self.guard.value}" if self.guard else ""
        itinerary = itinerary.whole
        number = (self.segment - itinerary.first) % len(itinerary) + 1
        return f"{self.kind}{what} in segment {number}, F{itinerary.fields[self.segment]}"


def inequalities(
    numbers: Backend, itinerary: Itinerary, system: ShootingSystem, zero_segment: int | None = None
) -> list[Inequality]:
    """All inequalities of an itinerary at a solution of its equations, shape (many,).

    The minima are those inside the segment, proved to be all; at its ends the itinerary's equations
    and the other inequalities hold the guards. Next to a segment of negative duration there are
    none. The segment with index `zero_segment`, if given, has the duration 0: what is 0 with it is
    left out. Of a motion that is its own mirror image what comes in pairs is looked at in the first
    half, the gap in both; where beta = 0 the gap is free.
    """
    found = []
    n, flows = len(itinerary), system.flows
    hidden = _ROUNDINGS * numbers.unit * max(flow.h for flow in flows)
    for i, flow in enumerate(flows):
        if i == zero_segment:
            continue
        before, after = (i - 1) % n, (i + 1) % n
        # Where rounding hides a duration it is not known to be below 0.
        duration = abs(flow.h) if abs(flow.h) <= hidden else flow.h
        found.append(Inequality(DURATION, i, None, duration, flow.h))
        # A segment of negative duration takes the inequalities of its neighbours with it.
        if any(flows[k].h <= 0 for k in (before, i, after) if k != zero_segment):
            continue
        if flow.segment.guard is Guard.DRIFT and after != zero_segment:
            found.append(Inequality(LANDING, i, None, _landing(itinerary, flows, i), flow.h))
        if itinerary.mirrored and flow.c.beta != 0:
            found += _gaps(numbers, itinerary, flow, i)
        for guard, time, value in minima(numbers, flow, _zeros(itinerary, i)):
            if itinerary.mirrored and guard is Guard.GAP:
                continue
            near = _NEAR * flow.h
            if (before == zero_segment and time < near) or (
                after == zero_segment and flow.h - time < near
            ):
                continue
            # A drift that sets off the wrong way fails by the landing before it.
            if guard is not Guard.DRIFT or not _reversed_wrongly(itinerary, flows, before):
                found.append(Inequality(MINIMUM, i, guard, value, time))
    return found


def _gaps(
    numbers: Backend, itinerary: Itinerary, flow: SegmentFlow, segment: int
) -> Iterator[Inequality]:
    """The least gaps in a segment and in its mirror image."""
    for kind, time, value in extrema(numbers, flow, Quantity.GAP, _zeros(itinerary, segment)):
        if kind < 0:
            yield Inequality(MINIMUM, segment, Guard.GAP, -value, time)
            continue
        value = value + 2 * flow.c.delta
        if len(itinerary.whole) == 1:
            yield Inequality(MINIMUM, segment, Guard.GAP, value, time + flow.h)
        else:
            yield Inequality(MINIMUM, segment + len(itinerary), Guard.GAP, value, time)


def tightest(orbit: Orbit) -> Inequality:
    """The inequality of an orbit's itinerary with the least value."""
    with backend(orbit.backend) as numbers:
        return min(inequalities(numbers, orbit.itinerary, orbit.system), key=lambda one: one.value)


def _zeros(itinerary: Itinerary, segment: int) -> dict[Guard, int]:
    """The guards that vanish at a segment's start, by the guard that ended the segment before."""
    before = itinerary.segments[segment - 1].guard
    if before is Guard.GAP:
        return {Guard.GAP: 1}
    if before is Guard.DRIFT:
        return {Guard.DRIFT: 1}
    return {Guard.DRIFT: 2} if before else {}


def _reversed_wrongly(itinerary: Itinerary, flows: Sequence[SegmentFlow], before: int) -> bool:
    return flows[before].segment.guard is Guard.DRIFT and _landing(itinerary, flows, before) <= 0


def _landing(itinerary: Itinerary, flows: Sequence[SegmentFlow], segment: int) -> Number:
    flow, following = flows[segment], flows[(segment + 1) % len(flows)]
    force = following.closed.margin + following.c.friction
    if itinerary.mirrored and segment % len(flows) == len(flows) - 1:
        force = -force
    beyond = flow.c.friction_guard(flow.c.drift, force)
    return -beyond if following.c.drift else beyond


def is_admissible(orbit: Orbit) -> bool:
    """Whether the certified map, run for the orbit's periods, goes through the same itinerary.

    Where beta = 0 an itinerary without contact stands for those with any.
    """
    fields = tuple(segment.field for segment in rerun(orbit).segments)
    if orbit.parameters.beta == 0 and not any(map(contact, orbit.itinerary.fields)):
        fields = tuple(field for field, _ in groupby(2 - drift(field) for field in fields))
    expected = orbit.itinerary.rotated(_longest(orbit)).fields
    if len(expected) == 1:
        return fields == expected
    return fields[: len(expected) + 1] == (*expected, expected[0])


def rerun(orbit: Orbit) -> Trajectory:
    """The certified map over the orbit's periods and one more.

    It starts in the middle of the longest segment, where nothing is at its bound.
    """
    parameters = orbit.parameters
    state, angle = _middle(orbit.system.flows[_longest(orbit)])
    phase = min(angle / parameters.omega, math.nextafter(parameters.period, 0.0))
    return simulate(parameters, state, phase, orbit.itinerary.period_number + 1)


def _longest(orbit: Orbit) -> int:
    return max(range(len(orbit.itinerary)), key=lambda i: float(orbit.system.flows[i].h))


def _middle(flow: SegmentFlow) -> tuple[tuple[float, float, float], float]:
    """State in the middle of a segment, and the forcing angle there in [0, 2 pi)."""
    with backend("numpy") as numbers:
        h = float(flow.h) / 2
        c = type(flow.c)(*map(float, flow.c))
        closed = type(flow.closed)(*map(float, flow.closed))
        position, v_r, *change = numbers.kernels.flow(c, closed, h)
        v_c = closed.v_c + change[0] if c.drift else 0.0
        return (closed.x_r + position, float(v_r), v_c), float(flow.angle + c.omega * h) % math.tau
