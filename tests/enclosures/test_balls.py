"""Balls: bounds and roundings that enclose."""

from fractions import Fraction

import mpmath

from capsule_sym._enclosures.numbers.balls import (
    arb,
    arb_mat,
    ball,
    greatest,
    largest,
    precision,
    spread,
    upper,
)
from tests.enclosures.case import precise

bits = precise(128)


def test_bounds_in_doubles_are_rounded_up() -> None:
    for share in (arb(1) / 3, arb(2) / 3, 1 + arb(2) ** -60, 1 - arb(2) ** -60, arb(10) ** -400):
        assert upper(share) > share
        assert upper(-share) > share
        assert spread(arb(7, share)) > arb(7, share).rad()
        assert largest(arb_mat([[share, -share], [0, share]])) > 2 * share
        assert greatest([share / 2, -share]) > share


def test_a_fraction_and_a_decimal_are_enclosed() -> None:
    assert (ball(Fraction(1, 3)) * 3).contains(1)
    assert ball(Fraction(1, 3)).rad() > 0
    assert (ball("0.1") * 10).contains(1)
    assert ball(0.1) == arb(0.1) != ball("0.1").mid()


def test_numbers_of_mpmath_are_exact() -> None:
    with mpmath.workdps(50):
        for value in (-mpmath.mpf(1) / 3, mpmath.mpf(2) ** 200 + 1, mpmath.mpf(0)):
            with precision(400):
                man, exp = value.man_exp
                assert ball(value) == arb(int(man)) * arb(2) ** exp * (-1 if value < 0 else 1)


def test_a_radius_is_added_to_that_of_rounding() -> None:
    found = ball("0.1", 0.25)
    for end in ("-0.15", "0.35", "0.1"):
        assert found.contains(arb(end).mid())
    assert found.rad() >= 0.25
