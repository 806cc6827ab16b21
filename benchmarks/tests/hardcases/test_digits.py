"""Roots that fifty digits tell apart."""

from __future__ import annotations

from fractions import Fraction
from math import factorial
from random import Random

import pytest
from mpmath import mp, mpf

from capsule_sym._map.expansion import Expansion
from capsule_sym._map.isolation import search


def fraction(number: mpf) -> Fraction:
    """The number, exactly."""
    sign, mantissa, exponent, _ = number._mpf_
    return (-1) ** sign * Fraction(int(mantissa)) * Fraction(2) ** exponent


@pytest.mark.parametrize("apart", [10, 20, 30, 40])
@pytest.mark.parametrize("seed", range(5))
def test_roots_closer_than_a_double_sees_are_told_apart_by_going_on(seed: int, apart: int) -> None:
    # (d - r)(d - r - 10^-apart), times a positive factor; looked at again from where it is clear.
    random = Random(f"{seed} {apart}")
    root = Fraction(random.randint(1, 10**15), 10**15)
    second = root + Fraction(1, 10**apart)
    factor = Fraction(random.randint(1, 9))
    begin, reach, bracket = Fraction(0), mpf(1), None
    with mp.workdps(60):
        unit = mp.eps / 2
        for _ in range(400):
            powers = [
                factor * (begin - root) * (begin - second),
                factor * (2 * begin - root - second),
                factor,
            ]
            values = [mpf(p.numerator) / p.denominator * factorial(i) for i, p in enumerate(powers)]
            errors = [unit * abs(value) for value in values]
            found = search(Expansion(values, errors, mpf(0), mpf(0)), 0, reach, unit)
            assert begin + fraction(found.clear) <= root
            if found.bracket is not None:
                bracket = [begin + Fraction(end) for end in found.bracket]
                break
            if found.clear > 0:
                begin += fraction(found.clear)
                reach = 2 * found.clear
            else:
                reach = reach / 8
    assert bracket is not None
    assert bracket[0] <= root <= bracket[1] < second
