"""Every interior minimum of a leg's guards, found by proof: roots of the guards' derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from capsule_sym.map.backend import Backend, Number
from capsule_sym.map.expansion import Expansion, Guard, Point, expand, watched
from capsule_sym.map.isolation import search
from capsule_sym.map.location import Departure, Flow, Start

_REACH = 3  # how far an expansion is tried, over the fastest rate of the segment
_SHRINK = 8
_LEAST = 64  # roundings of a time, below which nothing is told apart


class Minimum(NamedTuple):
    """An interior minimum of a guard: duration after the leg's start, and the guard there."""

    guard: Guard
    time: Number
    value: Number


@dataclass
class _Watch:
    """A guard's derivative between two of its roots: its sign, and its zeros at the start."""

    sign: int
    zeros: int


def minima(
    numbers: Backend, c: Any, field: int, start: Start, duration: Number
) -> Iterator[Minimum]:
    """The minima of all watched guards at durations in (0, `duration`), guard by guard in time.

    `c` are the constants of the leg of field F`field`; the start's `zeros` tell which guards
    vanish there. Between two minima that are given, each guard's derivative is proved to change
    its sign once at most.
    """
    flow = Flow(numbers, c, Departure(field, start))
    now, at = duration * 0, flow.origin
    reach = _REACH / c.rate
    states: dict[Guard, _Watch] = {}
    while now < duration:
        slopes = {g: _slope(e) for g, e in expand(numbers, c, at).items() if g in watched(c)}
        zeros = start.zeros if now == 0 else {}
        for guard, slope in slopes.items():
            if guard not in states or states[guard].sign == 0:
                states[guard] = _beginning(slope, max(0, zeros.get(guard, 0) - 1))
        least = _LEAST * numbers.unit * (now + 1 / c.rate)
        ahead = min(reach, duration - now)
        step, found = _stretch(slopes, states, ahead, least, numbers.unit)
        for guard, (low, high) in found.items():
            if states[guard].sign < 0 and now + high < duration:
                time = _root(flow, guard, now + low, now + high)
                yield Minimum(guard, time, flow.guard(guard, flow(time)))
            states[guard].sign = -states[guard].sign
        for guard, state in states.items():
            # A derivative that rounding hides for so long is looked at again further on.
            state.sign = 0 if step <= least and guard not in found else state.sign
            state.zeros = 0
        reach = 2 * step if step > least else _REACH / c.rate
        now = now + step
        if now < duration:
            at = flow(now)


def _slope(e: Expansion) -> Expansion:
    """Expansion of the derivative, whose remainder has one power of the duration less."""
    return Expansion(e.values[1:], e.errors[1:], e.rest, e.growth)


def _negated(e: Expansion) -> Expansion:
    return Expansion([-value for value in e.values], e.errors, e.rest, e.growth)


def _beginning(slope: Expansion, zeros: int) -> _Watch:
    """Sign of a derivative just after an instant, past the zeros that it has there."""
    for count in range(zeros, len(slope.values)):
        value, error = slope.values[count], slope.errors[count]
        if abs(value) > error:
            return _Watch(1 if value > 0 else -1, count)
    return _Watch(1, len(slope.values))


def _stretch(
    slopes: Mapping[Guard, Expansion],
    states: Mapping[Guard, _Watch],
    ahead: Number,
    least: Number,
    unit: Number,
) -> tuple[Number, dict[Guard, tuple[Number, Number]]]:
    """How far to go, `least` or more, with the brackets of the derivatives' roots on the way."""
    signed = {
        guard: slope if states[guard].sign > 0 else _negated(slope)
        for guard, slope in slopes.items()
        if states[guard].zeros < len(slope.values)
    }
    while True:
        searches = {g: search(e, states[g].zeros, ahead, unit) for g, e in signed.items()}
        brackets = {g: s.bracket for g, s in searches.items() if s.bracket is not None}
        ends = [brackets[g][1] if g in brackets else s.clear for g, s in searches.items()]
        step = min(ends, default=ahead)
        if step > least or ahead <= least:
            step = max(step, least)
            return step, {g: b for g, b in brackets.items() if b[1] <= step}
        ahead = ahead / _SHRINK


def _root(flow: Flow, guard: Guard, low: Number, high: Number) -> Number:
    """The root of a guard's derivative in a bracket that holds exactly one."""

    def rate(h: Number) -> Number:
        return _rate(flow, guard, flow(h) if h > 0 else flow.origin)

    if rate(low) >= 0:
        return low
    if rate(high) <= 0:
        return high
    return flow.backend.polish(rate, low, high)


def _rate(flow: Flow, guard: Guard, at: Point) -> Number:
    """Time derivative of a guard at a point."""
    c = flow.c
    if guard is Guard.GAP:
        return at.v_r if c.contact else -at.v_r
    if guard is Guard.DRIFT:
        return c.drift * at.margin
    acceleration = flow.backend.kernels.jet(c, at.x_r, at.gap, at.v_r, at.cos_theta, at.sin_theta)[
        0
    ]
    rate = (1 + c.kappa) * at.v_r + 2 * c.zeta * acceleration
    return -rate if guard is Guard.UPPER else rate
