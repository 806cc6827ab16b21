"""Curves of bifurcations in two parameters: against branches at other values, and crossings."""

from functools import lru_cache

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation import kinds, path
from capsule_sym._orbits.continuation.bifurcations import sorted_multipliers
from capsule_sym._orbits.continuation.conditions import of_matrix
from capsule_sym._orbits.continuation.crossing import Continuation
from capsule_sym._orbits.continuation.curve import CurveRun
from capsule_sym._orbits.continuation.parameter_paths import PathAxis
from capsule_sym._orbits.continuation.problem import Problem
from capsule_sym._orbits.continuation.records import codimension_two_rows, curve_record, curve_rows
from capsule_sym.inputs import ParameterPath
from capsule_sym.results import Bifurcation, Curve, Status
from tests.orbits.branches import hysteretic, settled, upwards

RANGES = ((0.001, 2.0), (3.0, 3.3))
DEGENERATE = (1.34731122382007, 4.1674541499034)


@lru_cache
def traced(kind: str, points: int = 8) -> Curve:
    one = next(one for one in upwards(3.3).bifurcations if one.type == kind)
    return cs.continue_bifurcation(one, "gamma", RANGES, points=points)


@pytest.mark.parametrize(
    "kind", [kinds.GRAZING, kinds.SWITCHING, kinds.GRAZING_SLIDING, kinds.CROSSING]
)
def test_a_curve_joins_the_values_of_two_branches(kind: str) -> None:
    curve = traced(kind)
    assert [ending for ending, _ in curve.endings] == [Status.REACHED, Status.REACHED]
    for point, gamma in ((curve.points[0], 3.0), (curve.points[-1], 3.3)):
        one = next(one for one in upwards(gamma).bifurcations if one.type == kind)
        assert point.values == pytest.approx((one.value, gamma), abs=1e-12)
        assert point.line == one.line
    for point in curve.points:
        assert point.orbit.residual < 1e-12
        assert point.orbit.z[4 + point.segment] == 0
        assert point.admissibility.value > 0


def test_a_curve_is_closed_only_where_it_passes_its_first_point() -> None:
    """However large its steps are beside the ranges."""
    one = next(one for one in upwards(3.3).bifurcations if one.type == kinds.GRAZING)
    axes = tuple(
        PathAxis(ParameterPath(name), *ends)
        for name, ends in zip(("alpha", "gamma"), RANGES, strict=True)
    )
    with backend("numpy") as numbers:
        continuation = Continuation(Problem(numbers, axes), one.orbit, one.segment)
        u = continuation.unknowns(one.orbit)
        begin = continuation.state(u, -np.eye(len(u))[-1])
        states, run = [begin], CurveRun(continuation, kinds.GRAZING, 10)
        for _ in range(2):
            states.append(run.advance(states[-1], 0.1).state)
        old, new = states[1:]
        middle = continuation.corrected((old.u + new.u) / 2, new.u - old.u)
        assert middle is not None
        first = continuation.state(middle.u, begin.tangent, middle)
        run.first = first
        assert run.closes(old, new)
        assert not run.closes(begin, old)
        near = first.u + 1e-5 * np.eye(len(u))[0]
        for other in (begin, first._replace(u=near, orbit=continuation.orbit(near))):
            run.first = other
            assert not run.closes(old, new)


def test_two_curves_meet_in_one_point() -> None:
    for kind in (kinds.SWITCHING, kinds.GRAZING_SLIDING):
        (here,) = (m for m in traced(kind).codimension_two if kinds.CROSSING in m.types)
        (there,) = (m for m in traced(kinds.CROSSING).codimension_two if kind in m.types)
        assert (here.types, here.lines) == (there.types[::-1], there.lines[::-1])
        for k in range(2):
            error = here.uncertainties[k] + there.uncertainties[k]
            assert abs(here.values[k] - there.values[k]) <= error < 1e-11
        assert here.residual < 1e-12
        assert sorted(here.orbit.z[4:])[:2] == [0, 0]


def test_the_order_of_events_changes_at_the_meeting() -> None:
    (meeting,) = (m for m in traced(kinds.SWITCHING).codimension_two if kinds.CROSSING in m.types)
    (alpha, gamma), below = meeting.values, [kinds.CROSSING, kinds.SWITCHING]
    for side, order in ((-1e-4, below), (1e-4, below[::-1])):
        start = settled(alpha=alpha - 0.01, gamma=gamma + side)
        branch = cs.continue_orbit(start, "alpha", alpha + 0.005, points=10)
        assert [one.type for one in branch.bifurcations] == order
        assert [one.value for one in branch.bifurcations] == pytest.approx(2 * [alpha], abs=1e-3)


def test_a_point_that_is_not_located_is_named_where_it_ends_a_curve(monkeypatch) -> None:
    (meeting,) = (m for m in traced(kinds.SWITCHING).codimension_two if kinds.CROSSING in m.types)
    monkeypatch.setattr(path, "first_event", lambda *arguments: None)
    curve = traced.__wrapped__(kinds.SWITCHING)
    (end,) = curve.codimension_two
    assert (curve.success, end.success, end.failed) == (False, False, meeting.failed)
    assert end.types == (kinds.SWITCHING, kinds.HIGHER.type)
    assert np.all(abs(np.subtract(end.values, meeting.values)) <= end.uncertainties)


@pytest.mark.parametrize(
    ("kind", "multiplier"),
    [(kinds.FOLD, 1), pytest.param(kinds.PERIOD_DOUBLING, -1, marks=pytest.mark.long)],
)
def test_smooth_bifurcations_have_curves_as_well(kind: str, multiplier: int) -> None:
    one = next(one for one in hysteretic().bifurcations if one.type == kind)
    curve = cs.continue_bifurcation(one, "alpha", ((0.5, 1.2), (1.19, 1.21)), points=4)
    assert len(curve.points) >= 3
    for point in curve.points:
        assert min(abs(value - multiplier) for value in sorted_multipliers(point.orbit)) < 1e-8
        assert point.segment is None
    # A branch at the other end of the curve has the same bifurcation.
    end = max(curve.points, key=lambda point: point.values[1])
    branch = cs.continue_orbit(settled(alpha=end.values[1], beta=10.0), "omega", 1.2, points=40)
    values = [other.value for other in branch.bifurcations if other.type == kind]
    assert min(abs(value - end.values[0]) for value in values) < 1e-11


def test_a_curve_in_other_parameters() -> None:
    one = next(one for one in upwards(3.3).bifurcations if one.type == kinds.GRAZING)
    curve = cs.continue_bifurcation(one, "delta", ((0.001, 0.02), (0.001, 0.05)), points=10)
    # In the shell at rest the motion is linear: its amplitude is that of the force.
    ratios = np.array([point.values[0] / point.values[1] for point in curve.points])
    assert ratios == pytest.approx(one.value / 0.02, rel=1e-12)


@pytest.mark.parametrize("share", [1 - 5e-4, 1 + 5e-4])
def test_a_curve_ends_at_the_border_that_it_meets_first(share: float) -> None:
    """The touch from rest is at alpha = ratio * delta: a line that passes by the corner."""
    one = next(one for one in upwards(3.3).bifurcations if one.type == kinds.GRAZING)
    ratio, delta = one.value / 0.02, 0.021
    ranges = ((0.001, share * ratio * delta), (0.001, delta))
    curve = cs.continue_bifurcation(one, "delta", ranges, points=10)
    end = min(share, 1.0) * delta
    assert curve.points[-1].values == pytest.approx((ratio * end, end), rel=1e-12)
    assert curve.endings[1][0] is cs.results.Status.REACHED


@pytest.mark.parametrize(
    ("second", "ranges", "field"),
    [
        ("alpha", RANGES, "second"),
        ("speed", RANGES, "second"),
        ("gamma", ((0.001, 2.0), (3.4, 4.0)), "gamma"),
        ("gamma", ((1.9, 2.0), (3.0, 4.0)), "alpha"),
        ("gamma", ((0.001, 2.0), (0.0, 4.0)), "gamma"),
        ("gamma", (0.001, 2.0), "ranges"),
        ("gamma", ((0.001, 2.0),), "ranges"),
    ],
)
def test_bad_input_is_refused(second: str, ranges, field: str) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        cs.continue_bifurcation(upwards(3.3).bifurcations[0], second, ranges)
    assert caught.value.field == field


def test_a_curve_holds_the_multipliers_along_it() -> None:
    # Just before the touch the motion that settles from rest has the same multipliers.
    curve = traced(kinds.GRAZING)
    for point in (curve.points[0], curve.points[-1]):
        alpha, gamma = point.values
        below = settled(alpha=alpha - 1e-9, gamma=gamma)
        assert point.multipliers == pytest.approx(sorted_multipliers(below), abs=1e-6)
    (row, *_) = curve_rows([curve])
    assert row["largest_multiplier"] == abs(curve.points[0].multipliers[0])


def test_every_table_of_meetings_has_their_uncertainties() -> None:
    curve = traced(kinds.SWITCHING)
    rows = codimension_two_rows([curve])
    assert len(rows) == len(curve.codimension_two) > 0
    for row, one in zip(rows, curve.codimension_two, strict=True):
        assert (row["uncertainty_alpha"], row["uncertainty_gamma"]) == one.uncertainties


@pytest.mark.parametrize("kind", [kinds.SWITCHING, kinds.CROSSING])
def test_multipliers_at_a_sliding_bifurcation_are_those_on_both_sides(kind: str) -> None:
    """The map is smooth to first order there (di Bernardo et al.)."""
    point = traced(kind).points[-1]
    alpha, gamma = point.values
    for side in (-1e-7, 1e-7):
        beside = settled(alpha=alpha + side, gamma=gamma)
        assert point.multipliers == pytest.approx(sorted_multipliers(beside), abs=1e-5)


def test_both_multipliers_at_a_grazing_sliding_bifurcation_are_those_of_its_sides() -> None:
    """The map's slope jumps there: each side's motion settles by itself."""
    curve = traced(kinds.GRAZING_SLIDING)
    for point in (curve.points[0], curve.points[-1]):
        alpha, gamma = point.values
        sides = [settled(alpha=alpha + side, gamma=gamma) for side in (-1e-9, 1e-9)]
        longer, shorter = sorted(sides, key=lambda one: -len(one.itinerary))
        assert len(longer.itinerary) > len(shorter.itinerary)
        assert point.multipliers == pytest.approx(sorted_multipliers(longer), abs=1e-5)
        assert point.multipliers_without == pytest.approx(sorted_multipliers(shorter), abs=1e-5)
        assert abs(point.multipliers[0] - point.multipliers_without[0]) > 1e-3
    written = [complex(*pair) for pair in curve_record(curve)["points"][0]["multipliers_without"]]
    assert tuple(written) == curve.points[0].multipliers_without
    smooth = traced(kinds.SWITCHING).points[0]
    assert smooth.multipliers_without == pytest.approx(smooth.multipliers, abs=1e-9)


def test_a_crossing_sliding_curve_has_a_degenerate_point_once() -> None:
    branch = cs.continue_orbit(settled(alpha=1.3, gamma=4.4), "alpha", 1.35, points=4)
    (one,) = (b for b in branch.bifurcations if b.type == kinds.CROSSING)
    curve = cs.continue_bifurcation(one, "gamma", ((1.2, 1.5), (4.1, 4.5)), points=4)
    near = [p for p in curve.codimension_two if p.values == pytest.approx(DEGENERATE, abs=1e-6)]
    (point,) = near
    assert point.values == pytest.approx(DEGENERATE, abs=1e-12)


@pytest.mark.long
def test_two_folds_end_on_a_border_between_them() -> None:
    """Of a branch w = e b s + a s^2 with a of either sign on the two sides of a border s = 0.

    For one sign of e each side has its fold, (e b)^2/(4 a) from the border, for the other none has.
    """

    def events(alpha: float) -> list[Bifurcation]:
        start = settled(alpha=alpha, beta=10.0, omega=0.865)
        found = cs.continue_orbit(start, "omega", 0.867, points=2).bifurcations
        return [one for one in found if one.type in (kinds.FOLD, kinds.CROSSING)]

    one = next(one for one in events(1.2235) if one.type == kinds.FOLD)
    curve = cs.continue_bifurcation(one, "alpha", ((0.865, 0.867), (1.223, 1.225)), points=2)
    (point,) = (p for p in curve.codimension_two if p.types[1] == kinds.CROSSING)
    assert max(point.uncertainties) < 1e-11
    far, near = events(point.values[1] - 2e-4), events(point.values[1] - 1e-4)
    assert (
        [one.type for one in far]
        == [one.type for one in near]
        == [kinds.FOLD, kinds.CROSSING, kinds.FOLD]
    )
    for k in (0, 2):
        apart = [abs(found[k].value - found[1].value) for found in (far, near)]
        assert apart[0] / apart[1] == pytest.approx(4, rel=0.1)
    assert [one.type for one in events(point.values[1] + 1e-4)] == [kinds.CROSSING]


def test_a_multiplier_passes_minus_one_on_an_adding_sliding_curve() -> None:
    branch = cs.continue_orbit(settled(alpha=0.36), "alpha", 0.38, points=4)
    curve = cs.continue_bifurcation(branch.at("AS1"), "zeta", ((0.1, 0.9), (0.047, 0.05)), points=4)
    (point,) = curve.codimension_two
    assert point.types == (kinds.ADDING, kinds.PERIOD_DOUBLING)
    assert max(point.uncertainties) < 1e-12
    # The end of the period-doubling curve of the branches over alpha.
    assert point.values == pytest.approx((0.368574, 0.048066), abs=1e-6)
    for one in curve.points:
        assert (one.multipliers[0].real < -1) == (one.values[1] < point.values[1])


@pytest.mark.long
def test_a_cusp_is_where_two_folds_of_a_branch_become_one() -> None:
    def folds(zeta: float) -> list[float]:
        start = settled(alpha=0.049, omega=1.1, delta=0.1, beta=10.0, gamma=3.0, zeta=zeta)
        branch = cs.continue_orbit(start, "alpha", 0.046, points=10)
        return [one for one in branch.bifurcations if one.type == kinds.FOLD]

    first, last = folds(0.194)
    curve = cs.continue_bifurcation(first, "zeta", ((0.04, 0.06), (0.193, 0.2)), points=5)
    (cusp,) = curve.codimension_two
    assert cusp.types == (kinds.FOLD, kinds.CUSP)
    assert cusp.values == pytest.approx((0.0481, 0.195), abs=1e-4)
    assert max(cusp.uncertainties) < 1e-12
    assert cusp.status == "converged"
    # Curves of both folds have the same one, and no branch beyond it has a fold.
    (other,) = cs.continue_bifurcation(
        last, "zeta", ((0.04, 0.06), (0.193, 0.2)), points=5
    ).codimension_two
    assert other.values == pytest.approx(cusp.values, abs=1e-12)
    assert folds(cusp.values[1] + 1e-5) == []
    # Towards a cusp the folds approach like the power 3/2 of the distance.
    apart = [
        np.diff([one.value for one in folds(cusp.values[1] - away)])[0] for away in (4e-3, 1e-3)
    ]
    assert apart[0] / apart[1] == pytest.approx(8, rel=0.05)


@pytest.mark.long
def test_a_period_doubling_curve_goes_on_where_a_slip_vanishes() -> None:
    branch = cs.continue_orbit(settled(alpha=0.36, zeta=0.0478), "alpha", 0.39, points=4)
    (one,) = (b for b in branch.bifurcations if b.type == kinds.PERIOD_DOUBLING)
    curve = cs.continue_bifurcation(one, "zeta", ((0.3, 0.4), (0.0478, 0.0484)), points=4)
    (point,) = curve.codimension_two
    assert point.types == (kinds.PERIOD_DOUBLING, kinds.ADDING)
    assert max(point.uncertainties) < 1e-12
    border = cs.continue_orbit(settled(alpha=0.36), "alpha", 0.38, points=4).at("AS1")
    other = cs.continue_bifurcation(border, "zeta", ((0.3, 0.4), (0.0478, 0.05)), points=4)
    (there,) = other.codimension_two
    assert there.values == pytest.approx(point.values, abs=1e-12)
    assert {str(p.orbit.itinerary) for p in curve.points} == {"F5 F4 F5 F2", "F5 F2"}


@pytest.mark.long
def test_two_sliding_curves_end_in_the_same_degenerate_point() -> None:
    branch = cs.continue_orbit(settled(alpha=1.34, gamma=4.1), "alpha", 1.37, points=4)
    found = []
    for kind in (kinds.SWITCHING, kinds.GRAZING_SLIDING):
        (one,) = (b for b in branch.bifurcations if b.type == kind)
        curve = cs.continue_bifurcation(one, "gamma", ((1.3, 1.4), (4.1, 4.2)), points=4)
        (point,) = (
            p
            for p in curve.codimension_two
            if set(p.types) == {kinds.SWITCHING, kinds.GRAZING_SLIDING}
        )
        assert max(point.uncertainties) < 1e-11
        found.append(point)
    assert found[0].values == pytest.approx(found[1].values, abs=1e-12)
    assert found[0].values == pytest.approx((1.34731122382007, 4.16745414990345), abs=1e-13)


@pytest.mark.parametrize(
    ("value", "name"), [(1.0, kinds.RESONANCE_1_1), (-1.0, kinds.RESONANCE_1_2)]
)
def test_a_resonance_is_where_a_second_multiplier_is_the_same(value: float, name: str) -> None:
    random = np.random.default_rng(3)
    basis = random.normal(size=(3, 3))
    tests = []
    for second in (value - 0.1, value, value + 0.1):
        matrix = basis @ np.diag([value, second, 0.3]) @ np.linalg.inv(basis)
        tests.append(of_matrix(matrix)[name])
    assert tests[1] == pytest.approx(0, abs=1e-12)
    assert tests[0] * tests[2] < 0


@pytest.mark.long
def test_a_curve_goes_on_where_the_mass_grazes_beside_the_segment_whose_inequality_fails() -> None:
    """Beyond that point, runs on both sides of the curve have the itineraries of both sides."""
    start = settled(
        alpha=1.3172520527091784,
        omega=0.34,
        delta=0.6286309135351807,
        zeta=0.11369938310363782,
        beta=17.903008679127566,
        gamma=2.218772879668801,
        f_b=1.5157150606580156,
    )
    (corner, *_) = cs.continue_orbit(start, "f_b", 1.55).bifurcations
    curve = cs.continue_bifurcation(corner, "zeta", ((1.2, 1.9), (0.05, 0.17)), points=10)
    assert [ending for ending, _ in curve.endings] == [Status.REACHED, Status.REACHED]
    assert (kinds.GRAZING, kinds.GRAZING) in [one.types for one in curve.codimension_two]
    point = curve.points[-1]
    f_b, zeta = point.values
    beside = [
        settled(**start.parameters.to_dict() | {"f_b": f_b + off, "zeta": zeta}).itinerary.cyclic
        for off in (-2e-4, 2e-4)
    ]
    assert beside[0] == point.orbit.itinerary.cyclic != beside[1]
