"""Taylor coefficients of an orbit's equations, and the derivative of its monodromy matrix.

Within a segment the motion is linear in y = (x_r, v_r, v_c, cos, sin, 1): y' = L y with a constant
matrix. The closed form's Jacobian, which does not depend on the state, propagates a change of the
start to the end; the series of exp(L d) propagates a change d of the duration. No
coefficient is a finite difference: all are exact but for rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import Number
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.closed import ClosedForms, chained
from capsule_sym._orbits.shooting.equations import Matrix, SegmentFlow, Vector, angle_row
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import field, saltation_matrix

Series = Matrix  # Taylor coefficients, by order along the first axis


def generator(c: Any, omega: Number) -> Matrix:
    """Matrix L (6, 6) of a segment with the constants `c`."""
    zero = omega * 0
    still = np.array([zero, zero, zero])
    constant = field(c, still, zero)
    matrix = np.full((6, 6), zero)
    matrix[:3, 5] = constant
    for column in range(2):
        unit = still.copy()
        unit[column] = unit[column] + 1
        matrix[:3, column] = field(c, unit, zero) - constant
    matrix[:3, 3] = field(c, still, zero + 1) - constant
    matrix[3, 4], matrix[4, 3] = -omega, omega
    return matrix


def residual_series(orbit: Orbit, curve: Series) -> Series:
    """Taylor coefficients (many, n + 4) of the equations of n segments along a curve of unknowns.

    `curve` (many, n + 4) has the coefficients of z; the first is the orbit's z. The equations are
    those of the orbit's residual. A segment of duration 0 loses the last orders, one for every zero
    of its guard at its start: their coefficients are not valid.
    """
    itinerary, n = orbit.itinerary, len(orbit.itinerary)
    forms, omega = ClosedForms(orbit.numbers, orbit.values), orbit.value("omega")
    result = curve * 0
    state, angle = curve[:, :3], _without_constant(curve[:, 3])
    for i, flow in enumerate(orbit.system.flows):
        duration = curve[:, 4 + i]
        begin, end = _ends(forms, flow, omega, state, angle, _without_constant(duration))
        result[:, i] = _guard(flow, itinerary.zeros(i), begin, end, angle, duration)
        state, angle = end[:, :3], _without_constant(angle + omega * duration)
    sign = -1 if itinerary.mirrored else 1
    result[:, n : n + 3] = state - sign * curve[:, :3]
    # The start is fixed on the last guard's surface, as in the equations.
    pinned = {Guard.GAP: 0, Guard.BACK: 0, Guard.DRIFT: 2}.get(
        itinerary.segments[-1].guard or Guard.UPPER
    )
    if pinned is not None:
        result[:, n + pinned] = curve[:, pinned]
    result[:, n + 3] = omega * curve[:, 4:].sum(axis=1)
    result[0] = orbit.system.residual
    return result


def product(first: Vector, second: Series) -> Series:
    """Product of two series, the first of scalars, to the same order."""
    result = second * 0
    for order, value in enumerate(first):
        result[order:] = result[order:] + value * second[: len(second) - order]
    return result


def quotient(series: Vector, by: Vector) -> Vector:
    """Quotient of two series; the constant of the divisor is not 0."""
    result = series * 0
    for order in range(len(series)):
        known = sum((by[k] * result[order - k] for k in range(1, order + 1)), 0 * by[0])
        result[order] = (series[order] - known) / by[0]
    return result


def carried(y: Series, duration: Vector, matrix: Matrix) -> Series:
    """Series of y (many, 6) after a duration without a constant term, where y' = L y."""
    term = y
    for order in range(1, len(y)):
        term = product(duration, term @ matrix.T) / order
        y = y + term
    return y


def _without_constant(series: Vector) -> Vector:
    rest = series.copy()
    rest[0] = rest[0] * 0
    return rest


def _cos_sin(angle: Vector) -> tuple[Vector, Vector]:
    """Cosine and sine of a series without a constant term."""
    term = angle * 0
    term[0] = term[0] + 1
    parts = [term]
    for order in range(1, len(angle)):
        parts.append(product(angle, parts[-1]) / order)
    cosine = sum(part if k % 4 == 0 else -part for k, part in enumerate(parts) if k % 2 == 0)
    sine = angle * 0 + sum(part if k % 4 == 1 else -part for k, part in enumerate(parts) if k % 2)
    return cosine, sine  # type: ignore[return-value]


def _ends(
    forms: ClosedForms, flow: SegmentFlow, omega: Number, state: Series, angle: Vector, more: Vector
) -> tuple[Series, Series]:
    """State and cosine of the angle (many, 4) at a segment's start and at its end.

    The state at the start, the angle there and the duration are series.
    """
    c, closed = flow.c, flow.closed
    # The derivative by the angle, shifted by a quarter turn, is the response to the forcing.
    back = closed._replace(cos_theta=closed.sin_theta, sin_theta=-closed.cos_theta)
    forced = forms.run(flow.segment.field, c, back, flow.h or forms.numbers.unit)[1][:3, 3]
    cosine, sine = _cos_sin(angle)
    matrix = flow.matrix[:3]
    y = np.full((len(state), 6), omega * 0)
    y[:, :3] = state @ matrix[:, :3].T + np.outer(cosine, forced) + np.outer(sine, matrix[:, 3])
    y[0, :3] = flow.end
    ahead = forms.numbers.cos_sin(flow.angle + omega * flow.h)
    y[:, 3] = ahead[0] * cosine - ahead[1] * sine
    y[:, 4] = ahead[1] * cosine + ahead[0] * sine
    y[0, 5] = y[0, 5] + 1
    begun = closed.cos_theta * cosine - closed.sin_theta * sine
    start: Series = np.column_stack([state, begun])
    return start, carried(y, more, generator(c, omega))[:, :4]


def _pull(c: Any, at: Series) -> Vector:
    """Series of the pull on the capsule, without its constant term."""
    drive = c.pull(0, 0, 0, 1) - c.pull(0, 0, 0, 0)
    return c.force_change(at[:, 0], at[:, 1]) + drive * at[:, 3]  # type: ignore[no-any-return]


def _guard(
    flow: SegmentFlow, zeros: int, start: Series, end: Series, angle: Vector, duration: Vector
) -> Vector:
    """Guard of a segment at its end, over the power `zeros` of its duration."""
    guard, c = flow.segment.guard, flow.c
    if guard is None:
        return angle
    if guard is Guard.EDGE:
        passed: Vector = angle + c.omega * duration
        return passed
    row = 2 if guard is Guard.DRIFT else 0
    if zeros == 0:
        return _pull(c, end) if guard in (Guard.UPPER, Guard.LOWER) else end[:, row]
    gained = end[:, row] - start[:, row]
    if zeros == 2:
        margin = _pull(c, start)
        margin[0] = flow.closed.margin
        gained = gained - product(duration, margin) / c.gamma
    no_duration = duration[0] == 0
    for _ in range(zeros):
        both = (_shifted(gained), _shifted(duration)) if no_duration else (gained, duration)
        gained = quotient(*both)
    return gained


def _shifted(series: Vector) -> Vector:
    """Series without a constant term over its variable; the last coefficient is lost."""
    return np.append(series[1:], series[:1] * 0)


_DIFFERENCE = 1e-5
_LANDING = np.array([[0.0, 0, 0], [0, 0, -1], [0, 0, 1]])  # saltation matrix by its ratio


def monodromy_derivative(orbit: Orbit, directions: Matrix) -> NDArray[np.float64]:
    """Derivative (n + 4 + m, 3, 3) of the monodromy matrix by z and along parameters, in doubles.

    `directions` (m, p) are directions of the p parameters. Only the derivative of a segment's
    matrix along parameters is a finite difference.
    """
    flows, itinerary, n = orbit.system.flows, orbit.itinerary, len(orbit.itinerary)
    numbers, omega = orbit.numbers, float(orbit.value("omega"))
    forms = ClosedForms(numbers, orbit.values)
    moved = [_flows(orbit, direction) for direction in directions]
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


def _flows(orbit: Orbit, direction: Vector) -> list[Matrix]:
    """Derivative of every segment's Jacobian along a direction of the parameters."""

    def jacobians(side: float) -> list[Matrix]:
        values = [float(v) + side * d for v, d in zip(orbit.values, direction, strict=True)]
        forms = ClosedForms(orbit.numbers, values)
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
