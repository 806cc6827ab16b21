"""Expansions of the guards: their derivatives, error bounds and remainders hold."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import factorial
from random import Random
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym._map import quasistatic
from capsule_sym._map.backend import Backend, MpmathBackend, NumpyBackend
from capsule_sym._map.expansion import Expansion, Guard, expand, watched
from tests.map import CASES, DIGITS, FIELDS, Motion, constants, random_motion
from tests.sampling import sampled, some

UNIT = NumpyBackend.unit
_QUICK = 15
# With mpmath at fewer digits than the judge's, its rounding errors can be seen.
SYSTEMS: list[Backend] = [NumpyBackend(), MpmathBackend(DIGITS - 6)]


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    with mp.workdps(DIGITS + 10):
        yield


def expansions(
    numbers: Backend, motion: Motion, h: float, forced: bool = False
) -> Mapping[Guard, Expansion]:
    flow = motion.flow(numbers)
    at = flow(numbers.number(h)) if h else flow.origin
    return (quasistatic.expand_forced if forced else expand)(numbers, flow.c, at)


def label(case: tuple[Motion, float]) -> str:
    motion, h = case
    return f"F{motion.field} {h:.0e} {motion.parameters}"


def test_every_guard_of_a_field_is_expanded() -> None:
    for motion, h in CASES[:12]:
        numbers = NumpyBackend()
        c = numbers.constants(motion.field, motion.parameters)
        assert set(expansions(numbers, motion, h)) == set(watched(c)) == set(motion.rows)


def bound(e: Expansion, d: Any, less: int = 0) -> Any:
    """Error bound of the expansion after d, for the guard or (less = 1) its rate."""
    n = len(e.values)
    errors = mp.fsum(
        mpf(a) * d ** (i - less) / factorial(i - less) for i, a in terms(e.errors, less)
    )
    return errors + (e.rest + e.growth * d) * d ** (n - less) / factorial(n - less)


def terms(numbers: list[Any], less: int) -> Iterator[tuple[int, Any]]:
    return ((i, a) for i, a in enumerate(numbers) if i >= less)


def value(e: Expansion, d: Any, less: int = 0) -> Any:
    return mp.fsum(mpf(a) * d ** (i - less) / factorial(i - less) for i, a in terms(e.values, less))


@pytest.mark.parametrize("numbers", SYSTEMS, ids=lambda b: b.name)
def test_derivatives_are_those_of_the_motion_within_their_error_bounds(numbers: Backend) -> None:
    unit = numbers.unit
    for motion, h in CASES[::2]:
        vector = motion.state_at(h)
        for guard, e in expansions(numbers, motion, h).items():
            truth = motion.derivatives(vector, len(e.values))[guard]
            for order, (found, error) in enumerate(zip(e.values, e.errors, strict=True)):
                # The search allows for the rounding of the numbers that it is given.
                off = abs(found - truth[order]) - 4 * unit * abs(found)
                assert off <= error, (label((motion, h)), guard, order, float(off / error))


@pytest.mark.parametrize("numbers", SYSTEMS, ids=lambda b: b.name)
def test_the_error_bounds_grow_with_the_forcing_angle(numbers: Backend) -> None:
    # The forcing angle of 10^4 is known to 10^4 units only, and all derivatives depend on it.
    fast = Parameters(alpha=0.3, zeta=5.0, omega=100.0)
    for field in (2, 5):
        for seed in range(4):
            motion = random_motion(fast, field, Random(seed))
            h = 100.0 * (1 + seed / 7)
            vector = motion.state_at(h)
            for guard, e in expansions(numbers, motion, h).items():
                truth = motion.derivatives(vector, len(e.values))[guard]
                for found, right, error in zip(e.values, truth, e.errors, strict=True):
                    assert abs(found - right) <= error


@sampled
def test_remainders_hold() -> None:
    numbers = NumpyBackend()
    for number, (motion, h) in enumerate(some(CASES[1::4], _QUICK)):
        about = expansions(numbers, motion, h)
        d = mpf(3 * Random(number).random() / constants(motion).rate)
        check_remainder(about, motion, h, d)


SLOW = [case for case in CASES if quasistatic.rate(constants(case[0])) is not None]


@sampled
def test_remainders_of_the_forced_response_hold() -> None:
    assert {motion.field for motion, _ in SLOW} == set(FIELDS)
    numbers = NumpyBackend()
    for number, (motion, h) in enumerate(some(SLOW, _QUICK)):
        about = expansions(numbers, motion, h, forced=True)
        d = mpf(3 * Random(number).random() / quasistatic.rate(constants(motion)))
        check_remainder(about, motion, h, d)


@sampled
@pytest.mark.parametrize("with_slow", [True, False])
def test_derivatives_of_the_forced_response_hold_far_ahead(with_slow: bool) -> None:
    numbers, checked, tight = NumpyBackend(), 0, 0
    for number, (motion, h) in enumerate(some(SLOW, len(SLOW) // 3)):
        flow = motion.flow(numbers)
        at = flow(h) if h else flow.origin
        rate = quasistatic.rate(flow.c, with_slow)
        if rate is None:
            continue
        d = mpf(3 * Random(number).random() / rate)
        truth = motion.derivatives(motion.state_at(mpf(h) + d), 3)
        for order in (1, 2):
            about = quasistatic.expand_forced(numbers, flow.c, at, order, with_slow)
            for guard, e in about.items():
                off = abs(value(e, d) - truth[guard][order])
                allowed = bound(e, d) + 4 * UNIT * abs(e.values[0])
                assert off <= allowed, (label((motion, h)), guard, order)
                checked, tight = checked + 1, tight + (off > allowed / 1000)
    assert checked > 50
    assert tight > checked / 10  # a much smaller bound would not hold


def check_remainder(about: Mapping[Guard, Expansion], motion: Motion, h: float, d: Any) -> None:
    truth = motion.derivatives(motion.state_at(mpf(h) + d), 2)
    for guard, e in about.items():
        for less in (0, 1):
            off = abs(value(e, d, less) - truth[guard][less])
            allowed = bound(e, d, less) + 4 * UNIT * abs(e.values[0]) * (less == 0)
            assert off <= allowed, (label((motion, h)), guard, less)


@sampled
@pytest.mark.parametrize("weaker", ["rest", "errors"])
def test_smaller_bounds_do_not_hold(weaker: str) -> None:
    broken, cases = 0, some(CASES[1::2], _QUICK)
    for number, (motion, h) in enumerate(cases):
        d = mpf(3 * Random(number).random() / constants(motion).rate) * (weaker == "rest")
        whole = expansions(NumpyBackend(), motion, h)
        if weaker == "rest":
            about = {g: replace(e, rest=e.rest / 100, growth=0.0) for g, e in whole.items()}
        else:
            about = {g: replace(e, errors=[a / 100 for a in e.errors]) for g, e in whole.items()}
        try:
            check_remainder(about, motion, h, d)
        except AssertionError:
            broken += 1
    assert broken > len(cases) / 20
