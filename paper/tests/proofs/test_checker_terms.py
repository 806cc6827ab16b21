"""Terms of the first checker, each by what is accepted without it."""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from mpmath import mp, mpc, mpf

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.certificates import checker
from capsule_sym.orbits import floquet_multipliers
from paper.tests.proofs.tampering.kind import TWO_PI, rounded
from paper.tests.proofs.tampering.numbers import KINDS
from tests.enclosures.certified import bifurcations, orbit, rejected, run


@pytest.fixture(autouse=True)
def bits():
    with ctx.workprec(256):
        yield


@pytest.mark.long
def test_no_last_digit_may_change() -> None:
    for given in (orbit(1.2), bifurcations()[1], run()):
        for by in (1, 9):
            for one in KINDS[f"digit 0 from the end moved by {by}"](given):
                assert one["parameters"] != given["parameters"] or rejected(one)


def test_a_zero_of_the_equations_that_is_no_motion_is_rejected() -> None:
    """Rest at an amplitude at which the mass would pass the gap."""
    with mp.workdps(50):
        response = mpf("0.3") / mpc(1 - mpf("0.64"), mpf("0.08"))
        state = [response.real, (mpc(0, mpf("0.8")) * response).real]
        texts = [rounded(Decimal(mp.nstr(x, 45))) for x in state]
    given = orbit(0.003)
    forged = {**given, "states": [[*texts, given["states"][0][2]]]}
    forged["parameters"] = {**given["parameters"], "alpha": "0.3"}
    checker.Equations(forged).enclose()
    assert rejected(forged)
    with pytest.raises(checker.Rejected, match="a guard"):
        checker.check_certificate(forged)


def test_the_remainder_of_a_guard_counts() -> None:
    """A guard whose middle of each piece is a maximum, and which is negative between them."""
    h, turn = arb(1), arb(16 * math.pi)
    A = arb_mat(6, 6)
    A[3, 4], A[4, 3] = -turn, turn
    start = arb_mat([[0], [0], [0], [(-turn / 16).cos()], [(-turn / 16).sin()], [1]])
    for level, holds in (("0.5", False), ("1.5", True)):
        guard = arb_mat([[0, 0, 0, 1, 0, arb(level)]])
        if holds:
            checker.positive(A, [(guard, 0, 0)], start, h)
        else:
            with pytest.raises(checker.Rejected):
                checker.positive(A, [(guard, 0, 0)], start, h)


@pytest.mark.parametrize("wide", ["angle", "duration"])
def test_a_box_in_which_derivatives_change_is_not_proved(wide: str) -> None:
    """Wide in one number, with the others narrower than its square."""
    motion = checker.Equations(orbit(1.2))
    motion.radius = [arb("1e-20")] * len(motion.radius)
    motion.enclose()
    motion.radius[4 * motion.n - (wide == "duration")] = arb("1e-6")
    with pytest.raises(checker.Rejected):
        motion.enclose()


def test_conditions_of_stability_are_those_of_the_multipliers() -> None:
    for radius, angle, third in ((1.1, 1.0, 0.5), (0.9, 1.0, 0.5), (0.9, 2.0, -1.2), (0.9, 2, 1.2)):
        turned = radius * np.array(
            [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        )
        matrix = np.block([[turned, np.zeros((2, 1))], [np.zeros((1, 2)), np.array([[third]])]])
        inside = max(radius, abs(third)) < 1
        found = checker.jury(arb_mat(matrix.tolist()))
        assert all(x > 0 for x in found) == inside
        assert any(x < 0 for x in found) != inside


@pytest.mark.parametrize("sign", [1, -1])
def test_the_product_of_multipliers_is_a_condition_of_its_own(sign: int) -> None:
    """Two of three are outside, and all other conditions hold."""
    matrix = arb_mat([[10 * sign, 0, 0], [0, 1.5 * sign, 0], [0, 0, 0.5 * sign]])
    assert sum(x < 0 for x in checker.jury(matrix)) == 1


def test_the_monodromy_matrix_has_the_multipliers_of_the_orbit() -> None:
    motion = checker.Equations(orbit(1.2))
    turn = motion.monodromy(motion.enclose())
    values = floquet_multipliers(solve_orbit(Parameters(alpha=1.2)))
    assert float(turn.trace()) == pytest.approx(float(np.sum(values).real), abs=1e-9)
    square = float((turn * turn).trace())
    assert square == pytest.approx(float(np.sum(np.square(values)).real), abs=1e-9)


def test_a_run_begins_in_the_first_turn() -> None:
    given = run()
    angle = Decimal(given["angle"]) + TWO_PI
    text = format(angle.quantize(Decimal("1e-50")), "f").rstrip("0")
    with pytest.raises(checker.Rejected, match="least phase"):
        checker.check_certificate({**given, "angle": text, "periods": given["periods"] + 1})


def test_a_truth_value_is_no_number() -> None:
    with pytest.raises(checker.Rejected, match="schema"):
        checker.check_certificate({**run(), "periods": True})
