"""Search for orbits: coexisting attractors against a grid of initial states, unstable orbits."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import capsule_sym as cs
from capsule_sym._orbits.shooting import search
from capsule_sym.orbits import floquet_multipliers, is_admissible, solve_itinerary, tightest
from capsule_sym.results import Itinerary, Orbit, Status
from tests.finals import final_states, parameter_rows

# Three capsules with more than one attractor, and the period period_numbers of these.
MULTISTABLE = {
    "rest beside drift": (
        cs.Parameters(alpha=1.2, omega=1.5, delta=2.0, beta=50.0, gamma=5.0),
        [1, 1],
    ),
    "one period beside three": (
        cs.Parameters(alpha=2.96, omega=0.8, delta=0.5, zeta=0.01, beta=50.0, gamma=5.0),
        [1, 3],
    ),
    "forward beside backward": (
        cs.Parameters(alpha=2.8, omega=0.4, delta=0.02, zeta=0.01, beta=5.0, gamma=5.0),
        [1, 1],
    ),
}
REACH = 3.0  # the grid covers (-REACH, REACH) in x_r and in v_r, with the capsule at rest


def stroboscopic(orbit: Orbit) -> NDArray[np.float64]:
    """States of an orbit at phase 0, one for each of its excitation periods."""
    start, phase = list(orbit.z[:3]), orbit.z[3] / orbit.parameters.omega
    period_number = orbit.itinerary.period_number
    run = cs.simulate(orbit.parameters, start, phase % orbit.parameters.period, period_number)
    return np.array(run.stroboscopic[-period_number:], dtype=float)


def attractors_missed(parameters: cs.Parameters, orbits: list[Orbit], size: int) -> list[int]:
    """Number of states of a grid that reach each orbit, and at last of those that reach none."""
    line = np.linspace(-REACH, REACH, size)
    x_r, v_r = (values.ravel() for values in np.meshgrid(line, line))
    states = np.stack([x_r, v_r, np.zeros_like(x_r)], axis=1)
    rows = np.repeat(parameter_rows(parameters), len(states), axis=0)
    final = final_states(rows, states, 0.0, 250).states
    left = np.ones(len(states), dtype=bool)
    counts = []
    for orbit in orbits:
        marks = stroboscopic(orbit)
        near = abs(final[:, None, :] - marks[None, :, :]).max(axis=2).min(axis=1) < 1e-8
        counts.append(int(near.sum()))
        left &= ~near
    return [*counts, int(left.sum())]


def stable(orbits: tuple[Orbit, ...]) -> list[Orbit]:
    return [orbit for orbit in orbits if abs(floquet_multipliers(orbit)[0]) < 1]


@pytest.mark.long
@pytest.mark.parametrize("name", MULTISTABLE)
def test_every_attractor_of_a_fine_grid_is_found(name: str) -> None:
    parameters, period_numbers = MULTISTABLE[name]
    found = stable(cs.search_orbits(parameters, 30))
    assert [orbit.itinerary.period_number for orbit in found] == period_numbers
    *counts, missed = attractors_missed(parameters, found, 100)
    assert missed == 0
    assert min(counts) > 100


def test_every_attractor_of_a_coarse_grid_is_found() -> None:
    parameters, period_numbers = MULTISTABLE["rest beside drift"]
    found = stable(cs.search_orbits(parameters, 12))
    assert [orbit.itinerary.period_number for orbit in found] == period_numbers
    assert attractors_missed(parameters, found, 12)[-1] == 0
    # With one attractor withheld the grid shows it.
    assert attractors_missed(parameters, found[:1], 12)[-1] > 10


def test_the_unstable_orbit_between_two_attractors_is_found() -> None:
    parameters, _ = MULTISTABLE["rest beside drift"]
    orbits = cs.search_orbits(parameters, 12)
    (saddle,) = set(orbits) - set(stable(orbits))
    values = floquet_multipliers(saddle)
    assert abs(values[0]) > 1 > abs(values[1])
    # Started on it, the map stays for a while, and then leaves by the unstable direction.
    state = stroboscopic(saddle)[0]
    soon, late = (cs.simulate(parameters, state.tolist(), periods=n).final[1] for n in (3, 200))
    assert np.max(abs(np.array(soon) - state)) < 1e-11
    assert np.max(abs(np.array(late) - state)) > 0.1


def test_orbits_are_found_once_and_the_same_every_time() -> None:
    parameters, _ = MULTISTABLE["rest beside drift"]
    one, two = (cs.search_orbits(parameters, 6, period_numbers=(1, 2, 4), seed=3) for _ in range(2))
    assert [orbit.z.tolist() for orbit in one] == [orbit.z.tolist() for orbit in two]
    assert [str(orbit.itinerary) for orbit in one].count("F2") == 1
    assert all(orbit.residual <= 1e-13 for orbit in one)


def test_a_transient_of_more_than_a_million_segments_ends_at_phase_0(monkeypatch) -> None:
    runs = list[cs.results.Trajectory]()

    def simulate(*given: Any, **named: Any) -> cs.results.Trajectory:
        runs.append(cs.simulate(*given, **named))
        return runs[-1]

    monkeypatch.setattr(search, "simulate", simulate)
    # Each period has the four segments F5 F4 F1 F2.
    cs.search_orbits(cs.Parameters(alpha=0.9), 1, period_numbers=(1,), transient=250_001)
    assert all(run.success for run in runs)
    assert {float(run.final[0].phase) for run in runs} == {0.0}


def test_progress_is_reported() -> None:
    told: list[tuple[int, int]] = []
    cs.search_orbits(
        cs.Parameters(), 3, period_numbers=(1,), report=lambda *state: told.append(state)
    )
    assert [done for done, _ in told] == [1, 2, 3]


def test_two_motions_are_found_from_their_own_starts() -> None:
    parameters, _ = MULTISTABLE["forward beside backward"]
    forward, backward = (cs.solve_orbit(parameters, s) for s in ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert forward.success, forward.message
    assert backward.success, backward.message
    assert {forward.progression > 0, backward.progression > 0} == {True, False}


def test_motion_of_three_periods_is_found_as_one() -> None:
    parameters, _ = MULTISTABLE["one period beside three"]
    found = {
        cs.solve_orbit(parameters, (x, 0.0, 0.0)).itinerary.period_number
        for x in (-1.0, 0.0, 1.0, 2.0)
    }
    assert found == {1, 3}


def test_a_run_that_stops_early_is_read_as_no_orbit() -> None:
    parameters = cs.Parameters(alpha=0.9)
    state = cs.simulate(parameters, periods=50, keep="final").final[1]
    assert cs.orbits.orbit_at(parameters, state, 3) is not None
    # The run ends after 10^6 segments, which are no period of an orbit.
    assert cs.orbits.orbit_at(parameters, state, 10**12) is None


def test_run_too_short_to_settle_is_typed() -> None:
    found = cs.solve_orbit(
        cs.Parameters(alpha=2.9, omega=3.0, delta=0.2, zeta=0.0, beta=50.0), periods=8
    )
    assert not found.success
    assert found.status in (Status.NOT_PERIODIC, Status.NOT_CONVERGED)
    assert found.message


def test_word_beyond_its_bifurcation_is_typed_with_the_inequality_that_fails() -> None:
    """Above alpha = 0.3688 the force on the sticking capsule exceeds its bound."""
    below = cs.solve_orbit(cs.Parameters(alpha=0.36))
    assert below.success, below.message
    assert str(below.itinerary) == "F5 F2"
    given = below.itinerary, list(below.z)
    assert is_admissible(solve_itinerary(cs.Parameters(alpha=0.362), *given))
    beyond = solve_itinerary(cs.Parameters(alpha=0.4), *given)
    assert beyond.success
    assert not is_admissible(beyond)
    assert tightest(beyond).named(beyond.itinerary) == "minimum of upper in segment 1, F5"
    assert tightest(beyond).value < 0


def test_stick_beyond_the_grazing_is_typed() -> None:
    """The forced response reaches the second spring where its amplitude is the gap."""
    beyond = solve_itinerary(cs.Parameters(alpha=0.0075), Itinerary.parse("2"))
    assert not is_admissible(beyond)
    assert tightest(beyond).named(beyond.itinerary).startswith("minimum of gap")
