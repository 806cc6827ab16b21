"""Orbits and branches at extreme parameters: weak friction, rapid forcing, large forces."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import capsule_sym as cs
from capsule_sym._orbits.continuation import path
from capsule_sym._orbits.shooting.search import endings

pytestmark = pytest.mark.long

_ROUGH = {"alpha": 1.2, "omega": 0.8, "zeta": 0.05, "beta": 1.5, "gamma": 3.3}


def progression_without_friction(delta: float, steps: int = 2000, periods: int = 60) -> float:
    """Progression of the motion that the least friction selects, by the classical Runge-Kutta rule.

    Without friction the relative motion does not know of the velocity of the capsule, of which the
    mean is free. A friction that is small beside the force of the spring turns that mean until the
    capsule moves forward half of the time.
    """
    alpha, omega, zeta, beta, gamma = _ROUGH.values()
    h = math.tau / omega / steps

    def rates(state: np.ndarray, time: float) -> np.ndarray:
        x, v, _ = state
        force = x + 2 * zeta * v + beta * max(x - delta, 0.0)
        drive = alpha * math.cos(omega * time)
        return np.array([v, drive - (gamma + 1) / gamma * force, force / gamma])

    state, velocities = np.zeros(3), np.zeros(steps)
    for k in range(periods * steps):
        velocities[k % steps] = state[2]
        time = k % steps * h
        one = rates(state, time)
        two = rates(state + h / 2 * one, time + h / 2)
        three = rates(state + h / 2 * two, time + h / 2)
        four = rates(state + h * three, time + h)
        state = state + h / 6 * (one + 2 * two + 2 * three + four)
    # As a curve through the samples, of which the last is the first of the next period.
    curve = CubicSpline(np.arange(steps + 1), [*velocities, velocities[0]], bc_type="periodic")

    def ahead(mean: float) -> float:
        crossings = curve.solve(mean, extrapolate=False)
        (first, second) = crossings[(crossings > 0) & (crossings < steps)]
        between = second - first
        return float((between if curve((first + second) / 2) > mean else steps - between) / steps)

    low, high = velocities.min(), velocities.max()
    middle = brentq(lambda mean: ahead(mean) - 0.5, 0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high)
    return float((curve.integrate(0, steps) / steps - middle) * math.tau / omega)


@pytest.mark.parametrize(("size", "friction"), [(1.0, 1e-9), (1e6, 1e-6)])
def test_a_motion_that_weak_friction_brakes_is_found(size: float, friction: float) -> None:
    """The run from rest comes nearer by a part of 10^-9 or 10^-6 in an excitation period."""
    far = cs.Parameters(**_ROUGH | {"alpha": 1.2 * size}, delta=0.02 * size, f_b=friction * size)
    found = cs.solve_orbit(far)
    assert found.success, found.message
    # The least friction's progression, below; this friction's differs by some part of it, and what
    # double precision has it up to the rounding over the friction.
    near = 4 * friction + 3e-6
    assert found.progression / size == pytest.approx(-0.262241, abs=near + 2.0**-48 / friction)
    assert found.refined().progression / size == pytest.approx(-0.262241, abs=near)
    assert 1 - 3 * friction < abs(found.multipliers[0]) < 1 - friction


def test_weak_friction_turns_the_capsule_forward_half_of_the_time() -> None:
    assert progression_without_friction(0.02) == pytest.approx(-0.262241, abs=3e-6)


def test_what_repeats_in_one_period_is_not_tried_in_several() -> None:
    """Newton's method on 144 segments took seconds, beside milliseconds on 9."""
    creeping = cs.simulate(cs.Parameters(alpha=1.2242, omega=0.8659, beta=10.0), periods=64)
    assert [one.itinerary.period_number for one in endings(creeping)] == [1]


def test_a_motion_under_rapid_forcing_is_closed() -> None:
    """Its shortest segment takes 1e-5: derivatives by durations had no digit at such a rate."""
    rapid = cs.Parameters(omega=1e3, alpha=1e4)
    settled = cs.simulate(rapid, periods=60_000, keep="final").final[1]
    found = cs.solve_orbit(rapid, settled)
    assert found.success, found.message
    passed = [one.field for one in cs.simulate(rapid, settled, periods=2).segments]
    assert found.itinerary.fields in [tuple(passed[k : k + 4]) for k in range(4)]


def test_a_branch_goes_on_to_a_large_force() -> None:
    branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=100.0)), "alpha", 1e4)
    assert branch.status is cs.results.Status.REACHED, branch.message
    # Far away the gap and the friction count for nothing: the motion grows with the force.
    last, scaled = branch.points[-1].orbit, cs.Parameters(alpha=1.0, delta=2e-6, f_b=1e-4)
    assert last.progression / 1e4 == pytest.approx(cs.solve_orbit(scaled).progression, rel=1e-9)


@pytest.mark.parametrize(("parameter", "to"), [("alpha", 1e6), ("omega", 1e-3)])
def test_a_branch_goes_on_far_away(parameter: str, to: float) -> None:
    branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters()), parameter, to)
    assert branch.status is cs.results.Status.REACHED, branch.message


def test_steps_grow_with_the_period_of_slow_forcing(monkeypatch) -> None:
    start = cs.solve_orbit(cs.Parameters())
    branch = cs.continue_orbit(start, "omega", 0.01)
    assert branch.status is cs.results.Status.REACHED
    # Of 0.2 beside durations of hundreds there would be 560.
    assert sum(point.value < 0.05 for point in branch.points) < 300
    assert cs.orbits.is_admissible(branch.points[-1].orbit)
    # Larger steps pass the same events.
    monkeypatch.setattr(path, "_LARGEST_SHARE", 0.05)
    again = cs.continue_orbit(start, "omega", 0.01)
    assert len(again.points) < len(branch.points)
    events = [[(one.type, round(one.value, 9)) for one in b.bifurcations] for b in (branch, again)]
    assert events[0] == events[1]
