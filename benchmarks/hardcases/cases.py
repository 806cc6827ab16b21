"""The hard cases by name: starts built so that a switch is hard to see, or easy to invent."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from benchmarks.hardcases.reference import Start
from capsule_sym import Parameters
from capsule_sym._map.interface import (
    Backend,
    Begin,
    Course,
    Guard,
    Number,
    Point,
    SegmentStart,
    backend,
    side_of,
)

_DISTANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-15)
_DURATIONS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
_EIGENFREQUENCIES = {1: 3.0, 2: 1.0, 4: 6.0, 5: 2.0}
"""Undamped eigenfrequencies of the four oscillators at beta = 3, gamma = 1/8: all are exact."""


@dataclass(frozen=True)
class Case:
    """A hard case: its name, what is hard about it, and how to build the start of its run."""

    name: str
    hard: str
    build: Callable[[], Start]


def cases() -> Iterator[Case]:
    """All hard cases, in the order of the table."""
    for group in (
        _grazes,
        _exact_tangencies,
        _sliding_tangencies,
        _onsets,
        _short,
        _corners,
        _slow_corners,
        _twins,
        _places,
        _damping,
        _resonance,
        _scales,
        _rest,
        _long,
    ):
        yield from group()


# Tangencies: the velocity at the start is solved for in 50 digits, then rounded to a double.


@dataclass(frozen=True)
class _Approach:
    """Starts of one field whose guard has a minimum soon; it is zero near `touch`, a (v_r, h)."""

    parameters: Parameters
    field: int
    x_r: float
    v_c: float
    phase: float
    guard: Guard
    touch: tuple[float, float]

    def near(self, distance: float) -> Start:
        """The start whose guard has a minimum of -distance."""
        from capsule_sym._map.interface import workspace

        with backend("mpmath") as numbers:

            def excess(v_r: Number, h: Number) -> tuple[Number, Number]:
                """The guard above -distance, and its rate."""
                begun = (self.field, self.x_r, v_r, self.v_c, self.phase)
                flow = flow_from(numbers, self.parameters, *begun)
                point = flow(h)
                above = guard_at(flow, self.guard, point) + numbers.number(distance)
                return above, _rate(flow, self.guard, point)

            v_r, _ = workspace().findroot(excess, self.touch, tol=1e-40)
        return Start(self.parameters, (self.x_r, float(v_r), self.v_c), self.phase, periods=2)


def guard_at(flow: Course, guard: Guard, point: Point) -> Number:
    """Value of a guard at a point."""
    c = flow.c
    if guard is Guard.GAP:
        return side_of(c) * point.gap
    if guard is Guard.BACK:
        return point.other
    if guard is Guard.DRIFT:
        return c.drift * point.v_c
    return c.friction_guard(-1 if guard is Guard.UPPER else 1, point.margin)


def flow_from(
    numbers: Backend,
    parameters: Parameters,
    field: int,
    x_r: Number,
    v_r: Number,
    v_c: Number,
    phase: float,
) -> Course:
    """The closed form of a field from any state."""
    number = numbers.number
    c = numbers.constants(field, parameters)
    x_r, v_r, v_c = number(x_r), number(v_r), number(v_c)
    gap = x_r - c.delta
    margin = c.margin_at(x_r, gap, v_r)
    angle = number(phase) * c.omega
    return Course(numbers, c, SegmentStart(field, Begin(x_r, gap, v_r, v_c, margin, angle, {})))


def _rate(flow: Course, guard: Guard, at: Point) -> Number:
    """Time derivative of a guard, from the equation of motion."""
    c = flow.c
    side = 1 if c.contact else -1
    if guard is Guard.GAP:
        return side * at.v_r
    change = c.v_rate(at.x_r, at.gap, at.v_r, at.cos_theta)
    rate = c.force_change(at.v_r, change)
    return -rate if guard is Guard.UPPER else rate


_CASE = Parameters(omega=1.0)
_APPROACHES = {
    "graze from F2": _Approach(_CASE, 2, -0.3, 0.0, 2.5, Guard.GAP, (0.59, 0.98)),
    "graze from F1": _Approach(_CASE, 1, -0.3, 1.5, 2.5, Guard.GAP, (0.36, 1.48)),
    "graze from F5": _Approach(_CASE, 5, 0.2, 0.0, 5.5, Guard.GAP, (-0.37, 0.79)),
    "graze from F6": _Approach(_CASE, 6, 0.2, -1.5, 5.5, Guard.GAP, (-0.13, 1.26)),
    "sliding tangency on L3": _Approach(_CASE, 5, 0.2, 0.0, 0.0, Guard.UPPER, (0.24, 1.01)),
    "sliding tangency on L2": _Approach(_CASE, 2, -0.5, 0.0, 2.5, Guard.LOWER, (-0.38, 1.61)),
}


def _tangencies(kind: str, hard: str) -> Iterator[Case]:
    for name, approach in _APPROACHES.items():
        if not name.startswith(kind):
            continue
        for distance in _DISTANCES:
            for side, word in ((1, "past"), (-1, "short of")):
                start = partial(approach.near, side * distance)
                yield Case(f"{name}, {distance:.0e} {word} it", hard, start)


def _grazes() -> Iterator[Case]:
    return _tangencies("graze", "a pair of crossings, or none")


def _sliding_tangencies() -> Iterator[Case]:
    return _tangencies("sliding", "a slip begins, or the capsule stays")


def _exact_tangencies() -> Iterator[Case]:
    free = Parameters(alpha=0.0, zeta=0.0, omega=1.0)
    graze = partial(Start, free.replace(delta=0.5), (-0.5, 0.0, 0.0), max_segments=3)
    yield Case("exact graze", "x_r = -cos(h)/2 only touches delta = 1/2", graze)
    slide = partial(Start, free.replace(delta=2.0), (0.0, 1.0, 0.0), max_segments=3)
    yield Case("exact sliding tangency", "P = sin(h) only touches f_b = 1", slide)


def _onsets() -> Iterator[Case]:
    base = Parameters(zeta=0.0, delta=2.0, omega=1.0)
    for name, alpha, state, zeros in (
        ("double zero at a slip's start", 0.5, (1.0, 0.25, 0.0), "v_c and v_c'"),
        ("double zero, backward", 0.5, (-1.0, -0.25, 0.0), "v_c and v_c'"),
        ("triple zero at a slip's start", 1.5, (1.0, 0.0, 0.0), "v_c, v_c' and v_c''"),
        ("triple zero, no slip", 0.5, (1.0, 0.0, 0.0), "v_c, v_c' and v_c''"),
        ("fivefold zero, no slip", 1.0, (1.0, 0.0, 0.0), "five derivatives"),
    ):
        yield Case(name, f"{zeros} vanish there", partial(Start, base.replace(alpha=alpha), state))


def _short() -> Iterator[Case]:
    impact = Parameters(omega=1.0)
    # x_r'' = -delta at the start of the contact, as the phase is that of no force.
    for duration in _DURATIONS:
        state = (impact.delta, duration * impact.delta / 2, 0.0)
        start = partial(Start, impact, state, math.pi / 2)
        yield Case(f"contact of {duration:.0e}", "both ends within one step", start)
    slip = Parameters(zeta=0.0, delta=2.0, omega=1.0, alpha=0.5)
    # P' = v_r and P'' = -1/2 at the start of the slip.
    for duration in _DURATIONS:
        start = partial(Start, slip, (1.0, duration / 6, 0.0))
        yield Case(f"slip of {duration:.0e}", "starts and ends within one step", start)


# Corners: x_r and v_c at the start are solved for so that both vanish at one time.


def _meeting(parameters: Parameters, field: int, v_r: float, impact: float, stop: float) -> Start:
    """A start with x_r = delta at one duration and v_c = 0 at another; both are affine in it."""
    with backend("mpmath") as numbers:
        at_zero, at_one = (
            flow_from(numbers, parameters, field, x, v_r, 0, 0.0)(numbers.number(impact)).gap
            for x in (0, 1)
        )
        x_r = -at_zero / (at_one - at_zero)
        stopped = flow_from(numbers, parameters, field, x_r, v_r, 0, 0.0)(numbers.number(stop))
        return Start(parameters, (float(x_r), v_r, -float(stopped.v_c)))


_CORNERS = Parameters(omega=1.0, zeta=0.25, delta=0.5, gamma=3.0)


def _corners() -> Iterator[Case]:
    for line, field, v_r in (
        ("L5", 3, 6.0),
        ("L6", 1, 1.0),
        ("L6", 3, 1.5),
        ("L7", 4, -1.0),
        ("L7", 6, -0.5),
        ("L8", 4, -9.0),
    ):
        start = partial(_meeting, _CORNERS, field, v_r, 0.25, 0.25)
        yield Case(f"corner on {line} from F{field}", "x_r = delta and v_c = 0 at once", start)


def _slowly(parameters: Parameters, field: int, speed: float) -> Start:
    """A corner after a duration of 1, passed at a speed, which is affine in v_r at the start."""
    with backend("mpmath") as numbers:
        at_zero, at_one = (
            flow_from(numbers, parameters, field, start.state[0], v_r, 0, 0.0)(
                numbers.number(1)
            ).v_r
            for v_r in (0.0, 1.0)
            for start in (_meeting(parameters, field, v_r, 1.0, 1.0),)
        )
    return _meeting(parameters, field, float((speed - at_zero) / (at_one - at_zero)), 1.0, 1.0)


def _slow_corners() -> Iterator[Case]:
    for field, sign in ((3, 1), (4, -1)):
        for speed in (1e-2, 1e-3, 1e-4, 1e-6):
            name = f"corner from F{field} at a speed of {speed:.0e}"
            start = partial(_slowly, _CORNERS, field, sign * speed)
            yield Case(name, "rounding moves the impact far, the stop not", start)


def _twins() -> Iterator[Case]:
    for gap in (2.0**-54, 2.0**-53, 2.0**-52, 1e-14, 1e-12):
        for field, v_r in ((1, 1.0), (4, -1.0)):
            start = partial(_meeting, _CORNERS, field, v_r, 0.25, 0.25 + gap)
            name = f"two switches {gap:.1e} apart from F{field}"
            yield Case(name, "one ulp of time between them", start)


def _places() -> Iterator[Case]:
    p = Parameters(alpha=0.7, gamma=3.0, zeta=0.25, delta=0.5)
    for place, state in PLACES.items():
        yield Case(f"start on {place}", "guards vanish at the start", partial(Start, p, state))


PLACES = {
    "S1": (-0.5, 4.0, 0.0),
    "S2": (0.0, 0.0, 0.0),
    "S3": (-0.5, -4.0, 0.0),
    "S4": (0.75, 2.0, 0.0),
    "S5": (0.6, 0.0, 0.0),
    "S6": (0.75, -9.0, 0.0),
    "S7": (0.5, 4.0, 0.1),
    "S8": (0.5, -4.0, 0.1),
    "S9": (0.5, 4.0, -0.1),
    "S10": (0.5, -4.0, -0.1),
    "L1": (0.0, 2.0, 0.0),
    "L2": (0.0, -2.0, 0.0),
    "L2, back into stick": (-1.5, 1.0, 0.0),
    "L3": (0.75, -0.25, 0.0),
    "L4": (0.75, -4.25, 0.0),
    "L5": (0.5, 4.0, 0.0),
    "L6": (0.5, 0.5, 0.0),
    "L7": (0.5, -0.5, 0.0),
    "L8": (0.5, -4.0, 0.0),
    "L9, forward": (0.5, 0.0, 0.2),
    "L9, backward": (0.5, 0.0, -0.2),
    "O1": (0.5, 1.0, 0.0),
    "O2": (0.5, -3.0, 0.0),
    "O3": (0.5, 0.0, 0.0),
}
"""A state on every surface, line and corner point, at zeta = 1/4, delta = 1/2, beta = 3/2."""


def _start_in(field: int) -> tuple[float, float, float]:
    """A state within a field, whatever the damping."""
    return {1: (-0.3, 0.4, 0.5), 2: (-0.3, 0.0, 0.0), 4: (0.3, 0.4, 0.5), 5: (0.05, 0.0, 0.0)}[
        field
    ]


def _damping() -> Iterator[Case]:
    for zeta in (0.0, 1e-12, 10.0, 1e3):
        start = partial(Start, Parameters(zeta=zeta), (0.3, 0.4, 0.5))
        yield Case(f"zeta = {zeta:g}", "undamped to stiff", start)
    base = Parameters(beta=3.0, gamma=1.0)
    critical = {1: math.sqrt(0.5), 2: 1.0, 4: math.sqrt(2.0), 5: 2.0}
    for field, zeta in critical.items():
        for value, word in (
            (zeta, "critical"),
            (math.nextafter(zeta, 0.0), "one ulp below critical"),
            (math.nextafter(zeta, 9.0), "one ulp above critical"),
        ):
            start = partial(Start, base.replace(zeta=value), _start_in(field))
            yield Case(f"F{field} {word}", "the eigenvalues meet", start)


def _resonance() -> Iterator[Case]:
    base = Parameters(beta=3.0, gamma=0.125, alpha=0.1)
    for field, frequency in _EIGENFREQUENCIES.items():
        for zeta in (0.0, 1e-9):
            for beside in (0.0, 1e-12):
                p = base.replace(zeta=zeta, omega=frequency + beside)
                omega = f"{frequency:g}{' + 1e-12' if beside else ''}"
                name = f"F{field} at omega = {omega}, zeta = {zeta:g}"
                yield Case(
                    name, "forcing meets an eigenfrequency", partial(Start, p, _start_in(field))
                )


def _scales() -> Iterator[Case]:
    def varied(name: str, values: tuple[float, ...], hard: str, **others: Any) -> Iterator[Case]:
        for value in values:
            p = Parameters(**{name: value})
            yield Case(f"{name} = {value:g}", hard, partial(Start, p, **others))

    yield from varied("beta", (0.0, 1e2, 1e4, 1e8), "contacts down to 1e-4", periods=2)
    yield from varied("gamma", (1e-6, 1e-3, 1e3, 1e6), "light to heavy capsule", periods=2)
    yield from varied("alpha", (0.0, 1e-12, 1e3, 1e6), "weak to strong forcing", periods=2)
    yield from varied("delta", (0.0, 1.0, 2.0), "no L6 from delta = f_b on", periods=2)
    yield from varied("omega", (1e-4, 1e4), "slow to fast forcing", state=(0.3, 0.4, 0.5))
    many = partial(Start, Parameters(omega=1e-4, zeta=1e-3), (0.0, 0.5, 0.0), max_segments=20)
    yield Case("omega = 1e-4, free oscillations", "thousands within one forcing period", many)
    stiff = partial(Start, Parameters(omega=1e-4, zeta=1e3), (0.3, 0.4, 0.5))
    yield Case("omega = 1e-4, zeta = 1000", "rates from 1e-4 to 1e3", stiff)
    for state in ((1e12, -1e12, 1e12), (-1e12, 1e12, -1e12)):
        start = partial(Start, Parameters(), state)
        yield Case(f"state at {state[0]:g}", "terms 1e12 times the guards' scale", start)


def _rest() -> Iterator[Case]:
    for alpha in (0.0, 0.005):
        start = partial(Start, Parameters(alpha=alpha), (0.3, 0.2, 0.1), 0.0, 100, max_segments=60)
        yield Case(f"decay to rest, alpha = {alpha:g}", "must end, not loop", start)
    on_impact = partial(Start, Parameters(alpha=0.0, delta=0.0))
    yield Case("at rest on the impact surface", "all derivatives vanish", on_impact)


def _long() -> Iterator[Case]:
    start = partial(Start, Parameters(alpha=0.005), periods=10**6)
    yield Case("10^6 periods of stick", "a segment of 8e6", start)
