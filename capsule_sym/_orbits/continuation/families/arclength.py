"""A curve of solutions of m equations in m + 1 unknowns: tangents, and Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from capsule_sym._orbits.continuation.points.extended import Evaluation
from capsule_sym._orbits.continuation.settings import DEFAULT, ContinuationSettings
from capsule_sym._orbits.shooting.equations import Matrix, Vector

_ROUNDING = 2.0**-51


class Solution(NamedTuple):
    """Point of the curve, the equations there, and the number of Newton steps."""

    u: Vector
    at: Evaluation
    steps: int


Equations = Callable[[Vector], Evaluation]


def tangent(by: Matrix, along: Vector) -> Vector:
    """Unit tangent of the curve where its equations have the derivative `by`, (m + 1,).

    It makes an acute angle with `along`. Raises numpy.linalg.LinAlgError at a branch point.
    """
    right = np.zeros(len(along))
    right[-1] = 1.0
    direction = np.linalg.solve(np.vstack([by, along]), right)
    return np.asarray(direction / np.linalg.norm(direction))


def corrected(
    equations: Equations,
    guess: Vector,
    normal: Vector,
    settings: ContinuationSettings = DEFAULT,
    tolerance: float | None = None,
) -> Solution | None:
    """Point of the curve in the plane through the guess, by Newton's method; None if none.

    The iteration ends when a step is within the tolerance, or limited by rounding.
    """
    u, size, tolerance = guess, float("inf"), tolerance or settings.newton_tolerance
    found = None
    for step in range(1, settings.newton_steps + 1):
        at = equations(u)
        if not np.all(np.isfinite(at.residual)):
            return None
        rounding = _ROUNDING * (1 + np.max(abs(u)))
        if size < settings.rounding_step and np.max(abs(at.residual)) <= rounding:
            return Solution(u, at, step - 1)
        try:
            change = np.linalg.solve(
                np.vstack([at.by, normal]), -np.append(at.residual, normal @ (u - guess))
            )
        except np.linalg.LinAlgError:
            return None
        u, size = u + change, float(np.linalg.norm(change))
        if size < tolerance * (1 + np.linalg.norm(u)):
            found = Solution(u, equations(u), step)
            # Near a segment of duration 0 the inexact derivative leaves a larger residual.
            if np.max(abs(found.at.residual)) <= settings.residual_tolerance * (1 + np.max(abs(u))):
                break
    return found


def least_between(ends: Vector, slopes: Vector) -> float:
    """Least value on [0, 1] of the cubic with these values and derivatives at 0 and 1."""
    return _least(_cubic(ends[1] - ends[0], slopes) + ends[0])


def least_slope_between(chord: float, slopes: Vector) -> float:
    """Least derivative on [0, 1] of the cubic with these derivatives at 0 and 1.

    `chord` is the difference of its values at the ends.
    """
    return _least(_cubic(chord, slopes).deriv())


def _cubic(chord: float, slopes: Vector) -> np.poly1d:
    """Cubic that is 0 at 0 and `chord` at 1, with these derivatives there."""
    first, last = slopes
    return np.poly1d([first + last - 2 * chord, 3 * chord - 2 * first - last, first, 0.0])


def _least(polynomial: np.poly1d) -> float:
    inside = [float(at.real) for at in polynomial.deriv().r if at.imag == 0 and 0 < at.real < 1]
    return float(min(polynomial(np.array([0.0, 1.0, *inside]))))
