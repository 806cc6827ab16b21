"""Whatever a run settles on is found as an orbit: random capsules, against the run itself."""

import numpy as np
import pytest
from numpy.typing import NDArray

import capsule_sym as cs

PERIODS = 2000
STEP = 1e-7  # of the differences
# alpha, omega, delta, zeta, beta, gamma
LOW, HIGH = (0.02, 0.3, 0.0, 0.005, 0.0, 0.3), (5.0, 3.0, 1.5, 0.2, 30.0, 10.0)

# Motions with a flight longer than an excitation period, and one with a period multiplier of -0.95,
# of which twice the turn repeats sooner.
FLIGHTS = {
    "two periods": cs.Parameters(0.1, 2.8, 0.0, 0.025, 3.0, 3.0),
    "two hits in two periods": cs.Parameters(0.76, 0.8, 1.26, 0.01, 29.0, 3.3, 1e6),
    "slides between flights": cs.Parameters(
        4.1455232343479365,
        2.803550197212714,
        0.4949617471725918,
        0.1147347896577122,
        4.850904031497997,
        3.1688536259328246,
    ),
    "alternating": cs.Parameters(
        4.274164338571364,
        2.666222277925314,
        0.8319970666697113,
        0.07495876403584673,
        20.603430075487317,
        8.223298218207631,
    ),
}


def random_capsules(count: int, seed: int) -> list[cs.Parameters]:
    """Capsules over the ranges of the battery; alpha and zeta by their logarithms."""
    low, high = np.array(LOW), np.array(HIGH)
    shares = np.random.default_rng(seed).random((count, 6))
    rows = low + shares * (high - low)
    for column in (0, 3):
        rows[:, column] = low[column] * (high[column] / low[column]) ** shares[:, column]
    return [cs.Parameters(*row) for row in rows.tolist()]


def differences(run: cs.results.Trajectory, motion: cs.results.SteadyMotion) -> NDArray[np.float64]:
    """The derivative of the map over the motion's periods, by central differences of runs.

    Where the capsule sticks at phase 0, that of (x_r, v_r): a deviation in v_c dies at once.
    """
    end = np.array(run.final[1], dtype=float)
    size = 2 if end[2] == 0 else 3
    columns = []
    for i in range(size):
        ends = []
        for side in (1, -1):
            state = end.copy()
            state[i] += side * STEP
            later = cs.simulate(run.parameters, state.tolist(), periods=motion.period_number)
            ends.append(np.array(later.final[1], dtype=float))
        columns.append((ends[0] - ends[1])[:size] / (2 * STEP))
    return np.array(columns).T


def check(parameters: cs.Parameters) -> bool:
    """True if a run settles; its motion then has to be the orbit found."""
    run = cs.simulate(parameters, periods=PERIODS)
    motion = run.steady()
    if motion is None:
        return False
    orbit = cs.solve_orbit(parameters, periods=PERIODS)
    assert orbit.success, orbit.message
    assert cs.orbits.is_admissible(orbit)
    assert orbit.itinerary.rotated(orbit.itinerary.first).names == motion.itinerary, parameters
    assert orbit.itinerary.period_number == motion.period_number, parameters
    assert float(orbit.progression) == pytest.approx(motion.progression, abs=1e-7), parameters
    matrix, values = differences(run, motion), cs.orbits.floquet_multipliers(orbit)
    # Sum and product, and not the multipliers themselves, which may be double.
    assert np.trace(matrix) == pytest.approx(values.sum().real, abs=1e-5), parameters
    if len(matrix) == 2:
        assert values[2] == 0
        values = values[:2]
    assert np.linalg.det(matrix) == pytest.approx(np.prod(values).real, abs=1e-5), parameters
    return True


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_motion_with_long_flights_is_found(name: str) -> None:
    assert check(FLIGHTS[name])
    orbit = cs.solve_orbit(FLIGHTS[name])
    flight = max(float(h) for h in orbit.durations) / orbit.parameters.period
    assert flight > 1 or name == "alternating"


def test_what_a_few_random_runs_settle_on_is_found() -> None:
    assert sum(map(check, random_capsules(12, seed=7))) >= 11


@pytest.mark.long
def test_whatever_random_runs_settle_on_is_found() -> None:
    assert sum(map(check, random_capsules(250, seed=1))) >= 240


def test_not_found_names_what_was_tried() -> None:
    # Undamped and without contact the response keeps its beat for ever.
    parameters = cs.Parameters(alpha=0.3, omega=0.77, delta=5.0, zeta=0.0, f_b=10.0)
    found = cs.solve_orbit(parameters, periods=100)
    assert not found.success
    assert found.status is cs.results.Status.NOT_PERIODIC
    assert "the run from (0.0, 0.0, 0.0) at phase 0.0 has not settled within 100" in found.message
    assert "on a motion of at most 16; tried F2 over 1" in found.message
    assert "\n" not in found.message


def test_a_run_too_short_for_a_switch_is_typed() -> None:
    found = cs.solve_orbit(cs.Parameters(alpha=0.01, delta=1.0), periods=1)
    assert not found.success
    assert "repeats no itinerary" in found.message
