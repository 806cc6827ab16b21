"""Exact decisions about the inequalities of the theory.

Variables are eliminated exactly, so that consistency and implication are decided, not sampled;
where the elimination meets a coefficient of unknown sign, `Undecided` is raised. A parameter of 0
is a case of its own, beside one that is positive.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from functools import cache
from itertools import product

import sympy as sp
from sympy.solvers.inequalities import solve_rational_inequalities

from capsule_sym._symbolic.model.elimination import (
    MAY_VANISH,
    RANGES,
    VARIABLES,
    Comparison,
    Contradiction,
    Relation,
    Sign,
    Undecided,
    constraint_of,
    depth,
    without,
)
from capsule_sym._symbolic.model.symbols import (
    x_r,
)


def _zero_patterns(symbols: list[sp.Symbol]) -> Iterator[dict[sp.Symbol, int]]:
    for zeros in product((False, True), repeat=len(symbols)):
        yield {symbol: 0 for symbol, zero in zip(symbols, zeros, strict=True) if zero}


def _cases(constraints: Iterable[Comparison]) -> Iterator[list[Comparison]]:
    """The constraints and `RANGES`, with parameters that may vanish at 0 or above, in all cases."""
    constraints = [*constraints, *RANGES]
    present = [s for s in MAY_VANISH if any(c.involves(s) for c in constraints)]
    for values in _zero_patterns(present):
        yield [constraint.at(values) for constraint in constraints]


def _satisfiable(constraints: list[Comparison]) -> bool:
    """True if some state and some positive parameters satisfy constraints; raises Undecided."""
    try:
        unsettled = without(constraints, VARIABLES)
    except Contradiction:
        return False
    except Undecided:
        if any(_satisfiable(tried) for tried in _with_numbers(constraints)):
            return True
        raise
    unknown = sorted({s for c in unsettled for s in c.polynomial.as_expr().free_symbols}, key=str)
    samples = (dict(zip(unknown, values, strict=True)) for values in _trials(len(unknown)))
    if any(all(constraint.at(sample).holds() for constraint in unsettled) for sample in samples):
        return True
    if len(unknown) > 1:
        raise Undecided(unsettled)
    (symbol,) = unknown
    one = sp.Poly(1, symbol)
    system = [((sp.Poly(c.polynomial.as_expr(), symbol), one), c.kind) for c in unsettled]
    positive = ((sp.Poly(symbol, symbol), one), ">")
    return bool(solve_rational_inequalities([[positive, *system]]) != sp.S.EmptySet)


def _with_numbers(constraints: list[Comparison]) -> Iterator[list[Comparison]]:
    """The constraints with numbers for the parameters in their coefficients, by several trials."""
    symbols = {s for c in constraints for s in c.polynomial.as_expr().free_symbols}
    names = sorted(symbols - {*VARIABLES}, key=str)
    for values in _trials(len(names)) if names else ():
        numbers = dict(zip(names, values, strict=True))
        yield [constraint.at(numbers) for constraint in constraints]


def _trials(count: int) -> Iterator[tuple[Fraction, ...]]:
    """Trial values of the parameters; a system that fails at all of them is not refuted."""
    return product((Fraction(1, 16), Fraction(1), Fraction(16)), repeat=count)


@cache
def _consistent(constraints: tuple[Comparison, ...]) -> bool:
    return any(map(_satisfiable, _cases(constraints)))


def consistent(relations: Iterable[Relation]) -> bool:
    """True if some state, force and admissible parameters satisfy all the relations.

    Of the parameters' ranges only the signs count, and the force's rate is unbounded. Raises
    `Undecided` when the elimination meets a coefficient of unknown sign.
    """
    return _consistent(tuple(map(constraint_of, relations)))


def negations(relation: Relation) -> tuple[Relation, ...]:
    """Relations of which exactly one holds where the given one does not."""
    if isinstance(relation, sp.Eq):
        return sp.Gt(relation.lhs, relation.rhs), sp.Lt(relation.lhs, relation.rhs)
    return (sp.Not(relation),)


def implies(hypotheses: Iterable[Relation], conclusion: Relation) -> bool:
    """True if the conclusion holds wherever all the hypotheses do; raises as `consistent`."""
    hypotheses = list(hypotheses)
    return not any(consistent([*hypotheses, other]) for other in negations(conclusion))


def sign_under(expression: sp.Expr, hypotheses: Iterable[Relation]) -> Sign | None:
    """Sign of an expression wherever the hypotheses hold; None where it takes several.

    It is 1 if they hold nowhere. Raises as `consistent`.
    """
    hypotheses = list(hypotheses)
    if implies(hypotheses, sp.Gt(expression, 0)):
        return 1
    if implies(hypotheses, sp.Lt(expression, 0)):
        return -1
    return 0 if implies(hypotheses, sp.Eq(expression, 0)) else None


def always_solvable(
    hypotheses: Iterable[Relation], relations: Iterable[Relation], unknowns: Iterable[sp.Symbol]
) -> bool:
    """True if for ALL values that satisfy the hypotheses some unknowns satisfy the relations.

    The unknowns are among x_r, v_r, v_c, the force and its rate. Raises as `consistent`.
    """
    eliminated = [depth if symbol == x_r else symbol for symbol in unknowns]
    given = [constraint_of(relation) for relation in hypotheses]
    wanted = [constraint_of(relation) for relation in relations]
    present = [s for s in MAY_VANISH if any(c.involves(s) for c in given + wanted)]
    for values in _zero_patterns(present):
        case = [constraint.at(values) for constraint in given]
        fixed = [constraint_of(sp.Gt(s, 0)) for s in present if s not in values]
        try:
            remaining = without([c.at(values) for c in (*wanted, *RANGES)], eliminated)
        except Contradiction:
            remaining = [constraint_of(sp.false)]
        for condition in remaining:
            for opposite in condition.opposites():
                if _consistent((*case, *fixed, opposite)):
                    return False
    return True
