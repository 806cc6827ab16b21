"""Flow of a field in balls: the exponential of its derived matrix.

The extended state y = (x_r, v_r, v_c, alpha cos, alpha sin, 1) satisfies y' = A y. For short
durations exp(A h) is its series with a bound on the tail, in which terms small with h stay small.
For longer ones, and with many bits, flint's exponential of the matrix at the ball's midpoint is
extended to the ball by its derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from math import exp, factorial, inf
from typing import Any

from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    arb,
    bits,
    largest,
    matrix,
    symmetric,
    unit,
    upper,
)
from capsule_sym._native import check_time
from capsule_sym.generated.capsule import fields as _generated
from capsule_sym.generated.capsule.facts import FIELDS

SIZE = 6
X, V, C, U, W, ONE = range(SIZE)
generated: Any = _generated  # what is printed has no types
_FAR = 100.0  # exponents beyond which a bound is of no use
_NARROW = 1e-9  # radius of a parameter below which nothing is gained by its derivative
_SHORT = 1.0  # norm times duration below which the series is used
_SERIES_BITS = 512  # bits beyond which flint's exponential takes a fraction of the time


def at_rest(field: int) -> bool:
    """True if the capsule is at rest in a field."""
    return FIELDS[field][1] == 0


class Exponential:
    """exp(A h) of a square matrix A of balls, and its rest without the first terms."""

    def __init__(self, A: Matrix) -> None:
        self.A, self.norm = A, largest(A)
        self._powers: dict[int, list[Matrix]] = {}
        self._latest: tuple[Ball, int, Matrix] | None = None  # a duration, its bits, exp(A h)

    def terms(self, order: int) -> list[Matrix]:
        """A^k/k! for k from 0 to an order."""
        found = self._powers.setdefault(bits(), [unit(self.A.nrows())])
        while len(found) <= order:
            found.append(self.A * found[-1] / len(found))
        return found[: order + 1]

    def short(self, h: Ball) -> bool:
        """True for a duration h, short enough for the series: norm(A) h is below 1."""
        return self.norm * upper(h) < _SHORT

    def rest(self, h: Ball, zeros: int = 0) -> Matrix:
        """exp(A h) without its terms below A^zeros, over h^zeros: finite at h = 0."""
        check_time()
        if self.short(h) and (zeros or bits() <= _SERIES_BITS):
            order = _order(bits())
            total = self.A * 0
            for term in reversed(self.terms(order)[zeros:]):
                total = total * h + term
            return total + self._around(_tail(self.norm, upper(h), order + 1, zeros))
        if self._latest is None or self._latest[0] is not h or self._latest[1] != bits():
            middle = arb(h.mid())
            self._latest = h, bits(), self.moved((self.A * middle).exp(), h - middle)
        found = self._latest[2]
        for k, term in enumerate(self.terms(zeros)[:zeros]):
            found = found - term * h**k
        return found / h**zeros if zeros else found

    def moved(self, moved: Matrix, step: Ball) -> Matrix:
        """exp(A (h + step)) from exp(A h), to second order with its remainder."""
        if step.rad() == 0:
            return moved
        first = self.A * moved
        last = self.A * first
        around = self._around(_growth(self.norm * upper(step)))
        return moved + first * step + (last + around * last) * (step * step / 2)

    def _around(self, radius: Any) -> Matrix:
        size, entry = self.A.nrows(), symmetric(radius)
        return arb_mat([[entry] * size] * size)


class Field:
    """A field at parameters that are balls (alpha is not one of them)."""

    def __init__(self, index: int, values: Mapping[str, Ball]) -> None:
        self.index = index
        self._values = dict(values)
        given = [values[name] for name in generated.PARAMETERS]
        self.A = matrix(SIZE, SIZE, generated.RATES[index - 1](*given))
        entries = generated.GUARDS[index - 1](*given)
        self.guards = matrix(1 + max(i for i, _, _ in entries), SIZE, entries)
        self._slopes = generated.RATES_BY[index - 1](*given)
        self._guard_slopes = generated.GUARDS_BY[index - 1](*given)
        self._exponential, self._by = Exponential(self.A), dict[str, Exponential]()
        self.norm, self.terms = self._exponential.norm, self._exponential.terms
        self._wide = [name for name in self._slopes if values[name].rad() > _NARROW]

    @property
    def stick(self) -> bool:
        """True if the capsule is at rest in this field."""
        return at_rest(self.index)

    def guard_slope(self, name: str) -> Matrix:
        """Derivative of the guards by a parameter."""
        return matrix(self.guards.nrows(), SIZE, self._guard_slopes.get(name, ()))

    def depends(self, name: str) -> bool:
        """True if A depends on a parameter."""
        return name in self._slopes

    @cached_property
    def _centre(self) -> Field:
        """The field at the midpoints of the wide parameters, at the balls of the others."""
        return Field(self.index, self._values | {n: arb(self._values[n].mid()) for n in self._wide})

    def flow(self, h: Ball) -> Matrix:
        """exp(A h)."""
        if not self._wide or self._exponential.short(h):
            return self._exponential.rest(h)
        middle = arb(h.mid())
        moved = self._centre.flow(middle)
        for name in self._wide:
            moved += self.flow_by(middle, name) * symmetric(self._values[name].rad())
        return self._exponential.moved(moved, h - middle)

    def flow_by(self, h: Ball, name: str, zeros: int = 0) -> Matrix:
        """Derivative by a parameter of exp(A h) without its terms below A^zeros, over h^zeros.

        It is the corner of the same expression of ((A, A'), (0, A)), with A' the derivative of A.
        """
        if not self.depends(name):
            return matrix(SIZE, SIZE)
        if name not in self._by:
            slope, none = matrix(SIZE, SIZE, self._slopes[name]).tolist(), [0] * SIZE
            rows = [[*row, *by] for row, by in zip(self.A.tolist(), slope, strict=True)]
            rows += [[*none, *row] for row in self.A.tolist()]
            self._by[name] = Exponential(arb_mat(rows))
        return arb_mat([row[SIZE:] for row in self._by[name].rest(h, zeros).tolist()[:SIZE]])

    def divided(self, row: Matrix, zeros: int, h: Ball) -> tuple[Matrix, Matrix]:
        """Functional after h over h^zeros, without its leading terms; and its derivative by h.

        Row r gives r (exp(A h) - terms below A^zeros)/h^zeros: the gain of a guard whose first
        derivatives vanish at the start, finite at h = 0. The derivative of such an R_n is A R_n - n
        R_(n + 1), and (A R_(n - 1) - n R_n)/h.
        """
        value = self._exponential.rest(h, zeros)
        if self._exponential.short(h):
            slope = self.A * value - self._exponential.rest(h, zeros + 1) * zeros
        else:
            slope = (self.A * self._exponential.rest(h, zeros - 1) - value * zeros) / h
        return row * value, row * slope


def _growth(size: float) -> float:
    """More than |exp(M) - 1| for a matrix M of this norm."""
    return exp(size) * size * (1 + 1e-9) if size < _FAR else inf


def _order(precision: int) -> int:
    return 12 + precision // 6


def _tail(norm: float, h: float, order: int, zeros: int) -> Ball:
    """More than the sum of norm^k h^(k - zeros)/k! from k = order on."""
    size = arb(norm) * h
    return arb(norm) ** zeros * size ** (order - zeros) / factorial(order) * size.exp()
