"""Branches at stiff stops, whose stiffness magnifies the rounding of an event's equations."""

from __future__ import annotations

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym import scenes
from capsule_sym._orbits.continuation import path

PULSED = {
    "alpha": 0.429432255087572,
    "alpha_low": 1.7879656203188588,
    "D": 0.07486739641866713,
    "delta": 0.3477582835545055,
    "zeta": 0.09815355228586173,
    "beta": 868.3296668528869,
    "gamma": 0.21963187494737899,
    "f_b": 0.3935110876608558,
}
CAPSULE = {
    "alpha": 1.570040205155535,
    "delta": 0.8994511099097939,
    "zeta": 0.06884950399449594,
    "beta": 396.493019540342,
    "gamma": 0.3127457268991757,
    "f_b": 1.1881176141097651,
}
REACTION = {
    "alpha": 2.3460280515457947,
    "delta": 0.18181956382868072,
    "zeta": 0.0881157175739018,
    "beta": 947.4221707391337,
    "gamma": 4.743980469078068,
    "f_b": 1.0367725573783069,
}
CASES = [
    ("reaction_pulse", PULSED, 0.2825, 0.278),
    pytest.param("capsule", CAPSULE, 0.5223369424795006, 0.3134, marks=pytest.mark.long),
    pytest.param("reaction", REACTION, 0.6548844682730086, 0.3929, marks=pytest.mark.long),
    pytest.param("reaction_pulse", PULSED, 0.3096, 0.25, marks=pytest.mark.long),
]


@pytest.mark.parametrize(("scene", "values", "begin", "end"), CASES)
def test_a_branch_reaches_the_end_of_its_range(scene, values, begin: float, end: float) -> None:
    start = cs.solve_orbit(scenes.load(scene).Parameters(omega=begin, **values))
    branch = cs.continue_orbit(start, "omega", end)
    assert branch.success, branch.message
    assert branch.points[-1].value == end


@pytest.mark.parametrize(
    ("p", "name", "to"),
    [
        (cs.Parameters(alpha=0.9), "alpha", 1.0),
        pytest.param(cs.Parameters(alpha=0.9), "omega", 0.65, marks=pytest.mark.long),
        (scenes.reaction_pulse.Parameters(omega=0.2825, **PULSED), "omega", 0.2785),
    ],
)
def test_runs_alone_find_the_events_that_equations_find(monkeypatch, p, name, to) -> None:
    start = cs.solve_orbit(p)
    expected = cs.continue_orbit(start, name, to, points=5)
    monkeypatch.setattr(path, "first_event", lambda *arguments: None)
    found = cs.continue_orbit(start, name, to, points=5)
    assert found.success, found.message
    for one, other in zip(found.bifurcations, expected.bifurcations, strict=True):
        assert str(one.itinerary_after) == str(other.itinerary_after)
        assert abs(one.value - other.value) <= one.uncertainty + other.uncertainty
    [onward] = cs.continue_from(found, "HC1", to, points=5)
    assert onward.success, onward.message


def test_a_curve_of_doubled_orbits_ends_where_their_halves_become_equal() -> None:
    """There the curve of the orbits of half the period has a period doubling."""
    ranges = (0.3, 0.4), (0.0478, 0.052)
    once = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.3)), "alpha", 0.4, points=3)
    (point,) = cs.continue_bifurcation(once.at("AS1"), "zeta", ranges, points=3).codimension_two
    begin = cs.solve_orbit(cs.Parameters(alpha=0.3655, zeta=0.0479))
    doubled = cs.continue_orbit(begin, "alpha", 0.372, points=5)
    curve = cs.continue_bifurcation(doubled.at("AS1"), "zeta", ranges, points=10)
    (end,) = curve.codimension_two
    assert (curve.success, end.success, end.types) == (True, True, point.types)
    assert np.all(abs(np.subtract(end.values, point.values)) <= end.uncertainties)
