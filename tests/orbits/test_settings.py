"""Lengths of steps and tolerances of continuations, and their effect."""

import pytest

import capsule_sym as cs
from capsule_sym._orbits.continuation import branch as branch_run
from capsule_sym._orbits.continuation import continue_orbits, path, problem
from capsule_sym._orbits.continuation import curve as curve_run
from capsule_sym._orbits.continuation.kinds import GRAZING, PERIOD_DOUBLING
from tests.orbits.branches import hysteretic, settled, upwards


@pytest.mark.long
def test_smaller_steps_make_more_points(monkeypatch) -> None:
    """As many as the length of the branch over that of a step; twice as many if it is halved."""

    def steps(size: float) -> int:
        monkeypatch.setattr(path, "_FIRST_STEP", size)
        monkeypatch.setattr(path, "_LARGEST_STEP", size)
        branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 0.95, points=1)
        assert branch.status is cs.results.Status.REACHED
        return len(branch.points)

    few, many, most = map(steps, (0.02, 0.01, 0.005))
    assert 1.8 < (many - 2) / (few - 2) < 2.2
    assert 1.8 < (most - 2) / (many - 2) < 2.2
    wide = steps(0.2)
    monkeypatch.setattr(path, "_LEAST_COSINE", 1 - 1e-6)
    assert steps(0.2) > 2 * wide


def test_a_larger_tolerance_of_newtons_method_is_less_exact(monkeypatch) -> None:
    """Its square is left as an error, which the residual has."""
    monkeypatch.setattr(problem, "_ROUNDING_STEP", 1e-16)

    def residual(tolerance: float) -> float:
        monkeypatch.setattr(problem, "_RESIDUAL_TOLERANCE", tolerance)
        monkeypatch.setattr(problem, "_NEWTON_TOLERANCE", tolerance)
        branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 0.95, points=2)
        return max(float(point.orbit.residual) for point in branch.points)

    assert residual(1e-13) < 1e-13 < 1e-9 < residual(1e-3)


def test_a_number_of_points_ends_all_that_follows(monkeypatch) -> None:
    first, second = upwards(3.3), hysteretic()
    one = next(one for one in first.bifurcations if one.type == GRAZING)
    monkeypatch.setattr(branch_run, "_MOST_POINTS", 2)
    monkeypatch.setattr(curve_run, "_MOST_CURVE_POINTS", 2)
    curve = cs.continue_bifurcation(one, "gamma", ((0.001, 2.0), (3.0, 3.3)))
    assert len(curve.points) == 3  # two of each half, the first of which they share
    (branch, *_) = cs.continue_from(first, one.label, 2.0)
    assert branch.status is cs.results.Status.TOO_MANY_POINTS
    cascade = cs.orbits.period_doubling_cascade(second, 1)
    assert {found.status for found in cascade} == {cs.results.Status.TOO_MANY_POINTS}


def test_no_doubled_orbit_is_found_within_rounding_of_the_orbit_that_doubles(monkeypatch) -> None:
    branch = hysteretic()
    monkeypatch.setattr(continue_orbits, "_DOUBLED_DISTANCES", (1e-12,))
    lost = cs.orbits.period_doubling_cascade(branch, 1)
    doublings = [one for one in branch.bifurcations if one.type == PERIOD_DOUBLING]
    assert len(lost) == len(doublings)
    assert {found.status for found in lost} == {cs.results.Status.NOT_CONVERGED}
