"""Branches in balls: each condition of a proof taken away or made to fail."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.numbers.balls import Unproved, arb, ball, precision, symmetric
from capsule_sym._enclosures.orbits.events import Proved
from capsule_sym._enclosures.orbits.proof import guess_of, shooting_of
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym.results import Orbit
from paper.proofs import branches, steady
from paper.proofs.branches import Box, glue, march
from paper.proofs.case import EXACT
from paper.proofs.intervals import approximate, prove_intervals, threshold
from tests.enclosures.case import precise

VALUES = EXACT | {"gamma": "3.3"}

bits = precise(128)


@pytest.fixture(scope="module")
def found() -> Any:
    """Forward drift begins at alpha = 0.3687..., a contact before it at 0.5245..."""
    return approximate(Parameters(), 0.3, 0.6)[0]


@pytest.fixture(scope="module")
def event(found: Any) -> Proved:
    return threshold(found[0], VALUES)


def test_an_interval_ends_at_a_bifurcation_of_its_own_itinerary(event: Proved) -> None:
    orbit, ends = orbit_at(0.7), (ball("0.7"), ball("0.8"))
    with pytest.raises(Unproved, match="no side of adding-sliding has the itinerary F5"):
        next(prove_intervals([event], orbit, VALUES, *ends))


# Branches


def orbit_at(alpha: float) -> Orbit:
    orbit = solve_orbit(Parameters(alpha=alpha))
    assert orbit.success, orbit.message
    return orbit


@pytest.fixture(scope="module")
def boxes() -> list[Box]:
    orbit = orbit_at(0.7)
    with precision(128):
        shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha",), VALUES)
        at = shooting.parameter("alpha")
        ends = 0.7, 0.702
        return [*march(shooting, guess_of(shooting, orbit), at, *ends, step=1e-3, watch=Signs())]


def shifted(box: Box) -> Box:
    centre = tuple(x + (1e-2 if k == 0 else 0) for k, x in enumerate(box.tube.centre))
    return replace(box, tube=replace(box.tube, centre=centre))


def test_boxes_are_glued_to_the_one_before(boxes: list[Box]) -> None:
    first, second, *_ = boxes
    glue(first, second)
    with pytest.raises(Unproved, match="gluing"):
        glue(shifted(first), second)
    with pytest.raises(Unproved, match="gluing"):
        glue(first, shifted(second))


def test_a_branch_goes_on_from_its_box_alone(
    boxes: list[Box], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second, *_ = boxes
    tube, shooting = second.tube, second.tube.shooting
    given = shooting, tube.centre, second.column, second.begin, second.end
    monkeypatch.setattr(branches, "_LEAST", 0.1)
    assert [*march(*given, step=1e-3, watch=Signs(), before=first)]
    with pytest.raises(Unproved, match="gluing"):
        [*march(*given, step=1e-3, watch=Signs(), before=shifted(first))]


def test_a_box_has_both_of_its_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exactly, although its middle is rounded."""
    told: list[tuple[Fraction, Fraction]] = []

    def proved(shooting: Any, there: Any, given: Any, watch: Any) -> None:
        man, exp = there[0].man_exp()
        told.append((Fraction(int(man)) * Fraction(2) ** int(exp), Fraction(given[0])))

    monkeypatch.setattr(branches, "prove", proved)
    rng = np.random.default_rng(1)
    for _ in range(200):
        begin = float(rng.uniform(0.1, 2))
        end = float(begin + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-15, -1))
        branches._box(None, [arb(0)], 0, begin, end, None)
        middle, radius = told.pop()
        assert abs(Fraction(begin) - middle) <= radius
        assert abs(Fraction(end) - middle) <= radius


def test_bounds_of_a_speed_enclose_it() -> None:
    low, high = steady._bounds(arb("0.3") + symmetric(0.1))
    assert low <= Fraction("0.2")
    assert high >= Fraction("0.4")
    assert high - low < Fraction("0.2000001")
