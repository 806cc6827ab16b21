"""Appendices A and B against numbers: bounds, parts, and what the paper prints."""

import numpy as np
import pytest
import sympy as sp

from capsule_sym._symbolic.model.symbols import alpha, beta, delta, f_b, omega, tau, v_r, zeta
from paper.derived.inner_products import outward
from paper.derived.parts import BOUNDS, EDGES, PARTS, bifurcations, part

RANDOM = np.random.default_rng(5)
NUMBERS = {zeta: 0.3, beta: 1.5, f_b: 1.0}


def _product(line: str, speed: float, wave: float, damping: float) -> float:
    """Inner product out of stick, from a second model; `wave` is alpha cos(omega tau)."""
    side, stiff = {"L1": (1, 1), "L2": (-1, 1), "L3": (1, 2.5), "L4": (-1, 2.5)}[line]
    acceleration = -side * 1.0 + wave  # the elastic force is side * f_b
    return side * (stiff * speed + 2 * damping * acceleration)


@pytest.mark.parametrize("line", EDGES)
def test_product_is_the_rate_of_the_force(line: str) -> None:
    for speed, phase in RANDOM.uniform(-5, 5, (20, 2)):
        values = {**NUMBERS, v_r: speed, alpha: 0.7, omega: 1.0, tau: phase}
        expected = _product(line, speed, 0.7 * np.cos(phase), 0.3)
        assert float(outward(line).subs(values)) == pytest.approx(expected)


@pytest.mark.parametrize("bound", BOUNDS, ids=lambda b: b.line)
def test_bound_separates_numerically(bound: object) -> None:
    gap, damping = 0.4, 0.6
    limit = float(bound.alpha_bound.subs({**NUMBERS, zeta: damping, delta: gap}))
    end = {"L1": 1 - gap, "L2": -1 - gap, "L3": 1 - gap, "L4": -1 - gap}[bound.line] / (2 * damping)
    away = 1 if bound.line in ("L1", "L2") else -1
    speeds = end + away * np.array([1e-9, 1e-3, 1.0, 100.0])

    def worst(amplitude: float) -> float:
        waves = (-amplitude, amplitude)
        return min(bound.side * _product(bound.line, s, w, damping) for s in speeds for w in waves)

    if limit > 0:
        assert worst(limit - 1e-6) > 0
    assert worst(max(limit, 0) + 1e-6) < 0 or limit < 0


def test_bounds_of_the_paper_have_the_printed_form() -> None:
    printed = {
        "L1": (f_b - delta) / (4 * zeta**2) - f_b,
        "L4": (1 + beta) * (f_b + delta) / (4 * zeta**2) - f_b,
    }
    for bound in BOUNDS[:2]:
        assert sp.expand(bound.alpha_bound - printed[bound.line]) == 0


def test_parts_of_l3_have_the_printed_ends() -> None:
    for number, sign in ((1, -1), (3, 1)):
        (within,) = part(f"L3^({number})").within
        end = sp.solve(sp.Eq(within.lhs, within.rhs), v_r)[0]
        assert sp.expand(sp.together(end - 2 * zeta * (f_b + sign * alpha) / (1 + beta))) == 0


def test_parts_of_l2_lie_at_negative_velocity() -> None:
    ends = [sp.solve(sp.Eq(r.lhs, r.rhs), v_r)[0] for r in part("L2^(2)").within]
    assert [sp.expand(e) for e in ends] == [
        sp.expand(-2 * zeta * (f_b + alpha)),
        sp.expand(-2 * zeta * (f_b - alpha)),
    ]


@pytest.mark.parametrize("one", PARTS, ids=lambda p: p.name)
def test_bifurcations_follow_the_side(one: object) -> None:
    expected = {
        1: {"crossing", "grazing"},
        -1: {"switching"},
        None: {"adding", "crossing", "grazing", "switching"},
    }
    assert bifurcations(one) == expected[one.side]


def test_middle_parts_are_mirrored_between_lines() -> None:
    assert [p.side for p in PARTS] == [-1, None, 1, 1, None, -1, -1, None, 1, 1, None, -1]
