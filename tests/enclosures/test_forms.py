"""Polynomial forms: each remainder alone, against exact values at places of the box."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import pytest
from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import arb, precision
from capsule_sym._enclosures.numbers.forms import (
    MONOMIALS,
    Form,
    assembled,
    exponential,
    number,
    polynomial,
    shifted,
)

CORNERS = tuple(product((-1.0, -0.5, 1.0), repeat=2))
SIGNS = (-1.0, 1.0)


@pytest.fixture(autouse=True)
def bits():
    with precision(128):
        yield


def at(form: Form, place: tuple[float, float], error: float | None = None):
    """A form's ball at a place of its box, or its value with a share of its remainder."""
    x, y = place
    total = sum((c * x**a * y**b for c, (a, b) in zip(form.p, MONOMIALS, strict=True)), arb(0))
    return total + (form.e if error is None else arb(form.e.rad()) * error)


def exact(form: Form) -> Iterator[tuple[tuple[float, float], float, object]]:
    """Places, shares of the remainder, and what the form stands for there."""
    for place, error in product(CORNERS, SIGNS):
        yield place, error, at(form, place, error)


# One kind of term in each, so that a product has one kind of remainder.
PARTS = {
    "middle": polynomial([1.5]),
    "first": polynomial([0, 0.75, -0.5]),
    "second": polynomial([0, 0, 0, 0.5, 0.25, -0.75]),
    "error": polynomial([], 0.5),
}


@pytest.mark.parametrize(("one", "other"), [*product(PARTS, repeat=2)])
def test_a_product_holds_the_products_of_each_part(one: str, other: str) -> None:
    made = PARTS[one] * PARTS[other]
    for (place, _, x), (there, _, y) in product(exact(PARTS[one]), exact(PARTS[other])):
        assert place != there or at(made, place).contains((x * y).mid())


@pytest.mark.parametrize("part", PARTS)
def test_sums_and_multiples_keep_each_part(part: str) -> None:
    one, other = PARTS[part], polynomial([0.25, 0.5], 0.125)
    for place, _, x in exact(one):
        assert at(one + 1, place).contains(x + 1)
        assert at(one * arb(-3), place).contains(-3 * x)
        assert at(arb(-3) * one, place).contains(-3 * x)
        for there, _, y in exact(other):
            assert place != there or at(one - other, place).contains((x - y).mid())
        assert one.hull.contains(x)
        assert (one - one.c).range.contains(x - one.c)


@pytest.mark.parametrize(
    "given",
    [
        polynomial([1.25, 0.25, -0.25]),
        polynomial([-1.25, 0.0, 0.0, 0.125, 0.125, -0.125]),
        polynomial([1.25], 0.25),
    ],
    ids=["first", "second", "error"],
)
@pytest.mark.parametrize(
    ("of_form", "of_ball"),
    [
        (Form.inverse, lambda x: 1 / x),
        (lambda form: form.sin_cos()[0], lambda x: x.sin()),
        (lambda form: form.sin_cos()[1], lambda x: x.cos()),
    ],
    ids=["inverse", "sine", "cosine"],
)
def test_functions_hold_their_values_at_each_place(given: Form, of_form, of_ball) -> None:
    made = of_form(given)
    for place, _, x in exact(given):
        assert at(made, place).contains(of_ball(x).mid())


def test_an_exponential_is_held_with_the_tail_of_its_series() -> None:
    """Exactly 1/4, so that nothing is halved and no remainder of a product covers the tail."""
    found = exponential(assembled(1, 1, [(0, 0, number(1))]), number(0.25))[0, 0]
    assert found.hull.contains((arb(1) / 4).exp().mid())


@pytest.mark.parametrize("size", [0.3, 3.0, 40.0])
def test_an_exponential_is_halved_until_its_series_is_short(size: float) -> None:
    found = exponential(assembled(1, 1, [(0, 0, number(-1))]), number(size))[0, 0]
    assert found.hull.contains((-arb(size)).exp().mid())
    assert float(found.hull.rad()) < 1e-10


def test_a_flow_is_held_over_all_of_a_shift() -> None:
    rates = arb_mat([[0, 1], [-4, 0]])
    h = polynomial([1.0, 0.25, -0.25])
    found = shifted(rates, h, lambda t: (rates * t).exp())
    for place, _, t in exact(h):
        true = (rates * t).exp()
        for i, j in product(range(2), repeat=2):
            assert at(found[i, j], place).contains(true[i, j].mid())
