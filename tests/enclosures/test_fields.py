"""The flow of a field over boxes, against the exponential at exact points of them."""

import math
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import pytest
from flint import arb_mat
from hypothesis import example, given
from hypothesis import strategies as st

from capsule_sym._enclosures.numbers import fields
from capsule_sym._enclosures.numbers.balls import arb, ball, matrix, precision
from capsule_sym._enclosures.numbers.fields import SIZE, Exponential, Field, generated
from tests.enclosures.case import EXACT, precise

VALUES = EXACT | {"gamma": "3.3"}
NAMES = generated.PARAMETERS

bits = precise(128)


def inside(value: Any, share: float) -> Any:
    """A number of a ball, exactly."""
    return arb(value.mid()) + arb(value.rad()) * share


def held(outer: Any, exact: Any) -> bool:
    """True if a matrix of balls contains one that is known with more digits."""
    pairs = zip(outer.tolist(), exact.tolist(), strict=True)
    return all(one.contains(other) for rows in pairs for one, other in zip(*rows, strict=True))


def rates(index: int, values: Mapping[str, Any]) -> Any:
    """The printed matrix at a point."""
    return matrix(SIZE, SIZE, generated.RATES[index - 1](*(values[name] for name in NAMES)))


def slopes(index: int, values: Mapping[str, Any], name: str) -> Any:
    """The derivative of the printed matrix by a parameter."""
    given = [values[one] for one in NAMES]
    return matrix(SIZE, SIZE, generated.RATES_BY[index - 1](*given).get(name, ()))


def corner(left: Any, right: Any, h: Any) -> Any:
    """Derivative of exp(A h) along A': the corner of the exponential of ((A, A'), (0, A))."""
    none = [0] * SIZE
    rows = [[*a, *b] for a, b in zip(left.tolist(), right.tolist(), strict=True)]
    rows += [[*none, *a] for a in left.tolist()]
    return arb_mat([row[SIZE:] for row in (arb_mat(rows) * h).exp().tolist()[:SIZE]])


radii = st.sampled_from((0.0, 9e-10, 2e-9, 1e-7, 1e-4, 1e-2))
shares = st.sampled_from((-1.0, 1.0)) | st.floats(-1.0, 1.0)


@given(
    st.integers(1, 6),
    st.tuples(*(st.tuples(radii, shares) for _ in NAMES)),
    st.floats(0.01, 2.5),
    st.tuples(st.sampled_from((0.0, 1e-9, 1e-3, 0.2)), shares),
)
@example(4, tuple((9e-10 if name == "zeta" else 2e-9, 1.0) for name in NAMES), 2.5, (0.0, 0.0))
def test_a_flow_is_held_for_radii_of_all_parameters(index, boxes, middle, late) -> None:
    """Radii are below and above the one from which derivatives by parameters are used."""
    values = {
        name: ball(VALUES[name], radius) for name, (radius, _) in zip(NAMES, boxes, strict=True)
    }
    h = ball(middle, late[0])
    field = Field(index, values)
    with precision(256):
        point = {
            name: inside(values[name], share) for name, (_, share) in zip(NAMES, boxes, strict=True)
        }
        there = inside(h, late[1])
        A = rates(index, point)
        exact = (A * there).exp()
    assert held(field.flow(h), exact)
    for name in ("zeta", "gamma"):
        with precision(256):
            by = corner(A, slopes(index, point, name), there)
        assert held(field.flow_by(h, name), by)


def test_every_wide_parameter_moves_the_flow() -> None:
    """The radii are small, so that no derivative is covered by the remainder of another."""
    for name, share in product(NAMES, (-1.0, 1.0)):
        values = {one: ball(VALUES[one], 1e-6 if one == name else 0) for one in NAMES}
        with precision(256):
            A = rates(4, values | {name: inside(values[name], share)})
            exact = (A * ball(2.5)).exp()
        assert held(Field(4, values).flow(ball(2.5)), exact)


def test_a_parameter_is_missing_in_no_derivative() -> None:
    for index, name in product(range(1, 7), NAMES):
        here = {one: ball(VALUES[one]) for one in NAMES}
        moved = rates(index, here | {name: here[name] + 1}) - rates(index, here)
        assert Field(index, here).depends(name) == any(
            x != 0 for row in moved.tolist() for x in row
        )


# One rate, so that each term of an exponential is known


def ends(h: Any) -> Iterator[Any]:
    yield from (inside(h, share) for share in (-1.0, 0.25, 1.0))


@pytest.mark.parametrize("rate", [1.0, -1.0])
@pytest.mark.parametrize("wide", [2.0**-4, 0.5, 3.0])
def test_an_exponential_is_moved_with_its_remainder(rate: float, wide: float) -> None:
    found = Exponential(arb_mat([[rate]]))
    step = ball(0, wide)
    moved = found.moved(arb_mat([[arb(rate).exp()]]), step)
    for s in ends(step):
        assert moved[0, 0].contains((rate * (1 + s)).exp())


@pytest.mark.parametrize("rate", [1.0, -1.0, 3.0])
@pytest.mark.parametrize("zeros", range(4))
@pytest.mark.parametrize("h", [0.0, 0.25, 0.3, 0.9])
def test_the_rest_of_a_series_is_held_by_few_terms_and_their_tail(
    rate, zeros, h, monkeypatch
) -> None:
    monkeypatch.setattr(fields, "_order", lambda bits: 3)
    found = Exponential(arb_mat([[rate]])).rest(arb(h), zeros)[0, 0]
    with precision(256):
        powers = (arb(rate) ** k * arb(h) ** (k - zeros) for k in range(zeros, 60))
        exact = sum((x / math.factorial(k) for k, x in enumerate(powers, zeros)), arb(0))
    assert found.contains(exact)


@pytest.mark.parametrize("order", [0, 40])
@pytest.mark.parametrize("zeros", range(3))
def test_the_rest_of_a_series_is_held_for_all_durations_of_a_ball(
    zeros, order, monkeypatch
) -> None:
    monkeypatch.setattr(fields, "_order", lambda bits: order)
    for h in (ball(0.25, 0.25), ball(0.5, 0.75), ball(2.0, 0.5)):
        found = Exponential(arb_mat([[1]])).rest(h, zeros)[0, 0]
        for t in ends(h):
            if t > 0:
                left = sum((t**k / math.factorial(k) for k in range(zeros)), arb(0))
                assert found.contains((t.exp() - left) / t**zeros)


@pytest.mark.parametrize("size", [1e-9, 0.1, 0.5, 0.99, 3.0])
@pytest.mark.parametrize("order", range(1, 5))
def test_a_tail_is_more_than_the_terms_that_are_left_out(size: float, order: int) -> None:
    for norm, zeros in product((1.0, 4.0, 0.25), range(order)):
        h = size / norm
        terms = (
            arb(norm) ** k * arb(h) ** (k - zeros) / math.factorial(k) for k in range(order, 60)
        )
        assert fields._tail(norm, h, order, zeros) >= sum(terms, arb(0))


def test_the_rest_of_a_series_is_held_for_all_rates_of_a_ball(monkeypatch) -> None:
    monkeypatch.setattr(fields, "_order", lambda bits: 0)
    found = Exponential(arb_mat([[ball(0.25, 0.5)]])).rest(arb(1))[0, 0]
    for rate in ends(ball(0.25, 0.5)):
        assert found.contains(rate.exp())


def test_growth_is_more_than_the_change_of_an_exponential() -> None:
    for size in (1e-12, 1e-3, 0.5, 2.0, 40.0, 99.0):
        assert fields._growth(size) > arb(size).exp() - 1
    assert fields._growth(101.0) == math.inf


def divided(A: Any, row: Any, zeros: int, t: Any) -> tuple[Any, Any]:
    """The functional without its leading terms over t^zeros, and its derivative by t."""
    whole = (A * t).exp()
    rate = A * whole
    for k in range(zeros):
        term = A**k / math.factorial(k)
        whole -= term * t**k
        rate -= term * k * t ** max(k - 1, 0)
    return row * whole / t**zeros, row * (rate - whole * zeros / t) / t**zeros


@pytest.mark.parametrize("zeros", [1, 2])
@pytest.mark.parametrize("h", [(0.1, 0.01), (1.5, 0.01)], ids=["series", "beyond"])
def test_a_divided_functional_is_held_for_all_durations_of_a_ball(zeros, h) -> None:
    field, row = Field(4, {name: ball(VALUES[name]) for name in NAMES}), matrix(1, 6, [(0, 2, 1)])
    found = field.divided(row, zeros, ball(*h))
    for t in ends(ball(*h)):
        with precision(512):
            exact = divided(rates(4, {name: ball(VALUES[name]) for name in NAMES}), row, zeros, t)
        assert all(map(held, found, exact))


@pytest.mark.parametrize("reach", [0.05, 0.4, 1.0])
def test_a_flow_is_held_over_all_times_up_to_a_reach(reach: float) -> None:
    """The forcing's quadrature moves x_r in third order alone."""
    field, h = Field(4, {name: ball(VALUES[name]) for name in NAMES}), ball(0, reach)
    for t in ends(h):
        with precision(256):
            exact = (rates(4, {name: ball(VALUES[name]) for name in NAMES}) * t).exp()
        assert held(field.flow(h), exact)


@pytest.mark.parametrize("reach", [0.05, 0.4, 1.0])
def test_a_flow_by_a_parameter_is_held_over_all_times_up_to_a_reach(reach: float) -> None:
    field, h = Field(4, {name: ball(VALUES[name]) for name in NAMES}), ball(0, reach)
    for t in ends(h):
        with precision(256):
            point = {name: ball(VALUES[name]) for name in NAMES}
            exact = corner(rates(4, point), slopes(4, point, "gamma"), t)
        assert held(field.flow_by(h, "gamma"), exact)
