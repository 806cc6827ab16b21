"""Derivative of an orbit's monodromy matrix, by its unknowns and along parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import Backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import Matrix, SegmentFlow, Vector, angle_row
from capsule_sym._orbits.shooting.guards import chained
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import field, saltation_matrix
from capsule_sym._orbits.shooting.taylor import generator

_DIFFERENCE = 1e-5
_LANDING = np.array([[0.0, 0, 0], [0, 0, -1], [0, 0, 1]])  # saltation matrix by its ratio


def monodromy_derivative(numbers: Backend, orbit: Orbit, directions: Matrix) -> NDArray[np.float64]:
    """Derivative (n + 4 + m, 3, 3) of the monodromy matrix by z and along parameters, in doubles.

    `directions` (m, p) are directions of the p parameters. Only the derivative of a segment's
    matrix along parameters is a finite difference.
    """
    flows, itinerary, n = orbit.system.flows, orbit.itinerary, len(orbit.itinerary)
    forms, omega = ClosedForms(numbers, orbit.values), float(orbit.value("omega"))
    moved = [_flows(numbers, orbit, direction) for direction in directions]
    jacobians = [flow.matrix[:3, :3] for flow in flows]
    switches: list[Matrix] = [np.eye(3)] * n
    slopes: list[Vector | None] = [None] * n
    for k, flow in enumerate(flows):
        if flow.segment.guard is Guard.DRIFT:
            turned = numbers.cos_sin(flow.angle + omega * flow.h)
            after = forms.constants(itinerary.neighbour(k + 1))
            switches[k] = saltation_matrix(flow.c, after, flow.end, turned[0])
            slopes[k] = _ratio_by(forms, flow, after, turned)
    before = [(-1 if itinerary.mirrored else 1) * np.eye(3)]
    for jacobian, switch in zip(jacobians, switches, strict=True):
        before.append(switch @ jacobian @ before[-1])
    result, after_k = np.zeros((n + 4 + len(directions), 3, 3)), np.eye(3)
    for k in reversed(range(n)):
        flow, slope = flows[k], slopes[k]
        if slope is not None:
            along = np.array([*slope[: n + 4], *(directions @ slope[n + 4 :])])
            result += along[:, None, None] * (after_k @ _LANDING @ jacobians[k] @ before[k])
        after_k = after_k @ switches[k]
        rate = generator(flow.c, omega)[:3, :3]
        result[4 + k] += after_k @ rate @ jacobians[k] @ before[k]
        for m, changes in enumerate(moved):
            result[n + 4 + m] += after_k @ changes[k] @ before[k]
        after_k = after_k @ jacobians[k]
    return result


def _flows(numbers: Backend, orbit: Orbit, direction: Vector) -> list[Matrix]:
    """Derivative of every segment's Jacobian along a direction of the parameters."""

    def jacobians(side: float) -> list[Matrix]:
        values = [float(v) + side * d for v, d in zip(orbit.values, direction, strict=True)]
        forms = ClosedForms(numbers, values)
        found = []
        for flow in orbit.system.flows:
            field = flow.segment.field
            found.append(forms.run(field, forms.constants(field), flow.closed, flow.h)[1][:3, :3])
        return found

    ends = zip(jacobians(_DIFFERENCE), jacobians(-_DIFFERENCE), strict=True)
    return [(ahead - behind) / (2 * _DIFFERENCE) for ahead, behind in ends]


def _ratio_by(
    forms: ClosedForms, flow: SegmentFlow, after: Any, turned: tuple[float, float]
) -> Vector | None:
    """Gradient (many,) of the ratio of v_c's rates at a landing; None if the capsule sticks.

    `turned` are cosine and sine of the forcing angle there.
    """
    c, (x_r, v_r, _) = flow.c, flow.end
    if not after.drift:
        return None
    place = x_r, x_r - c.own_stop(), v_r
    angle_by = flow.total(angle_row(forms, flow.h, flow.matrix[0]))
    first, second = field(c, flow.end, turned[0])[2], field(after, flow.end, turned[0])[2]
    before_by, after_by = (
        chained(one.slip_gradient(one.drift, *place, *turned), flow.end_by, angle_by)
        for one in (c, after)
    )
    return (after_by * first - before_by * second) / first**2  # type: ignore[no-any-return]
