"""State of a trajectory, at the end of a segment and before the next, and its successor field.

A field is the successor at a point if each of its guards is positive just after it: the first time
derivative of the guard that does not vanish is positive. On surfaces and lines this gives the
derived switching tables; the same rule applies at corner points and tangencies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any, NamedTuple

from capsule_sym._errors import Outcome
from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.course import Begin, Course, SegmentStart
from capsule_sym._map.expansion import Expansion, Guard, Point, expand, pulsed, side_of, watched
from capsule_sym._map.location import End


class State(NamedTuple):
    """State with its exactly known facts: gap = 0 on the impact surface, v_c = 0 at rest.

    `gap` is relative to the front stop, `back` to the back stop (None with one stop). `bound` is +1
    (-1) if Q = f_plus (-f_minus) is known to hold, else 0. `angle_rest` is the rounding error of
    the forcing angle; `level` is that of pulses just after the state, 1 for the low level.
    """

    x_r: Number
    gap: Number
    v_r: Number
    v_c: Number
    angle: Number
    bound: int = 0
    angle_rest: Number = 0
    back: Number = None
    level: int = 0

    def exactly(self, number: Callable[[Number], Number], *stops: float) -> State:
        """State in a wider number system, given the distances of the front and back stop.

        Near the impact surface the gap is the known quantity, elsewhere the position; the other
        follows from it without the present rounding error.
        """
        x_r, gap, v_r, v_c, angle = (number(value) for value in self[:5])
        angle += number(self.angle_rest)
        delta, back = number(stops[0]), None if self.back is None else number(self.back)
        far = 2 * abs(self.gap) > stops[0]
        if not far:
            x_r = delta + gap
        if back is not None:
            behind = number(stops[1])
            if far and 2 * abs(self.back) <= stops[1]:
                x_r = back - behind
            else:
                back = x_r + behind
        if far:
            gap = x_r - delta
        return State(x_r, gap, v_r, v_c, angle, self.bound, back=back, level=self.level)

    def gaps(self, contact: int) -> tuple[Number, Number]:
        """Gaps to the stop of a field of this contact, and to the other one of two."""
        return (self.back, self.gap) if contact == 2 else (self.gap, self.back)


def select_field(
    backend: Backend, constants: Any, state: State, *, vanish: bool = False
) -> SegmentStart | None:
    """Successor field at a state; `constants` are those of all fields, in order.

    A derivative within its error bound of zero is undecided, or taken to be zero with `vanish`.
    None if a field is undecided, and if none, or more than one, is the successor.
    """
    begins = []
    cosine, sine = backend.cos_sin(state.angle, state.angle_rest)
    for field in _candidates(backend.scene.facts, state):
        c = constants[field - 1]
        start = start_at(c, state, cosine)
        zeros, sign = _departing(backend, c, state, start, (cosine, sine), vanish)
        if sign == 0:
            return None
        if sign > 0:
            begins.append(SegmentStart(field, start._replace(zeros=zeros)))
    return begins[0] if len(begins) == 1 else None


def _candidates(facts: ModuleType, state: State) -> list[int]:
    contacts: tuple[int, ...] = (0, 1) if state.gap == 0 else (int(state.gap > 0),)
    if state.back is not None and state.back <= 0:
        contacts = (0, 2) if state.back == 0 and state.gap <= 0 else (2,)
        contacts = (0, 1, 2) if state.gap == state.back == 0 else contacts
    drifts = (1, 0, -1) if state.v_c == 0 else (1 if state.v_c > 0 else -1,)
    lower = state.level * len(facts.FIELD_OF)
    return [lower + facts.FIELD_OF[contact, drift] for contact in contacts for drift in drifts]


def start_at(c: Any, state: State, cosine: Number = None) -> Begin:
    """Start of a segment with constants `c` at a state, before its zeros are known.

    The forcing's cosine is needed if the drive reacts.
    """
    gap, other = state.gaps(c.contact)
    if state.bound:
        margin = c.friction_at(state.bound) - c.friction
    else:
        margin = c.margin_at(state.x_r, gap, state.v_r, cosine)
    return Begin(
        state.x_r, gap, state.v_r, state.v_c, margin, state.angle, {}, state.angle_rest, other
    )


def _departing(
    backend: Backend,
    c: Any,
    state: State,
    start: Begin,
    forcing: tuple[Number, Number],
    vanish: bool,
) -> tuple[dict[Guard, int], int]:
    """Leading zeros of each guard, and 1 if the field is the successor, -1 if not, 0 if unknown."""
    zero, turned = state.x_r * 0, 2 * backend.unit * start.angle
    point = Point(*start[:5], *forcing, zero, zero, zero, turned, start.other, zero)
    zeros, known = dict[Guard, int](), 1
    for guard, expansion in expand(backend, c, point).items():
        # Contact and rest are the closed regions, Eqs. (10)-(12), where a guard stays zero.
        outside = guard is Guard.DRIFT or (guard in (Guard.GAP, Guard.BACK) and not c.contact)
        closed = -1 if outside else 1
        count, sign = _first_sign(expansion, _exact_zeros(c, guard, state), vanish, closed)
        if sign < 0:
            return {}, -1
        known = min(known, sign)
        if count:
            zeros[guard] = count
    return zeros, known


def _exact_zeros(c: Any, guard: Guard, state: State) -> tuple[bool, ...]:
    """True for the guard's first derivatives that are known to vanish at the state."""
    if guard in (Guard.GAP, Guard.BACK):
        touches = state.gaps(c.contact)[guard is Guard.BACK] == 0
        return (touches, touches and state.v_r == 0)
    if guard is Guard.DRIFT:
        return (state.v_c == 0, state.v_c == 0 and state.bound == c.drift)
    return (state.bound == (1 if guard is Guard.UPPER else -1),)


def _first_sign(
    expansion: Expansion, exact: tuple[bool, ...], vanish: bool, closed: int
) -> tuple[int, int]:
    """Number of leading zeros of a guard's derivatives, and the sign of the next one.

    `exact` is True for those that are known to be 0. One within its error bound gives the sign 0,
    or counts as 0 with `vanish`. If all are 0 the sign is `closed`.
    """
    for count, (value, error) in enumerate(zip(expansion.values, expansion.errors, strict=True)):
        if count < len(exact) and exact[count]:
            continue
        if abs(value) > error:
            return count, 1 if value > 0 else -1
        if not vanish:
            return count, 0
    return len(expansion.values), closed


def tells(flow: Course, switch: End) -> bool:
    """True if the computed state at the end of a segment has the signs that are proved."""
    return all(sign * getattr(switch.point, name) > 0 for name, sign, _ in _proved(flow, switch))


def _proved(flow: Course, switch: End) -> Iterator[tuple[str, int, Number]]:
    """Quantities at a segment's end that are proved not to vanish: sign, and error of the value."""
    if switch.duration == 0 or switch.outcome is Outcome.UNDECIDED:
        return
    c, point, side = flow.c, switch.point, side_of(flow.c)
    if Guard.BACK in switch.guards and switch.outcome is Outcome.REGULAR:
        yield "v_r", -1, point.error_v
    elif Guard.BACK in watched(c) and Guard.BACK not in switch.guards:
        stays = flow.start.zeros.get(Guard.BACK, 0) == flow.backend.kernels.JET_ORDER
        if not stays:
            yield "other", 1, point.error_other
    if Guard.GAP not in switch.guards:
        # At rest on the impact surface the gap remains zero.
        if flow.start.zeros.get(Guard.GAP, 0) < flow.backend.kernels.JET_ORDER:
            yield "gap", side, point.error_x
    elif switch.outcome is Outcome.REGULAR:
        yield "v_r", -side, point.error_v
    if c.drift and Guard.DRIFT not in switch.guards:
        yield "v_c", c.drift, point.error_v_c


def reached(flow: Course, switch: End, angle: Number) -> State:
    """State at the end of a segment.

    A guard that fired is exactly zero, whatever its rounded value. A guard that did not fire is
    proved positive; if terms cancel, its computed value may still be zero or negative, which is no
    information. A proved sign that rounding hides is restored within the error bound.
    """
    c, point, zero = flow.c, switch.point, angle * 0
    for name, sign, error in _proved(flow, switch):
        if not sign * getattr(point, name) > 0 and error > 0:
            point = point._replace(**{name: sign * error})
            if name == "gap":
                point = point._replace(x_r=c.own_stop() + sign * error)
    v_c = point.v_c if c.drift else zero
    gap, back = (point.other, point.gap) if c.contact == 2 else (point.gap, point.other)
    state = State(point.x_r, gap, point.v_r, v_c, angle, back=back)
    if pulsed(c):
        state = state._replace(level=int(not c.high) ^ (Guard.EDGE in switch.guards))
    stops = [getattr(c, name) for name, _ in flow.backend.scene.facts.STOPS]
    for guard in switch.guards:
        if guard is Guard.BACK or (guard is Guard.GAP and c.contact == 2):
            state = state._replace(x_r=-stops[1], gap=-stops[1] - stops[0], back=zero)
        elif guard is Guard.GAP:
            state = state._replace(x_r=stops[0], gap=zero)
            if back is not None:
                state = state._replace(back=stops[0] + stops[1])
        elif guard is Guard.EDGE:
            continue
        elif guard is Guard.DRIFT:
            state = state._replace(v_c=zero)
        else:
            state = state._replace(bound=1 if guard is Guard.UPPER else -1)
    return state
