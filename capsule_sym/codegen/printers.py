"""How each target language spells an expression and a function."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp
from sympy.printing.c import C99CodePrinter
from sympy.printing.pycode import PythonCodePrinter


def _product(base: str, exponent: int) -> str:
    power = "*".join([base] * abs(exponent))
    return power if exponent > 0 else f"1.0/({power})"


class _Products:
    """Small integer powers as products, which neither libm nor NumPy spells faster."""

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Integer and 0 < abs(int(exponent)) <= 4:
            return _product(self.parenthesize(base, 100), int(exponent))  # type: ignore[attr-defined]
        return super()._print_Pow(expr, rational=rational)  # type: ignore[misc, no-any-return]


class _Python(_Products, PythonCodePrinter):
    """Python code whose functions are plain names, imported by the template."""

    def _print_Function(self, expr: sp.Function) -> str:
        name = type(expr).__name__
        return f"{name}({', '.join(self._print(argument) for argument in expr.args)})"

    _print_sin = _print_cos = _print_exp = _print_expm1 = _print_Function


class _C99(_Products, C99CodePrinter):
    """C99 code in double precision."""


@dataclass(frozen=True)
class Language:
    """A target language: its printer, and its ways to assign, to unpack constants and to return."""

    printer: sp.printing.codeprinter.CodePrinter
    assign: str
    unpack: str
    function: str
    comment: str

    def expression(self, expression: sp.Expr) -> str:
        """The expression in this language."""
        return str(self.printer.doprint(expression))


_PYTHON_FUNCTION = '''def {name}({signature}):
    """{doc}

    {operations} operations.
    """
{body}    return ({results},)
'''
_C_FUNCTION = """/* {doc} {operations} operations. */
void {name}({signature}, double *restrict out)
{{
{body}{results}}}
"""

LANGUAGES = {
    "numpy": Language(_Python(), "{} = {}", "{0} = c.{0}", _PYTHON_FUNCTION, "#"),
    "mpmath": Language(_Python(), "{} = {}", "{0} = c.{0}", _PYTHON_FUNCTION, "#"),
    "c": Language(_C99(), "const double {} = {};", "const double {0} = c->{0};", _C_FUNCTION, "//"),
}
