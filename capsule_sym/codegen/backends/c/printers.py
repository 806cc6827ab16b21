"""Expressions in C, in double precision and over other number types."""

from __future__ import annotations

from typing import ClassVar

import sympy as sp
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import CodePrinter

from capsule_sym.codegen._printers import Products


class DoubleCode(Products, C99CodePrinter):
    """C99 code in double precision."""


class Numbers(CodePrinter):
    """C99 code over any number type: add, sub, mul, mad, over and neg are called for operations.

    `mad(a, b, c)` is a b + c; a type may round it once or twice. Exponents have to be
    integers; a rational constant is rounded to a double.
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


class Bounds(Products, C99CodePrinter):
    """C99 code for bounds, which are doubles or vectors of them."""

    def _print_Abs(self, expr: sp.Abs) -> str:
        return f"size_of({self._print(expr.args[0])})"
