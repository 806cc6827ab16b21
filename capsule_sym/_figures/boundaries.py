"""Lines L1-L8 of the plane P1 = v_c = 0, Eq. (14), as their ends.

L10 is the part of P1 = 0, P2 = delta that Eq. (14) omits: v_r < 0, P3 > f_b, for delta > f_b.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from capsule_sym._arrays import Matrix as Array
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._parameters import Parameters

Limits = tuple[float, float]


def lines(parameters: Parameters, x_r: Limits, v_r: Limits) -> dict[str, Array]:
    """Parts of L1-L8 in a rectangle of the plane P1 = 0, as their two ends (2, 2).

    A line that does not meet the rectangle is absent.
    """
    p, delta = parameters, parameters.delta
    rectangle = [(1.0, 0.0, -x_r[0]), (-1.0, 0.0, x_r[1]), (0.0, 1.0, -v_r[0]), (0.0, -1.0, v_r[1])]
    found = {}
    reach = 1e3 * max(map(abs, (*x_r, *v_r, p.f_b, delta)))
    for name, side, stick, bound in (
        ("L1", -1.0, 2, p.f_b),
        ("L2", -1.0, 2, -p.f_b),
        ("L3", 1.0, 5, p.f_b),
        ("L4", 1.0, 5, -p.f_b),
    ):
        c = NumpyBackend().constants(stick, p)
        middle = np.array([c.position_at(bound, 0.0), 0.0])
        along = reach * np.array([-c.force_change(0.0, 1.0), c.force_change(1.0, 0.0)])
        whole = np.array([middle - along, middle + along])
        found[name] = within(whole, [*rectangle, (side, 0.0, -side * delta)])
    upper, lower = np.clip(corners(p), -reach, reach)
    for name, high, low in (
        ("L5", reach, max(upper, 0.0)),
        ("L6", upper, 0.0),
        ("L10", 0.0, upper),
        ("L7", min(upper, 0.0), lower),
        ("L8", lower, -reach),
    ):
        if high > low:
            found[name] = within(np.array([(delta, high), (delta, low)]), rectangle)
    return {name: line for name, line in found.items() if len(line) and np.ptp(line, axis=0).any()}


def corners(parameters: Parameters) -> tuple[float, float]:
    """v_r of the corner points O1 and O2 on P1 = 0, P2 = delta; infinite without damping."""
    p = parameters
    if p.zeta == 0.0:
        return np.copysign(np.inf, p.f_b - p.delta), -np.inf
    c = NumpyBackend().constants(2, p)
    return c.velocity_at(p.f_b), c.velocity_at(-p.f_b)


def within(ends: Array, half_planes: Sequence[tuple[float, float, float]]) -> Array:
    """Part of a line, given by its ends, inside half-planes: its two ends, or an empty array."""
    first, step = ends[0], ends[1] - ends[0]
    low, high = 0.0, 1.0
    for a, b, c in half_planes:
        value, slope = first @ (a, b) + c, step @ (a, b)
        if slope == 0.0:
            if value < 0:
                return np.empty((0, 2))
        elif slope > 0:
            low = max(low, -value / slope)
        else:
            high = min(high, -value / slope)
    return np.array([first + low * step, first + high * step]) if low < high else np.empty((0, 2))
