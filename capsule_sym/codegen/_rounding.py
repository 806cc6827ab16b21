"""Bound on the rounding error of the printed operations of a formula, from its expression tree.

Each operation rounds its result by at most one unit of its magnitude; products with a power of two,
changes of sign and sums of small integers are exact. So a term that passes k operations on its way
to the result, or has k roundings from the start, has an error of k units of its magnitude. The
error of a sum of terms is as many units of the sum of their magnitudes, its size. One unit is added
for higher orders and for the rounding of the size itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce

import sympy as sp

from capsule_sym.codegen._lower import Kernel


@dataclass(frozen=True)
class Term:
    """Product in an expanded sum: its arguments, its magnitude, its error in units."""

    names: frozenset[str]
    size: sp.Expr
    units: int

    def times(self, other: Term) -> Term:
        """Product with another term, which is rounded unless it is exact."""
        exact = any(_power_of_two(t.size) for t in (self, other))
        names, units = self.names | other.names, self.units + other.units
        return Term(names, self.size * other.size, units + (not exact))


CIRCULAR_UNITS = 2
"""Bound on the roundings of a cosine or sine, in units of 1, for the library's own and libm's."""

ONE = Term(frozenset(), sp.S.One, 0)


def _power_of_two(number: sp.Expr) -> bool:
    return bool(number.is_Number and sp.log(number, 2).is_Integer)


def terms_of(expression: sp.Expr, known: Mapping[str, list[Term]]) -> list[Term]:
    """Terms that an expression sums, with each operation counted.

    Raises ValueError for a function, and for a denominator whose terms may cancel.
    """
    if expression.is_Symbol:
        return known[expression.name]
    if expression.is_Rational:
        whole = _power_of_two(sp.Integer(expression.q))
        return [Term(frozenset(), abs(expression), 0 if whole else 1)]
    if expression.is_Add:
        parts = [terms_of(part, known) for part in expression.args]
        exact = all(not t.names and not t.units and _whole(t.size) for part in parts for t in part)
        sums = 0 if exact else len(parts) - 1
        return [Term(t.names, t.size, t.units + sums) for part in parts for t in part]
    above, below = sp.fraction(expression)
    if below != 1:
        divisor = terms_of(below, known)
        total = sp.Add(*(t.size for t in divisor))
        if sp.expand(total - below) != 0:
            raise ValueError(f"terms cancel in the denominator of {expression}")
        names = frozenset(name for t in divisor for name in t.names)
        off = 1 + max(t.units for t in divisor)
        return [
            Term(t.names | names, t.size / total, t.units + off) for t in terms_of(above, known)
        ]
    if expression.is_Mul or (expression.is_Pow and expression.exp.is_Integer):
        base = expression.args if expression.is_Mul else [expression.base] * int(expression.exp)
        factors = (terms_of(factor, known) for factor in base)
        return reduce(lambda a, b: [s.times(t) for s in a for t in b], factors, [ONE])
    raise ValueError(f"no rule for {expression}")


def _whole(size: sp.Expr) -> bool:
    return bool(size.is_Integer or size in WHOLE)


WHOLE = (sp.Symbol("n", positive=True),)
"""Symbols of small integers."""


def results_of(kernel: Kernel, given: Mapping[str, int]) -> list[list[Term]]:
    """Terms of each result."""
    known = {}
    for name in (*kernel.arguments, *kernel.constants):
        symbol = sp.Symbol(name, positive=True)
        names = frozenset() if symbol in WHOLE else frozenset((name,))
        known[name] = [Term(names, symbol, given.get(name, 0))]

    def terms(expression: sp.Expr) -> list[Term]:
        named = {s: sp.Symbol(s.name, positive=True) for s in expression.free_symbols}
        return terms_of(expression.xreplace(named), known)

    for name, step in kernel.steps:
        known[name] = terms(step)
    return [terms(result) for result in kernel.results]


def units(kernel: Kernel, given: Mapping[str, int], argument: str | None = None) -> int:
    """Largest rounding error of a kernel's results in units of their sizes.

    With an `argument`, that of the terms with it alone. `given` are the rounding errors of
    arguments and constants, 0 if not named.
    """
    terms = (term for result in results_of(kernel, given) for term in result)
    return 1 + max(t.units for t in terms if argument is None or argument in t.names)
