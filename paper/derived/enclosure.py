"""Rigorous enclosures of trajectories: Taylor polynomials with a bound on the remainder.

Everything is exact rational arithmetic, so that a comparison that succeeds is a proof.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from math import ceil, comb

import sympy as sp

from capsule_sym._symbolic.theory import Linear, coefficients, extended_rates

Polynomial = list[Fraction]
"""Coefficients of the powers of a variable, from order 0."""
Bracket = tuple[Fraction, Fraction]

_DEEPEST = 12


def affine(function: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> list[Fraction]:
    """The coefficients of an affine function of `EXTENDED`, its constant last, as fractions."""
    found = [coefficient.xreplace(values) for coefficient in coefficients(function)]
    return [Fraction(int(c.p), int(c.q)) for c in found]


class RationalFlow:
    """The trajectory of a field through a rational state, as a function of elapsed time.

    `start` holds (x_r, v_r, v_c, alpha cos(omega tau), alpha sin(omega tau)), `values` rational
    parameters; `sense` is +1 to follow the field forwards, -1 backwards in time.
    """

    def __init__(
        self,
        field: Linear,
        values: Mapping[sp.Symbol, sp.Expr],
        start: Iterable[Fraction],
        sense: int,
        degree: int = 16,
    ) -> None:
        self._values = values
        self._degree = degree
        rows = [affine(rate, values) for rate in extended_rates(field)]
        terms = [list(start)]
        for order in range(degree + 1):
            rise = [
                sum((a * x for a, x in zip(row, terms[-1], strict=False)), Fraction(0))
                + (row[-1] if order == 0 else 0)
                for row in rows
            ]
            terms.append([sense * rate / (order + 1) for rate in rise])
        *self._terms, tail = terms
        self._tail = max(map(abs, tail))
        self._norm = max(sum(map(abs, row[:-1]), Fraction(0)) for row in rows)

    def series(self, function: sp.Expr) -> Polynomial:
        """Taylor polynomial of an affine function of the state."""
        *slopes, constant = affine(function, self._values)
        found = [
            sum((a * x for a, x in zip(slopes, term, strict=True)), Fraction(0))
            for term in self._terms
        ]
        found[0] += constant
        return found

    def remainder(self, function: sp.Expr, order: int, time: Fraction) -> Fraction:
        """Bound on the terms neglected until `time`, divided by the elapsed time**order."""
        sensitivity = sum(map(abs, affine(function, self._values)[:-1]), Fraction(0))
        growth = Fraction(3) ** ceil(self._norm * time)  # exceeds the exponential
        return sensitivity * self._tail * time ** (self._degree + 1 - order) * growth

    def positive_until(self, function: sp.Expr, time: Fraction) -> bool:
        """True if a function is proved positive from just after the start until `time`."""
        series = self.series(function)
        order = first_order(series)
        return exceeds(series[order:], self.remainder(function, order, time), Fraction(0), time)

    def positive_within(self, function: sp.Expr, bracket: Bracket) -> bool:
        """True if a function is proved positive at all times of a bracket."""
        return exceeds(self.series(function), self.remainder(function, 0, bracket[1]), *bracket)

    def negative_at(self, function: sp.Expr, time: Fraction) -> bool:
        """True if a function is proved negative at a time."""
        value = sum((c * time**k for k, c in enumerate(self.series(function))), Fraction(0))
        return value < -self.remainder(function, 0, time)


def first_order(series: Polynomial) -> int:
    """Order of the first term that does not vanish; the last order if all vanish."""
    return next((order for order, term in enumerate(series) if term != 0), len(series) - 1)


def _bernstein(polynomial: Polynomial, start: Fraction, end: Fraction) -> list[Fraction]:
    degree = len(polynomial) - 1
    scaled = [
        sum(
            (polynomial[k] * comb(k, j) * start ** (k - j) for k in range(j, degree + 1)),
            Fraction(),
        )
        * (end - start) ** j
        for j in range(degree + 1)
    ]
    return [
        sum((Fraction(comb(i, j), comb(degree, j)) * scaled[j] for j in range(i + 1)), Fraction())
        for i in range(degree + 1)
    ]


def exceeds(
    polynomial: Polynomial, bound: Fraction, start: Fraction, end: Fraction, depth: int = 0
) -> bool:
    """True if a polynomial is proved larger than a bound on an interval (Bernstein form)."""
    coefficients = _bernstein(polynomial, start, end)
    if min(coefficients) > bound:
        return True
    if min(coefficients[0], coefficients[-1]) <= bound or depth == _DEEPEST:
        return False
    middle = (start + end) / 2
    halves = ((start, middle), (middle, end))
    return all(exceeds(polynomial, bound, *half, depth + 1) for half in halves)
