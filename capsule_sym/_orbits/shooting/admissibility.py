"""The inequalities of an orbit's word: what must hold for the motion to be what its word says."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import Shot, Span
from capsule_sym._orbits.shooting.extrema import Quantity, minima, turns
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.word import Word, contact, drift

DURATION, MINIMUM, LANDING = "duration", "minimum", "landing"
_NEAR = 1e-5  # share of a leg within which a minimum is that at its end


class Inequality(NamedTuple):
    """A quantity that is positive where the word is realised; dimensionless.

    `kind` is "duration": that of leg `leg`; "minimum": the least of guard `guard` at the time
    `time` inside the leg; "landing": where the leg ends with v_c = 0, how far the force is within
    the friction bound if stick follows, or beyond it if the drift is reversed.
    """

    kind: str
    leg: int
    guard: Guard | None
    value: Number
    time: Number

    def named(self, word: Word) -> str:
        """The inequality in words; legs count from 1, from where the paper begins a word."""
        what = f" of {self.guard.value}" if self.guard else ""
        word = word.whole
        number = (self.leg - word.first) % len(word) + 1
        return f"{self.kind}{what} in leg {number}, F{word.fields[self.leg]}"


def inequalities(
    numbers: Backend, word: Word, shot: Shot, born: int | None = None
) -> list[Inequality]:
    """All inequalities of a word at a solution of its equations, shape (many,).

    The minima are those inside the leg, proved to be all; at its ends the word's equations and
    the other inequalities hold the guards. Next to a leg of negative duration there are none. The
    leg with index `born`, if given, has the duration 0: what is 0 with it is left out. Of a motion
    that is its own mirror image what comes in pairs is looked at in the first half, the gap in
    both; where beta = 0 the gap is free.
    """
    found = []
    n, spans = len(word), shot.spans
    for i, span in enumerate(spans):
        if i == born:
            continue
        before, after = (i - 1) % n, (i + 1) % n
        found.append(Inequality(DURATION, i, None, span.h, span.h))
        # A leg of negative duration takes the inequalities of its neighbours with it.
        if any(spans[k].h <= 0 for k in (before, i, after) if k != born):
            continue
        if span.leg.guard is Guard.DRIFT and after != born:
            found.append(Inequality(LANDING, i, None, _landing(word, spans, i), span.h))
        if word.mirrored and span.c.beta != 0:
            found += _gaps(numbers, word, span, i)
        for guard, time, value in minima(numbers, span, _zeros(word, i)):
            if word.mirrored and guard is Guard.GAP:
                continue
            near = _NEAR * span.h
            if (before == born and time < near) or (after == born and span.h - time < near):
                continue
            # A drift that sets off the wrong way fails by the landing before it.
            if guard is not Guard.DRIFT or not _reversed_wrongly(word, spans, before):
                found.append(Inequality(MINIMUM, i, guard, value, time))
    return found


def _gaps(numbers: Backend, word: Word, span: Span, leg: int) -> Iterator[Inequality]:
    """The least gaps in a leg and in its mirror image."""
    for kind, time, value in turns(numbers, span, Quantity.GAP, _zeros(word, leg)):
        if kind < 0:
            yield Inequality(MINIMUM, leg, Guard.GAP, -value, time)
            continue
        value = value + 2 * span.c.delta
        if len(word.whole) == 1:
            yield Inequality(MINIMUM, leg, Guard.GAP, value, time + span.h)
        else:
            yield Inequality(MINIMUM, leg + len(word), Guard.GAP, value, time)


def tightest(orbit: Orbit) -> Inequality:
    """The inequality of an orbit's word with the least value."""
    with backend(orbit.backend) as numbers:
        return min(inequalities(numbers, orbit.word, orbit.shot), key=lambda one: one.value)


def _zeros(word: Word, leg: int) -> dict[Guard, int]:
    """The guards that vanish at a leg's start, by the guard that ended the leg before."""
    before = word.legs[leg - 1].guard
    if before is Guard.GAP:
        return {Guard.GAP: 1}
    if before is Guard.DRIFT:
        return {Guard.DRIFT: 1}
    return {Guard.DRIFT: 2} if before else {}


def _reversed_wrongly(word: Word, spans: Sequence[Span], before: int) -> bool:
    return spans[before].leg.guard is Guard.DRIFT and _landing(word, spans, before) <= 0


def _landing(word: Word, spans: Sequence[Span], leg: int) -> Number:
    span, following = spans[leg], spans[(leg + 1) % len(spans)]
    force = following.closed.margin + following.c.friction
    if word.mirrored and leg % len(spans) == len(spans) - 1:
        force = -force
    beyond = span.c.f_b + span.c.drift * force
    return -beyond if following.c.drift else beyond


def realised(orbit: Orbit) -> bool:
    """Whether the certified map, run for the orbit's periods, goes through the same word.

    Where beta = 0 a word without contact stands for those with any.
    """
    fields = tuple(segment.field for segment in rerun(orbit).segments)
    if orbit.parameters.beta == 0 and not any(map(contact, orbit.word.fields)):
        fields = tuple(field for field, _ in groupby(2 - drift(field) for field in fields))
    expected = orbit.word.rotated(_longest(orbit)).fields
    if len(expected) == 1:
        return fields == expected
    return fields[: len(expected) + 1] == (*expected, expected[0])


def rerun(orbit: Orbit) -> Trajectory:
    """The certified map over the orbit's periods and one more.

    It starts in the middle of the longest leg, where nothing is at its bound.
    """
    parameters = orbit.parameters
    state, angle = _middle(orbit.shot.spans[_longest(orbit)])
    phase = min(angle / parameters.omega, math.nextafter(parameters.period, 0.0))
    return simulate(parameters, state, phase, orbit.word.multiple + 1)


def _longest(orbit: Orbit) -> int:
    return max(range(len(orbit.word)), key=lambda i: float(orbit.shot.spans[i].h))


def _middle(span: Span) -> tuple[tuple[float, float, float], float]:
    """State in the middle of a leg, and the forcing angle there in [0, 2 pi)."""
    with backend("numpy") as numbers:
        h = float(span.h) / 2
        c = type(span.c)(*map(float, span.c))
        closed = type(span.closed)(*map(float, span.closed))
        position, v_r, *change = numbers.kernels.flow(c, closed, h)
        v_c = closed.v_c + change[0] if c.drift else 0.0
        return (closed.x_r + position, float(v_r), v_c), float(span.angle + c.omega * h) % math.tau
