"""Expressions as they are printed mean what they meant."""

import operator

import pytest
import sympy as sp

from capsule_sym.codegen._backend import Language
from capsule_sym.codegen.backends.c import Bound, Real
from capsule_sym.codegen.backends.c import C as CBackend
from capsule_sym.codegen.backends.python import Python

A, B, C = sp.symbols("a b c")


@pytest.mark.parametrize("backend", [Python, CBackend, Bound])
@pytest.mark.parametrize(
    "expression",
    [A / B**2, -A / B**2, (A + C) / B**3, A / (2 * B**2), A * C / B**4, A / (B**2 * C)],
)
def test_a_quotient_by_a_power_is_one(expression: sp.Expr, backend: type[Language]) -> None:
    value = eval(
        backend.printer.doprint(expression), {"a": 3.0, "b": 7.0, "c": 11.0}
    )  # spelled alike in C
    assert value == pytest.approx(float(expression.subs({A: 3, B: 7, C: 11})), rel=1e-15)


@pytest.mark.parametrize(
    "expression",
    [
        A * B + B * C + A * C**2,
        A * B + C,
        C - A * B,
        -A * B,
        A * B * C + A - 1,
        (A + B) / C,
        A**3 - 2 / B,
        -(A**2) + B * C,
    ],
)
def test_an_expression_over_any_number_type_keeps_its_value(expression: sp.Expr) -> None:
    numbers = {
        **{"add": operator.add, "sub": operator.sub, "mul": operator.mul, "neg": operator.neg},
        **{"over": operator.truediv, "mad": lambda a, b, c: a * b + c, "num": float},
        **{"a": 3.0, "b": 7.0, "c": 11.0},
    }
    value = eval(Real.printer.doprint(expression), numbers)
    assert value == pytest.approx(float(expression.subs({A: 3, B: 7, C: 11})), rel=1e-15)
