"""The flow of a field in balls: the exponential of the matrix that the derivation printed.

The extended state y = (x_r, v_r, v_c, alpha cos, alpha sin, 1) obeys y' = A y. For short durations
exp(A h) is its series with a bound on the tail, which keeps what is small with h small; for longer
ones flint's exponential of the matrix at the ball's midpoint is moved by its derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import exp, factorial, inf
from typing import Any

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    arb,
    bits,
    largest,
    matrix,
    symmetric,
    upper,
)
from capsule_sym.generated import fields as _generated
from capsule_sym.generated.facts import FIELDS

SIZE = 6
X, V, C, U, W, ONE = range(SIZE)
generated: Any = _generated  # what is printed has no types
_FAR = 100.0  # exponents beyond which a bound is of no use
_NARROW = 1e-9  # radius of a parameter below which nothing is gained by its derivative
_SHORT = 1.0  # norm times duration below which the series is used


def at_rest(field: int) -> bool:
    """Whether the capsule is at rest along a field."""
    return FIELDS[field][1] == 0


class Field:
    """One of the fields at parameters that are balls (alpha is no part of it)."""

    def __init__(self, index: int, values: Mapping[str, Ball]) -> None:
        self.index = index
        self._values = dict(values)
        given = [values[name] for name in generated.PARAMETERS]
        self.A = matrix(SIZE, SIZE, generated.RATES[index - 1](*given))
        entries = generated.GUARDS[index - 1](*given)
        self.guards = matrix(1 + max(i for i, _, _ in entries), SIZE, entries)
        self._slopes = generated.RATES_BY[index - 1](*given)
        self._guard_slopes = generated.GUARDS_BY[index - 1](*given)
        self.norm = largest(self.A)
        self._wide = [name for name in self._slopes if values[name].rad() > _NARROW]
        self._powers: dict[int, list[Matrix]] = {}

    @property
    def stick(self) -> bool:
        """Whether the capsule is at rest along this field."""
        return at_rest(self.index)

    def slope(self, name: str) -> Matrix:
        """Derivative of A by a parameter."""
        return matrix(SIZE, SIZE, self._slopes.get(name, ()))

    def guard_slope(self, name: str) -> Matrix:
        """Derivative of the guards by a parameter."""
        return matrix(self.guards.nrows(), SIZE, self._guard_slopes.get(name, ()))

    def depends(self, name: str) -> bool:
        """Whether A depends on a parameter."""
        return name in self._slopes

    @cached_property
    def _centre(self) -> Field:
        """The field at the parameters' midpoints."""
        return Field(self.index, {n: arb(v.mid()) for n, v in self._values.items()})

    def terms(self, order: int) -> list[Matrix]:
        """A^k/k! for k from 0 to an order."""
        found = self._powers.setdefault(bits(), [_identity()])
        while len(found) <= order:
            found.append(self.A * found[-1] / len(found))
        return found[: order + 1]

    def flow(self, h: Ball) -> Matrix:
        """exp(A h)."""
        if self.norm * upper(h) < _SHORT:
            return self._series(h, 0)
        middle = arb(h.mid())
        if not self._wide:
            moved = (self.A * middle).exp()
        else:
            moved = self._centre.flow(middle)
            for name in self._wide:
                value = self._values[name]
                moved += self.flow_by(middle, name) * symmetric(value.rad())
        return self._moved(moved, h - middle) if h.rad() > 0 else moved

    def _moved(self, moved: Matrix, step: Ball) -> Matrix:
        """exp(A (h + step)) from exp(A h), to second order with its remainder."""
        first = self.A * moved
        growth = _growth(self.norm * upper(step))
        around = matrix(
            SIZE, SIZE, ((i, j, symmetric(growth)) for i in range(SIZE) for j in range(SIZE))
        )
        last = self.A * first
        return moved + first * step + (last + around * last) * (step * step / 2)

    def flow_by(self, h: Ball, name: str) -> Matrix:
        """Derivative of exp(A h) by a parameter."""
        if not self.depends(name):
            return matrix(SIZE, SIZE)
        slope = self.slope(name)
        if self.norm * upper(h) < _SHORT:
            return self._series_by(h, 0, slope)
        double = matrix(2 * SIZE, 2 * SIZE)
        _place(double, self.A, 0, 0)
        _place(double, self.A, SIZE, SIZE)
        _place(double, slope, 0, SIZE)
        middle = arb(h.mid())
        found = (double * middle).exp()
        if h.rad() > 0:
            growth = _growth(largest(double) * spread_of(h - middle))
            entries = ((i, j, symmetric(growth)) for i in range(12) for j in range(12))
            found += matrix(12, 12, entries) * found
        return _part(found, 0, SIZE)

    def divided(self, row: Matrix, zeros: int, h: Ball) -> tuple[Matrix, Matrix]:
        """A functional after h over h^zeros, its leading terms left out; and its derivative by h.

        Row r gives r (exp(A h) - terms below A^zeros)/h^zeros, which is what a guard has gained
        where its first derivatives vanish at the start, finite at h = 0.
        """
        if self.norm * upper(h) < _SHORT:
            order = _order(bits())
            terms = [row * term for term in self.terms(order)]
            value, slope = matrix(1, SIZE), matrix(1, SIZE)
            for k in range(order, zeros - 1, -1):
                slope = slope * h + value
                value = value * h + terms[k]
            tails = (
                largest(row) * _tail(self.norm, upper(h), order + 1, zeros),
                largest(row) * _tail(self.norm, upper(h), order + 1, zeros + 1) * (order + 3),
            )
            return value + _all(1, tails[0]), slope + _all(1, tails[1])
        moved = row * self.flow(h)
        rate = moved * self.A
        for k, term in enumerate(self.terms(zeros)[:zeros]):
            moved -= row * term * h**k
            if k:
                rate -= row * term * (k * h ** (k - 1))
        value = moved / h**zeros
        return value, (rate / h**zeros) - value * zeros / h

    def divided_by(self, row: Matrix, zeros: int, h: Ball, name: str) -> Matrix:
        """Derivative of `divided` by a parameter on which the row does not depend."""
        if not self.depends(name):
            return matrix(1, SIZE)
        slope = self.slope(name)
        if self.norm * upper(h) < _SHORT:
            return row * self._series_by(h, zeros, slope)
        moved = row * self.flow_by(h, name)
        if zeros == 2:
            moved -= row * slope * h
        return moved / h**zeros

    def _series(self, h: Ball, start: int) -> Matrix:
        order = _order(bits())
        total = matrix(SIZE, SIZE)
        for term in reversed(self.terms(order)[start:]):
            total = total * h + term
        return total + _all(SIZE, _tail(self.norm, upper(h), order + 1, start))

    def _series_by(self, h: Ball, zeros: int, slope: Matrix) -> Matrix:
        """Derivative by a parameter of the sum of A^k h^(k - zeros)/k! from k = zeros on."""
        order = _order(bits())
        powers = self.terms(order)
        by = [matrix(SIZE, SIZE)]
        for k in range(1, order + 1):
            by.append((slope * powers[k - 1] + self.A * by[-1]) / k)
        total = matrix(SIZE, SIZE)
        for term in reversed(by[zeros:]):
            total = total * h + term
        # The terms' norms are at most |slope| |A|^(k-1) h^(k-zeros)/(k-1)!.
        tail = largest(slope) * _tail(self.norm, upper(h), order, zeros - 1)
        return total + _all(SIZE, tail)


def spread_of(value: Ball) -> float:
    """The largest absolute value in a ball."""
    return upper(value)


def _growth(size: float) -> float:
    """More than |exp(M) - 1| for a matrix M of this norm."""
    return exp(size) * size * (1 + 1e-9) if size < _FAR else inf


def _order(precision: int) -> int:
    return 12 + precision // 6


def _tail(norm: float, h: float, order: int, zeros: int) -> Ball:
    """More than the sum of norm^k h^(k - zeros)/k! from k = order on; a ball, that never is 0."""
    size = norm * h
    if h == 0:
        return arb(0) if order > zeros else arb(norm) ** order / factorial(order)
    if size > _SHORT:
        return arb(inf)
    bound = arb(norm) ** zeros * arb(size) ** (order - zeros) / factorial(order)
    return bound * (exp(size) * (1 + 1e-9))


def _identity() -> Matrix:
    return matrix(SIZE, SIZE, ((i, i, 1) for i in range(SIZE)))


def _all(rows: int, radius: Ball) -> Matrix:
    entry = symmetric(radius)
    return matrix(rows, SIZE, ((i, j, entry) for i in range(rows) for j in range(SIZE)))


def _place(into: Matrix, part: Matrix, row: int, at: int) -> None:
    for i, entries in enumerate(part.tolist()):
        for j, value in enumerate(entries):
            into[row + i, at + j] = value


def _part(whole: Matrix, row: int, at: int) -> Matrix:
    return matrix(
        SIZE, SIZE, ((i, j, whole[row + i, at + j]) for i in range(SIZE) for j in range(SIZE))
    )


def rates(field: Field, state: Matrix) -> Sequence[Ball]:
    """Time derivative of an extended state."""
    return [row[0] for row in (field.A * state).tolist()]
