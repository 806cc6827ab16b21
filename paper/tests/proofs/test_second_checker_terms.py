"""Terms of the second checker, each by what is accepted without it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from mpmath import mp, mpf

from paper.proofs import second_checker as second
from paper.tests.proofs.tampering.files import file_of
from paper.tests.proofs.tampering.kind import TWO_PI, put, rounded
from paper.tests.proofs.tampering.numbers import KINDS
from tests.enclosures.certified import bifurcations, orbit, run

Interval, number = second.I, second.number


@pytest.fixture(autouse=True)
def bits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Interval, "bits", 256)


def holds(found: Any, exact: Fraction) -> bool:
    return bool(found.lo <= exact * 2**Interval.bits <= found.hi)


def intervals() -> Iterator[tuple[Any, tuple[Fraction, ...]]]:
    """All short intervals with ends up to 5 units, with their ends and middle."""
    for low in range(-5, 6):
        for wide in (0, 1, 3):
            ends = (Fraction(2 * low + k * wide, 2 ** (Interval.bits + 1)) for k in range(3))
            yield Interval(low, low + wide), tuple(ends)


def test_every_operation_encloses_all_exact_results(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Interval, "bits", 2)
    for (a, first), (b, other) in product(intervals(), repeat=2):
        divides = not b.lo <= 0 <= b.hi
        for x, y in product(first, other):
            assert holds(a + b, x + y)
            assert holds(a - b, x - y)
            assert holds(-a, -x)
            assert holds(a * b, x * y)
            assert holds(second.times([[a, b]], [[a], [b]])[0][0], x * x + y * y)
            assert holds(a.over(3), x / 3)
            assert not divides or holds(a / b, x / y)
        if not divides:
            with pytest.raises(second.Rejected, match="division"):
                a / b


def test_what_follows_the_terms_of_an_exponential_is_bounded() -> None:
    for norm in (1, 2):
        terms, rest = second.series([[number(norm)]], [[number(1)]], 1 << Interval.bits)
        left = math.e**norm - sum(norm**k / math.factorial(k) for k in range(len(terms)))
        assert left < rest / 2**Interval.bits < 10 * left


def test_that_bound_is_in_every_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    size = 1 << 100
    monkeypatch.setattr(second, "series", lambda _, y: ([y], size))
    ((found,),) = second.moved([[number(1)]], [[number(0)]])
    assert (found.lo, found.hi) == (-size, size)


def test_circle() -> None:
    with mp.workdps(90):
        two = mpf(2) ** Interval.bits
        assert second.pi(Interval.bits).lo < mp.pi * two < second.pi(Interval.bits).hi
        for middle, wide in ((1, 0.5), (40, 0.25), (-2, 0.125)):
            c, s = second.direction(number(middle, Fraction(wide)))
            for angle in (mpf(middle) - wide, mpf(middle), mpf(middle) + wide):
                assert c.lo < mp.cos(angle) * two < c.hi
                assert s.lo < mp.sin(angle) * two < s.hi


INSIDE = [(0.5, 0.5, 0.5), (-0.9, 0.9, 0.1), (0.99, -0.5, 0), (0.6 + 0.6j, 0.6 - 0.6j, -0.95)]
OUTSIDE = [(2, 0.4, 0.4), (-2, 0.4, 0.4), (0.8 + 0.8j, 0.8 - 0.8j, 0.1), (3, 2, 0.5), (-1.01, 0, 0)]


def turn(values: tuple[complex, ...]) -> Any:
    """Companion matrix of multipliers and of 0."""
    coefficients = [1 + 0j]
    for root in (*values, 0):
        times = [-root * c for c in coefficients]
        coefficients = [a + b for a, b in zip([*coefficients, 0], [0, *times], strict=True)]
    last = [number(str(-round(c.real, 12))) for c in coefficients[:0:-1]]
    shift = [[number(int(j == i + 1)) for j in range(4)] for i in range(3)]
    return [*shift, last]


def test_stability_is_that_of_the_multipliers() -> None:
    assert [second.stable(turn(values)) for values in INSIDE] == [True] * len(INSIDE)
    assert [second.stable(turn(values)) for values in OUTSIDE] == [False] * len(OUTSIDE)
    for values in ((1, 0.5, 0.5), (-1, 0.2, 0.3), (0.6 + 0.8j, 0.6 - 0.8j, 0.5)):
        with pytest.raises(second.Rejected, match="stability"):
            second.stable(turn(values))


def oscillation(level: str) -> tuple[Any, ...]:
    """Half a turn of level + cos, which is least at its end."""
    a = [[number(0)] * 6 for _ in range(6)]
    a[3][4], a[4][3] = number(-3), number(3)
    y, z = ([number(0)] * 3 + [number(x), number(0), number(1)] for x in (1, -1))
    guard = [number(0)] * 3 + [number(1), number(0), number(level)]
    h = second.pi(Interval.bits).over(3)
    return a, second.column(y), second.column(z), h, [(guard, 0, 0)]


def test_a_guard_is_positive_all_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    second.positive(*oscillation("1.01"))
    for level in ("0.99", "0", "-0.5"):
        with pytest.raises(second.Rejected, match="guard"):
            second.positive(*oscillation(level))
    series = second.series

    def wide(a: Any, y: Any, least: int = 2) -> tuple[Any, int]:
        terms, rest = series(a, y, least)
        return terms, rest if least == 2 else 3 << Interval.bits

    monkeypatch.setattr(second, "series", wide)
    with pytest.raises(second.Rejected, match="guard"):
        second.positive(*oscillation("1.01"))


def test_the_box_has_all_that_the_digits_allow() -> None:
    given, radius = bifurcations()[0], Fraction(1, 1000)
    states, durations, angles, alpha = second.Motion(given).box(radius)
    assert all(x.hi - x.lo >= 2 * radius * 2**Interval.bits - 2 for state in states for x in state)
    others = [h for i, h in enumerate(durations) if [i] != given["still"]]
    assert all(
        x.hi - x.lo >= 2 * radius * 2**Interval.bits - 2 for x in (*others, angles[0], alpha)
    )
    assert angles[-1].hi - angles[-1].lo > angles[0].hi - angles[0].lo


def test_derivatives_are_those_in_the_whole_box(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second, "HALF", Fraction(1, 4))
    with pytest.raises(second.Rejected):
        second.Motion(orbit(0.7)).enclose()


def test_no_last_digit_may_change() -> None:
    for given in (orbit(0.003), bifurcations()[0]):
        for by in (1, 9):
            for one in KINDS[f"digit 0 from the end moved by {by}"](given):
                if one["parameters"] == given["parameters"]:
                    with pytest.raises(second.Rejected):
                        second.check_certificate(one)


def test_a_segment_of_duration_0_has_no_other() -> None:
    """Not even if the next one is shorter by as much."""
    given = bifurcations()[0]
    assert given["still"] == [0]
    nothing, whole = map(Decimal, given["durations"])
    later = [rounded(nothing + Decimal("1e-30")), rounded(whole - Decimal("1e-30"))]
    with pytest.raises(second.Rejected, match="lasts"):
        second.check_certificate({**given, "durations": later})


def test_zeros_at_switches_are_exact_facts() -> None:
    """After contact, rest, contact, the end of stick; at a graze and where stick only touches."""
    motion = second.Motion(orbit(0.7))
    assert motion.fields == [1, 2, 5, 4]
    found = {
        (i, name): motion.zeros(i, field, name)
        for i, field in enumerate(motion.fields)
        for name in motion.models[field][1]
    }
    assert {place: count for place, count in found.items() if count} == {
        (0, "x"): 1,
        (2, "x"): 1,
        (3, "c"): 2,
    }
    graze, touch = (second.Motion(bifurcations()[k]) for k in (0, 1))
    assert graze.zeros(1, 2, "x") == 2
    assert [touch.zeros(i, 5, "P1") for i in (0, 1, 3)] == [2, 2, 0]


def test_a_run_begins_in_the_first_turn() -> None:
    given = run()
    angle = Decimal(given["angle"]) + TWO_PI
    text = format(angle.quantize(Decimal("1e-50")), "f").rstrip("0")
    with pytest.raises(second.Rejected, match="least phase"):
        second.check_certificate({**given, "angle": text, "periods": given["periods"] + 1})


@pytest.mark.parametrize("text", ["1" + 50 * "0", 400 * "9"])
@pytest.mark.parametrize("name", ["omega", "beta"])
def test_huge_numbers_are_refused_at_once(name: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_text(json.dumps(file_of(put(orbit(0.7), ("parameters", name), text))))
    assert second.main([str(path)]) == 1
