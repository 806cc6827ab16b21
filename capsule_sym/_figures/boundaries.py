"""Lines L1-L8 of the plane P1 = v_c = 0, Eq. (14), as their ends.

L10 is the part of P1 = 0, P2 = delta that Eq. (14) omits: v_r < 0, P3 > f_b, for delta > f_b.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from capsule_sym._arrays import Matrix as Array
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._parameters import Parameters, SceneParameters

Limits = tuple[float, float]
_REST_ENDS = {(0, 1): "L1", (0, -1): "L2", (1, 1): "L3", (1, -1): "L4"}


def lines(parameters: Parameters, x_r: Limits, v_r: Limits) -> dict[str, Array]:
    """Parts of L1-L8 and L10 in a rectangle of the plane P1 = 0, as their two ends (2, 2).

    A line that does not meet the rectangle is absent.
    """
    p, delta = parameters, parameters.delta
    rectangle = [(1.0, 0.0, -x_r[0]), (-1.0, 0.0, x_r[1]), (0.0, 1.0, -v_r[0]), (0.0, -1.0, v_r[1])]
    reach = 1e3 * max(map(abs, (*x_r, *v_r, p.f_b, delta)))
    found = {
        _REST_ENDS[contact, way]: within(line, rectangle)
        for contact, way, line in rest_ends(p, *v_r)
    }
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


def rest_ends(
    parameters: SceneParameters, low: float, high: float
) -> Iterator[tuple[int, int, Array]]:
    """Lines in (x_r, v_r) on which rest ends, v_r from `low` to `high`.

    Of each the contact, the sign of the slip that follows, and the ends, (2, 2).
    """
    facts, numbers = parameters.scene.facts, NumpyBackend(parameters.scene)
    front, *behind = stops_of(parameters)
    back = behind[0] if behind else -np.inf
    for contact, left, right in ((0, back, front), (1, front, np.inf), (2, -np.inf, back)):
        if (contact, 0) not in facts.FIELD_OF:
            continue
        rest = numbers.constants(facts.FIELD_OF[contact, 0], parameters)
        sides = [(1.0, 0.0, -left)] * (left > -np.inf) + [(-1.0, 0.0, right)] * (right < np.inf)
        for way, name in facts.BOUNDS.items():
            bound = way * getattr(parameters, name)
            ends = np.array([(rest.position_at(bound, v), v) for v in (low, high)])
            if len(line := within(ends, sides)):
                yield contact, way, line


def stops_of(parameters: SceneParameters) -> tuple[float, ...]:
    """Places x_r of the stops: in front and, if there are two, behind."""
    (front, _), *behind = parameters.scene.facts.STOPS
    return (getattr(parameters, front), *(-getattr(parameters, gap) for gap, _ in behind))


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
