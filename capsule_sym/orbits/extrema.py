"""Every interior extremum of gap, force and speed along a leg, by proof: roots of their rates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any, NamedTuple

from capsule_sym.map.backend import Backend, Number
from capsule_sym.map.expansion import Expansion, Guard, Point, expand
from capsule_sym.map.isolation import polish, positive_at, search
from capsule_sym.map.location import Departure, Flow, Start
from capsule_sym.orbits.equations import Span

_REACH = 3  # how far an expansion is tried, over the fastest rate of the segment
_SHRINK = 8
_LEAST = 64  # roundings of a time, below which nothing is told apart


class Quantity(Enum):
    """What turns round."""

    GAP = "gap"  # x_r - delta
    FORCE = "force"  # the interaction force P
    SPEED = "speed"  # v_c, of a drift


class Turn(NamedTuple):
    """An interior extremum: 1 for a minimum, -1 for a maximum; duration after the start; value."""

    kind: int
    time: Number
    value: Number


class Minimum(NamedTuple):
    """An interior minimum of a guard: duration after the leg's start, and the guard there."""

    guard: Guard
    time: Number
    value: Number


def minima(numbers: Backend, span: Span, zeros: Mapping[Guard, int]) -> Iterator[Minimum]:
    """The minima of all watched guards inside a leg, guard by guard in time.

    `zeros` tells which guards vanish at the leg's start, and how many derivatives from the guard
    itself on.
    """
    c = span.c
    side = 1 if c.contact else -1
    for kind, time, value in turns(numbers, span, Quantity.GAP, zeros):
        if kind == side:
            yield Minimum(Guard.GAP, time, side * value)
    # In stick P is least where it is nearest to its lower bound.
    quantity = Quantity.SPEED if c.drift else Quantity.FORCE
    for kind, time, value in turns(numbers, span, quantity, zeros):
        if not c.drift:
            yield Minimum(Guard.LOWER if kind > 0 else Guard.UPPER, time, c.f_b + kind * value)
        elif kind == c.drift:
            yield Minimum(Guard.DRIFT, time, kind * value)


def turns(
    numbers: Backend, span: Span, quantity: Quantity, zeros: Mapping[Guard, int]
) -> Iterator[Turn]:
    """The extrema of a quantity inside a leg, in the order of time.

    Between two of them its rate is proved to keep its sign, wherever it can be told from zero;
    where its sign before and after a time at which it cannot differ, one is given. `zeros` is as
    for `minima`. A leg of duration 0 or less has none.
    """
    c, number = span.c, numbers.number
    # Plain numbers: NumPy's own make this several times slower.
    x_r, gap, v_r, v_c, margin, *_ = map(number, span.closed)
    angle, duration = number(span.angle % numbers.full_turn), number(span.h)
    start = Start(x_r, gap, v_r, v_c, margin, angle, zeros)
    flow = Flow(numbers, c, Departure(span.leg.field, start))
    now, sign = duration * 0, 0
    vanishing = max(0, zeros.get(Guard.DRIFT, 0) - 1) if quantity is Quantity.SPEED else 0

    def rate(h: Number) -> Expansion:
        at = flow(h) if h > 0 else flow.origin
        return _signed(_rate(numbers, c, at, quantity), sign)

    while now < duration:
        here = rate(now)
        if now == 0:
            sign, vanishing = _beginning(here, vanishing)
            here = _signed(here, sign)
        ahead = min(_REACH / c.rate, duration - now)
        least = _LEAST * numbers.unit * (now + 1 / c.rate)
        low, high, after = _stretch(here, vanishing, ahead, least, numbers.unit)
        if sign and after < 0 and now + high < duration:
            time = polish(rate, (now + low, now + high), numbers.unit)
            yield Turn(-sign, time, _value(c, flow(time), quantity))
        sign = after * (sign or 1) or sign
        now, vanishing = now + high, 0


def _rate(numbers: Backend, c: Any, at: Point, quantity: Quantity) -> Expansion:
    """Expansion of a quantity's rate, or of a positive multiple of it.

    The remainder of an expansion bounds a derivative, and so that of its derivatives too.
    """
    expansions = expand(numbers, c, at)
    if quantity is Quantity.GAP:
        e, side, order = expansions[Guard.GAP], 1 if c.contact else -1, 1
    elif c.drift:
        # v_c changes at the rate (P - friction)/gamma.
        e, side, order = expansions[Guard.DRIFT], c.drift, 1 if quantity is Quantity.SPEED else 2
    else:
        e, side, order = expansions[Guard.LOWER], 1, 1
    return _signed(Expansion(e.values[order:], e.errors[order:], e.rest, e.growth), side)


def _signed(e: Expansion, sign: int) -> Expansion:
    if sign >= 0:
        return e
    return Expansion([-value for value in e.values], e.errors, e.rest, e.growth)


def _value(c: Any, at: Point, quantity: Quantity) -> Number:
    if quantity is Quantity.GAP:
        return at.gap
    return at.v_c if quantity is Quantity.SPEED else at.margin + c.friction


def _beginning(rate: Expansion, zeros: int) -> tuple[int, int]:
    """Sign of a rate just after an instant, 0 if not known, and how many zeros it has there."""
    for count in range(zeros, len(rate.values)):
        value, error = rate.values[count], rate.errors[count]
        if abs(value) > error:
            return (1 if value > 0 else -1), count
    return 0, 0


def _stretch(
    rate: Expansion, zeros: int, ahead: Number, least: Number, unit: Number
) -> tuple[Number, Number, int]:
    """How far a rate is positive, how far to go in all, and its sign there, 0 if not known.

    If it is negative there, it has one root in between, or is hidden by rounding.
    """
    reach = ahead
    while reach > least:
        found = search(rate, zeros, reach, unit)
        if found.bracket is not None and found.bracket[1] > least:
            return *found.bracket, -1
        if found.clear > least:
            return found.clear, found.clear, 1
        reach = reach / _SHRINK
    # Rounding hides the rate here, and perhaps not further on.
    step = least
    while step < ahead:
        for sign in (1, -1):
            if positive_at(_signed(rate, sign), step, unit):
                return ahead * 0, step, sign
        step = _SHRINK * step
    return ahead * 0, ahead, 0
