"""Switches: exact facts there, multiplicities of the guards' zeros, and the saltation matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from capsule_sym._enclosures.numbers.balls import Ball, Matrix, arb, assembled, matrix, unit
from capsule_sym._enclosures.numbers.fields import ONE, SIZE, C, V, X
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift

_FIRST, _COLUMNS = unit(3, SIZE), unit(SIZE, 3)
GUARD_ROWS = {Guard.GAP: 0, Guard.DRIFT: 1, Guard.UPPER: 1, Guard.LOWER: 2}
"""Row of a guard among those of a field."""


Orders = tuple[Sequence[int], Sequence[int]]


@dataclass(frozen=True)
class Known:
    """Exact facts at an instant: x_r = delta, v_r = 0, v_c = 0, P = side f_b, P' = 0."""

    gap: int = 0
    """Number of x_r - delta and its derivative that vanish."""
    rest: bool = False
    side: int = 0
    level: bool = False

    def orders(self, field: int) -> tuple[int, ...]:
        """Number of derivatives of each guard of a field, from itself on, that vanish."""
        if drift(field) == 0:
            reached = 2 if self.level else 1
            return self.gap, *(reached if self.side == side else 0 for side in (1, -1))
        if not self.rest:
            return self.gap, 0
        return self.gap, 1 + (0 if self.side != drift(field) else 1 + self.level)


def known(itinerary: Itinerary, segment: int, still: Sequence[int] = ()) -> Known:
    """Exact facts at the start of a segment; the segments `still` have duration 0.

    Segments of duration 0 on either side share the instant, and their guards' exact facts.
    """
    n = len(itinerary)
    first = segment
    while (first - 1) % n in still:
        first -= 1
    found = after(itinerary.guard_before(first % n))
    while first % n in still:
        found = _passed(found, itinerary, first % n)
        first += 1
    return found


def after(guard: Guard | None) -> Known:
    """Exact facts just after a guard has vanished."""
    if guard is None:
        return Known()
    if guard is Guard.GAP:
        return Known(gap=1)
    return Known(rest=True, side={Guard.UPPER: 1, Guard.LOWER: -1}.get(guard, 0))


def _passed(start: Known, itinerary: Itinerary, segment: int) -> Known:
    """Exact facts at a segment of duration 0: its start, and one more zero of its guard."""
    guard, zeros = itinerary.segments[segment].guard, itinerary.zeros(segment)
    if guard is Guard.GAP:
        return replace(start, gap=1 + zeros)
    if guard is not Guard.DRIFT:
        return replace(start, rest=True, side=1 if guard is Guard.UPPER else -1)
    if zeros == 0:
        return replace(start, rest=True)
    # v_c = v_c' = 0: the force is the friction; after stick v_c'' = 0 too, and so is P'.
    return replace(start, rest=True, side=drift(itinerary.fields[segment]), level=zeros == 2)


def zeros(itinerary: Itinerary, i: int, still: Sequence[int] = ()) -> Orders:
    """Multiplicity of each guard's zeros at the start and end of segment i, by exact facts."""
    field, guard = itinerary.segments[i].field, itinerary.segments[i].guard
    if guard is None:
        return Known().orders(field), Known().orders(field)
    n = len(itinerary)
    ends = known(itinerary, i, still), known(itinerary, (i + 1) % n, still)
    return ends[0].orders(field), ends[1].orders(field)


def guard_row(field: Any, guard: Guard) -> Matrix:
    """A guard of a field as a functional (1, 6) of the extended state."""
    row = GUARD_ROWS[guard]
    return matrix(1, SIZE, ((0, k, field.guards[row, k]) for k in range(SIZE)))


def pin(field: Any, guard: Guard) -> tuple[Ball, Ball]:
    """Slope and constant of x_r = slope v_r + constant, on the zero set of a field's guard."""
    row = guard_row(field, guard)
    return -row[0, V] / row[0, X], -row[0, ONE] / row[0, X]


def three(flow: Any) -> Any:
    """Derivative of the state by its start, from a flow."""
    return _FIRST * flow * _COLUMNS


def saltation(field: Any, following: Any, guard: Guard | None, state: Any) -> Any:
    """Saltation matrix: the change of the derivative, at a fixed time, at a switch.

    `state` contains all states there, in balls or as a form over a patch.
    """
    if guard is not Guard.DRIFT:  # the fields agree at the impact surface and at the end of stick
        return unit(3)
    lost: Any = arb(1)  # share of v_c lost, if stick follows
    if not following.stick:
        lost = 1 - (following.A * state)[C, 0] / (field.A * state)[C, 0]
    # The inner mass does not feel friction: v_r gains what v_c loses.
    return assembled(3, 3, [(X, X, 1), (V, V, 1), (V, C, lost), (C, C, 1 - lost)])
