"""Exact elimination of variables from linear constraints, after Fourier and Motzkin.

Every set of the theory (surface, line, subspace) and every sign condition on it is linear in the
state, in the excitation force and in the parameters that are forces or lengths (of the capsule:
alpha, delta and f_b), once x_r is measured from the stop in front (x_r = delta + s). Its
coefficients are polynomials in the other parameters and 1/gamma, whose signs follow from the
ranges of the parameters. Eliminating the variables one by one is then an equivalence over the real
numbers; where the sign of a coefficient is not known, `Undecided` is raised.

Every relation is homogeneous in the variables (the unit of force is free), so a bound of friction
of 1 stands for all that are > 0. The force alpha cos(omega tau) takes any value in [-alpha, alpha];
its rate of change is left unbounded. This makes a system easier to satisfy, so a system that is
inconsistent here is inconsistent in the model.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from itertools import combinations, product
from typing import Literal, TypeAlias

import sympy as sp
from sympy.polys.rings import PolyElement, ring

from capsule_sym._symbolic.model.model import BACKWARD, FORWARD, LOAD
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    PARAMETERS,
    PULSED,
    alpha,
    force,
    force_rate,
    front,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
)

Kind = Literal[">", ">=", "=="]
Sign = Literal[-1, 0, 1]
Relation: TypeAlias = sp.Basic
"""A SymPy relation (>, >=, <, <=, Eq), or one of SymPy's truth values."""

depth = sp.Symbol("s", real=True)  # x_r - front
inverse_gamma = sp.Symbol("g", positive=True)

_FORCES = LOAD.free_symbols | BACKWARD.free_symbols | FORWARD.free_symbols
_OTHER_FORCES = tuple(p for p in PARAMETERS if p in _FORCES and p != FORWARD)
GAPS = tuple(p for p in PARAMETERS if any(place.has(p) for place in MODEL.stops))
"""Parameters that are distances of stops."""
VARIABLES = (depth, v_c, v_r, force_rate, force, alpha, *GAPS, *_OTHER_FORCES)
"""Symbols in which constraints are linear; coefficients hold the others."""

_RATIOS = tuple(p for p in PARAMETERS if p not in (*VARIABLES, FORWARD, omega, gamma))
MAY_VANISH = tuple(ratio for ratio in _RATIOS if not ratio.is_positive)
"""Parameters of the coefficients that may be 0, which is treated as a separate case."""
_RING = ring((*VARIABLES, FORWARD, *_RATIOS, omega, inverse_gamma), sp.QQ)[0]
_GENERATOR = dict(zip(_RING.symbols, _RING.gens, strict=True))
_POSITION = {symbol: position for position, symbol in enumerate(_RING.symbols)}
_LINEAR = {
    x_r: front + depth,
    sp.cos(omega * tau): force / alpha,
    sp.sin(omega * tau): -force_rate / (alpha * omega),
    gamma: 1 / inverse_gamma,
}


class Undecided(Exception):
    """Raised where the ranges of the parameters do not fix the sign of a coefficient.

    Also raised for a relation that is not homogeneous, or not linear in a variable. Its first
    argument is the polynomial, expression or constraints at which the elimination stopped.
    """


@dataclass(frozen=True)
class Comparison:
    """Constraint `polynomial kind 0`, such as `polynomial > 0`."""

    polynomial: PolyElement
    kind: Kind

    @cached_property
    def _support(self) -> frozenset[int]:
        return frozenset(i for powers in self.polynomial for i, n in enumerate(powers) if n)

    def involves(self, symbol: sp.Symbol) -> bool:
        """True if a symbol occurs."""
        return _POSITION[symbol] in self._support

    def at(self, values: Mapping[sp.Symbol, Fraction | int]) -> Comparison:
        """Constraint with numbers in place of some symbols."""
        numbers = [
            (_GENERATOR[s], sp.QQ(v.numerator, v.denominator))  # not each type takes a Fraction
            for s, v in values.items()
            if self.involves(s)
        ]
        return Comparison(self.polynomial.subs(numbers), self.kind) if numbers else self

    def holds(self) -> bool:
        """True if a constraint without variables holds; raises Undecided if that is not fixed."""
        if self._truth is None:
            raise Undecided(self.polynomial)
        return self._truth

    @cached_property
    def _truth(self) -> bool | None:
        try:
            sign = _sign(self.polynomial)
        except Undecided:
            return None
        return sign == 0 if self.kind == "==" else sign > 0 or (sign == 0 and self.kind == ">=")

    def opposites(self) -> list[Comparison]:
        """Constraints of which exactly one holds where this one does not."""
        negative = -self.polynomial
        if self.kind == "==":
            return [Comparison(negative, ">"), Comparison(self.polynomial, ">")]
        return [Comparison(negative, ">=" if self.kind == ">" else ">")]


def _sign(polynomial: PolyElement) -> Sign:
    signs = {1 if coefficient > 0 else -1 for coefficient in polynomial.values()}
    if len(signs) == 2 or any(any(powers[: len(VARIABLES)]) for powers in polynomial):
        raise Undecided(polynomial)
    if not polynomial:
        return 0
    return 1 if signs == {1} else -1


@cache
def slope_of(constraint: Comparison, symbol: sp.Symbol) -> PolyElement:
    """Coefficient of a variable in a constraint; raises Undecided if that is not linear in it."""
    polynomial, generator = constraint.polynomial, _GENERATOR[symbol]
    if polynomial.degree(generator) > 1:
        raise Undecided(polynomial, symbol)
    return polynomial.diff(generator)


@cache
def _slope_sign(constraint: Comparison, symbol: sp.Symbol) -> Sign | None:
    """Sign of `slope_of`, None where the ranges of the parameters do not fix it."""
    try:
        return _sign(slope_of(constraint, symbol))
    except Undecided:
        return None


@cache
def _polynomial(expression: sp.Expr) -> PolyElement:
    """A homogeneous expression as a polynomial, at FORWARD = 1; raises Undecided for another."""
    polynomial = _RING.from_expr(sp.expand(expression.xreplace(_LINEAR)))
    if len({sum(powers[: _POSITION[FORWARD] + 1]) for powers in polynomial}) > 1:
        raise Undecided(expression)
    return Comparison(polynomial, "==").at({FORWARD: 1}).polynomial


@cache
def constraint_of(relation: Relation) -> Comparison:
    """A homogeneous relation as a constraint, at FORWARD = 1; a truth value as one of a number."""
    if relation in (sp.true, sp.false):
        return Comparison(_RING.one if relation == sp.true else -_RING.one, ">")
    if isinstance(relation, sp.Eq):
        return Comparison(_polynomial(relation.lhs - relation.rhs), "==")
    strict = isinstance(relation, (sp.StrictGreaterThan, sp.StrictLessThan))
    return Comparison(_polynomial(relation.gts - relation.lts), ">" if strict else ">=")


_a, _u = (_GENERATOR[symbol] for symbol in (alpha, force))
RANGES = (
    Comparison(_a, ">="),
    *(Comparison(_GENERATOR[gap], ">=") for gap in GAPS),
    *(Comparison(_GENERATOR[front] - _RING.from_expr(back), ">") for back in MODEL.stops[1:]),
    *(() if PULSED else (Comparison(_a - _u, ">="), Comparison(_a + _u, ">="))),
    *(
        Comparison(_GENERATOR[p], ">" if p.is_positive else ">=")
        for p in _OTHER_FORCES
        if p.is_nonnegative
    ),
)
"""Ranges of variables: alpha and gaps >= 0, room between stops, the force, signs of others.

The level of pulses, a symbol of its own, is unbounded.
"""


def _pivot(symbol: sp.Symbol, constraints: Iterable[Comparison]) -> Comparison | None:
    """Equation that can be solved for the symbol, or None."""
    for constraint in constraints:
        if constraint.kind == "==" and _slope_sign(constraint, symbol):
            return constraint
    return None


# The same two constraints meet in many systems, since each system of a piece repeats its relations.
@cache
def _without_symbol(symbol: sp.Symbol, one: Comparison, other: Comparison) -> Comparison:
    """Combination of two constraints in which a symbol is eliminated.

    The first is an equation, or its slope is positive and the other's is negative.
    """
    slope, sign = slope_of(one, symbol), _slope_sign(one, symbol)
    rest = slope * other.polynomial - slope_of(other, symbol) * one.polynomial
    kinds = (one.kind, other.kind)
    if one.kind == "==":
        return Comparison(sign * rest, other.kind)
    return Comparison(rest, ">" if ">" in kinds else ">=")


def _eliminate(symbol: sp.Symbol, constraints: Iterable[Comparison]) -> list[Comparison]:
    """Constraints on the other symbols after exact elimination of one; raises Undecided."""
    kept: list[Comparison] = []
    involved: list[Comparison] = []
    for constraint in constraints:
        (involved if constraint.involves(symbol) else kept).append(constraint)
    if pivot := _pivot(symbol, involved):
        others = (constraint for constraint in involved if constraint is not pivot)
        return kept + [_without_symbol(symbol, pivot, other) for other in others]
    if not all(_slope_sign(constraint, symbol) for constraint in involved):
        raise Undecided(involved, symbol)
    lower = [constraint for constraint in involved if _slope_sign(constraint, symbol) == 1]
    upper = [constraint for constraint in involved if _slope_sign(constraint, symbol) == -1]
    return kept + [_without_symbol(symbol, *pair) for pair in product(lower, upper)]


def _order(constraints: list[Comparison], symbols: list[sp.Symbol]) -> sp.Symbol:
    """Next symbol to eliminate: one that an equation determines, else the least involved.

    If there is none, raises Contradiction where two constraints are opposed, else Undecided.
    """
    costs: list[tuple[int, int]] = []
    for index, symbol in enumerate(symbols):
        involved = [constraint for constraint in constraints if constraint.involves(symbol)]
        if _pivot(symbol, involved):
            return symbol
        if all(c.kind != "==" and _slope_sign(c, symbol) for c in involved):
            costs.append((len(involved), index))
    if not costs:
        if any(_opposed(*pair) for pair in combinations(constraints, 2)):
            raise Contradiction
        raise Undecided(constraints)
    return symbols[min(costs)[1]]


def _opposed(one: Comparison, other: Comparison) -> bool:
    """True if two constraints contradict one another by opposite multiples of one polynomial."""
    common = one.polynomial.gcd(other.polynomial)
    try:
        signs = {_sign(each.polynomial.exquo(common)) for each in (one, other)}
    except Undecided:
        return False
    return signs == {1, -1} and ">" in (one.kind, other.kind)


class Contradiction(Exception):
    """Raised if no values of the variables satisfy the constraints."""


def _settled(constraints: Iterable[Comparison]) -> list[Comparison]:
    """Constraints without those that always hold; raises Contradiction for one that never does."""
    kept: list[Comparison] = []
    for constraint in dict.fromkeys(constraints):
        if constraint._truth is None:
            kept.append(constraint)
        elif not constraint._truth:
            raise Contradiction
    return kept


def eliminations(
    constraints: list[Comparison], symbols: Iterable[sp.Symbol]
) -> Iterator[tuple[sp.Symbol, list[Comparison]]]:
    """Each eliminated symbol with the constraints it was eliminated from; then 1 with the rest.

    When iterated, raises Contradiction if nothing satisfies the constraints, and Undecided.
    """
    left = list(symbols)
    constraints = _settled(constraints)
    while left:
        held = frozenset[int]().union(*(c._support for c in constraints))
        present = [symbol for symbol in left if _POSITION[symbol] in held]
        symbol = _order(constraints, present) if present else left[0]
        left.remove(symbol)
        yield symbol, constraints
        if present:
            constraints = _settled(_eliminate(symbol, constraints))
    yield sp.S.One, constraints


def without(constraints: list[Comparison], symbols: Iterable[sp.Symbol]) -> list[Comparison]:
    """Constraints that remain after elimination of the symbols; raises as `eliminations`."""
    return list(eliminations(constraints, symbols))[-1][1]
