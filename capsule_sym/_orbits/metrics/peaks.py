"""Largest forces along an orbit, with their derivatives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from capsule_sym._map.backend import Number
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import BY_TIME, STATES, Matrix, SegmentFlow, Vector
from capsule_sym._orbits.shooting.extrema import extrema
from capsule_sym._orbits.shooting.guards import chained
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym.generated.interface import Quantity


class _Place(NamedTuple):
    """Candidate for the largest force: its size, the segment, and the time since its start.

    A time None is the segment's end.
    """

    size: Number
    flow: SegmentFlow
    time: Number | None


def peak_of_force(forms: ClosedForms, orbit: Orbit) -> tuple[Number, Vector]:
    """Largest |P| along an orbit, and its derivatives (n + 11,)."""
    return _of_force(forms, max(_places(forms, orbit, Quantity.FORCE), key=lambda one: one.size))


def _of_force(forms: ClosedForms, place: _Place) -> tuple[Number, Vector]:
    """|P| at a place, and its derivatives (n + 11,)."""
    x_r, v_r, by = _state(forms, place)
    c = place.flow.c
    gap = x_r - c.own_stop()
    force = c.force(x_r, gap, v_r)
    side = 1 if force > 0 else -1
    return side * force, side * chained(c.force_gradient(gap, v_r), by)


def peaks_of_force(
    forms: ClosedForms, orbit: Orbit, least: float
) -> dict[tuple[int, int], tuple[Number, Vector]]:
    """Local maxima of |P| of at least a share of the largest, with derivatives (n + 11,).

    Keys are the segment and the number of the place within it, the end first.
    """
    places, found = list(_places(forms, orbit, Quantity.FORCE)), {}
    bound, segments = least * max(place.size for place in places), list(orbit.system.flows)
    numbers = dict.fromkeys(range(len(segments)), -1)
    for place in places:
        segment = next(i for i, flow in enumerate(segments) if flow is place.flow)
        numbers[segment] += 1
        if place.size >= bound:
            found[segment, numbers[segment]] = _of_force(forms, place)
    return found


def peak_of_contact(forms: ClosedForms, orbit: Orbit) -> tuple[Number, Vector]:
    """Largest force of a stop's spring along an orbit, and its derivatives (n + 11,)."""
    places = _places(forms, orbit, Quantity.GAP)
    place = max(places, key=lambda found: found.size, default=None)
    if place is None:
        return forms.numbers.number(0), 0 * orbit.system.advance_by
    x_r, _, by = _state(forms, place)
    c = place.flow.c
    gap = x_r - c.own_stop()
    side = 1 if gap > 0 else -1
    return side * c.force(0, gap, 0), side * chained(c.contact_gradient(gap), by)


def _places(forms: ClosedForms, orbit: Orbit, quantity: Quantity) -> Iterator[_Place]:
    """Ends and extrema of all segments; of the gap only for segments in contact."""
    for flow in orbit.system.flows:
        c, (x_r, v_r, _) = flow.c, flow.end
        gap = x_r - c.own_stop()
        if quantity is Quantity.FORCE:
            yield _Place(abs(c.force(x_r, gap, v_r)), flow, None)
        elif c.contact:
            yield _Place(_size(forms, c, gap), flow, None)
        else:
            continue
        for _, time, value in extrema(forms.numbers, flow, quantity, {}):
            size = abs(value) if quantity is Quantity.FORCE else _size(forms, c, value)
            yield _Place(size, flow, time)


def _size(forms: ClosedForms, c: Any, gap: Number) -> Number:
    """Measure by which contacts are compared: the gap, with two stops the force."""
    return gap if len(forms.scene.facts.STOPS) == 1 else abs(c.force(0, gap, 0))


def _state(forms: ClosedForms, place: _Place) -> tuple[Number, Number, Matrix]:
    """x_r and v_r at a place, and their total derivatives (3, n + 11) at a time in the segment.

    At an interior extremum the time may be held fixed, since the force is stationary in it.
    """
    flow = place.flow
    if place.time is None:
        return flow.end[0], flow.end[1], flow.end_by
    (position, v_r, *_), matrix = forms.run(flow.segment.field, flow.c, flow.closed, place.time)
    rows = matrix[:STATES].copy()
    rows[:, BY_TIME] = 0 * rows[:, BY_TIME]
    return flow.closed.x_r + position, v_r, flow.total(rows)
