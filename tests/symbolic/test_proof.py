"""The decision procedure, against linear programming and against statements known by hand."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from capsule_sym._symbolic.model.elimination import Undecided
from capsule_sym._symbolic.model.proof import (
    always_solvable,
    consistent,
    implies,
    sign_under,
)
from capsule_sym._symbolic.model.symbols import (
    alpha,
    beta,
    delta,
    f_b,
    force,
    gamma,
    omega,
    v_c,
    v_r,
    x_r,
    zeta,
)
from paper.derived.points import evaluate, example

VALUES = {zeta: Fraction(1, 20), beta: Fraction(3, 2), gamma: Fraction(3), f_b: Fraction(1)}
UNKNOWNS = (x_r, v_r, v_c, force, alpha, delta)

integers = st.integers(-3, 3)
rows = st.lists(st.tuples(*[integers] * 7, st.booleans()), min_size=1, max_size=5)


def _relation(row: tuple[int, ...]) -> sp.Basic:
    *coefficients, equation = row
    terms = zip(coefficients, (*UNKNOWNS, f_b), strict=True)
    expression = sum((c * symbol for c, symbol in terms), sp.S.Zero)
    return sp.Eq(expression, 0) if equation else sp.Ge(expression, 0)


def _feasible(system: list[tuple[int, ...]]) -> bool:
    """Feasibility at f_b = 1 by linear programming, with the ranges of the parameters."""
    table = np.array([row[:7] for row in system], dtype=float)
    equal = np.array([row[7] for row in system])
    bounds = np.array([[0, 0, 0, 1, -1, 0], [0, 0, 0, -1, -1, 0]], dtype=float)
    lhs = np.vstack([-table[~equal, :6], bounds])
    rhs = np.concatenate([table[~equal, 6], [0, 0]])
    limits = [(None, None)] * 4 + [(0, None)] * 2
    equations = {"A_eq": table[equal, :6], "b_eq": -table[equal, 6]} if equal.any() else {}
    return bool(linprog(np.zeros(6), lhs, rhs, bounds=limits, **equations).status == 0)


@settings(max_examples=50)
@given(rows)
def test_consistency_agrees_with_linear_programming(system: list[tuple[int, ...]]) -> None:
    relations = [_relation(row) for row in system]
    expected = _feasible(system)
    assert consistent(relations) is expected
    if not expected:
        with pytest.raises(ValueError, match="no point"):
            example(relations, VALUES)
        return
    point = example(relations, VALUES)
    for row, relation in zip(system, relations, strict=True):
        if isinstance(relation, sp.core.relational.Relational):
            value = evaluate(relation.lhs - relation.rhs, point)
            assert value == 0 if row[7] else value >= 0
    assert -point[alpha] <= point[force] <= point[alpha]
    assert point[delta] >= 0


def test_strict_and_weak_bounds_are_told_apart() -> None:
    assert consistent([x_r <= v_r, x_r >= v_r])
    assert not consistent([x_r < v_r, x_r >= v_r])
    assert implies([x_r < v_r, v_r <= v_c], x_r < v_c)
    assert not implies([x_r <= v_r, v_r <= v_c], x_r < v_c)


def test_zero_and_positive_parameters_are_separate_cases() -> None:
    assert not implies([v_r > 0], zeta * v_r > 0)
    assert implies([v_r > 0, zeta > 0], zeta * v_r > 0)
    assert implies([v_r > 0], zeta * v_r >= 0)
    assert consistent([sp.Gt(2 * zeta * v_r, f_b)])
    assert not consistent([sp.Gt(2 * zeta * v_r, f_b), sp.Eq(zeta, 0)])


def test_signs() -> None:
    assert sign_under(x_r - delta, [x_r < delta]) == -1
    assert sign_under(x_r - delta, [sp.Eq(x_r, delta)]) == 0
    assert sign_under(x_r, [x_r > delta]) == 1
    assert sign_under(x_r, [x_r < delta]) is None


def test_for_all_there_is() -> None:
    assert always_solvable([alpha > 0], [force > 0], [force])
    assert not always_solvable([alpha >= 0], [force > 0], [force])
    assert always_solvable([zeta > 0], [sp.Eq(x_r + 2 * zeta * v_r, f_b), x_r < delta], [x_r, v_r])
    assert not always_solvable([], [sp.Eq(x_r + 2 * zeta * v_r, f_b), x_r < delta], [x_r, v_r])


def test_example_where_two_closed_bounds_meet_beside_a_strict_one() -> None:
    """That a bound elsewhere is strict does not open those that meet."""
    point = example([v_r >= f_b, v_r <= f_b, v_r < 2 * f_b], VALUES)
    assert point[v_r] == 1
    point = example([v_r >= alpha, alpha >= f_b, v_r <= f_b, v_r > -f_b], VALUES)
    assert point[v_r] == point[alpha] == 1


def test_products_of_unknowns_are_not_guessed() -> None:
    with pytest.raises(Undecided):
        consistent([x_r * v_r > 0, x_r * v_c > 0, v_c * v_r < 0])
    with pytest.raises(Undecided):
        consistent([sp.Gt(x_r, 1)])  # the unit of force is free


def test_coefficients_of_unknown_sign_are_decided_where_numbers_or_factors_do() -> None:
    # omega**2 - 1 has either sign, so that nothing can be solved for the force
    either = sp.Ge(f_b + force * (1 - omega**2), 0)
    less, more = sp.Gt(f_b - force * omega**2, 0), sp.Ge(force * omega**2 - f_b, 0)
    assert consistent([either, less])
    assert not consistent([either, less, more])
    assert not consistent([either, sp.Gt((1 + beta) * less.gts, 0), sp.Ge(omega * more.gts, 0)])
    assert consistent([either, sp.Ge((1 + beta) * -more.gts, 0), sp.Ge(omega * more.gts, 0)])
