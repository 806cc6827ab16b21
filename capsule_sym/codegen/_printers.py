"""Base class of printers in Python and C."""

from __future__ import annotations

import sympy as sp
from sympy.printing.precedence import PRECEDENCE


def _product(base: str, exponent: int) -> str:
    power = "*".join([base] * abs(exponent))
    return power if exponent > 0 else f"1.0/({power})"


class Products:
    """Integer powers up to 4 as products, for which libm and NumPy have no faster form."""

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Integer and 0 < abs(int(exponent)) <= 4:
            return _product(self.parenthesize(base, 100), int(exponent))  # type: ignore[attr-defined]
        given = {"rational": True} if rational else {}
        return super()._print_Pow(expr, **given)  # type: ignore[misc, no-any-return]

    def _print_Mul(self, expr: sp.Mul) -> str:
        below = [f for f in expr.args if f.is_Pow and f.exp.is_Rational and f.exp.is_negative]
        if len(below) == 1 and below[0].exp.is_Integer and below[0].exp < -1:
            # SymPy takes a power for one name and writes a/b*b.
            over = sp.Mul(*(factor for factor in expr.args if factor is not below[0]))
            over = self.parenthesize(over, PRECEDENCE["Mul"])  # type: ignore[attr-defined]
            return f"{over}/({self._print(1 / below[0])})"  # type: ignore[attr-defined]
        return super()._print_Mul(expr)  # type: ignore[misc, no-any-return]
