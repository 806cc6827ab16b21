"""How each target language spells an expression and a function."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import sympy as sp
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.octave import OctaveCodePrinter
from sympy.printing.precedence import PRECEDENCE
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


class _Python(_Products, PythonCodePrinter):
    """Python code whose functions are plain names, imported by the template."""

    def _print_Function(self, expr: sp.Function) -> str:
        name = type(expr).__name__
        return f"{name}({', '.join(self._print(argument) for argument in expr.args)})"

    _print_sin = _print_cos = _print_exp = _print_expm1 = _print_Function


class _C99(_Products, C99CodePrinter):
    """C99 code in double precision."""


class _Generic(CodePrinter):
    """C99 code over any number type: sums and products are calls of add, sub, mul, mad and over.

    `mad(a, b, c)` is a b + c; a type may round it once or twice.
    """

    language = "C"
    _default_settings: ClassVar = {**CodePrinter._default_settings, "precision": 17}

    def _format_code(self, lines: list[str]) -> list[str]:
        return lines

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return str(expr.name)

    def _print_Number(self, expr: sp.Expr) -> str:
        return f"num({float(expr)!r})"

    _print_Integer = _print_Rational = _print_Float = _print_Number
    _print_One = _print_Zero = _print_NegativeOne = _print_Half = _print_Number

    def _print_Add(self, expr: sp.Add, order: object = None) -> str:
        total = ""
        terms = sorted(self._as_ordered_terms(expr), key=lambda t: t.could_extract_minus_sign())
        for term in terms:
            negative = bool(total) and term.could_extract_minus_sign()
            term = -term if negative else term
            factors = list(term.as_ordered_factors())
            if not total:
                total = self._print(term)
            elif negative:
                total = f"sub({total}, {self._print(term)})"
            elif len(factors) > 1 and not any(f.is_Pow and f.exp.is_negative for f in factors):
                rest = self._print(sp.Mul(*factors[1:]))
                total = f"mad({self._print(factors[0])}, {rest}, {total})"
            else:
                total = f"add({total}, {self._print(term)})"
        return str(total)

    def _print_Mul(self, expr: sp.Mul) -> str:
        coefficient, rest = expr.as_coeff_Mul()
        if coefficient == -1:
            return f"neg({self._print(rest)})"
        numerator, denominator = sp.fraction(expr)
        if denominator != 1:
            return f"over({self._print(numerator)}, {self._print(denominator)})"
        factors = [self._print(factor) for factor in expr.as_ordered_factors()]
        total = factors[0]
        for factor in factors[1:]:
            total = f"mul({total}, {factor})"
        return str(total)

    def _print_Pow(self, expr: sp.Pow) -> str:
        base, exponent = str(self._print(expr.base)), int(expr.exp)
        if exponent < 0:
            return f"over(num(1.0), {self._print(expr.base**-exponent)})"
        total = base
        for _ in range(exponent - 1):
            total = f"mul({total}, {base})"
        return str(total)


class _Bound(_Products, C99CodePrinter):
    """C99 code for bounds, which are doubles or vectors of them."""

    def _print_Abs(self, expr: sp.Abs) -> str:
        return f"size_of({self._print(expr.args[0])})"


@dataclass(frozen=True)
class Language:
    """A target language: its printer, and its ways to assign, to unpack constants and to return."""

    printer: sp.printing.codeprinter.CodePrinter
    assign: str
    unpack: str
    function: str
    comment: str
    kind: str = ""
    """The C type of its numbers."""

    def expression(self, expression: sp.Expr) -> str:
        """The expression in this language."""
        return str(self.printer.doprint(expression))


_PYTHON_FUNCTION = '''def {name}({signature}){returned}:
    """{doc}

    {operations}.
    """
{body}    return {results}
'''
_C_FUNCTION = """/* {doc} {operations}. */
typedef struct {{
{fields}}} {name}_results;
static {name}_results {name}({signature})
{{
{body}    return ({name}_results){{{results}}};
}}
"""
_GENERIC_FUNCTION = """/* {doc} {operations}. */
static inline {returned} {name}({signature})
{{
{body}{results}}}
"""

# Element by element: where no choice is made, constants and durations may be arrays.
_MATLAB = OctaveCodePrinter({"user_functions": {"expm1": "expm1"}})
_MATLAB_FUNCTION = """function {results}{name}({signature})
% {doc} {operations}.
{body}end
"""

LANGUAGES = {
    "numpy": Language(_Python(), "{} = {}", "{0} = c.{0}", _PYTHON_FUNCTION, "#"),
    "mpmath": Language(_Python(), "{} = {}", "{0} = c.{0}", _PYTHON_FUNCTION, "#"),
    "c": Language(
        _C99(), "const double {} = {};", "const double {0} = c->{0};", _C_FUNCTION, "//", "double"
    ),
    "real": Language(
        _Generic(),
        "const real {} = {};",
        "const real {0} = c->{0};",
        _GENERIC_FUNCTION,
        "//",
        "real",
    ),
    "matlab": Language(_MATLAB, "{} = {};", "{0} = c.{0};", _MATLAB_FUNCTION, "%"),
    "page": Language(_C99(), "", "", "", "//"),
    "bound": Language(
        _Bound(),
        "const bound {} = {};",
        "const bound {0} = c->{0};",
        _GENERIC_FUNCTION,
        "//",
        "bound",
    ),
}
