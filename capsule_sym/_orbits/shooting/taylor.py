"""Taylor coefficients of an orbit's equations, and the derivative of its monodromy matrix.

Within a segment the motion is linear in y = (x_r, v_r, v_c, cos, sin, 1): y' = L y with a constant
matrix. Its exponential propagates a series, and the series of exp(L d) propagates a change d of the
duration. A series is an array with its orders along the first axis; a product of two is that with a
Toeplitz matrix.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import Number
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import STATES, Matrix, Vector, touched
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, evaluated
from capsule_sym._orbits.shooting.stability import field, monodromy_matrix

_DIFFERENCE = 1e-5  # over the fastest rate, and of the parameters
_TERMS = 19  # 1/19! is below rounding
_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])  # derivative of (cos, sin) by the angle


def generator(c: Any, omega: Number) -> Matrix:
    """Matrix L (6, 6) of a segment with the constants `c`."""
    constant, matrix = field(c, np.zeros(STATES), 0.0), np.zeros((6, 6))
    for column, unit in enumerate(np.eye(STATES + 1)):
        matrix[:STATES, column] = field(c, unit[:STATES], unit[STATES]) - constant
    matrix[:STATES, 5] = constant
    matrix[3:5, 3:5] = omega * _TURN
    return matrix


def guard_row(
    forms: ClosedForms, itinerary: Itinerary, place: int, guard: Guard | None, field: int
) -> Vector:
    """Guard as a linear function of y, from its gradient and its value at 0.

    A stop is the one at the end of the segment `place`.
    """
    cosine, c = 0.0, forms.constants(field)
    if guard is Guard.DRIFT:
        by, constant = c.speed_gradient(), 0.0
    elif guard in (Guard.GAP, Guard.BACK):
        c = touched(forms, itinerary, place)
        by, constant = c.gap_gradient(), -c.own_stop()
    else:
        way = 1 if guard is Guard.UPPER else -1
        by = c.limit_gradient(way, 0.0, 0.0, 0.0, 0.0)
        constant = c.pull(0, -c.own_stop(), 0, 0) - c.friction_at(way)
        cosine = c.pull(0, 0, 0, 1) - c.pull(0, 0, 0, 0)
    return np.array([*by[:STATES], cosine, 0.0, constant])


def residual_series(orbit: Orbit, curve: Matrix) -> Matrix:
    """Taylor coefficients (many, n + 4) of the equations along a curve of unknowns, in doubles.

    `curve` (many, n + 4) has the coefficients of z; the first is the orbit's z. A segment of
    duration 0 loses the last orders, one for every zero of its guard at its start: their
    coefficients are not valid.
    """
    itinerary, n = orbit.itinerary, len(orbit.itinerary)
    forms, omega = ClosedForms(orbit.numbers, orbit.values), orbit.value("omega")
    result, y, change = 0 * curve, np.zeros((len(curve), 6)), curve.copy()
    change[0] = 0
    angle = change[:, STATES]
    y[:, :STATES], y[0, 3], y[0, 5] = curve[:, :STATES], 1, 1
    y[:, 3:5] = _carried(y[:, 3:5], curve[:, STATES], _TURN)
    for i, segment in enumerate(itinerary.segments):
        rates, h, guard = (
            generator(forms.constants(segment.field), omega),
            curve[:, 4 + i],
            segment.guard,
        )
        start, y = y, _carried(y, h, rates)
        if not orbit.system.flows[i].c.drift:
            y[:, 2] = 0
        result[:, i] = angle
        angle = angle + omega * change[:, 4 + i]
        if guard is Guard.EDGE:
            result[:, i] = angle
        elif guard is not None:
            row, zeros = guard_row(forms, itinerary, i, guard, segment.field), itinerary.zeros(i)
            result[:, i] = _divided(start, y, row, rates, h, zeros)
    result[:, n : n + 3] = y[:, :3] - (-1 if itinerary.mirrored else 1) * curve[:, :3]
    # The start is fixed on the last guard's surface, as in the equations.
    pinned = {Guard.GAP: 0, Guard.BACK: 0, Guard.DRIFT: 2}.get(
        itinerary.segments[-1].guard or Guard.UPPER
    )
    if pinned is not None:
        result[:, n + pinned] = curve[:, pinned]
    result[:, n + 3] = omega * curve[:, 4:].sum(axis=1)
    result[0] = orbit.system.residual
    return result


def _by(series: Vector) -> Matrix:
    """Matrix of the product with a series."""
    orders = np.arange(len(series))
    product: Matrix = np.tril(series[orders[:, None] - orders])
    return product


def _exponential(matrix: Matrix) -> Matrix:
    """Exponential by squaring; SciPy's takes long to import, and its threads disturb NumPy's."""
    halvings = max(0, math.ceil(math.log2(np.linalg.norm(matrix, 1) or 1.0)))
    term = total = np.eye(len(matrix))
    for order in range(1, _TERMS):
        term = term @ matrix / (order * 2**halvings)
        total = total + term
    return np.linalg.matrix_power(total, 2**halvings)


def _carried(y: Matrix, duration: Vector, rates: Matrix) -> Matrix:
    """Series of y after a duration, where y' = L y."""
    term = y = y @ _exponential(rates * duration[0]).T
    change = _by(duration) - duration[0] * np.eye(len(y))
    for order in range(1, len(y)):
        term = change @ term @ rates.T / order
        y = y + term
    return y


def _divided(
    start: Matrix, end: Matrix, row: Vector, rates: Matrix, h: Vector, zeros: int
) -> Vector:
    """Guard at the end of a segment over the power `zeros` of its duration h."""
    gained: Vector = (end - bool(zeros) * start) @ row
    if zeros == 2:
        gained = gained - _by(h) @ start @ rates.T @ row
    # With a duration of 0 both are over the variable: the last coefficient is lost.
    shift = int(h[0] == 0)
    lost = np.zeros(shift)
    product = _by(np.append(h[shift:], lost))
    for _ in range(zeros):
        gained = np.linalg.solve(product, np.append(gained[shift:], lost))
    return gained


def monodromy_derivative(orbit: Orbit, directions: Matrix) -> NDArray[np.float64]:
    """Derivative (n + 4 + m, 3, 3) of the monodromy matrix by z and along parameters, in doubles.

    `directions` (m, p) are directions of the p parameters. It is a central difference.
    """
    step = _DIFFERENCE / max(1.0, *(float(flow.c.rate) for flow in orbit.system.flows))
    unit, still = np.eye(len(orbit.z)), 0 * directions[:1]

    def at(by_z: Vector, by_p: Vector) -> Matrix:
        values = (np.array(orbit.values, dtype=float) + by_p).tolist()
        return monodromy_matrix(evaluated(orbit.numbers, values, orbit.itinerary, orbit.z + by_z))

    ways = [*((row, still[0]) for row in unit), *((0 * unit[0], row) for row in directions)]
    changes = [at(step * z, step * p) - at(-step * z, -step * p) for z, p in ways]
    return np.array(changes) / (2 * step)
