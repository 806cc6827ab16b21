"""Orbits that are one, and that repeat themselves."""

import numpy as np
import pytest

from capsule_sym import orbits, results
from capsule_sym._orbits.shooting.symmetry import primitive, same
from tests.orbits.branches import settled


def twice(orbit: results.Orbit) -> results.Orbit:
    """The same orbit gone round two times."""
    itinerary = results.Itinerary(2 * orbit.itinerary.segments, 2 * orbit.itinerary.period_number)
    found = orbits.solve_itinerary(orbit.values, itinerary, [*orbit.z, *orbit.durations])
    assert found.success, found.message
    return found


def turned(orbit: results.Orbit, segment: int) -> results.Orbit:
    """The same orbit begun at another segment."""
    flow, h = orbit.system.flows[segment], orbit.durations
    guess = [*flow.start, flow.angle, *h[segment:], *h[:segment]]
    found = orbits.solve_itinerary(orbit.values, orbit.itinerary.rotated(segment), guess)
    assert found.success, found.message
    return found


def test_an_orbit_is_the_same_wherever_it_begins() -> None:
    orbit, other = settled(alpha=1.2), settled(alpha=1.2 + 1e-5)
    assert all(same(orbit, turned(orbit, segment)) for segment in range(len(orbit.itinerary)))
    assert not same(orbit, other)
    assert not same(orbit, twice(orbit))


def test_an_orbit_gone_round_twice_is_traversed_once() -> None:
    orbit = settled(alpha=1.2)
    once = primitive(twice(orbit))
    assert once.itinerary == orbit.itinerary
    assert once.z == pytest.approx(orbit.z, abs=1e-12)
    assert primitive(orbit) is orbit


def test_a_period_doubled_orbit_is_no_shorter_one() -> None:
    # Between the doublings at alpha = 0.0429 and 0.0488 two turns differ.
    orbit = settled(alpha=0.045, zeta=0.005)
    assert orbit.itinerary.period_number == 2
    half = len(orbit.itinerary) // 2
    assert orbit.itinerary.fields[:half] == orbit.itinerary.fields[half:]
    assert abs(np.diff(orbit.durations[::half])) > 1e-3
    assert primitive(orbit) is orbit
