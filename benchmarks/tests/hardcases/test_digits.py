"""Fifty digits by MPFR: the same numbers as by mpmath, and what is decided on them."""

from __future__ import annotations

from fractions import Fraction
from math import factorial
from random import Random

import pytest
from mpmath import mp, mpf

from benchmarks.hardcases.cases import cases, flow_from
from capsule_sym import Parameters, simulate
from capsule_sym._map import digits
from capsule_sym._map.backend import backend
from capsule_sym._map.digits import fifty_digits
from capsule_sym._map.expansion import Expansion
from capsule_sym._map.isolation import search

gmpy2 = pytest.importorskip("gmpy2")


def fraction(number: mpf) -> Fraction:
    """The number, exactly."""
    sign, mantissa, exponent, _ = number._mpf_
    return (-1) ** sign * Fraction(int(mantissa)) * Fraction(2) ** exponent


PLACES = [
    Parameters(),
    Parameters(zeta=0.0, omega=1.0),  # resonance
    Parameters(zeta=1.0),  # critical damping
    Parameters(zeta=3.0, omega=0.1),  # overdamped
    Parameters(alpha=0.0, delta=0.0),
]


def exactly(number: object) -> mpf:
    """The number of either library, for mpmath."""
    if isinstance(number, type(gmpy2.mpfr(0))):
        numerator, denominator = number.as_integer_ratio()
        return mpf(int(numerator)) / int(denominator)
    return mpf(number)


@pytest.mark.parametrize("parameters", PLACES)
def test_its_closed_forms_are_those_of_mpmath(parameters: Parameters) -> None:
    random = Random(1)
    for field in range(1, 7):
        for h in (0.01, 0.7, 30.0):
            state = [random.gauss(0, 1) for _ in range(3)]
            with backend("mpmath") as numbers:
                slow = flow_from(numbers, parameters, field, *state, 0.3)(numbers.number(h))
            with fifty_digits() as numbers:
                assert numbers.name == "mpfr"
                fast = flow_from(numbers, parameters, field, *state, 0.3)(numbers.number(h))
            with mp.workdps(60):
                numbers_of = (map(exactly, point[:-2]) for point in (fast, slow))  # of one stop
                for a, b in zip(*numbers_of, strict=True):
                    assert abs(a - b) < mpf(10) ** -55 * (1 + abs(b))


def test_without_gmpy2_mpmath_decides_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    start = next(case for case in cases() if case.name == "corner on L6 from F1").build()
    arguments = start.parameters, start.state, start.phase, 1
    fast = simulate(*arguments, max_segments=3)
    monkeypatch.setattr(digits, "gmpy2", None)
    with fifty_digits() as numbers:
        assert numbers.name == "mpmath"
    slow = simulate(*arguments, max_segments=3)
    assert fast.statistics.escalations == slow.statistics.escalations > 0
    assert [s.end_state for s in fast.segments] == [s.end_state for s in slow.segments]
    assert fast.segments[0].outcome == slow.segments[0].outcome


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
