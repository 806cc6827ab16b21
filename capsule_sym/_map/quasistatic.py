"""Expansions for segments that end long before the forcing varies: slow forcing, stiff segments.

The motion is the forced response, a harmonic known exactly, plus a free part. If the segment's own
rates are much faster than the forcing, the free part is soon negligible, but an expansion of the
whole motion reaches no further than those rates allow. Here the forced response is expanded and the
free part only bounded: as a whole by its energy, which never grows. In an overdamped segment its
slow mode is expanded too, and the fast one bounded by its present size.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import (
    Expansion,
    Guard,
    Point,
    amplitude_of,
    pulsed,
    reaction_of,
    side_of,
    watched,
)

_FASTER = 8  # least ratio of the rates of the free and the expanded part


def rate(c: Any, with_slow: bool = True) -> Number | None:
    """Fastest rate that is expanded; None at resonance, or if nothing would be gained."""
    slowest = max(c.omega, -c.slow) if c.q < 0 and with_slow else c.omega
    resonant = not pulsed(c) and c.resonant
    return slowest if c.rate > _FASTER * slowest and not resonant else None


def expand_forced(
    backend: Backend, c: Any, at: Point, derivative: int = 0, with_slow: bool = True
) -> dict[Guard, Expansion]:
    """Expansions of all watched guards, or of a derivative of each, with the fast part bounded.

    The slow mode of an overdamped segment is expanded, or bounded like the rest of the free part.
    The bounds for a derivative hold for its values, not for its slope. Meaningful only away from
    resonance, where the forced response is well defined.
    """
    order, unit = backend.kernels.JET_ORDER, backend.unit
    if not pulsed(c):
        in_phase, rate = c.forced(at.cos_theta, at.sin_theta)
        amplitude = amplitude_of(c) / backend.sqrt(c.Z2)
    else:  # between edges pulses are a part of the centre
        in_phase = rate = amplitude = at.x_r * 0
    quadrature = rate / c.omega
    # x^(n) of the forced response: in_phase and quadrature in turn, the sign changing every two.
    cycle = (in_phase, quadrature, -in_phase, -quadrature)
    steps = [cycle[n % 4] * c.omega**n for n in range(order + 2)]
    sizes = [8 * amplitude * c.omega**n for n in range(order + 2)]

    centre = c.centre()
    y, y_rate = at.x_r - centre - in_phase, at.v_r - c.omega * quadrature
    rounding = 8 * unit + at.error_angle
    error_y = at.error_x + rounding * (abs(at.x_r) + abs(centre) + amplitude)
    error_rate = at.error_v + rounding * (abs(at.v_r) + c.omega * amplitude)
    if c.q < 0 and with_slow:
        fast = -(c.sigma + c.nu)
        slow_part = (y_rate - fast * y) / (2 * c.nu)
        slow_error = (error_rate - fast * error_y) / (2 * c.nu) + rounding * abs(slow_part)
        size = (abs(c.slow * y - y_rate) + error_rate - c.slow * error_y) / (2 * c.nu)
        for n in range(order + 2):
            steps[n] = steps[n] + slow_part * c.slow**n
            spread = 8 * abs(slow_part) + slow_error / unit
            sizes[n] = sizes[n] + spread * abs(c.slow) ** n
        free = _Free(size, -fast * size, abs(c.force_change(1, fast)) * size, -fast)
    else:
        low, high = abs(y) + error_y, abs(y_rate) + error_rate
        root = backend.sqrt(c.K)
        energy = backend.hypot(high, root * low)
        force = c.force_per_energy(root) * energy
        free = _Free(energy / root, 2 * energy, force, 2 * (c.sigma + root))
    return _guards(backend, c, at, centre, steps, sizes, free, derivative)


class _Free(NamedTuple):
    """Bounds on the fast free part: x_r, changes of v_r, P, and the fastest of its rates."""

    x: Number
    v: Number
    force: Number
    fastest: Number


def _guards(
    backend: Backend,
    c: Any,
    at: Point,
    centre: Number,
    x: list[Number],
    sizes: list[Number],
    free: _Free,
    derivative: int,
) -> dict[Guard, Expansion]:
    unit, order = backend.unit, backend.kernels.JET_ORDER
    side, stop = side_of(c), c.own_stop()
    errors = [(unit + at.error_angle) * size for size in sizes]
    zero = x[0] * 0

    def expansion(
        values: list[Number], slack: list[Number], last: Number, size: Number
    ) -> Expansion:
        # Neither the free part nor any of its derivatives grows.
        size = size * free.fastest**derivative
        first, second, *others = slack[derivative:]
        slack = [first + size, second + (0 if derivative else free.fastest * size), *others]
        return Expansion(values[derivative:], slack, last * (1 + 16 * unit), zero)

    rounding = 8 * unit + at.error_angle
    offset = rounding * (abs(centre) + abs(stop))
    gap = [side * (x[0] + (centre - stop)), *(side * value for value in x[1:order])]
    result = {
        Guard.GAP: expansion(
            gap, [errors[0] + offset, *errors[1:order]], abs(x[order]) + sizes[order], free.x
        )
    }
    if Guard.BACK in watched(c):
        behind = getattr(c, backend.scene.facts.STOPS[1][0])
        result[Guard.BACK] = expansion(
            [x[0] + (centre + behind), *x[1:order]],
            [errors[0] + rounding * (abs(centre) + behind), *errors[1:order]],
            abs(x[order]) + sizes[order],
            free.x,
        )
    reaction = reaction_of(c)
    if c.drift:
        # By momentum: (gamma + 1) v_c' = u + load - friction - x_r'', without u if it reacts.
        forcing = c.alpha if not pulsed(c) and not reaction else zero
        cycle = (at.cos_theta, -at.sin_theta, -at.cos_theta, at.sin_theta)
        scale = c.drift / (c.gamma + 1)
        values, slack = [c.drift * at.v_c], [at.error_v_c]
        for n in range(1, order):
            drive = forcing * c.omega ** (n - 1)
            constant = c.friction - load_of(c) if n == 1 else zero
            values.append(scale * (cycle[(n - 1) % 4] * drive - constant - x[n + 1]))
            terms = rounding * (drive + abs(constant)) + errors[n + 1]
            slack.append(terms / (c.gamma + 1))
        last = (forcing * c.omega ** (order - 1) + abs(x[order + 1]) + sizes[order + 1]) / (
            c.gamma + 1
        )
        result[Guard.DRIFT] = expansion(values, slack, last, free.v / (c.gamma + 1))
        return result
    for guard, sign in ((Guard.UPPER, -1), (Guard.LOWER, 1)):
        mean = c.pull(centre, centre - stop, zero, zero)
        own = (at.cos_theta, -at.sin_theta, -at.cos_theta, at.sin_theta)
        values, slack = [], []
        for n in range(order):
            force = c.force_change(x[n], x[n + 1]) - reaction * own[n % 4] * c.omega**n
            first = n == 0
            values.append(c.friction_guard(sign, force + mean) if first else sign * force)
            slack.append(
                c.force_change_size(errors[n], errors[n + 1]) + rounding * reaction * c.omega**n
            )
        slack[0] = slack[0] + rounding * (
            c.friction_bounds() + c.pull_size(abs(centre), abs(centre) + abs(stop), zero)
        )
        last = c.force_change_size(
            abs(x[order]) + sizes[order], abs(x[order + 1]) + sizes[order + 1]
        )
        last = last + reaction * c.omega**order
        result[guard] = expansion(values, slack, last, free.force)
    return result


def load_of(c: Any) -> Number:
    """Constant force on both bodies together, with the pulses' level if they do not react."""
    load = c.load_force()
    if not pulsed(c):
        return load
    zero = load * 0
    return load + c.drive_level() + c.pull(zero, zero, zero)
