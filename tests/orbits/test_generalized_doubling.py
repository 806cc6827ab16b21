"""A generalized period doubling: where doubled orbits change from one side to the other."""

from functools import lru_cache

import pytest
from mpmath import mp, mpf

import capsule_sym as cs
from capsule_sym._map.backend import MpmathBackend
from capsule_sym._map.reference import Run
from capsule_sym._orbits.continuation import kinds
from capsule_sym.results import Bifurcation, Branch, Curve, Status
from tests.orbits.branches import settled

pytestmark = pytest.mark.long

MOTION = {
    "alpha": 1.6538244045219441,
    "zeta": 0.028105469109101076,
    "beta": 16.898313099171958,
    "gamma": 1.0489255429322448,
}


def doubling(delta: float) -> tuple[Branch, Bifurcation]:
    branch = cs.continue_orbit(
        settled(omega=0.625, delta=delta, **MOTION), "omega", 0.635, points=3
    )
    return branch, next(one for one in branch.bifurcations if one.type == kinds.PERIOD_DOUBLING)


def side_of_doubled_orbits(delta: float) -> int:
    """On which side of its period doubling doubled orbits lie: by following them."""
    branch, one = doubling(delta)
    for side in (1, -1):
        to = one.value + side * 1e-5
        for new in cs.continue_from(branch, one.label, to, points=2):
            if len(new.points[0].orbit.itinerary) == 2 * len(one.orbit.itinerary):
                return side
    raise AssertionError("no doubled orbit")


#: (omega, delta), found first on a longer curve, from a motion at delta = 0.996.
POINT = (0.6321612304996292, 0.9810967197171732)


@lru_cache
def doublings() -> Curve:
    _, one = doubling(0.978)
    return cs.continue_bifurcation(one, "delta", ((0.62, 0.64), (0.978, 0.984)), points=6)


def test_a_generalized_period_doubling_is_found_on_its_curve() -> None:
    curve = doublings()
    (point,) = (p for p in curve.codimension_two if p.types[1] == kinds.GENERALIZED_DOUBLING)
    assert point.status == "converged"
    assert max(point.uncertainties) < 1e-11
    assert point.values == pytest.approx(POINT, abs=1e-10)


def test_doubled_orbits_change_sides_there() -> None:
    """Followed by their own equations, without the normal form."""
    below, above = (side_of_doubled_orbits(POINT[1] + by) for by in (-3e-4, 3e-4))
    assert below == -above


@pytest.mark.parametrize("away", [1e-4, 2e-4, 3e-4, 4e-4])
def test_their_folds_are_solved_where_rounding_moves_the_orbits(away: float) -> None:
    """Near the doubling a fold's equations are nearly dependent: steps end at some 1e-9."""
    branch, one = doubling(POINT[1] - away)
    found = [
        bifurcation.status
        for new in cs.continue_from(branch, one.label, one.value + 1e-3, points=10)
        for bifurcation in new.bifurcations
        if bifurcation.type == kinds.FOLD
    ]
    assert found == [Status.CONVERGED]


def third_order(one: Bifurcation) -> mpf:
    """Coefficient c of the map u -> -u + c u^3 at a period doubling, by 50-digit differences.

    Of the map from (x_r, v_r) at phase 0, where the capsule sticks, to those a period later.
    """
    numbers = MpmathBackend()
    step, identity = mpf("1e-10"), mp.eye(2)

    def after(start: mp.matrix) -> mp.matrix:
        run = Run(numbers, one.orbit.parameters, escalate=False)
        x_r, v_r, v_c = run.go((start[0], start[1], mpf(0)), 0.0, 1, 1000).final[1]
        assert v_c == 0
        return mp.matrix([x_r, v_r])

    def jacobian(at: mp.matrix) -> mp.matrix:
        return mp.matrix([list(first(at, identity[:, k])) for k in range(2)]).T

    def first(at: mp.matrix, way: mp.matrix) -> mp.matrix:
        return (after(at + step * way) - after(at - step * way)) / (2 * step)

    def second(at: mp.matrix, way: mp.matrix) -> mp.matrix:
        ends = after(at + step * way) + after(at - step * way)
        return (ends - 2 * after(at)) / step**2

    parameters = one.orbit.parameters
    begin = one.orbit.trajectory()(parameters.period * one.orbit.itinerary.period_number)
    at = mp.matrix(begin[:2].tolist())
    matrix = jacobian(at)
    at -= mp.lu_solve(matrix - identity, after(at) - at)
    (a, b), (c, d) = (matrix + identity).tolist()
    assert abs(a * d - b * c) < mpf("1e-9")  # a multiplier is -1
    right, left = mp.matrix([b, -a]), mp.matrix([[c, -a]])
    left /= (left * right)[0]
    bent = mp.lu_solve(identity - matrix, second(at, right))
    mixed = (second(at, right + bent) - second(at, right - bent)) / 4
    far, near = (after(at + k * step * right) - after(at - k * step * right) for k in (2, 1))
    cubed = (far - 2 * near) / (2 * step**3)
    return (left * (cubed / 6 + mixed / 2))[0]


def test_the_third_order_coefficient_of_the_map_vanishes_there() -> None:
    """Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4: by the map, at doublings."""
    with mp.workdps(60):
        delta = doublings().codimension_two[0].values[1]
        low, here, high = (third_order(doubling(delta + by)[1]) for by in (-1e-4, 0.0, 1e-4))
        assert low * high < 0
        assert abs(here / ((high - low) / 2e-4)) < 1e-10


def folds(away: float, ranges: tuple[tuple[float, float], ...], points: int) -> Curve:
    """Curve of the folds of doubled orbits, from so far before the point."""
    branch, one = doubling(POINT[1] - away)
    (fold,) = (
        bifurcation
        for new in cs.continue_from(branch, one.label, one.value + 1e-3, points=10)
        for bifurcation in new.bifurcations
        if bifurcation.type == kinds.FOLD
    )
    return cs.continue_bifurcation(fold, "delta", ranges, points=points)


@pytest.mark.parametrize(
    ("away", "ranges", "points"),
    [
        (3e-4, ((0.62, 0.64), (0.979, 0.984)), 6),
        (3e-4, ((0.3, 1.0), (0.5, 1.5)), 2),  # a step leads across it
        (3e-6, ((0.3, 1.0), (0.5, 1.5)), 2),  # the first step does
    ],
)
def test_the_folds_of_doubled_orbits_end_there_once(away, ranges, points) -> None:
    curve = folds(away, ranges, points)
    found = [one for one in curve.codimension_two if one.types[1] == kinds.GENERALIZED_DOUBLING]
    assert [one.success for one in found] == [True]
    assert found[0].values == pytest.approx(POINT, abs=1e-10)
    assert curve.success
    named = {(one.types, f"{one.values[0]:.8f}") for one in curve.codimension_two}
    assert len(named) == len(curve.codimension_two)


def test_the_folds_do_not_end_at_a_point_beyond_the_range_or_behind_them() -> None:
    curve = folds(1e-5, ((0.62, 0.64), (0.98, POINT[1] - 2e-7)), 10)
    assert not curve.codimension_two
    assert not curve.success
