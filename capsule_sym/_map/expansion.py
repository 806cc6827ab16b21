"""Taylor expansions of a segment's guards, with certain bounds on remainder and rounding error.

A guard is positive inside the segment's region and fires where it vanishes:

    gap     +-(x_r - stop), the sign that of contact      (every segment)
    back    x_r + delta_2                                 (without contact, between two stops)
    drift   drift * v_c                                   (drifting segments)
    upper   f_plus - Q,   lower   f_minus + Q             (sticking segments)

with Q the pull on the capsule, which is the interaction force P less a drive that reacts. From the
state at one instant, the equation of motion gives their derivatives to any order. The remainder is
bounded by an energy argument: y = x_r^(n) obeys y'' + 2 sigma y' + K y = (drive), so that sqrt(y'^2
+ K y^2) grows at most by the size of the drive per unit of time, whatever the damping, at resonance
as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from math import factorial
from typing import Any, NamedTuple

from capsule_sym._map.backend import Backend, Number


class Guard(Enum):
    """A condition of the present segment; it fires where its function vanishes.

    The gap is that at the stop in front, or at the stop in contact; `BACK` is that of two stops at
    the other one, and `EDGE` the time to the drive's next rise or fall.
    """

    GAP = "gap"
    DRIFT = "drift"
    UPPER = "upper"
    LOWER = "lower"
    BACK = "back gap"
    EDGE = "edge"


class Point(NamedTuple):
    """State and forcing angle within a segment, with error bounds of each quantity.

    `gap` is relative to the field's own stop, `other` to the other one of two (None with one stop);
    `margin` is Q - friction. At a segment's start, which is given, the error bounds are 0 except
    for roundings of the gaps and the angle.
    """

    x_r: Number
    gap: Number
    v_r: Number
    v_c: Number
    margin: Number
    cos_theta: Number
    sin_theta: Number
    error_x: Number
    error_v: Number
    error_v_c: Number
    error_angle: Number
    other: Number = None
    error_other: Number = 0


@dataclass(frozen=True)
class Expansion:
    """A guard about an instant: derivatives g, g', ..., bounds on their errors, and a remainder.

    For every duration d >= 0, |g(d) - sum values[i] d^i / i!| is at most
    sum errors[i] d^i / i! + (rest + growth d) d^n / n!, with n the number of values; each
    derivative of g likewise, with one power of d less.
    """

    values: list[Number]
    errors: list[Number]
    rest: Number
    growth: Number


def watched(c: Any) -> tuple[Guard, ...]:
    """Guards that can fire in a segment with these constants, except edges of the drive."""
    gaps = (Guard.GAP,) if c.contact or not hasattr(c, "stop") else (Guard.GAP, Guard.BACK)
    return (*gaps, Guard.DRIFT) if c.drift else (*gaps, Guard.UPPER, Guard.LOWER)


def pulsed(c: Any) -> bool:
    """True if the drive is constant in a segment, which ends at the next edge at the latest."""
    return hasattr(c, "high")


def side_of(c: Any) -> int:
    """Sign of the gap to the field's own stop within the field: 1 in contact in front, else -1."""
    return 1 if c.contact == 1 else -1


def amplitude_of(c: Any) -> Number:
    """Amplitude of the forcing of x_r: 0 for pulses, whose level is a constant of the field."""
    return c.alpha * 0 if pulsed(c) else c.forcing_terms_size()[0]


def reaction_of(c: Any) -> Number:
    """Amplitude of the drive's own part of the pull Q, which varies with the angle."""
    zero = c.alpha * 0
    return zero if pulsed(c) else c.pull_size(zero, zero, zero)


@lru_cache(maxsize=4)
def factorials(count: int) -> tuple[int, ...]:
    """0! to (count - 1)!."""
    return tuple(factorial(n) for n in range(count))


def expand(backend: Backend, c: Any, at: Point) -> dict[Guard, Expansion]:
    """Expansions of all watched guards of the segment with constants `c` about a point."""
    kernels, unit = backend.kernels, backend.unit
    order = kernels.JET_ORDER
    x = [at.x_r, at.v_r]
    jet = kernels.jet(c, at.x_r, at.gap, at.v_r, at.cos_theta, at.sin_theta)
    # An error of the point counts as a number of roundings of its value.
    sizes = [abs(at.x_r) + at.error_x / unit, abs(at.v_r) + at.error_v / unit]
    gap_size = abs(at.gap) + at.error_x / unit
    bounds = kernels.jet_magnitudes(c, sizes[0], gap_size, sizes[1])
    x += jet[:order]
    sizes += bounds[:order]
    # Each step of the recurrence makes at most five rounding errors of the magnitude, and its
    # constants contribute three more; the forcing also has the error of its angle.
    slack = [(8 * n + 8) * unit + at.error_angle for n in range(order + 2)]
    error_x = [at.error_x, at.error_v] + [slack[n] * sizes[n] for n in range(2, order + 2)]
    p = list(jet[order:])
    error_p = [slack[n + 1] * bounds[order + n] for n in range(order + 1)]

    def energy(n: int) -> Number:
        """sqrt(y'^2 + K y^2) for y = x_r^(n), rounded up."""
        high, low = abs(x[n + 1]) + error_x[n + 1], abs(x[n]) + error_x[n]
        return (1 + 8 * unit) * backend.hypot(high, backend.sqrt(c.K) * low)

    drive = amplitude_of(c) * c.omega ** (order - 1)
    force = (1 + 8 * unit) * c.force_per_energy(backend.sqrt(c.K))
    side, reaction = side_of(c), (1 + 8 * unit) * reaction_of(c)
    expansions = {
        Guard.GAP: Expansion(
            [side * at.gap] + [side * value for value in x[1:order]],
            error_x[:order],
            energy(order - 1),
            drive,
        )
    }
    if Guard.BACK in watched(c):
        expansions[Guard.BACK] = Expansion(
            [at.other, *x[1:order]], [at.error_other, *error_x[1:order]], energy(order - 1), drive
        )
    if c.drift:
        rate = c.v_c_rate
        expansions[Guard.DRIFT] = Expansion(
            [
                c.drift * at.v_c,
                *(c.drift * rate(value) for value in (at.margin, *p[1 : order - 1])),
            ],
            [at.error_v_c, rate(margin_error(c, at, unit))]
            + [rate(error) for error in error_p[1 : order - 1]],
            rate(force * energy(order - 1) + reaction * c.omega ** (order - 1)),
            rate(force * drive),
        )
        return expansions
    rest = force * energy(order) + reaction * c.omega**order
    growth = force * drive * c.omega
    for guard, sign in ((Guard.UPPER, -1), (Guard.LOWER, 1)):
        # In stick the margin is Q itself, unless the start is known to lie on the bound.
        first = c.friction_guard(sign, at.margin)
        expansions[guard] = Expansion(
            [first, *(sign * value for value in p[1:order])],
            [margin_error(c, at, unit) + 2 * unit * abs(first), *error_p[1:order]],
            rest,
            growth,
        )
    return expansions


def margin_error(c: Any, at: Point, unit: Number) -> Number:
    """Bound on the error of Q - friction, from errors of the point and of the summation."""
    added = c.margin_at_size(abs(at.x_r), abs(at.gap), abs(at.v_r))
    carried = c.force_change_size(at.error_x, at.error_v) + at.error_angle * reaction_of(c)
    return carried + c.MARGIN_AT_UNITS * unit * added
