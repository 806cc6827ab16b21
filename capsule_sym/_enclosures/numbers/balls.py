"""Balls (midpoint and radius) of python-flint, every operation of which encloses the exact result.

A comparison of balls that is true is a proof; one that is not true proves nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import CapsuleError, NotInstalled

try:
    from flint import arb as arb
    from flint import arb_mat, ctx
except ModuleNotFoundError as error:  # pragma: no cover - the extra is part of `dev`
    raise NotInstalled(error) from error

Ball: TypeAlias = Any
"""A ball of real numbers, `flint.arb`."""
Matrix: TypeAlias = Any
"""A matrix of balls, `flint.arb_mat`."""


class Unproved(CapsuleError, ArithmeticError):
    """A step of a proof that does not succeed; the statement may still hold.

    `step` names it: existence, guards, stability, regularity, first switch, line, type, unfolding,
    or certificate at the time limit and for what no certificate can state. Other proofs have
    further steps.
    """

    def __init__(self, step: str, detail: str) -> None:
        super().__init__(step, detail)
        self.step, self.detail = step, detail

    def __str__(self) -> str:
        return f"{self.step}: {self.detail}"


def precision(bits: int) -> AbstractContextManager[Any]:
    """Context in which every new ball has this many bits."""
    return ctx.workprec(bits)


def bits() -> int:
    """Number of bits of new balls."""
    return int(ctx.prec)


def ball(value: Any, radius: Any = 0) -> Ball:
    """Ball around a number, with a radius.

    It is exact for an int or a float. A decimal (text), a fraction and a number of mpmath are
    enclosed within their rounding to the precision.
    """
    if isinstance(value, Fraction):
        found = arb(value.numerator) / value.denominator
    elif hasattr(value, "_mpf_"):
        sign, mantissa, exponent, _ = value._mpf_
        found = (-1) ** sign * arb(int(mantissa)) * arb(2) ** int(exponent)
    else:
        found = arb(value)
    return found + arb(0, radius) if radius else found


def matrix(rows: int, columns: int, entries: Iterable[tuple[int, int, Any]] = ()) -> Matrix:
    """A matrix with the given entries, as (row, column, value), and 0 elsewhere."""
    found = arb_mat(rows, columns)
    for i, j, value in entries:
        found[i, j] = value
    return found


def unit(rows: int, columns: int | None = None) -> Matrix:
    """The unit matrix, or its first rows or columns."""
    columns = rows if columns is None else columns
    return matrix(rows, columns, ((i, i, 1) for i in range(min(rows, columns))))


def assembled(rows: int, columns: int, entries: Iterable[tuple[int, int, Any]]) -> Any:
    """A matrix of balls, or of numbers whose type has another `assembled`; 0 without an entry."""
    given = [*entries]
    other = next((x for *_, x in given if hasattr(x, "assembled")), None)
    return (matrix if other is None else other.assembled)(rows, columns, given)


def stacked(blocks: Sequence[Any]) -> Any:
    """Matrices, one below the other; of balls, or of numbers whose type has another `stacked`."""
    other = next((one for one in blocks if hasattr(one, "stacked")), None)
    if other is not None:
        return other.stacked(blocks)
    return arb_mat([row for one in blocks for row in one.tolist()])


def floats(found: Matrix) -> NDArray[np.float64]:
    """Midpoints of a matrix, rounded."""
    return np.array([[float(x) for x in row] for row in found.mid().tolist()])


def thin(values: NDArray[np.float64]) -> Matrix:
    """A matrix of balls of radius 0, with these values."""
    return arb_mat(values.tolist())


def symmetric(radius: Any) -> Ball:
    """Ball about 0 with a radius."""
    return arb(0, radius)


def upper(value: Ball) -> float:
    """Upper bound, as a float, on |x| in the ball."""
    return math.nextafter(float(value.abs_upper()), math.inf)


def spread(value: Ball) -> float:
    """Upper bound, as a float, on the ball's radius."""
    return math.nextafter(float(value.rad()), math.inf)


def largest(found: Matrix) -> float:
    """Upper bound, as a float, on the largest row sum of absolute values."""
    return greatest(sum((abs(x) for x in row), arb(0)) for row in found.tolist())


def greatest(values: Iterable[Ball]) -> float:
    """Upper bound, as a float, on |x| in all of the balls; infinite or NaN if one is unbounded."""
    return float(np.max([0.0, *map(upper, values)]))
