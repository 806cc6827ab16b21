"""The first switch of a segment, certified: every earlier time is excluded by a bound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from capsule_sym.errors import Outcome
from capsule_sym.map.backend import Backend, Number
from capsule_sym.map.expansion import Guard, Point, expand, watched
from capsule_sym.map.isolation import Search, search

_REACH = 3  # how far an expansion is tried, over the fastest rate of the segment
_SHRINK = 8
_ERROR_UNITS = 8  # rounding of the kernels, in units of their largest terms; measured: below 4


class Start(NamedTuple):
    """The start of a segment: state, forcing angle, and which guards vanish there exactly.

    `zeros` gives, for each such guard, how many derivatives from the guard itself on vanish.
    """

    x_r: Number
    gap: Number
    v_r: Number
    v_c: Number
    margin: Number
    angle: Number
    zeros: Mapping[Guard, int]


@dataclass(frozen=True)
class Switch:
    """The end of a segment: when, which guard fired, the state there, and how it was found.

    `guard` is None for outcomes at which no guard fired. `evaluations` counts evaluations of the
    closed form.
    """

    outcome: Outcome
    guard: Guard | None
    duration: Number
    point: Point
    evaluations: int


class Flow:
    """The closed form of one segment from one start, with error bounds and a count of calls."""

    def __init__(self, backend: Backend, c: Any, start: Start) -> None:
        self.backend, self.c, self.start = backend, c, start
        self.evaluations = 0
        cosine, sine = backend.cos_sin(start.angle)
        self.closed = backend.kernels.Start(
            start.x_r, start.gap, start.v_r, start.v_c, start.margin, cosine, sine
        )
        zero = start.x_r * 0
        self.origin = Point(
            start.x_r, start.gap, start.v_r, start.v_c, start.margin, cosine, sine, zero, zero, zero
        )
        self._force = abs(c.push) + c.m * (abs(start.x_r) + c.kappa * abs(start.gap))
        self._root_K = backend.sqrt(c.K)

    def __call__(self, h: Number) -> Point:
        """The point at a duration h > 0."""
        self.evaluations += 1
        c, start, number = self.c, self.start, self.backend.number
        values = self.backend.kernels.flow(c, self.closed, h)
        position, v_r = number(values[0]), number(values[1])
        x_r, gap = start.x_r + position, start.gap + position
        v_c = start.v_c + number(values[2]) if c.drift else start.v_c
        cosine, sine = self.backend.cos_sin(start.angle + c.omega * h)
        margin = x_r + c.kappa * gap + 2 * c.zeta * v_r - c.friction
        return Point(x_r, gap, v_r, v_c, margin, cosine, sine, *self._errors(h, x_r, v_r, v_c))

    def _errors(
        self, h: Number, x_r: Number, v_r: Number, v_c: Number
    ) -> tuple[Number, Number, Number]:
        """Bounds on the errors of x_r, v_r and v_c, from the largest terms of the closed form."""
        c, start, unit = self.c, self.start, self.backend.unit
        g = min(h, 1 / c.fast)
        terms_x = (
            abs(start.v_r) * g
            + self._force * min(h * h / 2, 2 / c.K)
            + c.alpha * min(h * h / 2, h / self._root_K)
        )
        terms_v = abs(start.v_r) + self._force * g + c.alpha * h
        units = _ERROR_UNITS * unit * (1 + c.rate * h)
        error_x = units * terms_x + unit * abs(x_r)
        error_v = units * terms_v
        if not c.drift:
            return error_x, error_v, h * 0
        if c.rate * h < 1:
            grown = (1 + c.kappa) * terms_x * h + 2 * c.zeta * (terms_x + abs(start.v_r) * h)
            terms = (abs(start.margin) * h + grown) / c.gamma
        else:
            terms = (abs(start.v_r) + terms_v + (abs(c.friction) + c.alpha) * h) / (c.gamma + 1)
        return error_x, error_v, units * terms + unit * abs(v_c)

    def guard(self, guard: Guard, point: Point) -> Number:
        """Value of a guard at a point."""
        c = self.c
        if guard is Guard.GAP:
            return point.gap if c.contact else -point.gap
        if guard is Guard.DRIFT:
            return c.drift * point.v_c
        return c.f_b - point.margin if guard is Guard.UPPER else c.f_b + point.margin


def locate(flow: Flow, limit: Number) -> Switch:
    """The first switch of the segment within (0, limit].

    The outcome is REGULAR (one guard crosses zero), CORNER (two do, and are not told apart),
    GRAZE or SLIDING_TANGENCY (a guard comes within its error bound of zero without a certain
    crossing), or END (proved: no guard fires up to the limit).
    """
    backend, c = flow.backend, flow.c
    unit = backend.unit
    now, at = limit * 0, flow.origin
    zeros: Mapping[Guard, int] = flow.start.zeros
    reach = _REACH / c.rate
    while True:
        expansions = expand(backend, c, at)
        ahead = min(reach, limit - now)
        while True:
            searches = {
                guard: search(expansions[guard], zeros.get(guard, 0), ahead, unit)
                for guard in watched(c)
            }
            found = {g: s for g, s in searches.items() if s.bracket is not None}
            horizon = min(s.clear for s in searches.values())
            if horizon > 0 or ahead <= 4 * unit * (now + 1 / c.rate):
                break
            ahead = ahead / _SHRINK
        if found:
            switch = _first(flow, now, searches, found)
            if switch is not None:
                return switch
        if horizon <= 4 * unit * now:
            return _undecided(flow, now, at, searches)
        if now + horizon >= limit:
            return Switch(Outcome.END, None, limit, flow(limit), flow.evaluations)
        now, zeros = now + horizon, {}
        at = flow(now)


def _first(
    flow: Flow, now: Number, searches: Mapping[Guard, Search], found: Mapping[Guard, Search]
) -> Switch | None:
    """The switch, if one bracket comes before whatever else is possible; None if that is open."""
    order = sorted(found, key=lambda g: found[g].bracket[1])  # type: ignore[index]
    first = order[0]
    low, high = found[first].bracket  # type: ignore[misc]
    rivals = [g for g, s in searches.items() if g is not first and s.clear < high]
    if any(g not in found for g in rivals):
        return None
    root = _polish(flow, first, now + low, now + high)
    others = [
        (_polish(flow, g, now + found[g].bracket[0], now + found[g].bracket[1]), g)  # type: ignore[index]
        for g in rivals
    ]
    point = flow(root)
    for other, guard in others:
        if abs(other - root) <= _time_error(flow, first, root) + _time_error(flow, guard, other):
            return Switch(Outcome.CORNER, first, root, point, flow.evaluations)
        if other < root:
            first, root, point = guard, other, flow(other)
    return Switch(Outcome.REGULAR, first, root, point, flow.evaluations)


def _polish(flow: Flow, guard: Guard, low: Number, high: Number) -> Number:
    """The root in a bracket that holds exactly one, by Brent's method on the closed form."""
    known: dict[Number, Number] = {}

    def value(h: Number) -> Number:
        if h not in known:
            known[h] = flow.guard(guard, flow(h) if h > 0 else flow.origin)
        return known[h]

    # Rounding may hide the sign at an end of a bracket as narrow as the error: then it is the root.
    if value(low) <= 0:
        return low
    if value(high) >= 0:
        return high
    return flow.backend.polish(value, low, high)


def _time_error(flow: Flow, guard: Guard, h: Number) -> Number:
    """Bound on the error of a switching time: that of the guard over its slope, and rounding."""
    point = flow(h)
    expansion = expand(flow.backend, flow.c, point)[guard]
    slope = abs(expansion.values[1])
    return expansion.errors[0] / slope + 4 * flow.backend.unit * h


def _undecided(
    flow: Flow, now: Number, at: Point, searches: Mapping[Guard, Search]
) -> Switch:
    """What it is called where a guard stays within its error bound of zero."""
    stuck = [guard for guard, s in searches.items() if s.clear <= 4 * flow.backend.unit * now]
    if len(stuck) > 1:
        outcome = Outcome.CORNER
    elif stuck[0] is Guard.GAP:
        outcome = Outcome.GRAZE
    else:
        outcome = Outcome.SLIDING_TANGENCY
    return Switch(outcome, stuck[0], now, at, flow.evaluations)
