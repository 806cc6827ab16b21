"""Where a trajectory stands, and the field that takes it on: the rule for every start.

At a point, a field takes over if every one of its guards is positive just after: the first of the
guard's time derivatives that does not vanish is positive. On S1-S10 and L1-L8 this is the derived
switching table; the same rule serves corner points and tangencies.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from capsule_sym.map.backend import Backend, Number
from capsule_sym.map.expansion import Expansion, Guard, Point, expand
from capsule_sym.map.location import Start

FIELDS = {(0, 1): 1, (0, 0): 2, (0, -1): 3, (1, 1): 4, (1, 0): 5, (1, -1): 6}
"""Index of the field by contact and drift."""


class State(NamedTuple):
    """A state with what is known exactly: gap = 0 on the impact surface, v_c = 0 at rest.

    `bound` is +1 (-1) where P = f_b (-f_b) is known to hold, else 0.
    """

    x_r: Number
    gap: Number
    v_r: Number
    v_c: Number
    angle: Number
    bound: int = 0


@dataclass(frozen=True)
class Departure:
    """The field that takes over at a state, and the start of its segment."""

    field: int
    start: Start


class Undetermined(Exception):
    """No field, or more than one, takes over with certainty at this precision."""


def depart(backend: Backend, constants: Any, state: State) -> Departure:
    """The field that takes over at a state; `constants` are those of F1 to F6, in order.

    Raises Undetermined where rounding leaves it open.
    """
    departures = []
    open_fields = []
    for field in _candidates(state):
        c = constants[field - 1]
        start = _start(backend, c, state)
        zeros = _departing(backend, c, state, start)
        if zeros is None:
            continue
        if any(count < 0 for count in zeros.values()):
            open_fields.append(field)
        departures.append(Departure(field, start._replace(zeros=zeros)))
    if len(departures) != 1 or open_fields:
        raise Undetermined(f"fields {[d.field for d in departures]} at {state}")
    return departures[0]


def _candidates(state: State) -> Iterator[int]:
    contacts = (0, 1) if state.gap == 0 else (int(state.gap > 0),)
    drifts = (1, 0, -1) if state.v_c == 0 else (1 if state.v_c > 0 else -1,)
    for contact in contacts:
        for drift in drifts:
            yield FIELDS[contact, drift]


def _start(backend: Backend, c: Any, state: State) -> Start:
    force = state.x_r + c.kappa * state.gap + 2 * c.zeta * state.v_r
    if state.bound:
        force = state.bound * c.f_b
    margin = force - c.friction
    return Start(state.x_r, state.gap, state.v_r, state.v_c, margin, state.angle, {})


def _departing(
    backend: Backend, c: Any, state: State, start: Start
) -> dict[Guard, int] | None:
    """Leading zeros of each guard if the field takes over, -1 where that is open; None if not."""
    cosine, sine = backend.cos_sin(start.angle)
    zero = state.x_r * 0
    point = Point(*start[:5], cosine, sine, zero, zero, zero)
    zeros = {}
    for guard, expansion in expand(backend, c, point).items():
        exact = _exact_zeros(c, guard, state)
        count, sign = _first_sign(expansion, exact)
        if sign < 0:
            return None
        if sign == 0:
            count = -1
        if count:
            zeros[guard] = count
    return zeros


def _exact_zeros(c: Any, guard: Guard, state: State) -> tuple[bool, ...]:
    """Which of the guard's first derivatives vanish by what is known of the state."""
    if guard is Guard.GAP:
        return (state.gap == 0, state.gap == 0 and state.v_r == 0)
    if guard is Guard.DRIFT:
        return (state.v_c == 0, state.v_c == 0 and state.bound == c.drift)
    return (state.bound == (1 if guard is Guard.UPPER else -1),)


def _first_sign(expansion: Expansion, exact: tuple[bool, ...]) -> tuple[int, int]:
    """Number of leading zeros, and the sign of what follows (0 where rounding leaves it open)."""
    for count, (value, error) in enumerate(zip(expansion.values, expansion.errors, strict=True)):
        if count < len(exact) and exact[count]:
            continue
        if abs(value) <= error:
            return count, 0
        return count, 1 if value > 0 else -1
    return len(expansion.values), 0
