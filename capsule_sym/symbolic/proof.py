"""Exact decisions about the inequalities of the theory, by Fourier-Motzkin elimination.

Every set of the theory (surface, line, subspace) and every sign condition on it is linear in the
state, in the excitation force and in alpha, delta and f_b, once x_r is measured from the contact
plane (x_r = delta + s). Its coefficients are polynomials in zeta, beta and 1/gamma whose signs
follow from the ranges of the parameters. Eliminating the variables one by one is then an
equivalence over the real numbers, so that consistency and implication are decided, not sampled;
where the sign of a coefficient is not known, `Undecided` is raised.

Every relation is homogeneous in the variables (the unit of force is free), so f_b = 1 stands for
all f_b > 0. zeta = 0 and beta = 0 are cases of their own, beside zeta > 0 and beta > 0. The
force alpha cos(omega tau) takes any value in [-alpha, alpha]; its rate of change is left
unbounded, which only makes a system easier to satisfy: what is inconsistent here is so in the
model.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from itertools import product
from math import ceil, floor
from typing import Any, Literal, TypeAlias

import sympy as sp
from sympy.polys.rings import PolyElement, ring
from sympy.solvers.inequalities import solve_rational_inequalities

from capsule_sym.symbolic.symbols import (
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
    zeta,
)

Kind = Literal[">", ">=", "=="]
Sign = Literal[-1, 0, 1]
Relation: TypeAlias = sp.Basic
"""A SymPy relation (>, >=, <, <=, Eq), or one of SymPy's truth values."""

force = sp.Symbol("u", real=True)  # alpha cos(omega tau)
force_rate = sp.Symbol("u1", real=True)  # its time derivative
_depth = sp.Symbol("s", real=True)  # x_r - delta
_inverse_gamma = sp.Symbol("g", positive=True)

_VARIABLES = (_depth, v_c, v_r, force_rate, force, alpha, delta)
_RING = ring((*_VARIABLES, f_b, zeta, beta, omega, _inverse_gamma), sp.QQ)[0]
_GENERATOR = dict(zip(_RING.symbols, _RING.gens, strict=True))
_POSITION = {symbol: position for position, symbol in enumerate(_RING.symbols)}
_LINEAR = {
    x_r: delta + _depth,
    sp.cos(omega * tau): force / alpha,
    sp.sin(omega * tau): -force_rate / (alpha * omega),
    gamma: 1 / _inverse_gamma,
}


class Undecided(Exception):
    """The sign of a coefficient is not fixed by the ranges of the parameters.

    Its arguments are the polynomial, or the constraints, at which the elimination stopped.
    """


@dataclass(frozen=True)
class _Constraint:
    """`polynomial kind 0`."""

    polynomial: PolyElement
    kind: Kind

    def slope(self, symbol: sp.Symbol) -> PolyElement:
        """Coefficient of a variable, in which the constraint is linear."""
        position = _POSITION[symbol]
        terms = {}
        for powers, coefficient in self.polynomial.items():
            if powers[position] > 1:
                raise Undecided(self.polynomial, symbol)
            if powers[position]:
                terms[_without(powers, position)] = coefficient
        return _RING.from_dict(terms)

    @cached_property
    def _support(self) -> frozenset[int]:
        return frozenset(i for powers in self.polynomial for i, n in enumerate(powers) if n)

    def involves(self, symbol: sp.Symbol) -> bool:
        return _POSITION[symbol] in self._support

    def at(self, values: Mapping[sp.Symbol, Fraction | int]) -> _Constraint:
        """The constraint with numbers in place of some symbols."""
        numbers = [(_POSITION[s], sp.QQ(Fraction(v))) for s, v in values.items()]
        terms: dict[tuple[int, ...], Any] = {}
        for powers, coefficient in self.polynomial.items():
            for position, number in numbers:
                if powers[position]:
                    coefficient *= number ** powers[position]
                    powers = _without(powers, position)
            terms[powers] = terms.get(powers, 0) + coefficient
        return _Constraint(_RING.from_dict(terms), self.kind)


def _without(powers: tuple[int, ...], position: int) -> tuple[int, ...]:
    return (*powers[:position], 0, *powers[position + 1 :])


def _permits(kind: Kind, sign: Sign) -> bool:
    return sign == 0 if kind == "==" else sign > 0 or (sign == 0 and kind == ">=")


def _sign(polynomial: PolyElement) -> Sign:
    signs = {1 if coefficient > 0 else -1 for coefficient in polynomial.values()}
    if len(signs) == 2 or any(any(powers[: len(_VARIABLES)]) for powers in polynomial):
        raise Undecided(polynomial)
    if not polynomial:
        return 0
    return 1 if signs == {1} else -1


@cache
def _polynomial(expression: sp.Expr) -> PolyElement:
    """A homogeneous expression as a polynomial, at f_b = 1."""
    polynomial = _RING.from_expr(sp.expand(expression.xreplace(_LINEAR)))
    if len({sum(powers[: _POSITION[f_b] + 1]) for powers in polynomial}) > 1:
        raise Undecided(expression)
    return _Constraint(polynomial, "==").at({f_b: 1}).polynomial


def _constraint(relation: Relation) -> _Constraint:
    if relation in (sp.true, sp.false):
        return _Constraint(_RING.one if relation == sp.true else -_RING.one, ">")
    if isinstance(relation, sp.Eq):
        return _Constraint(_polynomial(relation.lhs - relation.rhs), "==")
    if isinstance(relation, (sp.StrictGreaterThan, sp.StrictLessThan)):
        return _Constraint(_polynomial(relation.gts - relation.lts), ">")
    if isinstance(relation, (sp.GreaterThan, sp.LessThan)):
        return _Constraint(_polynomial(relation.gts - relation.lts), ">=")
    raise TypeError(f"not a relation that can be decided: {relation}")


_a, _u = (_GENERATOR[symbol] for symbol in (alpha, force))
_RANGES = (
    _Constraint(_a, ">="),
    _Constraint(_GENERATOR[delta], ">="),
    _Constraint(_a - _u, ">="),
    _Constraint(_a + _u, ">="),
)


def _pivot(symbol: sp.Symbol, constraints: Iterable[_Constraint]) -> _Constraint | None:
    """An equation that can be solved for the symbol."""
    for constraint in constraints:
        if constraint.kind == "==" and constraint.involves(symbol):
            try:
                _sign(constraint.slope(symbol))
            except Undecided:
                continue
            return constraint
    return None


def _eliminate(symbol: sp.Symbol, constraints: Iterable[_Constraint]) -> list[_Constraint]:
    """The constraints that remain for the other symbols, by exact elimination of one."""
    constraints = list(constraints)
    kept = [constraint for constraint in constraints if not constraint.involves(symbol)]
    involved = [constraint for constraint in constraints if constraint.involves(symbol)]
    if pivot := _pivot(symbol, involved):
        scale = pivot.slope(symbol)
        sign = _sign(scale)
        for constraint in involved:
            if constraint is not pivot:
                rest = scale * constraint.polynomial - constraint.slope(symbol) * pivot.polynomial
                kept.append(_Constraint(sign * rest, constraint.kind))
        return kept
    slopes = [(constraint, constraint.slope(symbol)) for constraint in involved]
    lower = [(constraint, slope) for constraint, slope in slopes if _sign(slope) > 0]
    upper = [(constraint, slope) for constraint, slope in slopes if _sign(slope) < 0]
    for (below, a), (above, b) in product(lower, upper):
        kind: Kind = ">" if ">" in (below.kind, above.kind) else ">="
        kept.append(_Constraint(a * above.polynomial - b * below.polynomial, kind))
    return kept


def _order(constraints: list[_Constraint], symbols: list[sp.Symbol]) -> sp.Symbol:
    """The symbol to eliminate next: one that an equation gives, else the least involved."""
    costs: list[tuple[int, int]] = []
    for index, symbol in enumerate(symbols):
        involved = [constraint for constraint in constraints if constraint.involves(symbol)]
        if _pivot(symbol, involved):
            return symbol
        try:
            for constraint in involved:
                if constraint.kind == "==":
                    raise Undecided
                _sign(constraint.slope(symbol))
        except Undecided:
            continue
        costs.append((len(involved), index))
    if not costs:
        raise Undecided(constraints)
    return symbols[min(costs)[1]]


class _Contradiction(Exception):
    """A constraint without variables that does not hold."""


def _settled(constraints: Iterable[_Constraint]) -> list[_Constraint]:
    """The constraints without those that hold by themselves."""
    kept: list[_Constraint] = []
    for constraint in dict.fromkeys(constraints):
        try:
            if not _holds(constraint):
                raise _Contradiction
        except Undecided:
            kept.append(constraint)
    return kept


def _stages(
    constraints: list[_Constraint], symbols: Iterable[sp.Symbol]
) -> Iterator[tuple[sp.Symbol, list[_Constraint]]]:
    """Each eliminated symbol with the constraints it was eliminated from; then what is left."""
    left = list(symbols)
    constraints = _settled(constraints)
    while left:
        present = [s for s in left if any(c.involves(s) for c in constraints)]
        symbol = _order(constraints, present) if present else left[0]
        left.remove(symbol)
        yield symbol, constraints
        if present:
            constraints = _settled(_eliminate(symbol, constraints))
    yield sp.S.One, constraints


def _remaining(constraints: list[_Constraint], symbols: Iterable[sp.Symbol]) -> list[_Constraint]:
    return list(_stages(constraints, symbols))[-1][1]


def _zero_patterns(symbols: list[sp.Symbol]) -> Iterator[dict[sp.Symbol, int]]:
    for zeros in product((False, True), repeat=len(symbols)):
        yield {symbol: 0 for symbol, zero in zip(symbols, zeros, strict=True) if zero}


def _cases(constraints: Iterable[_Constraint]) -> Iterator[list[_Constraint]]:
    """The constraints for zeta and beta zero or positive, in every combination that occurs."""
    constraints = [*constraints, *_RANGES]
    present = [s for s in (zeta, beta) if any(c.involves(s) for c in constraints)]
    for values in _zero_patterns(present):
        yield [constraint.at(values) for constraint in constraints]


def _satisfiable(constraints: list[_Constraint]) -> bool:
    """Whether some state and some positive zeta, beta, omega and 1/gamma satisfy constraints."""
    try:
        unsettled = _remaining(constraints, _VARIABLES)
    except _Contradiction:
        return False
    unknown = sorted({s for c in unsettled for s in c.polynomial.as_expr().free_symbols}, key=str)
    samples = (dict(zip(unknown, values, strict=True)) for values in _trials(len(unknown)))
    if any(all(_holds(constraint.at(sample)) for constraint in unsettled) for sample in samples):
        return True
    if len(unknown) > 1:
        raise Undecided(unsettled)
    (symbol,) = unknown
    one = sp.Poly(1, symbol)
    system = [((sp.Poly(c.polynomial.as_expr(), symbol), one), c.kind) for c in unsettled]
    positive = ((sp.Poly(symbol, symbol), one), ">")
    return bool(solve_rational_inequalities([[positive, *system]]) != sp.S.EmptySet)


def _holds(constraint: _Constraint) -> bool:
    return _permits(constraint.kind, _sign(constraint.polynomial))


def _trials(count: int) -> Iterator[tuple[Fraction, ...]]:
    """Values at which a system may be seen to hold; that it does not there proves nothing."""
    return product((Fraction(1, 16), Fraction(1), Fraction(16)), repeat=count)


@cache
def _consistent(constraints: tuple[_Constraint, ...]) -> bool:
    return any(map(_satisfiable, _cases(constraints)))


def consistent(relations: Iterable[Relation]) -> bool:
    """Whether some state, force and admissible parameters satisfy all the relations.

    Raises `Undecided` when the elimination meets a coefficient of unknown sign.
    """
    return _consistent(tuple(map(_constraint, relations)))


def negations(relation: Relation) -> tuple[Relation, ...]:
    """The relations of which exactly one holds where the given one does not."""
    if isinstance(relation, sp.Eq):
        return sp.Gt(relation.lhs, relation.rhs), sp.Lt(relation.lhs, relation.rhs)
    return (sp.Not(relation),)


def implies(hypotheses: Iterable[Relation], conclusion: Relation) -> bool:
    """Whether the conclusion holds wherever all the hypotheses do."""
    hypotheses = list(hypotheses)
    return not any(consistent([*hypotheses, other]) for other in negations(conclusion))


def sign_under(expression: sp.Expr, hypotheses: Iterable[Relation]) -> Sign | None:
    """Sign of an expression wherever the hypotheses hold; None where it takes several."""
    hypotheses = list(hypotheses)
    if implies(hypotheses, sp.Gt(expression, 0)):
        return 1
    if implies(hypotheses, sp.Lt(expression, 0)):
        return -1
    return 0 if implies(hypotheses, sp.Eq(expression, 0)) else None


def always_solvable(
    hypotheses: Iterable[Relation], relations: Iterable[Relation], unknowns: Iterable[sp.Symbol]
) -> bool:
    """Whether for ALL values that satisfy the hypotheses some unknowns satisfy the relations.

    The unknowns are among x_r, v_r, v_c, the force and its rate.
    """
    eliminated = [_depth if symbol == x_r else symbol for symbol in unknowns]
    given = [_constraint(relation) for relation in hypotheses]
    wanted = [_constraint(relation) for relation in relations]
    present = [s for s in (zeta, beta) if any(c.involves(s) for c in given + wanted)]
    for values in _zero_patterns(present):
        case = [constraint.at(values) for constraint in given]
        fixed = [_Constraint(_GENERATOR[s], ">") for s in present if s not in values]
        try:
            remaining = _remaining([c.at(values) for c in (*wanted, *_RANGES)], eliminated)
        except _Contradiction:
            remaining = [_Constraint(-_RING.one, ">")]
        for condition in remaining:
            for opposite in _opposites(condition):
                if _consistent((*case, *fixed, opposite)):
                    return False
    return True


def _opposites(constraint: _Constraint) -> list[_Constraint]:
    negative = -constraint.polynomial
    if constraint.kind == "==":
        return [_Constraint(negative, ">"), _Constraint(constraint.polynomial, ">")]
    return [_Constraint(negative, ">=" if constraint.kind == ">" else ">")]


def _simplest(low: Fraction | None, high: Fraction | None, closed: bool) -> Fraction:
    """A rational between the bounds (None for unbounded) with a small denominator."""
    if low is None and high is None:
        return Fraction(0)
    if low is None:
        assert high is not None
        return Fraction(min(0, ceil(high) - 1))
    if high is None:
        return Fraction(max(0, floor(low) + 1))
    if closed and low == high:
        return low
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
    result holds them and x_r, v_r, v_c, the force, alpha and delta. Raises ValueError when there
    is no such point.
    """
    fixed = {symbol: Fraction(value) for symbol, value in values.items()}
    polynomial_values: dict[sp.Symbol, Fraction | int] = {
        symbol: value for symbol, value in fixed.items() if symbol not in (gamma, x_r)
    }
    polynomial_values[_inverse_gamma] = 1 / fixed[gamma]
    constraints = [c.at(polynomial_values) for c in [*map(_constraint, relations), *_RANGES]]
    unknowns = [symbol for symbol in _VARIABLES if symbol not in fixed]
    try:
        *stages, _ = _stages(constraints, unknowns)
    except _Contradiction:
        raise ValueError(f"no point satisfies {list(relations)} at {fixed}") from None
    found: dict[sp.Symbol, Fraction | int] = {}
    for symbol, stage in reversed(stages):
        found[symbol] = _choose(symbol, [c.at(found) for c in stage if c.involves(symbol)])
    point = {symbol: Fraction(value) for symbol, value in found.items()} | fixed
    point[x_r] = point[delta] + point.pop(_depth)
    return point


def _choose(symbol: sp.Symbol, constraints: Iterable[_Constraint]) -> Fraction:
    low: Fraction | None = None
    high: Fraction | None = None
    closed = True
    for constraint in constraints:
        slope = Fraction(str(constraint.slope(symbol).as_expr()))
        offset = Fraction(str(constraint.at({symbol: 0}).polynomial.as_expr()))
        bound = -offset / slope
        if constraint.kind == "==":
            return bound
        closed = closed and constraint.kind == ">="
        if slope > 0:
            low = bound if low is None else max(low, bound)
        else:
            high = bound if high is None else min(high, bound)
    return _simplest(low, high, closed)


def evaluate(expression: sp.Expr, point: Mapping[sp.Symbol, Fraction]) -> Fraction:
    """Exact value of an expression that is rational in the symbols of a point."""
    reduced = expression.xreplace({sp.cos(omega * tau): force / alpha}).expand()
    value = reduced.xreplace({symbol: sp.Rational(v) for symbol, v in point.items()})
    return Fraction(int(value.p), int(value.q))
