"""Printed formulas: what is read, and that nothing else is."""

from __future__ import annotations

import pytest
import sympy as sp

from capsule_sym._symbolic.model.model import P3
from capsule_sym._symbolic.model.symbols import delta, f_b, gamma, v_r, zeta
from paper.claims.formula import NotAFormula, cleared, formula, relations


def test_formula_is_read() -> None:
    assert formula("-(P3 + f_b)/gamma") == -(P3 + f_b) / gamma
    assert formula("v_r <= 2*zeta") == sp.Le(v_r, 2 * zeta)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os')",
        "v_r.free_symbols",
        "exec('1')",
        "[v_r]",
        "lambda: v_r",
        "unknown + 1",
        "0.5*v_r",
        "0 < v_r < 1",
        "v_r if 1 else 0",
        "True",
        "cos(v_r, v_c)",
        "v_r +",
        "",
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(NotAFormula):
        formula(text)


def test_magnitude_is_two_relations() -> None:
    assert relations(["abs(P3) <= f_b"]) == (sp.Le(P3, f_b), sp.Le(-P3, f_b))
    with pytest.raises(NotAFormula):
        relations(["abs(P3) > f_b"])


def test_denominators_that_are_positive_are_cleared() -> None:
    bound = formula("v_r > -delta/(2*zeta) + f_b/(2*zeta)")
    assert cleared(bound) == sp.Gt(2 * zeta * v_r, f_b - delta)
    with pytest.raises(NotAFormula):
        cleared(formula("v_r > 1/(f_b - delta)"))
