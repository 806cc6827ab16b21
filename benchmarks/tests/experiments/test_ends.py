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
