"""Polynomial forms: numbers or matrices over a box of parameters, with a remainder.

A form is a polynomial of the place s in [-1, 1]^2 of the box, up to the third degree, plus a ball
e about 0 for terms of fourth degree. Coefficients are narrow balls or matrices of them. So the
joint variation of two quantities is kept, which plain balls lose.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import ceil, factorial, log2
from typing import Any

from capsule_sym._enclosures.interface import (
    Matrix,
    arb,
    largest,
    matrix,
    stacked,
    symmetric,
    unit,
    upper,
)

DEGREE = 3
MONOMIALS = tuple(
    sorted(
        ((a, b) for a, b in product(range(DEGREE + 1), repeat=2) if a + b <= DEGREE),
        key=lambda m: (sum(m), -m[0]),
    )
)
"""Powers of s_1 and s_2, the constant first."""
_PLACE = {powers: k for k, powers in enumerate(MONOMIALS)}
_PRODUCTS = [
    [
        (_PLACE[a, b], _PLACE[c, d])
        for (a, b), (c, d) in product(MONOMIALS, repeat=2)
        if (a + c, b + d) == powers
    ]
    for powers in MONOMIALS
]
_BY_DEGREE = [[k for k, m in enumerate(MONOMIALS) if sum(m) == n] for n in range(DEGREE + 1)]
_SMALL = 0.25  # norm below which an exponential is its series
_ORDER = 10
_TERMS = 20  # of a series that is not halved
_ANY = symmetric(1)
_ALL = range(len(MONOMIALS))


class Form:
    """A number or a matrix over a box: coefficients in the order of MONOMIALS, and remainder."""

    __slots__ = ("e", "p")

    def __init__(self, p: Sequence[Any], e: Any) -> None:
        self.p, self.e = tuple(p), e

    @property
    def c(self) -> Any:
        """The value at the middle of the box, without the remainder."""
        return self.p[0]

    def part(self, degree: int) -> Any:
        """A ball that holds all terms of a degree."""
        first, *rest = _BY_DEGREE[degree]
        found = self.p[first] * _ANY
        for k in rest:
            found = found + self.p[k] * _ANY
        return found

    @property
    def range(self) -> Any:
        """Deviation from the middle, as a ball that contains it."""
        found = self.e
        for degree in range(1, DEGREE + 1):
            found = found + self.part(degree)
        return found

    @property
    def hull(self) -> Any:
        """A ball, or a matrix of balls, that holds all values."""
        return self.c + self.range

    def __getitem__(self, place: tuple[int, int]) -> Form:
        """Entry of a matrix."""
        return Form([x[place] for x in self.p], self.e[place])

    def __add__(self, other: Any) -> Form:
        """The sum with a form, or with a narrow number or matrix."""
        if not isinstance(other, Form):
            return Form([self.p[0] + other, *self.p[1:]], self.e)
        return Form([x + y for x, y in zip(self.p, other.p, strict=True)], self.e + other.e)

    __radd__ = __add__

    def __neg__(self) -> Form:
        return self * -1

    def __sub__(self, other: Any) -> Form:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Form:
        return (self * -1).__add__(other)

    def __truediv__(self, other: Any) -> Form:
        return self * (other.inverse() if isinstance(other, Form) else 1 / other)

    def __rmul__(self, other: Any) -> Form:
        """The product of a narrow number or matrix with this one."""
        return Form([other * x for x in self.p], other * self.e)

    def __mul__(self, other: Any) -> Form:
        """The product with a form, or with a narrow number or matrix."""
        if not isinstance(other, Form):
            return Form([x * other for x in self.p], self.e * other)
        found = []
        for pairs in _PRODUCTS:
            (i, j), *more = pairs
            total = self.p[i] * other.p[j]
            for i, j in more:
                total = total + self.p[i] * other.p[j]
            found.append(total)
        own = [self.part(n) for n in range(1, DEGREE + 1)]
        theirs = [other.part(n) for n in range(1, DEGREE + 1)]
        whole = other.e
        for one in theirs:
            whole = whole + one
        rest = self.e * (other.c + whole) + self.c * other.e
        for n, one in enumerate(own, 1):
            high = other.e
            for m, part in enumerate(theirs, 1):
                if n + m > DEGREE:
                    high = high + part
            rest = rest + one * high
        return Form(found, rest)

    def composed(self, terms: Sequence[Any], last: Any) -> Form:
        """Sum of terms_k d^k, d this form minus its middle, plus `last` d^(DEGREE + 1)."""
        away = Form((self.c * 0, *self.p[1:]), self.e)
        found = away * terms[DEGREE]
        for k in range(DEGREE - 1, 0, -1):
            found = (found + terms[k]) * away
        left = away.range
        power = left
        for _ in range(DEGREE):
            power = power * left
        found = found + terms[0]
        return Form(found.p, found.e + last * power)

    def inverse(self) -> Form:
        """One over a number."""
        share = 1 / self.c
        terms = [share * (-share) ** k for k in range(DEGREE + 1)]
        return self.composed(terms, (-share) ** (DEGREE + 1) / self.hull)

    def sin_cos(self) -> tuple[Form, Form]:
        """Sine and cosine of a number."""
        sine, cosine = self.c.sin_cos()
        wide_sine, wide_cosine = self.hull.sin_cos()
        order = DEGREE + 1
        return (
            self.composed(
                _derivatives(sine, cosine)[:order], _derivatives(wide_sine, wide_cosine)[order]
            ),
            self.composed(
                _derivatives(cosine, -sine)[:order], _derivatives(wide_cosine, -wide_sine)[order]
            ),
        )

    @staticmethod
    def assembled(rows: int, columns: int, given: Sequence[tuple[int, int, Any]]) -> Form:
        """A matrix of numbers, of which one is a form, and 0 where there is no entry."""
        forms = [(i, j, x if isinstance(x, Form) else number(x)) for i, j, x in given]
        parts = [matrix(rows, columns, ((i, j, x.p[k]) for i, j, x in forms)) for k in _ALL]
        return Form(parts, matrix(rows, columns, ((i, j, x.e) for i, j, x in forms)))

    @staticmethod
    def stacked(blocks: Sequence[Any]) -> Form:
        """Matrices, of which one is a form, one below the other."""
        forms = [one if isinstance(one, Form) else _constant(one) for one in blocks]
        return Form([stacked([x.p[k] for x in forms]) for k in _ALL], stacked([x.e for x in forms]))


def _derivatives(value: Any, slope: Any) -> list[Any]:
    """Derivatives of a sine over their factorials, from its value and its slope."""
    return [x / factorial(k) for k, x in enumerate((value, slope, -value, -slope, value, slope))]


def _constant(value: Any) -> Form:
    return Form([value, *[value * 0] * (len(MONOMIALS) - 1)], value * 0)


def number(value: Any) -> Form:
    """Number that is constant over the box."""
    return _constant(arb(value))


def polynomial(coefficients: Sequence[Any], radius: float = 0.0) -> Form:
    """A number from its coefficients in the order of MONOMIALS, 0 where there are none."""
    left = len(MONOMIALS) - len(coefficients)
    return Form([*map(arb, coefficients), *[arb(0)] * left], symmetric(radius))


def hull(value: Any) -> Any:
    """A ball, or a matrix of balls, that holds all values of a form, or of a ball itself."""
    return value.hull if isinstance(value, Form) else value


def identity(size: int) -> Form:
    """The unit matrix."""
    return _constant(unit(size))


def exponential(rates: Form, h: Form) -> Form:
    """The exponential of a matrix times a number, by halving, its series, and squaring."""
    size = rates.c.nrows()
    norm = largest(rates.hull) * upper(h.hull)
    halvings = max(0, ceil(log2(norm / _SMALL))) if norm > 0 else 0
    whole = rates * (h * (arb(1) / 2**halvings))
    norm /= 2**halvings
    one = identity(size)
    found = one
    for k in range(_ORDER, 0, -1):
        found = one + (whole * found) * (arb(1) / k)
    tail = arb(norm) ** (_ORDER + 1) / factorial(_ORDER + 1) * 2
    found = _within(found, tail)
    for _ in range(halvings):
        found = found * found
    return found


def series(rates: Form, h: Form, zeros: int) -> Form:
    """The exponential of a matrix times a number without its first terms, over h^zeros."""
    size, norm, reach = rates.c.nrows(), largest(rates.hull), upper(h.hull)
    last = zeros + _TERMS
    terms = [identity(size)]
    for k in range(1, last + 1):
        terms.append((rates * terms[-1]) * (arb(1) / k))
    found = terms[last]
    for k in range(last - 1, zeros - 1, -1):
        found = found * h + terms[k]
    # Of the terms after the last, norm^k h^(k - zeros)/k!, with the growth of a whole exponential.
    grown = (arb(norm) * reach).exp()
    power = arb(norm) ** (last + 1) * arb(reach) ** (_TERMS + 1)
    return _within(found, power / factorial(last + 1) * grown)


def _within(found: Form, radius: Any) -> Form:
    """A square matrix, each entry with a further radius."""
    size, around = found.c.nrows(), symmetric(radius)
    entries = ((i, j, around) for i in range(size) for j in range(size))
    return Form(found.p, found.e + matrix(size, size, entries))


def shifted(rates: Matrix, h: Form, flow: Any) -> Form:
    """The exponential of a narrow matrix times a number, `flow` that of a number alone."""
    terms, last = [flow(h.c)], flow(h.hull)
    for k in range(1, DEGREE + 1):
        terms.append(rates * terms[-1] / k)
    for k in range(1, DEGREE + 2):
        last = rates * last / k
    return h.composed(terms, last)
