"""Orbits closed by the C core: metrics, gradients and multipliers against 50 digits."""

from functools import lru_cache
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import capsule_sym as cs
from capsule_sym._native import core
from capsule_sym._orbits.metrics.many import METRICS
from capsule_sym.orbits import floquet_multipliers, solve_itinerary
from capsule_sym.results import Orbit, Performance, Performances

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")

MOTIONS: dict[str, dict[str, float]] = {
    "rest for ever": {"alpha": 0.005},
    "sliding and touching": {"alpha": 0.45},
    "forward alone": {"alpha": 0.7},
    "of the paper": {"alpha": 1.2},
    "without contact": dict(
        alpha=2.1531, omega=1.7811, delta=1.1068, zeta=0.4784, beta=8.526, gamma=6.5909
    ),
    "never sticking": {"alpha": 1.9},
    "never sticking, hardly a gap": dict(
        alpha=3.4811, omega=0.9135, delta=0.0022, zeta=0.4869, beta=8.952, gamma=3.3457
    ),
    "a peak at a switch": dict(
        alpha=2.951, omega=2.075, delta=0.018, zeta=0.979, beta=3.501, gamma=0.129
    ),
    "slow": dict(alpha=2.762, omega=0.055, delta=0.046, zeta=0.049, beta=7.005, gamma=2.015),
    "two periods": dict(
        alpha=1.0693, omega=2.583, delta=0.1901, zeta=0.1519, beta=14.7854, gamma=8.5398
    ),
    "three periods": dict(alpha=2.96, omega=0.8, delta=0.5, zeta=0.01, beta=50.0, gamma=5.0),
    "undamped": {"alpha": 1.3, "zeta": 0.0, "delta": 0.3},
    "reaching a spring of no force": dict(
        alpha=0.8, omega=0.8, delta=0.3, zeta=0.05, beta=0.0, gamma=2.6
    ),
    "undamped, backward": {"alpha": 2.0, "zeta": 0.0, "gamma": 1.0},
    "another friction": {"alpha": 1.6, "f_b": 0.6},
}
BIFURCATIONS = {
    "grazing": 0.007375635565834309,
    "adding-sliding": 0.3687797241855779,
    "boundary-intersection crossing": 0.5245932427623312,
    "adding-sliding backward": 0.9409980034460779,
    "switching-sliding": 1.5218348031410691,
    "grazing-sliding": 1.5513978202818315,
    "crossing-sliding": 1.5886210774813494,
}
"""Amplitudes of the paper's case study, from its branch: what lies beside them is looked at."""


@lru_cache
def known(name: str) -> tuple[Orbit, Performances]:
    """The orbit that Python solves for, and what the core makes of the end of the same run."""
    p = cs.Parameters(**MOTIONS[name])
    run = cs.simulate(p, periods=400)
    motion = run.steady()
    assert motion is not None
    orbit = cs.solve_orbit(p, run.final[1], 0.0, 2 * motion.period_number + 1)
    assert orbit.success, orbit.message
    found = closed(p, run.final[1], motion.period_number)
    assert found.itinerary(0) == motion.itinerary
    return orbit, found


def closed(p: cs.Parameters, state: Any, period_number: int = 1) -> Performances:
    """All results of the core for a motion near a state."""
    found = cs.performance_many(row(p), state, period_number, gradients=True)
    assert found.status.tolist() == ["closed"]
    return found


def row(p: cs.Parameters) -> list[float]:
    return [*p.to_dict().values()]


ROUNDINGS = 64
"""Of a metric in double precision, in units of what the rounding of its numbers does to it."""


def check_values(found: Performances, expected: Performance, orbit: Orbit, most: int) -> None:
    """The metrics are off by no more than so many roundings of what they are made from."""
    # Ways forward and back make up the progression, and cancel where a motion is its own image.
    ways = expected.friction_loss.value / orbit.values[-1]
    sums = {"progression": ways, "velocity": ways / cs.Parameters(*map(float, orbit.values)).period}
    for value, name in zip(found.values[0], METRICS, strict=True):
        metric = getattr(expected, name)
        moved = zip(metric.gradient.values(), orbit.values, strict=True)
        size = max(abs(metric.value), sums.get(name, 0))
        condition = size + sum(abs(slope * value) for slope, value in moved)
        assert abs(value - metric.value) <= most * 2.0**-53 * condition, name


def off(found: Performances, expected: Performance, orbit: Orbit) -> float:
    """Largest difference of gradients, beside the largest number of each."""
    most = 0.0
    for gradient, name in zip(found.gradients[0], METRICS, strict=True):
        slopes = getattr(expected, name).gradient
        # Without a second spring |P| is as large on either side: two peaks, and only one of them
        # grows with that spring. Rounding chooses between them.
        defined = [
            not (name == "peak_force" and orbit.values[4] == 0 and k == "beta") for k in slopes
        ]
        expected_slopes = np.array([float(slope) for slope in slopes.values()])
        differences = abs(gradient - expected_slopes)[defined]
        most = max(most, differences.max() / (1 + abs(expected_slopes).max()))
    return most


@pytest.mark.parametrize("name", MOTIONS)
def test_metrics_gradients_and_multipliers_are_those_of_the_orbit(name: str) -> None:
    orbit, found = known(name)
    expected = cs.performance(orbit)  # in double precision too
    check_values(found, expected, orbit, 2 * ROUNDINGS)
    assert off(found, expected, orbit) < 1e-10
    multipliers = floquet_multipliers(orbit)
    # Those of a pair may be in either order, as may values of equal absolute value.
    np.testing.assert_allclose(
        np.sort_complex(found.multipliers[0]), np.sort_complex(multipliers), rtol=0, atol=1e-12
    )


def test_a_multiplier_is_exactly_zero_where_the_capsule_sticks_and_nowhere_else() -> None:
    for name in MOTIONS:
        orbit, found = known(name)
        sticks = bool({2, 5} & set(orbit.itinerary.fields))
        assert (found.multipliers[0, 2] == 0) == sticks, name
        assert abs(found.multipliers[0, 0]) < 1


@pytest.mark.long
@pytest.mark.parametrize("name", MOTIONS)
def test_they_are_those_of_the_orbit_in_50_digits(name: str) -> None:
    orbit, found = known(name)
    exact = orbit.refined()
    assert exact.success, exact.message
    expected = cs.performance(exact)
    check_values(found, expected, orbit, ROUNDINGS)
    assert off(found, expected, orbit) < 1e-11


def beside(kind: str, distance: float) -> tuple[Orbit, Performances]:
    """Python's orbit and the core's, at a distance in amplitude from a bifurcation."""
    p = cs.Parameters(alpha=BIFURCATIONS[kind] + distance)
    state = cs.simulate(p, periods=1500, keep="final").final[1]
    orbit = cs.solve_orbit(p, state, 0.0, 3)
    assert orbit.success, orbit.message
    return orbit, closed(p, state)


@pytest.mark.parametrize("distance", [-1e-6, -1e-9, 1e-9, 1e-6])
@pytest.mark.parametrize("kind", BIFURCATIONS)
def test_they_hold_beside_bifurcations(kind: str, distance: float) -> None:
    orbit, found = beside(kind, distance)
    expected = cs.performance(orbit)
    check_values(found, expected, orbit, 2 * ROUNDINGS)
    # A duration that vanishes like the root of the distance is divided by.
    assert off(found, expected, orbit) < 1e-13 / abs(distance) ** 0.5


def difference(orbit: Orbit, along: Any, step: Any, digits: str) -> np.ndarray:
    """Central differences of the metrics along a direction of the parameters."""
    ends = []
    for side in (1, -1):
        values = [v + side * step * d for v, d in zip(orbit.values, along, strict=True)]
        moved = solve_itinerary(values, orbit.itinerary, list(orbit.z), backend=digits)
        assert moved.success, moved.message
        found = cs.performance(moved)
        ends.append(np.array([getattr(found, name).value for name in METRICS]))
    return (ends[0] - ends[1]) / (2 * step)


@pytest.mark.long
@pytest.mark.parametrize("place", ["two periods", "of the paper", "grazing", "grazing-sliding"])
def test_gradients_are_differences_in_50_digits(place: str) -> None:
    """At regular points, and beside bifurcations within the itinerary that is new there."""
    new = {"grazing": 1e-6, "grazing-sliding": -1e-6}
    orbit, found = beside(place, new[place]) if place in new else known(place)
    with mp.workdps(60):
        along = np.array([mpf(i) / 5 - 1 for i in (1, 2, 3, 4, 6, 7, 8)])
        expected = difference(orbit, along, mpf("1e-18"), "mpmath").astype(float)
        slopes = found.gradients[0] @ along.astype(float)
    np.testing.assert_allclose(slopes, expected, rtol=1e-10, atol=1e-10)


def test_the_state_moves_as_its_derivatives_say() -> None:
    """From the core's own states at parameters to both sides."""
    for name in ("of the paper", "never sticking", "two periods"):
        orbit, found = known(name)
        values, periods = np.array(orbit.values), orbit.itinerary.period_number
        for k in range(7):
            step = 1e-5 * np.eye(7)[k]
            ends = cs.performance_many([values + step, values - step], found.states[0], periods)
            slope = (ends.states[0] - ends.states[1]) / 2e-5
            np.testing.assert_allclose(slope, found.by_parameter[0, :, k], rtol=1e-6, atol=1e-6)


def test_what_was_not_asked_for_is_not_computed() -> None:
    p = MOTIONS["of the paper"]
    state = known("of the paper")[1].states[0]
    rows = row(cs.Parameters(**p))
    bare = cs.performance_many(rows, state, energies=False, forces=False)
    assert np.isfinite([bare["velocity"], bare["progression"]]).all()
    assert np.isnan(bare.values[0, 2:]).all()
    assert np.isnan(bare.gradients).all()
    forces = cs.performance_many(rows, state, energies=False, gradients=True)
    assert np.isnan(forces.gradients[0, 2:5]).all()
    rest = ["velocity", "progression", "peak_force", "peak_contact"]
    assert np.isfinite(forces.gradients[0, [METRICS.index(name) for name in rest]]).all()


def test_many_rows_are_as_one_by_one() -> None:
    names = [name for name in MOTIONS if name != "three periods"]
    parts = [known(name) for name in names]
    found = cs.performance_many(
        [orbit.values for orbit, _ in parts],
        np.concatenate([one.states for _, one in parts]),
        [orbit.itinerary.period_number for orbit, _ in parts],
        gradients=True,
    )
    assert found.closed.all()
    assert len(found.of(found["progression"] > 0)) < len(found) == len(names)
    for i, (_, one) in enumerate(parts):
        np.testing.assert_allclose(found.values[i], one.values[0], rtol=1e-13, atol=1e-15)
        assert found.itinerary(i) == one.itinerary(0)


def test_a_state_far_away_is_closed_and_said_to_switch_otherwise() -> None:
    orbit, found = known("of the paper")
    far = cs.performance_many(orbit.values, (1.3358, 0.3703, -0.0298))
    assert far.status.tolist() == ["changed"]
    np.testing.assert_allclose(far.values, found.values, rtol=1e-13)
    assert not far.closed.any()


def test_a_period_number_too_large_is_noticed_and_one_too_small_leads_elsewhere() -> None:
    orbit, found = known("two periods")
    assert cs.performance_many(orbit.values, found.states, 4).status.tolist() == ["changed"]
    assert cs.performance_many(orbit.values, found.states, 6).status.tolist() == ["changed"]
    # The unstable orbit that the motion of two periods left.
    assert cs.performance_many(orbit.values, found.states, 1).status.tolist() == ["changed"]


def test_a_motion_that_is_not_periodic_is_not_closed() -> None:
    # Undamped rest: x_r = 0.1 cos h beside a period of 2 pi/0.77 is closed by no state but 0.
    p = cs.Parameters(alpha=0.0, omega=0.77, delta=0.5, zeta=0.0)
    found = cs.performance_many(row(p), (0.1, 0.0, 0.0))
    assert found.closed.tolist() == [True]
    np.testing.assert_allclose(found.states, 0, atol=1e-15)
    # At resonance with the excitation nothing brings a deviation back: a fold.
    p = cs.Parameters(alpha=0.0, omega=1.0, delta=0.5, zeta=0.0)
    found = cs.performance_many(row(p), (0.1, 0.0, 0.0), gradients=True)
    assert found.status.tolist() == ["not-converged"]
    # A run whose first period meets a guard at a tangency has no derivative.
    state = (0.54784675, -0.92085314, -1.8361059)
    found = cs.performance_many(row(cs.Parameters(alpha=1.1)), state)
    assert found.status.tolist() == ["tangential"]
    assert np.isnan(found.values).all()


def test_a_time_limit_stops_it() -> None:
    orbit, found = known("of the paper")
    rows = np.tile(orbit.values, (2000, 1))
    stopped = cs.performance_many(rows, found.states[0], max_seconds=1e-9)
    assert stopped.status[-1] == "stopped"
    assert np.isnan([stopped[name][-1] for name in ("work", "velocity", "progression")]).all()
    assert not stopped.closed[-1]
    assert (stopped.itinerary(-1), stopped.cycle(-1)) == ((), ())


def test_a_time_limit_stops_one_orbit_of_many_panels() -> None:
    p = cs.Parameters(alpha=0.01, omega=1e-6, delta=1.0, zeta=0.05)
    began = perf_counter()
    found = cs.performance_many(row(p), (0.01, 0.0, 0.0), max_seconds=0.05)
    assert perf_counter() - began < 10
    assert found.status.tolist() == ["stopped"]
    assert not found.closed.any()


@pytest.mark.long
@pytest.mark.parametrize("asked", ["energies", "forces"])
def test_an_orbit_that_would_take_days_stays_open(asked: str) -> None:
    p = cs.Parameters(alpha=0.01, omega=1e-6, delta=1.0, zeta=1e4)
    wish = {"energies": False, "forces": False, asked: True}
    found = cs.performance_many(row(p), (0.01, 0.0, 0.0), **wish)
    assert found.status.tolist() == ["open"]
    assert not found.closed.any()


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"parameters": [1.0, 2.0]}, "parameters"),
        ({"parameters": [1.2, -0.8, 0.02, 0.05, 1.5, 3.3, 1.0]}, "omega"),
        ({"states": [[1.0, 2.0]]}, "states"),
        ({"period_numbers": 0}, "period_numbers"),
        ({"period_numbers": 1.5}, "period_numbers"),
    ],
)
def test_bad_input_names_the_field(given: dict[str, Any], field: str) -> None:
    fine = {"parameters": row(cs.Parameters()), "states": (0.0, 0.0, 0.0)}
    with pytest.raises(cs.InvalidInput, match=field):
        cs.performance_many(**{**fine, **given})
    with pytest.raises(cs.InvalidInput, match="metric"):
        cs.performance_many(**fine)["speed"]
