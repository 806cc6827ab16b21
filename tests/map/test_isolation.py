"""The search for a guard's first root: never a root excluded, never none or two in a bracket."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from math import acos, factorial, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from scipy.optimize import brentq

from capsule_sym import InvalidInput, Parameters, simulate
from capsule_sym._map import isolation, location
from capsule_sym._map.expansion import Expansion
from capsule_sym._map.isolation import Search, search

UNIT = 2.0**-53
LEAST = 4 * UNIT  # relative tolerance at which the least step changes every double
NARROW = 1e-5  # relative width above which a bracket is not worth polishing


def expansion(
    powers: Sequence[Any], errors: float = 0.0, rest: float = 0.0, growth: float = 0.0
) -> Expansion:
    """Expansion of sum powers[i] d^i, with one error bound for every derivative."""
    values = [float(a * factorial(i)) for i, a in enumerate(powers)]
    return Expansion(values, [errors] * len(values), rest, growth)


def with_roots(*roots: Any) -> list[Any]:
    """Powers of the polynomial with these simple roots that is positive at 0."""
    powers = [Fraction(1)]
    for root in map(Fraction, roots):
        wide = [*powers, Fraction(0)]
        for i, a in enumerate(powers):
            wide[i + 1] -= a / root
        powers = wide
    return powers


def check(found: Search, roots: Sequence[Any], reach: float = 1.0) -> None:
    """Nothing excluded that is a root; in a bracket the first root and no other."""
    ahead = sorted(Fraction(root) for root in roots if 0 < root <= reach)
    assert 0 <= found.clear <= reach
    assert not [root for root in ahead if root < Fraction(found.clear)]
    if found.bracket is not None:
        low, high = map(Fraction, found.bracket)
        assert low == Fraction(found.clear)
        assert [root for root in ahead if low <= root <= high] == ahead[:1] != []


@pytest.mark.parametrize(
    "roots",
    [
        (0.3,),
        (1e-9,),
        (1.0 - 2.0**-20,),
        (0.3, 0.9),
        (0.3, 0.34375),
        (0.03, 0.05, 0.07),
        (0.2, 0.4, 0.6, 0.8, 2.0, -1.0, -0.1),
        (0.4999, 0.9, 3.0),
    ],
)
def test_the_first_of_separate_roots_is_isolated(roots: tuple[float, ...]) -> None:
    found = search(expansion(with_roots(*roots)), 0, 1.0, UNIT)
    check(found, roots)
    assert found.bracket is not None
    assert found.bracket[1] - found.bracket[0] < NARROW * found.bracket[1]


@pytest.mark.parametrize("roots", [(), (1.0625,), (-0.25, -1e-6), (1.5, -0.5, 7.0)])
def test_without_a_root_the_whole_reach_is_clear(roots: tuple[float, ...]) -> None:
    assert search(expansion(with_roots(*roots)), 0, 1.0, UNIT) == Search(1.0)


@pytest.mark.parametrize("zeros", [1, 2, 3])
@pytest.mark.parametrize("root", [1e-12, 1e-6, 0.3])
def test_the_root_at_the_start_is_divided_out(zeros: int, root: float) -> None:
    powers = [0.0] * zeros + with_roots(root, 2.0)
    reach = min(1.0, 8 * root)
    found = search(expansion(powers), zeros, reach, UNIT)
    check(found, [root], reach)
    assert found.bracket is not None
    assert search(expansion([0.0] * zeros + with_roots(2.0)), zeros, 1.0, UNIT) == Search(1.0)


@pytest.mark.parametrize("zeros", [1, 2, 3])
def test_a_root_at_the_start_left_in_blocks_the_way(zeros: int) -> None:
    found = search(expansion([0.0] * zeros + with_roots(0.3)), 0, 1.0, UNIT)
    assert found == Search(0.0)


def walk(powers: Sequence[Any], reach: Any) -> tuple[Any, Any] | None:
    """Bracket of the first root, by exact expansions about one cleared end after the other."""
    now, ahead = mpf(0), reach
    for _ in range(300):
        values, slope = [], powers
        while slope:
            values.append(mp.polyval(list(reversed(slope)), now))
            slope = [i * a for i, a in enumerate(slope)][1:]
        about = Expansion(values, [mpf(0)] * len(values), mpf(0), mpf(0))
        found = search(about, 0, ahead, mp.eps / 2)
        if found.bracket is not None:
            return now + found.bracket[0], now + found.bracket[1]
        now += found.clear
        if now >= reach:
            return None
        ahead = reach - now if found.clear else ahead / 8
    raise AssertionError(f"no end after 300 steps, at {now}")


@pytest.mark.parametrize("distance", ["1e-3", "1e-6", "1e-9", "1e-12", "1e-15"])
def test_twin_roots_are_told_apart_however_close(distance: str) -> None:
    with mp.workdps(80):
        first = mpf("0.3")
        second = first + mpf(distance)
        bracket = walk([first * second, -(first + second), mpf(1)], mpf(1))
        assert bracket is not None
        assert bracket[0] <= first <= bracket[1] < second


@pytest.mark.parametrize("height", ["1e-3", "1e-6", "1e-12", "1e-24", "1e-30"])
def test_a_minimum_just_above_zero_is_passed(height: str) -> None:
    with mp.workdps(80):
        assert walk([mpf("0.09") + mpf(height), mpf("-0.6"), mpf(1)], mpf(1)) is None


def test_a_start_within_its_error_of_zero_is_left_open() -> None:
    inside = expansion([1e-10, 1.0])
    assert search(inside, 0, 1.0, UNIT) == Search(1.0)
    assert search(replace(inside, errors=[2e-10, 0.0]), 0, 1.0, UNIT) == Search(0.0)


def test_a_bracket_covers_every_root_that_the_errors_allow() -> None:
    found = search(expansion([1.0, -1.0], errors=0.125), 0, 2.0, UNIT)
    assert found.bracket is not None
    low, high = found.bracket
    assert low <= 0.875 / 1.125 < 1.125 / 0.875 <= high
    assert low > 0.777 < 1.286 > high


def test_a_bracket_covers_every_root_that_the_remainder_allows() -> None:
    # The bounds 1 - d -+ (1 + d) d^2 / 16 have their roots at 0.9033... and 1.1965...
    found = search(expansion([1.0, -1.0], rest=0.125, growth=0.125), 0, 1.5, UNIT)
    assert found.bracket is not None
    low, high = found.bracket
    assert 1 - low - (1 + low) * low**2 / 16 >= 0 >= 1 - high + (1 + high) * high**2 / 16
    assert 0.903 < low < 0.904 < 1.196 < high < 1.197


Waves = list[tuple[float, float, float, float]]
waves = st.lists(
    st.tuples(
        st.floats(-2, 2), st.floats(0, 2), st.floats(0, 4), st.floats(0, 6.3)
    ),  # amplitude, decay, frequency, phase
    min_size=1,
    max_size=4,
)


def derivative(terms: Waves, shift: float, order: int, d: Any) -> Any:
    """Derivative of shift + sum of A exp(-l d) cos(w d + p) at d."""
    total = mpf(shift) if order == 0 else mpf(0)
    for amplitude, decay, frequency, phase in terms:
        rate = mp.mpc(-decay, frequency)
        total += amplitude * mp.re(rate**order * mp.exp(rate * d + mp.mpc(0, phase)))
    return total


def size(terms: Waves, order: int) -> Any:
    """Bound on that derivative for all d >= 0."""
    return mp.fsum(abs(a) * abs(mp.mpc(-decay, w)) ** order for a, decay, w, _ in terms)


@given(
    terms=waves,
    shift=st.floats(-2, 4),
    zeros=st.integers(0, 2),
    count=st.integers(4, 10),
    reach=st.floats(0.05, 3),
    growing=st.booleans(),
    wobble=st.floats(-1, 1),
    error=st.sampled_from([0.0, 1e-12, 1e-6, 1e-2]),
)
def test_no_root_is_excluded_and_none_invented(
    terms, shift, zeros, count, reach, growing, wobble, error
) -> None:
    with mp.workdps(30):
        truth = [derivative(terms, shift, i, mpf(0)) for i in range(count + 1)]
        values = [float(v + wobble * error) for v in truth[:count]]
        # With `zeros` the guard is the function without its first Taylor terms.
        head = [a / factorial(i) for i, a in enumerate(truth[:zeros])]
        values[:zeros] = [0.0] * zeros
        # |g^(n)| either as a whole, or by its start and the bound on the next derivative.
        rest = abs(truth[count]) if growing else size(terms, count)
        growth = size(terms, count + 1) if growing else mpf(0)
        bound = Expansion(
            values,
            [error + 4 * UNIT * (1 + abs(v)) for v in values],
            float(rest) * (1 + 1e-12),
            float(growth) * (1 + 1e-12),
        )
        if values[zeros] <= bound.errors[zeros]:
            return  # not a start from which the guard is positive
        found = search(bound, zeros, reach, UNIT)

        def guard(d: Any) -> Any:
            return derivative(terms, shift, 0, d) - mp.polyval([*reversed(head)] or [0], d)

        bounds = isolation._bounds(bound, zeros, UNIT)
        for k in (1, 4, 8):
            d = reach * mpf(k) / 8
            value = guard(d) / d**zeros
            assert isolation._value(bounds.lower, d) <= value <= isolation._value(bounds.upper, d)
            slope = mp.diff(lambda d: guard(d) / d**zeros, d)
            assert slope <= isolation._value(bounds.slope, d) + mpf("1e-9")

        assert 0 <= found.clear <= reach
        for k in range(1, 60):
            assert guard(found.clear * mpf(k) / 60) > 0
        if found.bracket is None:
            return
        low, high = map(mpf, found.bracket)
        assert low == found.clear
        assert guard(high) < 0
        assert low == 0 or guard(low) > 0
        slopes = [mp.diff(guard, low + (high - low) * mpf(k) / 8) for k in range(1, 9)]
        assert max(slopes) < 0


# Each bound is needed: without it a named example loses a root, or gains one.


def spoil(monkeypatch: pytest.MonkeyPatch, change: Callable[[Any], Any]) -> None:
    honest = isolation._bounds
    monkeypatch.setattr(isolation, "_bounds", lambda *args: change(honest(*args)))


THREE = with_roots("0.3", "0.45", "0.7")


def test_without_the_bound_on_the_slope_two_roots_are_skipped(monkeypatch) -> None:
    check(search(expansion(THREE), 0, 1.0, UNIT), [0.3, 0.45, 0.7])
    spoil(monkeypatch, lambda b: replace(b, slope=[-1.0] * len(b.slope)))
    found = search(expansion(THREE), 0, 1.0, UNIT)
    assert found.bracket is not None
    assert found.clear > 0.45


def test_without_the_remainder_the_slope_is_not_bounded() -> None:
    # 1 - d + d^10 / 5 has its least value near d = 0.93 and rises from there.
    values, rest = [1.0, -1.0] + [0.0] * 8, factorial(10) / 5
    slopes = [
        isolation._bounds(Expansion(values, [0.0] * 10, r, 0.0), 0, UNIT).slope for r in (rest, 0.0)
    ]
    honest, careless = (isolation._value(slope, 0.97) for slope in slopes)
    assert careless < 0 < -1 + 2 * 0.97**9 <= honest


def test_without_the_remainder_a_root_is_excluded(monkeypatch: pytest.MonkeyPatch) -> None:
    # 1 - 1.1 d^2 from its value and slope at 0, with |g''| <= 2.2
    bowl = expansion([1.0, 0.0], rest=2.2)
    root = (1 / 1.1) ** 0.5
    assert search(bowl, 0, 1.0, UNIT).clear <= root
    spoil(monkeypatch, lambda b: replace(b, lower=[*b.lower[:-2], b.lower[-2] / 10, b.lower[-1]]))
    assert search(bowl, 0, 1.0, UNIT).clear == 1.0 > root


def test_with_errors_ignored_a_root_is_invented() -> None:
    # (d - 1/2)^2 + 5e-4 has no root; its value at the start is known to 1e-3 only.
    wrong = [0.25 + 5e-4 - 1e-3, -1.0, 1.0]
    careless = search(expansion(wrong), 0, 1.0, UNIT)
    assert careless.bracket is not None
    found = search(replace(expansion(wrong), errors=[1e-3, 0.0, 0.0]), 0, 1.0, UNIT)
    assert found.bracket is None
    assert found.clear < 0.5


def test_a_remainder_too_small_misses_an_impact(monkeypatch: pytest.MonkeyPatch) -> None:
    # Free oscillation x_r = -cos(tau) meets delta = 0.98 near its top, where the Taylor polynomial
    # of degree 9 about the start does not.
    case = Parameters(alpha=0.0, delta=0.98, zeta=0.0, f_b=2.0)
    start = (-1.0, 0.0, 0.0)
    impact = acos(-0.98)
    assert simulate(case, start, periods=1).segments[0].duration == pytest.approx(impact, abs=1e-13)
    honest = location.expand

    def small(*args: Any) -> Any:
        expansions = honest(*args).items()
        return {g: replace(e, rest=e.rest / 10, growth=e.growth / 10) for g, e in expansions}

    monkeypatch.setattr(location, "expand", small)
    assert simulate(case, start, periods=1).segments[0].duration > impact + 0.01


@pytest.mark.parametrize(
    ("f", "a", "b", "true"),
    [
        (lambda x: mp.cos(x) - x, 0, 1, lambda: mp.findroot(lambda x: mp.cos(x) - x, 0.74)),
        (lambda x: (1 - x) ** 3 - mpf(10) ** -12, 0, 3, lambda: 1 - mpf(10) ** -4),
        (lambda x: mp.exp(-50 * x) - mpf(1) / 3, 0, 1, lambda: mp.log(3) / 50),
    ],
)
def test_brents_method_has_all_digits_and_takes_scipys_steps(f, a, b, true) -> None:
    with mp.workdps(60):
        root = isolation.brent(f, mpf(a), mpf(b), mpf(10) ** -55)
        assert abs(root - true()) < 1e-50
    calls: list[float] = []

    def counted(x: float) -> float:
        calls.append(x)
        return float(f(mpf(x)))

    with mp.workdps(30):
        ours = isolation.brent(counted, float(a), float(b), 1e-12)
        mine, calls = calls, []
        theirs = brentq(counted, a, b, xtol=2e-12, rtol=4 * 2.0**-52)
    assert abs(ours - theirs) < 1e-11
    assert mine[2:6] == calls[2:6]
    # The least relative tolerance ends where neighbouring doubles are the bracket.
    calls = []
    with mp.workdps(30):
        last = isolation.brent(counted, float(a), float(b), 1e-290, LEAST)
        assert last == brentq(counted, a, b, xtol=2e-290, rtol=4 * 2.0**-52)


def test_brents_method_keeps_its_bracket_where_products_of_values_underflow() -> None:
    def f(x: float) -> float:
        return 2.0**-560 * (0.2 - x**3)

    root = isolation.brent(f, 0.0, 1.0, 1e-290, LEAST)
    assert root == pytest.approx(0.2 ** (1 / 3), rel=1e-15)


@pytest.mark.parametrize(
    ("field", "a", "b", "value"),
    [("a", nan, 1.0, 1.0), ("b", 0.0, nan, 1.0), ("f(a)", 0.0, 1.0, nan)],
)
def test_brents_method_refuses_ends_that_are_no_numbers(field, a, b, value) -> None:
    asked = iter(range(1000))

    def f(x: float) -> float:
        next(asked)  # or StopIteration: it does not end
        return value * (x - 0.5)

    with pytest.raises(InvalidInput) as caught:
        isolation.brent(f, a, b, 1e-290, LEAST)
    assert caught.value.field == field


def test_switches_of_the_smallest_motions_are_those_of_small_ones() -> None:
    """All scales with the drive: the capsule rests, and the gap is 0."""
    small, tiny = (
        simulate(Parameters(alpha=alpha, delta=0.0), periods=2, backend="numpy").segments
        for alpha in (1e-50, 1e-170)
    )
    assert len(small) == 5
    assert [s.duration for s in tiny] == pytest.approx([s.duration for s in small], rel=1e-12)
