"""Ends of branches beside runs: an orbit that continues beyond an end is noticed."""

from dataclasses import replace

import pytest

import capsule_sym as cs
from benchmarks.experiments import ends


@pytest.mark.parametrize("zeta", [0.05, 0.005])
def test_an_orbit_beyond_an_end_is_noticed(zeta: float) -> None:
    """The branch is cut where it is stable, or unstable beyond a period doubling."""
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.03, zeta=zeta))
    branch = cs.continue_orbit(orbit, "alpha", 0.05, points=3)
    found = ends.beyond(replace(branch, points=branch.points[:-1]))
    by_newton = [one["apart"] for one in found if one["how"] == "Newton" and one["close"]]
    assert len(by_newton) == len(ends.BEYOND)
    assert ends.is_false({"beyond": found})


def test_an_end_without_an_orbit_beyond_is_right() -> None:
    """A branch in omega that is cut at its first fold: another motion is there, far away."""
    orbit = cs.solve_orbit(cs.Parameters(alpha=1.2, beta=10.0))
    branch = cs.continue_orbit(orbit, "omega", 1.2, points=40)
    values = [point.value for point in branch.points]
    last = next(k for k, value in enumerate(values) if values[k + 1] < value)
    fold = next(one for one in branch.bifurcations if one.type == "fold")
    cut = replace(branch, points=branch.points[: last + 1], bifurcations=(fold,))
    found = ends.beyond(cut)
    assert found
    assert not ends.is_false({"beyond": found})
