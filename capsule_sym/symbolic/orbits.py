"""Motions followed switch by switch with proof.

A start is a vector of intervals: one state, or a box of them. Each segment is searched for the
first zero of the functions that bound its cell. An interval of time is passed where all of them
are proved positive, and ends the segment where one is proved to fall through zero once and the
others stay positive; otherwise it is halved. So every state of a box switches in the same order,
and the derivative with respect to the start is enclosed too, switching times included.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache

import sympy as sp

from capsule_sym.symbolic.elimination import Undecided
from capsule_sym.symbolic.intervals import (
    ONE,
    PRECISION,
    ZERO,
    Interval,
    Motion,
    Row,
    Values,
    Vector,
    apply,
    dot,
    exact,
    hull,
    meet,
    middle,
    period,
    rational,
    upper,
)
from capsule_sym.symbolic.model import SEGMENTS, Segment
from capsule_sym.symbolic.symbols import alpha, delta, f_b

_C = 2  # place of v_c
_SIDE, _SPEED = 0, 1  # the functions that bound the cell of a drift field
_FINEST = Fraction(1, 10**9)  # step of a search
_SEARCH_BITS = 96  # enough to tell signs; the state itself is kept with far more
IMPACT_PLANES = {1: "Σ8", 3: "Σ10", 4: "Σ7", 6: "Σ9"}
"""The plane on which a moving capsule's impact begins a field."""
_FIELDS = {(field.contact, field.drift): field for field in SEGMENTS}


@dataclass(frozen=True)
class Leg:
    """A segment of a motion: its field, and the plane on which it begins (None: inside a cell)."""

    field: int
    plane: str | None


@dataclass(frozen=True)
class Passage:
    """One excitation period of every motion from a box: its legs, the end, and its derivative.

    `marks` holds, for each leg, the state where it begins and what then remains of the period;
    `slopes` the derivative of the end by each direction of change of the start.
    """

    legs: tuple[Leg, ...]
    marks: tuple[tuple[Vector, Interval], ...]
    end: Vector
    slopes: tuple[Vector, ...]


@dataclass(frozen=True)
class Box:
    """States `centre + sum of directions times numbers in reach`, about a passage of the centre."""

    centre: Passage
    reach: Interval

    def around(self, value: Interval, slopes: Iterable[Interval]) -> Interval:
        """Mean-value form of a quantity over the box, from its value at the centre."""
        return value + sum((slope * self.reach for slope in slopes), ZERO)


@dataclass(frozen=True)
class _Begun:
    """A segment that has begun: the state, and the orders of the functions that vanish there."""

    field: Segment
    plane: str | None
    state: Vector
    orders: Mapping[int, int]


class _Leg:
    """The search of one segment for its first switch."""

    def __init__(self, motion: Motion, begun: _Begun) -> None:
        self._motion = motion
        self._start = begun.state
        self._orders = begun.orders
        for place, guard in enumerate(motion.guards):
            if place not in begun.orders and not apply(guard, begun.state) > 0:
                raise Undecided(motion.field.name, place)
        # Any function's second derivative beyond the order to which it vanishes at the start.
        self._guards = [
            motion.guard_in_time(place, begun.state, begun.orders.get(place, 0) + 2)
            for place in range(len(motion.guards))
        ]

    def first(self, horizon: Fraction) -> tuple[int, Interval] | None:
        """The first function to vanish up to a time, and an interval around the instant."""
        low, step = Fraction(0), horizon / 8
        while low < horizon:
            high = min(low + step, horizon)
            unproved, crossing = self._during(low, high)
            if crossing:
                return unproved[0], hull(exact(low), exact(high))
            if unproved:
                step /= 2
            else:
                low, step = high, 2 * step
            if step < _FINEST:
                raise Undecided(self._motion.field.name, low)
        return None

    def _during(self, low: Fraction, high: Fraction) -> tuple[list[int], bool]:
        """Functions not proved positive between two times, and whether one is, and just falls."""
        centre = self._motion.weights(exact((low + high) / 2), _SEARCH_BITS)
        whole = self._motion.weights(hull(exact(low), exact(high)), _SEARCH_BITS)
        away = exact((high - low) / 2)
        step = hull(-away, away)

        def within(place: int, order: int) -> Interval:
            """Values of a derivative of a function over the interval of time."""
            value, rise, bend = self._guards[place][order : order + 3]
            return dot(value, centre) + dot(rise, centre) * step + dot(bend, whole) * step**2 / 2

        orders = self._orders if low == 0 else {}
        unproved = [
            place
            for place in range(len(self._guards))
            if not within(place, orders.get(place, 0)) > 0
        ]
        if len(unproved) != 1 or unproved[0] in orders:
            return unproved, False
        value, slope = self._guards[unproved[0]][:2]
        falls = dot(slope, whole) < 0
        return unproved, falls and dot(value, self._motion.weights(exact(high), _SEARCH_BITS)) < 0

    def narrowed(self, place: int, time: Interval) -> Interval:
        """A narrow interval around the one zero of a function, which falls there."""
        value, slope = self._guards[place][:2]
        guard = self._motion.guards[place]

        def quick(time: Interval) -> Interval:
            return dot(value, self._motion.weights(time, _SEARCH_BITS))

        def tight(time: Interval) -> Interval:
            return apply(guard, self._motion.after(self._start, time))

        for height_at, bits in ((quick, _SEARCH_BITS), (tight, PRECISION)):
            while True:
                centre = exact(middle(time))
                height = height_at(centre)
                rate = dot(slope, self._motion.weights(time, bits))
                closer = meet(time, centre - height / rate)
                if not closer.delta < time.delta / 2:  # Newton's step does little: halve
                    if height > 0:
                        closer = hull(centre, time)
                    elif height < 0:
                        closer = hull(time, centre)
                    else:
                        break
                time = closer
        return time

    def at(self, time: Interval) -> Vector:
        """The state at an interval of time."""
        centre = exact(middle(time))
        start = self._motion.after(self._start, centre)
        rate = self._motion.rate(self._motion.after(self._start, time))
        moved = [x + slope * (time - centre) for x, slope in zip(start, rate, strict=False)]
        return [*moved, ONE]


@dataclass(frozen=True)
class _Change:
    """The derivative of a segment's state and of its instant by a direction at the start."""

    state: Vector
    delay: Interval

    def switched(self, motion: Motion, guard: Row, time: Interval, state: Vector) -> _Change:
        """The change at a switch, `time` after the start of the segment, in the given state."""
        moved, rate = motion.after(self.state, time), motion.rate(state)
        late = -apply(guard, moved) / apply(guard, rate)
        shifted = [x + slope * late for x, slope in zip(moved, rate, strict=True)]
        return _Change(shifted, self.delay + late)

    def held(self, motion: Motion, end: Vector, remaining: Interval) -> Vector:
        """The change at the end of the period, which comes at a fixed instant."""
        moved, rate = motion.after(self.state, remaining), motion.rate(end)
        return [x - slope * self.delay for x, slope in zip(moved, rate, strict=True)]


def _state(vector: Vector) -> Vector:
    return vector[: _C + 1]


def _narrowed(
    box: Box, leg: int, begun: _Begun, remaining: Interval, changes: list[_Change]
) -> tuple[_Begun, Interval]:
    """A leg's beginning and what remains of the period, by the mean-value form."""
    if box.centre.legs[leg : leg + 1] != (Leg(begun.field.index, begun.plane),):
        raise Undecided(leg, box.centre.legs)
    state, left = box.centre.marks[leg]
    narrow = [
        meet(x, box.around(c, [change.state[k] for change in changes]))
        for k, (x, c) in enumerate(zip(begun.state[:-1], state, strict=False))
    ]
    shorter = meet(remaining, box.around(left, [-change.delay for change in changes]))
    return replace(begun, state=[*narrow, ONE]), shorter


@cache
def _motion(field: Segment, values: tuple[tuple[sp.Symbol, sp.Rational], ...]) -> Motion:
    return Motion(field, dict(values))


class System:
    """The capsule system at rational parameters; all it tells of a motion is proved."""

    def __init__(self, values: Values) -> None:
        free = tuple(sorted((pair for pair in values.items() if pair[0] != alpha), key=str))
        self._motions = {field.index: _motion(field, free) for field in SEGMENTS}
        self._period = period(values)
        self._amplitude = exact(rational(values[alpha]))
        self._gap = exact(rational(values[delta]))
        self._bound = exact(rational(values[f_b]))

    def field_at(self, start: Vector) -> Segment:
        """The field in whose cell all states of a box are; raises `Undecided` if there is none."""
        for field in SEGMENTS:
            guards = self._motions[field.index].guards
            held = not field.stick or start[_C] == 0
            if held and all(apply(guard, self._at_crest(start)) > 0 for guard in guards):
                return field
        raise Undecided(start)

    def _at_crest(self, start: Vector) -> Vector:
        return [*_state(start), self._amplitude, ZERO, ONE]

    def passage(
        self, start: Vector, directions: Iterable[Vector] = (), box: Box | None = None
    ) -> Passage:
        """One period from states (x_r, v_r, v_c) inside a cell at cos(omega tau) = 1.

        With a box, `start` encloses its states; that serves to narrow what follows. Raises
        `Undecided` where the order of switches is not proved to be one and the same.
        """
        begun = _Begun(self.field_at(start), None, self._at_crest(start), {})
        changes = [_Change([*way, ZERO, ZERO], ZERO) for way in directions]
        remaining = self._period
        legs, marks = [], []
        while True:
            legs.append(Leg(begun.field.index, begun.plane))
            marks.append((begun.state, remaining))
            motion = self._motions[begun.field.index]
            leg = _Leg(motion, begun)
            found = leg.first(upper(remaining))
            if found is None:
                end = leg.at(remaining)
                last = [change.held(motion, end, remaining) for change in changes]
                return Passage(tuple(legs), tuple(marks), _state(end), tuple(map(_state, last)))
            place, bracket = found
            guard = motion.guards[place]
            time = leg.narrowed(place, bracket)
            if not time < remaining:
                raise Undecided(motion.field.name, time, remaining)
            state = leg.at(time)
            changes = [change.switched(motion, guard, time, state) for change in changes]
            remaining -= time
            begun = self._next(begun.field, place, state)
            if box:
                begun, remaining = _narrowed(box, len(legs), begun, remaining, changes)

    def _next(self, field: Segment, place: int, state: Vector) -> _Begun:
        """The segment that follows when a function that bounds a field's cell vanishes."""
        if place == _SIDE:
            following = _FIELDS[not field.contact, field.drift]
            plane = f"Σ{following.index}" if field.stick else IMPACT_PLANES[following.index]
            return _Begun(following, plane, [self._gap, *state[1:]], {_SIDE: 1})
        if field.stick:  # the force reaches a bound, and rises
            following = _FIELDS[field.contact, 1 if place == 1 else -1]
            return _Begun(following, f"Σ{following.index}", state, {_SPEED: 2})
        force = apply(self._motions[field.index].force, state)
        drifts = {0: abs(force) < self._bound, 1: force > self._bound, -1: force < -self._bound}
        possible = [drift for drift, holds in drifts.items() if holds]
        if not possible:
            raise Undecided(field.name, force)
        (drift,) = possible
        following = _FIELDS[field.contact, drift]
        rest = [*state[:_C], ZERO, *state[_C + 1 :]]
        return _Begun(following, f"Σ{following.index}", rest, {_SPEED: 1} if drift else {})
