"""Branches at stiff stops, whose stiffness magnifies the rounding of an event's equations."""

from __future__ import annotations

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym import scenes
from capsule_sym._orbits.continuation import path
from capsule_sym.orbits import jacobian, orbit_at

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
FOLDED = {
    "delta": 0.27835912105661864,
    "zeta": 0.011626653537442704,
    "beta": 613.2129000232818,
    "gamma": 3.2428445557502656,
    "f_b": 0.6796985625927296,
}
HALVED = {
    "alpha_low": -0.3100553403304964,
    "D": 0.15962513570908318,
    "delta": 0.7435211973614841,
    "zeta": 0.03219632309037885,
    "beta": 57.27884453209056,
    "gamma": 0.47020828211365573,
    "f_b": 1.0256763332721353,
}
PAIRED = {
    "alpha_low": 1.649481700200122,
    "D": 0.1863898982236883,
    "omega": 1.1092255944843221,
    "delta": 0.8438238538221045,
    "zeta": 0.05295786169301432,
    "beta": 19.738921051655648,
    "gamma": 2.81849298368157,
    "f_b": 0.9013631510309885,
}
LANDED = {
    "alpha": 1.5230474598474282,
    "alpha_low": 0.08450576469158477,
    "D": 0.18911084448528181,
    "delta": 0.3941830637686804,
    "zeta": 0.038150650268740365,
    "gamma": 0.23310364769033556,
    "f_b": 0.3268279794961723,
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


def test_a_curve_of_folds_ends_where_a_drift_comes_to_rest() -> None:
    """There the orbit is at its fold, and the capsule's velocity touches 0."""
    p = cs.Parameters(alpha=1.16138, omega=0.4902, **FOLDED)
    orbit = orbit_at(p, (-0.32720335, -0.79672037, 0.61828339), 1)
    assert orbit is not None
    fold = cs.continue_orbit(orbit, "omega", 0.4896, points=5).at("FO1")
    curve = cs.continue_bifurcation(fold, "alpha", ((0.489, 0.4905), (1.14, 1.17)), points=5)
    (end,) = curve.codimension_two
    assert (curve.success, end.success, end.types) == (True, True, ("fold", "grazing-sliding"))
    # The map's own derivative has the multiplier 1 beside it, where the drift has no rest.
    last = min(curve.points, key=lambda point: abs(point.values[0] - end.values[0]))
    assert np.allclose(last.values, end.values, rtol=0.01)
    run = cs.simulate(last.orbit.parameters, last.orbit.trajectory()(last.orbit.parameters.period))
    assert min(abs(np.linalg.eigvals(jacobian(run)) - 1)) < 1e-6
    switches = end.orbit.trajectory().span[0] + np.cumsum(end.orbit.durations)
    (segment,) = end.segments
    times = np.linspace(switches[segment - 2], switches[segment + 1], 10_001)
    assert abs(end.orbit.trajectory()(times)[:, 2]).min() < 1e-6


def test_a_curve_of_folds_ends_where_the_halves_of_its_orbits_become_equal() -> None:
    """There the edge of the drive and a period doubling meet on the branch of the half orbit."""
    scene, ranges = scenes.reaction_pulse.Parameters, ((0.979, 1.02), (0.9, 0.96))
    twice = orbit_at(
        scene(alpha=0.97935, omega=0.9202035711921273, **HALVED), (-0.078557, 0.258644, 0.0), 2
    )
    once = orbit_at(scene(alpha=1.0, omega=0.9423605928290067, **HALVED), (-0.14147, 0.244, 0.0), 1)
    assert twice is not None
    assert once is not None
    fold = cs.continue_orbit(twice, "alpha", 0.95, points=5).at("FO1")
    curve = cs.continue_bifurcation(fold, "omega", ranges, points=10)
    edge = cs.continue_orbit(once, "alpha", 1.02, points=5).at("ED1")
    (point,) = cs.continue_bifurcation(edge, "omega", ranges, points=5).codimension_two
    end = curve.codimension_two[-1]
    assert (curve.success, end.success, end.types) == (True, True, ("fold", "edge"))
    assert point.types == ("edge", "period doubling")
    assert np.all(abs(np.subtract(end.values, point.values)) <= 1e-9)


def test_a_curve_of_edges_passes_where_a_drift_lands_at_the_edge_and_leaves_it_at_once() -> None:
    """There rest before the edge and the slip beyond it vanish together."""
    orbit = cs.solve_orbit(scenes.reaction_pulse.Parameters(alpha=1.7344398077764567, **PAIRED))
    branch = cs.continue_orbit(orbit, "alpha", 2.1, points=10)
    edge = next(one for one in branch.bifurcations if abs(one.value - 2.0415870483) < 1e-9)
    curve = cs.continue_bifurcation(edge, "omega", ((1.6, 2.1), (1.0, 1.3)), points=10)
    assert curve.success, curve.message
    point = next(one for one in curve.codimension_two if abs(one.values[0] - 2.02715254) < 1e-7)
    assert (point.success, point.types) == (True, ("edge", "edge"))
    assert point.itinerary_after is not None
    # The capsule rests before and after, and the pull after the edge is its bound of friction.
    first = min(point.segments)
    state = np.array(point.orbit.system.flows[first].start, dtype=float)
    pull = pull_of(point.orbit.parameters, state, PAIRED["alpha_low"])
    assert state[2] == pytest.approx(0.0, abs=1e-12)
    assert pull == pytest.approx(PAIRED["f_b"], abs=1e-9)


def test_a_curve_of_edges_ends_where_a_drift_lands_with_the_pull_at_its_bound() -> None:
    """There a slip between the landing and the edge vanishes, and the rest that would follow."""
    p = scenes.reaction_pulse.Parameters(beta=22.115541, omega=0.8064346903898754, **LANDED)
    orbit = orbit_at(p, (0.25924929, -0.06136122, 0.0), 1)
    assert orbit is not None
    edge = cs.continue_orbit(orbit, "beta", 22.0, points=5).at("ED1")
    curve = cs.continue_bifurcation(edge, "omega", ((17.6, 26.4), (0.64, 0.96)), points=5)
    assert curve.success, curve.message
    (end,) = (one for one in curve.codimension_two if one.itinerary_after is None)
    assert (end.success, end.types) == (True, ("edge", "crossing-sliding"))
    _, rest, slip = end.segments
    assert slip == rest + 1
    state = np.array(end.orbit.system.flows[rest].start, dtype=float)
    assert state[2] == pytest.approx(0.0, abs=1e-12)
    pull = pull_of(end.orbit.parameters, state, LANDED["alpha"])
    assert pull == pytest.approx(-LANDED["f_b"], abs=1e-9)


def pull_of(p, state, drive: float) -> float:
    """Force of spring, damper and stop on the capsule, less the reaction of the drive."""
    x_r, v_r, _ = state
    return x_r + 2 * p.zeta * v_r + p.beta * max(x_r - p.delta, 0.0) - drive
