"""Polynomial forms: each remainder alone, against exact values at places of the box."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from math import factorial

import pytest
from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import arb, assembled, precision, stacked
from paper.proofs import forms
from paper.proofs.forms import (
    MONOMIALS,
    Form,
    exponential,
    number,
    polynomial,
    series,
    shifted,
)
from tests.enclosures.case import precise

CORNERS = tuple(product((-1.0, -0.5, 1.0), repeat=2))
SIGNS = (-1.0, 1.0)

bits = precise(128)


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
    "third": polynomial([0, 0, 0, 0, 0, 0, 0.5, -0.25, 0.75, -0.5]),
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


@pytest.mark.parametrize("h", [0.25, 0.2, 0.01])
def test_an_exponential_is_held_with_the_tail_of_its_series(h: float) -> None:
    """A number, of which nothing is halved: no remainder of a product covers the tail."""
    found = exponential(assembled(1, 1, [(0, 0, number(1))]), number(h))[0, 0]
    with precision(256):
        exact = arb(h).exp()
    assert found.hull.contains(exact)


def test_a_tail_is_that_of_the_whole_box(monkeypatch: pytest.MonkeyPatch) -> None:
    """The series has two terms here, which a form holds exactly."""
    monkeypatch.setattr(forms, "_ORDER", 2)
    rates, h = polynomial([0.5, 0.25]), polynomial([0.25, 0, 0.0625])
    for one, other in ((rates, number(0.25)), (number(0.5), h)):
        found = exponential(assembled(1, 1, [(0, 0, one)]), other)[0, 0]
        for place, _, x in exact(one * other):
            assert at(found, place).contains(x.exp().mid())


@pytest.mark.parametrize("zeros", [0, 1, 2])
@pytest.mark.parametrize("terms", [2, 3])
def test_a_series_without_its_first_terms_is_held_with_its_tail(
    zeros: int, terms: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a number: (exp(a h) - terms)/h^zeros, with tails of different sizes over the box."""
    monkeypatch.setattr(forms, "_TERMS", terms)
    for one, other in (
        (polynomial([0.5, 0.25]), number(0.25)),
        (number(0.5), polynomial([0.25, 0, 0.25])),
        (number(1), number(1)),
    ):
        found = series(assembled(1, 1, [(0, 0, one)]), other, zeros)[0, 0]
        for (place, _, a), (_, _, h) in zip(exact(one), exact(other), strict=True):
            tail = (a**k * h ** (k - zeros) / factorial(k) for k in range(zeros, 40))
            assert at(found, place).contains(sum(tail, arb(0)).mid())
        assert float(found.hull.rad()) < 1


@pytest.mark.parametrize("size", [0.3, 3.0, 40.0])
def test_an_exponential_is_halved_until_its_series_is_short(size: float) -> None:
    found = exponential(assembled(1, 1, [(0, 0, number(-1))]), number(size))[0, 0]
    assert found.hull.contains((-arb(size)).exp().mid())
    assert float(found.hull.rad()) < 1e-10


@pytest.mark.parametrize("rows", [[[0, 1], [-4, 0]], [[1, 0], [0, -1]], [[0, 1], [1, 1]]])
@pytest.mark.parametrize("h", [polynomial([1.0, 0.25, -0.25]), polynomial([1.0], 0.5)])
def test_a_flow_is_held_over_all_of_a_shift(rows: list[list[int]], h: Form) -> None:
    rates = arb_mat(rows)
    found = shifted(rates, h, lambda t: (rates * t).exp())
    for place, _, t in exact(h):
        true = (rates * t).exp()
        for i, j in product(range(2), repeat=2):
            assert at(found[i, j], place).contains(true[i, j].mid())


def test_matrices_of_forms_keep_remainders() -> None:
    wide = PARTS["error"]
    made = assembled(2, 1, [(0, 0, wide), (1, 0, arb(3))])
    for found in (made, stacked([made, arb_mat([[5]])]), stacked([arb_mat([[0]]), made])):
        rows = [found[i, 0] for i in range(found.c.nrows())]
        assert max(one.e.rad() for one in rows) == wide.e.rad()


def test_a_polynomial_has_its_radius() -> None:
    assert polynomial([1.5], 0.5).e.contains(arb(0.5))
    assert polynomial([1.5]).e == 0
