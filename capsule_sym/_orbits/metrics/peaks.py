"""The largest forces along an orbit, with their derivatives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from capsule_sym._map.backend import Number
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import PARAMETERS, Matrix, SegmentFlow, Vector, force_by
from capsule_sym._orbits.shooting.extrema import extrema
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym.generated import formulas
from capsule_sym.generated.interface import Quantity

_BETA, _DELTA = (PARAMETERS.index(name) - len(PARAMETERS) for name in ("beta", "delta"))
_H = 4  # column of the duration in the kernels' Jacobian


class _Place(NamedTuple):
    """A place where a force may be largest: its size, the segment, and the time since its start.

    No time stands for the segment's end.
    """

    size: Number
    flow: SegmentFlow
    time: Number | None


def peak_of_force(forms: ClosedForms, orbit: Orbit) -> tuple[Number, Vector]:
    """The largest |P| along an orbit, and its derivatives (n + 11,)."""
    place = max(_places(forms, orbit, Quantity.FORCE), key=lambda found: found.size)
    x_r, v_r, by = _state(forms, place)
    c = place.flow.c
    force = formulas.force(c, x_r, x_r - c.delta, v_r)
    side = 1 if force > 0 else -1
    return side * force, side * force_by(c, x_r, v_r, by)


def peak_of_contact(forms: ClosedForms, orbit: Orbit) -> tuple[Number, Vector]:
    """The largest force of the second spring along an orbit, and its derivatives (n + 11,)."""
    places = _places(forms, orbit, Quantity.GAP)
    place = max(places, key=lambda found: found.size, default=None)
    if place is None:
        return forms.numbers.number(0), 0 * orbit.system.advance_by
    x_r, _, by = _state(forms, place)
    c = place.flow.c
    gradient = c.beta * by[0]
    gradient[_DELTA] -= c.beta
    gradient[_BETA] += x_r - c.delta
    return formulas.force(c, 0, x_r - c.delta, 0), gradient


def _places(forms: ClosedForms, orbit: Orbit, quantity: Quantity) -> Iterator[_Place]:
    """Ends and extrema of all segments, for the gap of those in contact only."""
    for flow in orbit.system.flows:
        c, (x_r, v_r, _) = flow.c, flow.end
        gap = x_r - c.delta
        if quantity is Quantity.FORCE:
            yield _Place(abs(formulas.force(c, x_r, gap, v_r)), flow, None)
        elif c.contact:
            yield _Place(gap, flow, None)
        else:
            continue
        for _, time, value in extrema(forms.numbers, flow, quantity, {}):
            yield _Place(abs(value) if quantity is Quantity.FORCE else value, flow, time)


def _state(forms: ClosedForms, place: _Place) -> tuple[Number, Number, Matrix]:
    """x_r and v_r at a place, and their total derivatives (2, n + 11) at a time in the segment.

    At an extremum inside a segment the time may be held, for the force does not change with it.
    """
    flow = place.flow
    if place.time is None:
        return flow.end[0], flow.end[1], flow.end_by[:2]
    (position, v_r, *_), matrix = forms.run(flow.segment.field, flow.c, flow.closed, place.time)
    rows = matrix[:2].copy()
    rows[:, _H] = 0 * rows[:, _H]
    return flow.closed.x_r + position, v_r, flow.total(rows)
