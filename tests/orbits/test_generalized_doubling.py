"""A generalized period doubling: where doubled orbits change from one side to the other."""

from __future__ import annotations

from functools import lru_cache

import pytest

from capsule_sym import (
    Bifurcation,
    Branch,
    Curve,
    Ending,
    continue_bifurcation,
    continue_from,
    continue_orbit,
    curves_from,
)
from capsule_sym._orbits.continuation.bifurcations import FOLD, PERIOD_DOUBLING
from capsule_sym._orbits.continuation.events import GENERALIZED_DOUBLING
from tests.orbits.branches import settled

MOTION = {
    "alpha": 1.6538244045219441,
    "zeta": 0.028105469109101076,
    "beta": 16.898313099171958,
    "gamma": 1.0489255429322448,
}


def doubling(delta: float) -> tuple[Branch, Bifurcation]:
    branch = continue_orbit(settled(omega=0.625, delta=delta, **MOTION), "omega", 0.635, points=3)
    return branch, next(one for one in branch.bifurcations if one.type == PERIOD_DOUBLING)


def side_of_doubled_orbits(delta: float) -> int:
    """On which side of its period doubling doubled orbits lie: by following them."""
    branch, one = doubling(delta)
    for side in (1, -1):
        to = one.value + side * 1e-5
        for new in continue_from(branch, one.label, to, points=2):
            if len(new.points[0].orbit.itinerary) == 2 * len(one.orbit.itinerary):
                return side
    raise AssertionError("no doubled orbit")


#: (omega, delta), found first on a longer curve, from a motion at delta = 0.996.
POINT = (0.6321612304996292, 0.9810967197171732)


@lru_cache
def doublings() -> Curve:
    _, one = doubling(0.978)
    return continue_bifurcation(one, "delta", ((0.62, 0.64), (0.978, 0.984)), points=6)


def test_a_generalized_period_doubling_is_found_on_its_curve() -> None:
    curve = doublings()
    (point,) = (p for p in curve.codimension_two if p.types[1] == GENERALIZED_DOUBLING)
    assert point.status == "converged"
    assert max(point.uncertainties) < 1e-11
    assert point.values == pytest.approx(POINT, abs=1e-10)


def test_doubled_orbits_change_sides_there() -> None:
    """Followed by their own equations, without the normal form."""
    below, above = (side_of_doubled_orbits(POINT[1] + by) for by in (-3e-4, 3e-4))
    assert below == -above


def folds_of_doubled_orbits(away: float) -> Curve:
    """The curve of folds that leaves the point, to so far below it in delta."""
    ranges = ((0.62, 0.64), (POINT[1] - away, 0.984))
    (curve,) = curves_from(doublings(), ranges, points=2)
    return curve


def test_folds_of_doubled_orbits_leave_there() -> None:
    """The end of their curve is the fold that the branch of doubled orbits has at that delta."""
    curve = folds_of_doubled_orbits(4e-4)
    assert (curve.type, curve.endings[0][0]) == (FOLD, Ending.REACHED)
    assert curve.endings[1] == (
        Ending.CODIMENSION_TWO,
        "the point from which the curve is followed",
    )
    assert curve.codimension_two[0].values == doublings().codimension_two[0].values
    omega, delta = curve.points[0].values
    branch, one = doubling(delta)
    found = [
        bifurcation.value
        for to in (one.value - 1e-3, one.value + 1e-3)
        for new in continue_from(branch, one.label, to, points=10)
        for bifurcation in new.bifurcations
        if bifurcation.type == FOLD and new.points[0].orbit.itinerary.period_number == 2
    ]
    assert found == pytest.approx([omega], abs=1e-12)


def test_they_are_tangent_to_the_doublings() -> None:
    """With s the halves' difference: w = b s^2 + c s^4, b growing along the doublings."""
    apart = []
    for away in (4e-4, 2e-4):
        omega, delta = folds_of_doubled_orbits(away).points[0].values
        apart.append(omega - doubling(delta)[1].value)
    assert apart[0] / apart[1] == pytest.approx(4, rel=0.02)
