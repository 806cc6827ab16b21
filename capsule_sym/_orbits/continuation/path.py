"""Following a curve of solutions: m equations in m + 1 unknowns, by pseudo-arclength."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

_MOST_STEPS = 8
_SETTLED = 1e-10  # a Newton step this small leaves an error of its square
_NEARLY = 1e-6  # one this small too, if the residual then is rounding
_ROUNDING = 2.0**-51


class Evaluation(NamedTuple):
    """Equations at a point: residual (m,), derivative (m, m + 1), and what it was made from."""

    residual: Vector
    by: Matrix
    made: Any


class Solution(NamedTuple):
    """A point of the curve, the equations there, and the Newton steps it took."""

    u: Vector
    at: Evaluation
    steps: int


Equations = Callable[[Vector], Evaluation]


def tangent(by: Matrix, along: Vector) -> Vector:
    """The unit tangent of the curve where its equations have the derivative `by`, (m + 1,).

    It makes an acute angle with `along`. Raises numpy.linalg.LinAlgError at a branch point.
    """
    right = np.zeros(len(along))
    right[-1] = 1.0
    direction = np.linalg.solve(np.vstack([by, along]), right)
    return direction / np.linalg.norm(direction)


def corrected(
    equations: Equations, guess: Vector, normal: Vector, settled: float = _SETTLED
) -> Solution | None:
    """The point of the curve in the plane through the guess, by Newton's method; None if none.

    Steps that are `settled` end it; they do not get smaller than rounding lets them.
    """
    u, size = guess, float("inf")
    for step in range(1, _MOST_STEPS + 1):
        at = equations(u)
        if not np.all(np.isfinite(at.residual)):
            return None
        if size < _NEARLY and np.max(abs(at.residual)) <= _ROUNDING * (1 + np.max(abs(u))):
            return Solution(u, at, step - 1)
        try:
            change = np.linalg.solve(
                np.vstack([at.by, normal]), -np.append(at.residual, normal @ (u - guess))
            )
        except np.linalg.LinAlgError:
            return None
        u, size = u + change, float(np.linalg.norm(change))
        if size < settled * (1 + np.linalg.norm(u)):
            return Solution(u, equations(u), step)
    return None


def least_between(ends: Vector, slopes: Vector) -> float:
    """The least value on [0, 1] of the cubic that has these values and derivatives at 0 and 1."""
    (first, last), (rising, final) = ends, slopes
    chord = last - first
    cubic = np.array([rising + final - 2 * chord, 3 * chord - 2 * rising - final, rising, first])
    return _least(cubic)


def least_slope_between(chord: float, slopes: Vector) -> float:
    """The least derivative on [0, 1] of the cubic with these derivatives at 0 and 1.

    `chord` is the difference of its values there.
    """
    rising, final = slopes
    square, linear = 3 * (rising + final - 2 * chord), 2 * (3 * chord - 2 * rising - final)
    return _least(np.array([square, linear, rising]))


def _least(polynomial: Vector) -> float:
    roots = np.roots(np.polyder(polynomial))
    inside = [float(at.real) for at in roots if at.imag == 0 and 0 < at.real < 1]
    return float(min(np.polyval(polynomial, [0.0, 1.0, *inside])))
