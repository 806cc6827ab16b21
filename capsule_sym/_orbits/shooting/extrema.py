"""Interior extrema of gap, force, speed or pull in a segment: proved roots of its rate."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from capsule_sym._map import quasistatic
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.course import Begin, Course, SegmentStart
from capsule_sym._map.expansion import Expansion, Guard, Point, expand, reaction_of
from capsule_sym._map.isolation import polish, positive_at, search
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.closed import native_fields
from capsule_sym._orbits.shooting.equations import SegmentFlow
from capsule_sym._parameters import Scene
from capsule_sym.generated.interface import Quantity

_REACH = 3  # reach of an expansion, over the fastest rate of the segment
_SHRINK = 8
_FAINT = 32  # errors of a rate, below which its sign is not resolved
_TINY = 1e-200  # smaller rates and remainders are evaluated in 50 digits, which do not underflow
_LEAST = 64  # roundings of a time, the least resolved step


class Extremum(NamedTuple):
    """Interior extremum: 1 for a minimum, -1 for a maximum; duration after the start; value."""

    kind: int
    time: Number
    value: Number


class Minimum(NamedTuple):
    """Interior minimum of a guard: duration after the segment's start, and the guard there."""

    guard: Guard
    time: Number
    value: Number


def minima(numbers: Backend, flow: SegmentFlow, zeros: Mapping[Guard, int]) -> Iterator[Minimum]:
    """Minima of all watched guards inside a segment, guard by guard in order of time.

    `zeros` has the guards that vanish at the segment's start, each with the number of vanishing
    derivatives, counted from the guard itself.
    """
    c = flow.c
    stops = [getattr(c, distance) for distance, _ in numbers.scene.facts.STOPS]
    side = 1 if c.contact == 1 else -1
    for kind, time, value in extrema(numbers, flow, Quantity.GAP, zeros):
        if kind == side:
            yield Minimum(Guard.GAP, time, side * value)
        elif not c.contact and len(stops) > 1:
            yield Minimum(Guard.BACK, time, value + sum(stops))
    if c.drift:
        for kind, time, value in extrema(numbers, flow, Quantity.SPEED, zeros):
            if kind == c.drift:
                yield Minimum(Guard.DRIFT, time, kind * value)
        return
    # In stick a minimum of the pull is compared with its lower bound, a maximum with the upper one.
    for kind, time, value in extrema(numbers, flow, Quantity.PULL, zeros):
        least = c.friction_guard(kind, value)
        yield Minimum(Guard.LOWER if kind > 0 else Guard.UPPER, time, least)


def extrema(
    numbers: Backend, flow: SegmentFlow, quantity: Quantity, zeros: Mapping[Guard, int]
) -> Iterator[Extremum]:
    """Extrema of a quantity inside a segment, in order of time.

    Between two of them the rate is proved to keep its sign, except where it is within its error of
    zero; if its sign differs before and after such a time, one extremum is given. `zeros` is as for
    `minima`. A segment of duration <= 0 has none. In double precision the C core finds the extrema;
    what it cannot decide is searched here, in 50 digits if all values are tiny. Raises ValueError
    unless the duration is finite.
    """
    if not math.isfinite(flow.h):
        raise ValueError(f"a segment of duration {flow.h}")
    vanishing = max(0, zeros.get(Guard.DRIFT, 0) - 1) if quantity is Quantity.SPEED else 0
    found = None if numbers.name == "mpmath" else _by_core(numbers.scene, flow, quantity, vanishing)
    return _searched(numbers, flow, quantity, zeros) if found is None else iter(found)


def _parameters(scene: Scene, c: Any) -> tuple[Number, ...]:
    """Parameters, which are the first of a segment's constants."""
    return tuple(c[: len(scene.facts.PARAMETERS)])


def _by_core(
    scene: Scene, flow: SegmentFlow, quantity: Quantity, zeros: int
) -> list[Extremum] | None:
    """Extrema by the C core; None without it, and if it cannot decide."""
    c = flow.c
    core = native_fields(_parameters(scene, c), scene)
    if core is None:
        return None
    found = core.extrema(flow.segment.field, flow.closed, quantity, zeros, float(flow.h))
    return None if found is None else [Extremum(*one) for one in found]


def _searched(
    numbers: Backend, flow: SegmentFlow, quantity: int, zeros: Mapping[Guard, int]
) -> Iterator[Extremum]:
    """Extrema by the expansions of the reference map."""
    c, number = flow.c, numbers.number
    # NumPy's scalars make this several times slower than plain numbers.
    x_r, gap, v_r, v_c, margin, *_ = map(number, flow.closed)
    angle, duration = number(flow.angle % numbers.full_turn), number(flow.h)
    start = Begin(x_r, gap, v_r, v_c, margin, angle, zeros)
    motion = Course(numbers, c, SegmentStart(flow.segment.field, start))
    now, sign = duration * 0, 0
    vanishing = max(0, zeros.get(Guard.DRIFT, 0) - 1) if quantity is Quantity.SPEED else 0

    def rate(h: Number, with_slow: bool | None = None) -> Expansion:
        at = motion(h) if h > 0 else motion.origin
        return _signed(_rate(numbers, c, at, quantity, with_slow), sign)

    while now < duration:
        check_time()
        here = rate(now)
        if now == 0:
            if numbers.name != "mpmath" and max(map(abs, here.values)) < _TINY:
                yield from _in_fifty_digits(numbers.scene, flow, quantity, zeros)
                return
            sign, vanishing = _beginning(here, vanishing)
            here = _signed(here, sign)
        ahead = min(_REACH / c.rate, duration - now)
        least = _LEAST * numbers.unit * (now + 1 / c.rate)
        rounding = _FAINT * here.errors[0]
        low, high, after = _stretch(here, vanishing, rounding, ahead, least, numbers.unit)
        about = rate
        for with_slow in (True, False) if c.q < 0 else (False,):
            slow = quasistatic.rate(c, with_slow)
            if slow is not None and (low == high or not after):
                about = partial(rate, with_slow=with_slow)
                most = min(_REACH / slow, duration - now)
                low, high, after = _further(about(now), after, rounding, high, most, numbers.unit)
        if sign and after < 0 and now + high < duration:
            time = polish(about, (now + low, now + high), numbers.unit)
            yield Extremum(-sign, time, _value(c, motion(time), quantity))
        sign = after * (sign or 1) or sign
        now, vanishing = now + high, 0


def _in_fifty_digits(
    scene: Scene, flow: SegmentFlow, quantity: int, zeros: Mapping[Guard, int]
) -> Iterator[Extremum]:
    with backend("mpmath", scene) as numbers:
        values = scene.Parameters(*_parameters(scene, flow.c))
        exact = replace(flow, c=numbers.constants(flow.segment.field, values))
        found = list(_searched(numbers, exact, quantity, zeros))
    return (Extremum(kind, float(time), float(value)) for kind, time, value in found)


def _rate(numbers: Backend, c: Any, at: Point, quantity: int, with_slow: bool | None) -> Expansion:
    """Expansion of a quantity's rate, or of a positive multiple of it.

    The remainder of an expansion bounds a derivative, and so also the remainder of its derivatives.
    With `with_slow` given the reach is much longer: the fast free part is only bounded.
    """
    guard, side, order = _guard_of(c, quantity)
    if with_slow is None:
        e = expand(numbers, c, at)[guard]
        e = Expansion(e.values[order:], e.errors[order:], e.rest, e.growth)
    else:
        e = quasistatic.expand_forced(numbers, c, at, order, with_slow)[guard]
    return _of_force(numbers, c, at, quantity, _signed(e, side))


def _of_force(numbers: Backend, c: Any, at: Point, quantity: int, pull: Expansion) -> Expansion:
    """Rate of the pull Q; for the force that of P, which differs by the drive's reaction."""
    own = reaction_of(c) if quantity is Quantity.FORCE else 0
    if not own:
        return pull
    own, orders = c.v_c_rate(own) if c.drift else own, range(1, len(pull.values) + 2)
    *sizes, last = (own * c.omega**n for n in orders)
    cycle = (-at.sin_theta, -at.cos_theta, at.sin_theta, at.cos_theta)
    rounding = 8 * numbers.unit + at.error_angle
    values = [
        v + size * cycle[n % 4] for n, (v, size) in enumerate(zip(pull.values, sizes, strict=True))
    ]
    errors = [error + rounding * size for error, size in zip(pull.errors, sizes, strict=True)]
    return Expansion(values, errors, pull.rest + last, pull.growth)


def _guard_of(c: Any, quantity: int) -> tuple[Guard, int, int]:
    """Guard, sign, and order of the derivative that is a multiple of a quantity's rate."""
    if quantity is Quantity.GAP:
        return Guard.GAP, 1 if c.contact == 1 else -1, 1
    if c.drift:
        # v_c changes at the rate (P - friction)/gamma.
        return Guard.DRIFT, c.drift, 1 if quantity is Quantity.SPEED else 2
    return Guard.LOWER, 1, 1


def _signed(e: Expansion, sign: int) -> Expansion:
    if sign >= 0:
        return e
    return Expansion([-value for value in e.values], e.errors, e.rest, e.growth)


def _value(c: Any, at: Point, quantity: int) -> Number:
    if quantity is Quantity.GAP:
        return at.gap
    if quantity is Quantity.SPEED:
        return at.v_c
    if quantity is Quantity.FORCE:
        return c.force(at.x_r, at.gap, at.v_r)
    return at.margin + c.friction


def _beginning(rate: Expansion, zeros: int) -> tuple[int, int]:
    """Sign of a rate just after an instant, 0 if unknown, and the number of its zeros there."""
    for count in range(zeros, len(rate.values)):
        value, error = rate.values[count], rate.errors[count]
        if abs(value) > error:
            return (1 if value > 0 else -1), count
    return 0, 0


def _stretch(
    rate: Expansion, zeros: int, rounding: Number, ahead: Number, least: Number, unit: Number
) -> tuple[Number, Number, int]:
    """Length over which a rate is positive, length of the stretch, and the sign at its end.

    The sign is 0 if unknown. If it is negative, the rate has one root in between, or is hidden by
    `rounding`.
    """
    faint = not zeros and abs(rate.values[0]) <= rounding
    reach = ahead
    while reach > least:
        found = search(rate, zeros, reach, unit)
        if found.bracket is not None and found.bracket[1] > least:
            return *found.bracket, -1
        if found.clear > least and not (faint and found.clear < ahead):
            return found.clear, found.clear, 1
        if faint:
            break  # shorter stretches would hardly resolve it
        reach = reach / _SHRINK
    # Rounding hides the rate here; it may resolve further on.
    return ahead * 0, *_resolved(rate, rounding, least, ahead, unit)


def _resolved(
    rate: Expansion, rounding: Number, step: Number, most: Number, unit: Number
) -> tuple[Number, int]:
    """Length from `step` on after which a rate exceeds its rounding, and its sign; 0 if none."""
    while step < most:
        for sign in (1, -1):
            if positive_at(_raised(_signed(rate, sign), -rounding), step, unit):
                return step, sign
        step = _SHRINK * step
    return most, 0


def _further(
    rate: Expansion, sign: int, rounding: Number, least: Number, most: Number, unit: Number
) -> tuple[Number, Number, int]:
    """As `_stretch`, from an expansion of longer reach: at least `least`, at most `most`.

    A positive rate: the length over which it is proved positive. A rate hidden by `rounding`: the
    length until it is resolved, or over which it is proved to be hidden.
    """
    zero = least * 0
    step, way = _resolved(rate, rounding, _SHRINK * least, most, unit)
    if not sign and way:
        return zero, step, way
    hidden = [_raised(e, rounding) for e in (rate, _signed(rate, -1))]
    proved, reach = [rate] if sign else hidden, most
    while reach > least:
        clear = min(search(e, 0, reach, unit).clear for e in proved)
        if clear > least:
            return (clear if sign else zero), clear, sign
        reach = reach / _SHRINK
    return (least if sign else zero), least, sign


def _raised(rate: Expansion, by: Number) -> Expansion:
    return replace(rate, values=[rate.values[0] + by, *rate.values[1:]])
