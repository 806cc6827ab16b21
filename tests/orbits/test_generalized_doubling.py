"""A generalized period doubling: where doubled orbits change from one side to the other."""

from __future__ import annotations

import pytest

from capsule_sym import Bifurcation, Branch, continue_bifurcation, continue_from, continue_orbit
from capsule_sym._orbits.continuation.bifurcations import PERIOD_DOUBLING
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


def test_a_generalized_period_doubling_is_found_on_its_curve() -> None:
    _, one = doubling(0.978)
    curve = continue_bifurcation(one, "delta", ((0.62, 0.64), (0.978, 0.984)), points=6)
    (point,) = (p for p in curve.codimension_two if p.types[1] == GENERALIZED_DOUBLING)
    assert point.status == "converged"
    assert max(point.uncertainties) < 1e-11
    assert point.values == pytest.approx(POINT, abs=1e-10)


def test_doubled_orbits_change_sides_there() -> None:
    """Followed by their own equations, without the normal form."""
    below, above = (side_of_doubled_orbits(POINT[1] + by) for by in (-3e-4, 3e-4))
    assert below == -above
