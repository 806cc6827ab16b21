"""The inequalities of an orbit's word: what must hold for the motion to be what its word says."""

from __future__ import annotations

import math
from typing import NamedTuple

from capsule_sym.map import Trajectory, simulate
from capsule_sym.map.backend import Backend, Number, backend
from capsule_sym.map.expansion import Guard
from capsule_sym.orbits.equations import Shot, Span
from capsule_sym.orbits.extrema import minima
from capsule_sym.orbits.orbit import Orbit
from capsule_sym.orbits.word import Word

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
        number = (self.leg - word.first) % len(word) + 1
        return f"{self.kind}{what} in leg {number}, F{word.fields[self.leg]}"


def inequalities(
    numbers: Backend, word: Word, shot: Shot, born: int | None = None
) -> list[Inequality]:
    """All inequalities of a word at a solution of its equations, shape (many,).

    The minima are those inside the leg, proved to be all; at its ends the word's equations and
    the other inequalities hold the guards. Next to a leg of negative duration there are none. The
    leg with index `born`, if given, has the duration 0: what is 0 with it is left out.
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
            found.append(Inequality(LANDING, i, None, _landing(span, spans[after]), span.h))
        for guard, time, value in minima(numbers, span, _zeros(word, i)):
            near = _NEAR * span.h
            if (before == born and time < near) or (after == born and span.h - time < near):
                continue
            # A drift that sets off the wrong way fails by the landing before it.
            if guard is not Guard.DRIFT or not _reversed_wrongly(spans[before], span):
                found.append(Inequality(MINIMUM, i, guard, value, time))
    return found


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


def _reversed_wrongly(before: Span, span: Span) -> bool:
    return before.leg.guard is Guard.DRIFT and _landing(before, span) <= 0


def _landing(span: Span, following: Span) -> Number:
    force = following.closed.margin + following.c.friction
    beyond = span.c.f_b + span.c.drift * force
    return -beyond if following.c.drift else beyond


def realised(orbit: Orbit) -> bool:
    """Whether the certified map, run for the orbit's periods, goes through the same word."""
    fields = tuple(segment.field for segment in rerun(orbit).segments)
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
