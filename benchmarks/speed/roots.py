"""Newton's method beside Brent's, on the same brackets: time and evaluations against error.

The reference backends solve a bracket that is proved to hold one switch by Brent's method, the C
core by Newton's, held to the bracket. Here both are written in Python over the closed form.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from statistics import fmean
from typing import NamedTuple

from scipy.optimize import brentq

from benchmarks.hardcases.cases import guard_at
from benchmarks.speed.model import Start
from capsule_sym._map.interface import (
    Course,
    End,
    Guard,
    NumpyBackend,
    Run,
    SegmentStart,
    State,
    backend,
    locate,
    start_at,
)

TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-12, 1e-15)
"""Relative to the switching time."""

_WIDTH = 0.25  # of the widest bracket before the switching time, relative to it
_UNEVEN = 0.7  # times as much after it, so that no root is in the middle
_LEAST_RTOL = 2.0**-50  # that `brentq` takes


class Root(NamedTuple):
    """A method at one tolerance, over the switches of some runs."""

    method: str
    """"Brent" or "Newton"."""
    tolerance: float
    us_per_root: float
    evaluations: float
    """Of the closed form, in the mean."""
    max_error: float
    """Of a switching time, relative to it, by 50 digits."""


class Bracket(NamedTuple):
    """A guard that decreases from low to high through one zero, at `true` by 50 digits."""

    flow: Course
    guard: Guard
    low: float
    high: float
    true: object


def roots(starts: Sequence[Start]) -> list[Root]:
    """Both methods at each tolerance, on every switch of the runs."""
    brackets = [bracket for start in starts for bracket in _brackets(start)]
    return [
        _row(name, method, tolerance, brackets)
        for tolerance in TOLERANCES
        for name, method in (("Brent", _brent), ("Newton", _newton))
    ]


Method = Callable[[Bracket, float], float]


def _row(name: str, method: Method, tolerance: float, brackets: Sequence[Bracket]) -> Root:
    before = [bracket.flow.evaluations for bracket in brackets]
    begin = time.thread_time()
    found = [method(bracket, tolerance) for bracket in brackets]
    spent = time.thread_time() - begin
    made = [b.flow.evaluations - n for b, n in zip(brackets, before, strict=True)]
    errors = [
        abs(float((h - b.true) / b.true))  # type: ignore[operator]
        for h, b in zip(found, brackets, strict=True)
    ]
    return Root(name, tolerance, spent / len(found) * 1e6, fmean(made), max(errors))


def _brent(b: Bracket, tolerance: float) -> float:
    def value(h: float) -> float:
        return float(guard_at(b.flow, b.guard, b.flow(h)))

    rtol = max(tolerance, _LEAST_RTOL)
    return float(brentq(value, b.low, b.high, xtol=tolerance * b.low, rtol=rtol))


def _newton(b: Bracket, tolerance: float) -> float:
    low, high = b.low, b.high
    h = (low + high) / 2
    while True:
        value, slope = _value_and_slope(b, h)
        if value == 0.0:
            return h
        low, high = (h, high) if value > 0 else (low, h)
        step = -value / slope if slope else high - low
        inside = low < h + step < high
        h = h + step if inside else (low + high) / 2
        if (inside and abs(step) <= tolerance * h) or high - low <= _LEAST_RTOL * h:
            return h


def _value_and_slope(b: Bracket, h: float) -> tuple[float, float]:
    c, point = b.flow.c, b.flow(h)
    value = float(guard_at(b.flow, b.guard, point))
    if b.guard is Guard.GAP:
        return value, float(point.v_r if c.contact else -point.v_r)
    if b.guard is Guard.DRIFT:
        return value, float(c.drift * c.v_c_rate(point.margin))
    rate = c.v_rate(point.x_r, point.gap, point.v_r, point.cos_theta)
    rising = float(c.force_change(point.v_r, rate))
    return value, -rising if b.guard is Guard.UPPER else rising


def _brackets(start: Start) -> Iterator[Bracket]:
    run = _Located(NumpyBackend(), start.parameters, escalate=True)
    run.found = []
    run.go(start.state, 0.0, start.periods, 10**6)
    for flow, true in run.found:
        guard, width = true.guards[0], _WIDTH
        time = float(true.duration)
        while width > 2.0**-20:
            low, high = time * (1 - width), time * (1 + _UNEVEN * width)
            if guard_at(flow, guard, flow(low)) > 0 > guard_at(flow, guard, flow(high)):
                yield Bracket(flow, guard, low, high, true.duration)
                break
            width /= 2


class _Located(Run):
    """A run of which every switch is also located in 50 digits, from the same start."""

    found: list[tuple[Course, End]]

    def first_switch(self, state: State, begin: SegmentStart, limit: float) -> tuple[Course, End]:
        flow, switch = super().first_switch(state, begin, limit)
        with backend("mpmath") as numbers:
            c = numbers.constants(begin.field, self.parameters)
            given = start_at(c, self.exactly(numbers, state))
            exact = SegmentStart(begin.field, given._replace(zeros=begin.start.zeros))
            true = locate(Course(numbers, c, exact), numbers.number(limit))
        if true.certain and true.guards:
            self.found.append((flow, true))
        return flow, switch
