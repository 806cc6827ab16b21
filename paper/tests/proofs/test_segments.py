"""Motions of an interval carried together: directions, roundings, and the derivative."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    ball,
    precision,
    symmetric,
    thin,
)
from capsule_sym._enclosures.numbers.fields import SIZE, Field
from capsule_sym._enclosures.passage.segments import Leg
from capsule_sym._enclosures.passage.switches import pin, saltation, three
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS
from paper.proofs import segments
from paper.proofs.case import EXACT
from paper.proofs.segments import Interval, Passage
from tests.enclosures.case import precise

VALUES = EXACT | {"gamma": "3.3"}

NAMES = [name for name in PARAMETERS if name != "alpha"]

bits = precise(80)


def field(index: int) -> Field:
    return Field(index, {name: ball(VALUES[name]) for name in NAMES})


def passage(alpha: float = 1.2, radius: float = 0.0) -> Passage:
    given = {name: ball(VALUES[name]) for name in NAMES}
    return Passage(given, Interval(alpha, radius))


def column(*values: Any) -> arb_mat:
    return arb_mat([[arb(value)] for value in values])


EXCHANGES = {
    "impact": (1, 4, Guard.GAP),
    "slip": (2, 3, Guard.LOWER),
    "reversal": (1, 3, Guard.DRIFT),
    "stop": (4, 5, Guard.DRIFT),
}
"""Fields before and after a switch, and its guard."""


def switching(name: str, count: int) -> Iterator[tuple[Field, Field, Guard, arb_mat]]:
    """States at a switch, chosen at random, with its fields and its guard."""
    before, following, guard = EXCHANGES[name]
    rng = np.random.default_rng(7)
    for _ in range(count):
        values = [arb(float(x)) for x in rng.uniform(-1, 1, 5)] + [arb(1)]
        if guard is not Guard.GAP:
            values[2] = arb(0)
        if guard is not Guard.DRIFT:
            slope, constant = pin(field(before), guard)
            values[0] = slope * values[1] + constant
        yield field(before), field(following), guard, column(*values)


def exactly_moved(one: Field, h: float) -> arb_mat:
    with precision(200):
        return (one.A * arb(h)).exp()


@pytest.mark.parametrize("late", [0.4, -0.4, 0.01])
@pytest.mark.parametrize("name", EXCHANGES)
def test_the_derivative_into_the_next_field_is_that_at_the_switch(name: str, late: float) -> None:
    for before, following, guard, state in switching(name, 40):
        found = segments.crossing(before, following, guard, state, symmetric(abs(late)))
        jump = saltation(before, following, guard, state)
        flows = (three(exactly_moved(one, h)) for one, h in ((following, -late), (before, late)))
        behind, ahead = flows
        exact = behind * jump * ahead
        for i, j in product(range(3), repeat=2):
            assert found[i, j].overlaps(exact[i, j])


def test_a_direction_of_a_stick_is_at_rest_too() -> None:
    fields = passage(0.005)
    start = fields.start(arb_mat([[0, 0], [arb("0.001"), 0], [0, arb("1e-9")]]), arb(0.5))
    with pytest.raises(Unproved, match="does not begin at rest"):
        [*fields.segments(start, [Leg(2, 1.0, None)], arb(1))]


def test_a_start_has_the_directions_of_alpha() -> None:
    found = passage(1.2, 0.25).start(arb_mat([[0, 0], [0, 0], [0, 0]]), arb("0.5"))
    sine, cosine = arb("0.5").sin_cos()
    for alpha in (0.95, 1.2, 1.45):
        assert (found[3, 0] + found[3, 1] * (alpha - 1.2) / 0.25).overlaps(arb(alpha) * cosine)
        assert segments.hull(found)[3, 0].contains((arb(alpha) * cosine).mid())
        assert segments.hull(found)[4, 0].contains((arb(alpha) * sine).mid())
    with precision(200):
        assert Interval(1.2, 0.25).hull.contains(arb("1.4499"))


# Roundings


def exactly(values: Any) -> list[Fraction]:
    return [Fraction(float(x)) for x in values]


@pytest.mark.parametrize("count", [3, 40, 70])
def test_a_bundle_in_doubles_is_no_smaller_than_the_balls(count: int) -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        middles = rng.normal(size=(7, count))
        radius = float(rng.uniform(0, 1e-3))
        whole = thin(middles) + arb_mat([[symmetric(radius)] * count] * 7)
        found = segments.rounded(whole)
        for i in range(7):
            need = sum(map(abs, exactly(middles[i, 2:]))) + count * Fraction(radius)
            assert sum(map(abs, exactly(found[i, 2:]))) >= need


def test_columns_put_together_are_rounded_up() -> None:
    rng = np.random.default_rng(4)
    for _ in range(10):
        middles = rng.normal(size=(7, 70))
        found = segments.rounded(thin(middles))
        for i in range(7):
            need = sum(map(abs, exactly(middles[i, 2:])))
            assert sum(map(abs, exactly(found[i, 2:]))) >= need


def test_the_rest_of_a_form_in_doubles_is_rounded_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """In doubles the sum is 1."""
    radii: list[float] = []
    monkeypatch.setattr(segments, "symmetric", lambda radius: radii.append(radius) or arb(0))
    passage().boxed(thin(np.array([[0.0, 0.0, 1.0, 2.0**-60]] * 7)))
    assert len(radii) >= SIZE
    assert all(Fraction(radius) >= 1 + Fraction(2) ** -60 for radius in radii[-SIZE:])


def test_fields_of_other_parameters_are_others() -> None:
    narrow = {name: ball(VALUES[name]) for name in NAMES} | {"alpha": arb(1)}
    kept = segments._fields(narrow)
    assert segments._fields(narrow) is kept
    for other in (
        narrow | {"zeta": ball("0.06")},
        narrow | {"zeta": ball("0.05", 1e-3)},
    ):
        kept = segments._fields(narrow)
        assert segments._fields(other) is not kept
    kept = segments._fields(narrow)
    with precision(200):
        assert segments._fields(narrow) is not kept


def test_doubles_carry_all_of_a_bundle() -> None:
    whole = arb_mat([[arb(1), arb(2) ** -8, symmetric(0.5)]] * 7)
    carried, form = passage().boxed(whole)
    for found in (segments.hull(carried), segments.hull(form)):
        for share, rest in product((-1, 1), (-0.5, 0.5)):
            assert all(x.contains(1 + arb(2) ** -8 * share + rest) for (x,) in found.tolist())
