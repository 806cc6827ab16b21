"""Exact points that satisfy inequalities of the theory, found by elimination."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from math import ceil, floor

import sympy as sp

from capsule_sym._symbolic.theory import (
    RANGES,
    VARIABLES,
    Comparison,
    Contradiction,
    Relation,
    alpha,
    constraint_of,
    delta,
    depth,
    eliminations,
    force,
    gamma,
    inverse_gamma,
    omega,
    slope_of,
    tau,
    x_r,
)


def _simplest(low: Fraction | None, high: Fraction | None, closed: bool) -> Fraction:
    """A rational between the bounds (None for unbounded) with a small denominator.

    `closed` allows a bound itself if both bounds are equal. Raises ValueError if no number lies
    between them.
    """
    if low is None and high is None:
        return Fraction(0)
    if low is None:
        assert high is not None
        return Fraction(min(0, ceil(high) - 1))
    if high is None:
        return Fraction(max(0, floor(low) + 1))
    if closed and low == high:
        return low
    if not low < high:
        raise ValueError(f"nothing is between {low} and {high}")
    denominator = 1
    while True:
        numerator = floor(low * denominator) + 1
        if numerator < high * denominator:
            return Fraction(numerator, denominator)
        denominator += 1


def example(
    relations: Iterable[Relation], values: Mapping[sp.Symbol, Fraction | int]
) -> dict[sp.Symbol, Fraction]:
    """An exact rational point that satisfies the relations, found by back-substitution.

    `values` gives zeta, beta, gamma, f_b = 1 and any other symbol that is to be fixed; the
    result holds them and x_r, v_r, v_c, the force, alpha and the gaps. Raises ValueError when there
    is no such point.
    """
    fixed = {symbol: Fraction(value) for symbol, value in values.items()}
    polynomial_values: dict[sp.Symbol, Fraction | int] = {
        symbol: value for symbol, value in fixed.items() if symbol not in (gamma, x_r)
    }
    polynomial_values[inverse_gamma] = 1 / fixed[gamma]
    constraints = [c.at(polynomial_values) for c in [*map(constraint_of, relations), *RANGES]]
    unknowns = [symbol for symbol in VARIABLES if symbol not in fixed]
    try:
        *stages, _ = eliminations(constraints, unknowns)
    except Contradiction:
        raise ValueError(f"no point satisfies {list(relations)} at {fixed}") from None
    found: dict[sp.Symbol, Fraction | int] = {}
    for symbol, stage in reversed(stages):
        found[symbol] = _choose(symbol, [c.at(found) for c in stage if c.involves(symbol)])
    point = {symbol: Fraction(value) for symbol, value in found.items()} | fixed
    point[x_r] = point[delta] + point.pop(depth)
    return point


def _choose(symbol: sp.Symbol, constraints: Iterable[Comparison]) -> Fraction:
    lows: list[tuple[Fraction, bool]] = []
    highs: list[tuple[Fraction, bool]] = []
    for constraint in constraints:
        slope = Fraction(str(slope_of(constraint, symbol).as_expr()))
        offset = Fraction(str(constraint.at({symbol: 0}).polynomial.as_expr()))
        bound = -offset / slope
        if constraint.kind == "==":
            return bound
        (lows if slope > 0 else highs).append((bound, constraint.kind == ">="))
    low = max((bound for bound, _ in lows), default=None)
    high = min((bound for bound, _ in highs), default=None)
    closed = all(closed for bound, closed in lows + highs if bound in (low, high))
    return _simplest(low, high, closed)


def evaluate(expression: sp.Expr, point: Mapping[sp.Symbol, Fraction]) -> Fraction:
    """Exact value of an expression that is rational in the symbols of a point."""
    reduced = expression.xreplace({sp.cos(omega * tau): force / alpha}).expand()
    value = reduced.xreplace({symbol: sp.Rational(v) for symbol, v in point.items()})
    return Fraction(int(value.p), int(value.q))
