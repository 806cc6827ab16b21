"""Inequalities of an orbit's itinerary; the orbit is a motion of the map if all hold."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.result import by_fields
from capsule_sym._orbits.shooting.equations import SegmentFlow, ShootingSystem
from capsule_sym._orbits.shooting.extrema import extrema, minima
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym.generated.interface import Quantity

DURATION, MINIMUM, LANDING = "duration", "minimum", "landing"
EDGE, BEFORE_END = "edge", "before end"
KINKS = (Guard.EDGE, Guard.GAP, Guard.BACK)
"""Guards beyond which other forces act."""
_ROUNDINGS = 32  # in a duration, of the longest one; in a landing's margin, of the friction
FAR = 1e9  # distance of a stop that no motion reaches
_NEAR = 1e-5  # share of a segment within which a minimum counts as that at its end


class Inequality(NamedTuple):
    """A quantity that is positive if the itinerary is admissible; dimensionless.

    The meaning of `value` depends on `kind`:

    - "duration": duration of segment `segment`;
    - "minimum": value of guard `guard` at one of its minima, at the time `time` inside the segment;
    - "landing": where the segment ends with v_c = 0, distance of the force from the friction bound,
      inside it if stick follows, beyond it if the drift is reversed;
    - "edge": where the segment ends at an edge with a jump of the pull on the capsule, distance of
      guard `guard` from 0, or beyond 0 if the edge breaks rest;
    - "before end": distance of the guard from 0 at rest, just before an edge or a stop.

    `segment` counts from 0 as the itinerary's own segments do; those of the mirrored half follow.
    `time` is for every kind but "minimum" the duration of the segment.
    """

    kind: str
    segment: int
    guard: Guard | None
    value: Number
    time: Number

    def __repr__(self) -> str:
        return by_fields(self)

    def named(self, itinerary: Itinerary) -> str:
        """Name of the inequality; segments count from 1, from the start of the cyclic itinerary."""
        what = f" of {self.guard.value}" if self.guard else ""
        itinerary = itinerary.whole
        number = (self.segment - itinerary.first) % len(itinerary) + 1
        return f"{self.kind}{what} in segment {number}, F{itinerary.fields[self.segment]}"


def inequalities(
    numbers: Backend,
    itinerary: Itinerary,
    system: ShootingSystem,
    zero_segments: Collection[int] = (),
) -> list[Inequality]:
    """All inequalities of an itinerary at a solution of its equations.

    The minima are all interior minima of a segment, with proof; at its ends the itinerary's
    equations and the other inequalities bound the guards. The segments `zero_segments` have the
    duration 0; inequalities that are 0 with them are left out. Any other segment of duration <= 0
    has only the inequality of its duration, and so have the segments before and after it. If the
    motion is its own mirror image, pairs are evaluated in the first half, the gap of a single stop
    in both; that gap is free if the stop's spring has no stiffness.
    """
    found = []
    n, flows = len(itinerary), system.flows
    alone = itinerary.mirrored and len(itinerary.scene.facts.STOPS) == 1
    stiffness = itinerary.scene.facts.STOPS[0][1]
    hidden = _ROUNDINGS * numbers.unit * max(flow.h for flow in flows)
    # A duration hidden by rounding is not known to be negative.
    durations = [abs(flow.h) if abs(flow.h) <= hidden else flow.h for flow in flows]
    for i, flow in enumerate(flows):
        if i in zero_segments:
            continue
        before, after = (i - 1) % n, (i + 1) % n
        found.append(Inequality(DURATION, i, None, durations[i], flow.h))
        # A segment of negative duration invalidates the inequalities of its neighbours.
        if any(durations[k] <= 0 for k in (before, i, after) if k not in zero_segments):
            continue
        if flow.segment.guard is Guard.DRIFT and after not in zero_segments:
            landing, c = _landing(itinerary, flows, i), flow.c
            faint = _ROUNDINGS * numbers.unit * abs(c.friction_at(c.drift))
            # Nor is the margin of a landing on stick, which is 0 where the stick has no duration.
            if not flows[after].c.drift and abs(landing) <= faint:
                landing = faint
            found.append(Inequality(LANDING, i, None, landing, flow.h))
        if flow.segment.guard in KINKS and after not in zero_segments:
            found += _at_end(itinerary, flows, i)
        if alone and getattr(flow.c, stiffness) != 0:
            found += _gaps(numbers, itinerary, flow, i)
        for guard, time, value in minima(numbers, flow, itinerary.vanishing(i)):
            if alone and guard is Guard.GAP:
                continue
            near = _NEAR * flow.h
            if (before in zero_segments and time < near) or (
                after in zero_segments and flow.h - time < near
            ):
                continue
            # A drift that starts in the wrong direction fails by the landing or edge before it.
            if guard is not Guard.DRIFT or not _reversed_wrongly(itinerary, flows, before):
                found.append(Inequality(MINIMUM, i, guard, value, time))
    return found


def _at_end(itinerary: Itinerary, flows: Sequence[SegmentFlow], i: int) -> Iterator[Inequality]:
    """Inequalities at the edge or the stop that ends a segment, if there are any.

    If the drive reacts, the pull on the capsule jumps at an edge. Elsewhere its rate jumps: at rest
    the pull may be at an extremum there; for a drift there is none.
    """
    flow, following = flows[i], flows[(i + 1) % len(flows)]
    c, after, sides = flow.c, following.c, ((Guard.UPPER, -1), (Guard.LOWER, 1))
    x_r, v_r, v_c = flow.end
    pulled = c.pull(x_r, x_r - c.own_stop(), v_r, _turned(itinerary, flows, i)[0])
    if not (flow.segment.guard is Guard.EDGE and itinerary.scene.facts.REACTS):
        before, beyond = (0, 0) if c.drift else pull_rates(itinerary, flows, i)
        for guard, sign in sides:
            if sign * before < 0 < sign * beyond:
                yield Inequality(BEFORE_END, i, guard, c.friction_guard(sign, pulled), flow.h)
        return
    image = _image(itinerary, flows, i)
    if c.drift:
        margin = c.margin_at(x_r, x_r - c.own_stop(), v_r)
        if c.drift * margin < 0 < c.drift * image * following.closed.margin:
            yield Inequality(EDGE, i, Guard.DRIFT, c.drift * v_c, flow.h)
        return
    pull = image * (following.closed.margin + after.friction)
    for guard, sign in sides:
        yield Inequality(BEFORE_END, i, guard, c.friction_guard(sign, pulled), flow.h)
        within = after.friction_guard(sign, pull)
        if not after.drift:
            yield Inequality(EDGE, i, guard, within, flow.h)
        elif image * after.drift == -sign:
            yield Inequality(EDGE, i, guard, -within, flow.h)


def _image(itinerary: Itinerary, flows: Sequence[SegmentFlow], i: int) -> int:
    """-1 if the image of the first segment follows a segment, else 1."""
    return -1 if itinerary.mirrored and i == len(flows) - 1 else 1


def _turned(itinerary: Itinerary, flows: Sequence[SegmentFlow], i: int) -> tuple[Number, Number]:
    """Cosine and sine of the forcing angle where a segment ends."""
    image, start = _image(itinerary, flows, i), flows[(i + 1) % len(flows)].closed
    return image * start.cos_theta, image * start.sin_theta


def pull_rates(itinerary: Itinerary, flows: Sequence[SegmentFlow], i: int) -> tuple[Number, Number]:
    """Rates of the pull on the capsule before and after the end of a segment."""
    following, (cosine, sine) = flows[(i + 1) % len(flows)], _turned(itinerary, flows, i)
    image, rates = _image(itinerary, flows, i), []
    for c, (x_r, v_r, _), side in (
        (flows[i].c, flows[i].end, 1),
        (following.c, following.start, image),
    ):
        v_rate = c.v_rate(x_r, x_r - c.own_stop(), v_r, side * cosine)
        rates.append(side * c.pull_rate(v_r, v_rate, side * sine))
    return rates[0], rates[1]


def _gaps(
    numbers: Backend, itinerary: Itinerary, flow: SegmentFlow, segment: int
) -> Iterator[Inequality]:
    """Least gaps in a segment and in its mirror image."""
    for kind, time, value in extrema(numbers, flow, Quantity.GAP, itinerary.vanishing(segment)):
        if kind < 0:
            yield Inequality(MINIMUM, segment, Guard.GAP, -value, time)
            continue
        value = value + 2 * flow.c.own_stop()
        if len(itinerary.whole) == 1:
            yield Inequality(MINIMUM, segment, Guard.GAP, value, time + flow.h)
        else:
            yield Inequality(MINIMUM, segment + len(itinerary), Guard.GAP, value, time)


def tightest(orbit: Orbit) -> Inequality:
    """Inequality of an orbit's itinerary with the least value.

    On a motion of the map all inequalities are above 0. The least one shows how near the orbit is
    to a change of its itinerary. It is a duration, a length, a velocity or a force, by its kind and
    guard; all are compared by their dimensionless values.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True.

    Returns
    -------
    Inequality
        The inequality. Its `value` is dimensionless, and its meaning depends on `kind`.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.

    See Also
    --------
    is_admissible : the test by a run of the map.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> least = cs.orbits.tightest(orbit)
    >>> print(least.named(orbit.itinerary), f"{least.value:.6f}")
    minimum of lower in segment 4, F2 0.030337
    """
    held = inequalities(orbit.numbers, orbit.itinerary, orbit.system)
    return min(held, key=lambda one: one.value)


def _reversed_wrongly(itinerary: Itinerary, flows: Sequence[SegmentFlow], before: int) -> bool:
    flow, after = flows[before], flows[(before + 1) % len(flows)]
    if flow.segment.guard is Guard.EDGE:
        return bool(flow.c.drift == 0 and after.c.drift * after.closed.margin <= 0)
    return flow.segment.guard is Guard.DRIFT and _landing(itinerary, flows, before) <= 0


def _landing(itinerary: Itinerary, flows: Sequence[SegmentFlow], segment: int) -> Number:
    flow, following = flows[segment], flows[(segment + 1) % len(flows)]
    force = following.closed.margin + following.c.friction  # the pull on the capsule
    if itinerary.mirrored and segment % len(flows) == len(flows) - 1:
        force = -force
    beyond = flow.c.friction_guard(flow.c.drift, force)
    return -beyond if following.c.drift else beyond


def is_admissible(orbit: Orbit) -> bool:
    """True if the certified map, run from a state of the orbit, has the same itinerary.

    The run starts in the middle of the longest segment, away from all guards, and takes one
    excitation period more than the orbit. If no stop's spring has stiffness, an itinerary without
    contact represents those with contact.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True. A first half, as `half_orbit` gives, stands for its
        whole orbit.

    Returns
    -------
    bool
        True if the orbit is a motion of the map.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`, and for parameters outside the ranges of a
        run.

    See Also
    --------
    tightest : the inequality with the least value.
    solve_itinerary : orbit of a given itinerary.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> cs.orbits.is_admissible(orbit)
    True
    >>> far = cs.orbits.solve_itinerary(cs.Parameters(alpha=2.0), orbit.itinerary, orbit.z)
    >>> far.success, cs.orbits.is_admissible(far)
    (True, False)
    """
    fields = tuple(segment.field for segment in rerun(orbit).segments)
    expected = orbit.itinerary.rotated(_longest(orbit)).whole.fields
    if len(expected) == 1:
        return fields == expected
    # The run begins in the middle of a segment, whose first half comes last, before the next one.
    cycle = (*expected, *expected[:2])
    return len(fields) > len(expected) and fields[: len(cycle)] == cycle[: len(fields)]


def rerun(orbit: Orbit) -> Trajectory:
    """Run of the certified map over the orbit's periods and one more.

    It starts in the middle of the longest segment, away from all guards. Stops without stiffness
    change nothing: an orbit without contact may pass them, which are then out of reach.
    """
    parameters, scene = orbit.parameters, orbit.scene
    touches = any(contact(field, scene) for field in orbit.itinerary.fields)
    if not touches and not any(
        getattr(parameters, stiffness) for _, stiffness in scene.facts.STOPS
    ):
        parameters = parameters.replace(**{distance: FAR for distance, _ in scene.facts.STOPS})
    state, angle = middle(orbit, orbit.system.flows[_longest(orbit)])
    phase = min(angle / parameters.omega, math.nextafter(parameters.period, 0.0))
    return simulate(parameters, state, phase, orbit.itinerary.period_number + 1)


def _longest(orbit: Orbit) -> int:
    return max(range(len(orbit.itinerary)), key=lambda i: float(orbit.system.flows[i].h))


def middle(orbit: Orbit, flow: SegmentFlow) -> tuple[tuple[float, float, float], float]:
    """State in the middle of a segment, and the forcing angle there in [0, 2 pi)."""
    with backend("numpy", orbit.scene) as numbers:
        h = float(flow.h) / 2
        c = type(flow.c)(*map(float, flow.c))
        closed = type(flow.closed)(*map(float, flow.closed))
        position, v_r, *change = numbers.kernels.flow(c, closed, h)
        v_c = closed.v_c + change[0] if c.drift else 0.0
        return (closed.x_r + position, float(v_r), v_c), float(flow.angle + c.omega * h) % math.tau
