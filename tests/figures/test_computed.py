"""Motions and branches that figures draw: each is computed once in a process."""

from __future__ import annotations

import json

import pytest

from capsule_sym import InvalidInput, Parameters, simulate
from capsule_sym._figures.arcs import cycle
from capsule_sym._figures.computed import (
    branch_from_rest,
    followed,
    orbit_of,
    steady_run,
)


def test_a_run_is_steady_and_found_again() -> None:
    parameters = Parameters(alpha=0.7, gamma=3.0)
    motion = steady_run(parameters)
    assert (motion.parameters, motion.final[0].period) == (parameters, 4)
    assert motion.steady() is not None
    assert steady_run(Parameters(alpha=0.7, gamma=3.0)) is motion


SLOW = Parameters(alpha=0.405, zeta=0.02)  # a run from rest needs more than 4,096 periods
DOUBLED = Parameters(alpha=0.4, zeta=0.01)  # a motion of two excitation periods
RESTLESS = Parameters(alpha=0.0074, zeta=0.0)  # without damping nothing fades


def test_a_slow_motion_is_closed_by_newton() -> None:
    last = simulate(SLOW, periods=4096)
    assert last.steady() is None
    motion = steady_run(SLOW)
    # The drawn motion repeats, and lies at the end of the run from rest.
    assert motion.steady().itinerary == ("F5", "F4", "F5", "F2")
    assert motion.final[1] == pytest.approx(motion.stroboscopic[0], abs=1e-12)
    assert motion.final[1] == pytest.approx(last.final[1], abs=1e-3)


def test_a_motion_of_two_periods_is_steady_when_it_is_drawn() -> None:
    assert steady_run(DOUBLED).steady().period_number == 2


def test_a_motion_that_is_not_periodic_is_kept_as_it_is() -> None:
    motion = steady_run(RESTLESS)
    assert motion.success
    assert motion.steady() is None
    assert motion.final[0].period >= 16


def test_orbits_come_back_from_the_record(branch) -> None:
    one = branch["bifurcations"][4]
    orbit = orbit_of(json.loads(json.dumps(one)))
    assert orbit.residual < 1e-12
    assert orbit.average_velocity == pytest.approx(one["average_velocity"], rel=1e-12)
    assert list(orbit.itinerary.names) == one["orbit"]["itinerary"]
    begin, end = cycle(orbit)[0], cycle(orbit)[-1]
    assert begin.x_r[0] == pytest.approx(end.x_r[-1], abs=1e-12)


@pytest.mark.long
def test_a_branch_begins_where_a_run_from_rest_becomes_periodic() -> None:
    # Without damping a small excitation leaves a free oscillation for ever, without contact, that
    # repeats with the forcing after 77 periods; a large one does not.
    system = Parameters(zeta=0, omega=0.77)
    values = [p["value"] for p in branch_from_rest(system, "alpha", (0.002, 2.0), 10)["points"]]
    assert (values[0], values[-1]) == (2.0, 0.002)
    named = r"either end \(alpha = 0.002: .*; alpha = 0.003: .*\)"
    with pytest.raises(InvalidInput, match=named):
        followed(system, "alpha", (0.002, 0.003), 10)


def test_stroboscopic_states_of_a_branch_are_those_of_its_motions(branch) -> None:
    point = min(branch["points"], key=lambda one: abs(one["value"] - 1.2))
    motion = steady_run(Parameters(alpha=point["value"], gamma=3.0))
    assert point["stroboscopic"][0] == pytest.approx(motion.stroboscopic[0], abs=1e-8)
