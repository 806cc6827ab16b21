"""Ways between the best drives: driven slowly by the map itself, and where they are broken."""

import json
from itertools import pairwise

import numpy as np
import pytest

from capsule_sym import (
    InvalidInput,
    Parameters,
    Steering,
    SteeringStatus,
    simulate,
    simulate_many,
    steer,
)
from tests.design.clock import LIMIT, Clock


def test_the_map_itself_goes_the_way_that_was_found() -> None:
    found = steer(Parameters(alpha=2.0), {"omega": (0.65, 0.8)}, samples=8)
    assert found.success
    assert found.forward.value > 0.2
    assert found.backward.value < -0.2
    assert len(found.path) == 2
    columns = found.columns
    assert max(columns["largest_multiplier"]) < 1
    assert np.sign(columns["velocity"][0]) == -np.sign(columns["velocity"][-1])
    begin, end = (drive["omega"] for drive in found.path)
    state = tuple(simulate(found.forward.system, periods=100).final[1])
    for omega in np.linspace(begin, end, 25):
        run = simulate(Parameters(alpha=2.0, omega=float(omega)), state, periods=60)
        state = tuple(run.final[1])
    motion = run.steady()
    assert motion is not None
    velocity = float(motion.progression) * run.parameters.omega / (2 * np.pi)
    assert velocity == pytest.approx(found.backward.value, rel=1e-6)
    assert json.loads(json.dumps(found.to_dict()))["status"] == "connected"
    assert len(found.to_dataframe()) == found.statistics["points"]
    assert "connected" in repr(found)


def test_a_broken_way_is_told_with_its_bifurcation() -> None:
    found = steer(Parameters(alpha=1.0, zeta=0.01), {"omega": (0.66, 0.705)}, samples=16)
    assert found.status is SteeringStatus.BROKEN
    assert not found.success
    (one,) = found.breaks
    assert one.by == ()
    assert 0.679 < one.at["omega"] < 0.681
    assert "fold of F5 F4 F1 F2 F5 F2 F3 F6" in one.why
    # There the map leaves the orbits that come from the forward drive.
    state = tuple(simulate(found.forward.system, periods=200).final[1])
    velocities = []
    for omega in (one.at["omega"] + 1e-4, one.at["omega"] - 1e-4):
        for step in np.linspace(found.forward.over["omega"], omega, 25):
            run = simulate(Parameters(alpha=1.0, zeta=0.01, omega=float(step)), state, periods=60)
            state = tuple(run.final[1])
        further = simulate(run.parameters, state, periods=200)
        velocities.append(float(further.advance) / (200 * run.parameters.period))
    assert abs(velocities[0] - velocities[1]) > 0.05


def driven(found: Steering, steps: int) -> float:
    """The velocity at the end of a path, by runs of the map alone while the drive changes."""
    base, state = found.forward.system, (0.0, 0.0, 0.0)
    drives = np.array([[*drive.values()] for drive in found.path])
    ways = [np.linspace(a, b, steps) for a, b in pairwise(drives)]
    for drive in (drives[0], drives[0], *np.vstack(ways), drives[-1]):
        system = base.replace(**dict(zip(found.names, drive.tolist(), strict=True)))
        state = tuple(simulate_many([system], state, periods=100).states[0])
    motion = simulate(system, state, periods=64).steady()
    assert motion is not None
    return float(motion.progression) * system.omega / (2 * np.pi)


@pytest.mark.long
def test_a_way_is_found_over_a_grid_where_straight_ones_and_corners_are_broken() -> None:
    found = steer(Parameters(delta=0.249, zeta=0.045, beta=7.78, gamma=0.95))
    assert found.success
    assert len(found.path) > 3
    assert len(found.breaks) >= 3
    assert all("fold" in one.why for one in found.breaks)
    assert max(found.columns["largest_multiplier"]) < 1
    assert driven(found, 40) == pytest.approx(found.backward.value, rel=1e-6)


@pytest.mark.long
def test_a_broken_way_says_what_was_tried_and_where_each_path_is_broken() -> None:
    found = steer(Parameters(delta=0.312, zeta=0.075, beta=17.32, gamma=4.05))
    assert found.status is SteeringStatus.BROKEN
    assert "drives of a grid" in found.message
    assert len(found.breaks) >= 4
    base, begin, end = found.forward.system, found.forward.over, found.backward.over
    for one in found.breaks:
        drives = [
            {name: a[name] + share * (b[name] - a[name]) for name in a}
            for a, b in pairwise([begin, *one.by, end])
            for share in np.linspace(0.0, 1.0, 200)
        ]
        near = min(
            range(len(drives)), key=lambda i: max(abs(drives[i][k] - one.at[k]) for k in end)
        )
        state, velocities = tuple(simulate(base, periods=300).final[1]), []
        for drive in drives[: near + 3]:
            run = simulate(base.replace(**drive), state, periods=40)
            state = tuple(run.final[1])
            velocities.append(float(run.advance) / (40 * run.parameters.period))
        jumps = abs(np.diff(velocities))
        assert jumps[near - 3 :].max() > 0.02  # the map leaves the motion there, not before
        assert jumps[: near - 3].max() < 0.02


def test_where_the_capsule_goes_one_way_only_that_is_said() -> None:
    found = steer(Parameters(), {"alpha": (0.6, 0.8)}, samples=4)
    assert found.status is SteeringStatus.ONE_WAY
    assert "only moves forward" in found.message
    assert found.path == ()


def test_a_stretch_is_followed_in_as_many_steps_as_asked_for() -> None:
    given = Parameters(alpha=2.0), {"omega": (0.65, 0.8)}
    few, many = (steer(*given, samples=8, points=n).statistics["points"] for n in (20, 60))
    assert 60 <= many > few + 20
    with pytest.raises(InvalidInput, match="points = 0"):
        steer(points=0)


def test_a_drive_by_the_gap_is_refused() -> None:
    with pytest.raises(InvalidInput) as caught:
        steer(Parameters(), {"delta": (0.0, 1.0)})
    assert caught.value.field == "over"


@pytest.mark.parametrize("at", ["survey", "the way between the drives"])
def test_steering_that_is_out_of_time_leaves_the_drives_that_were_found(monkeypatch, at) -> None:
    clock = Clock(monkeypatch, at)
    given = Parameters(alpha=2.0), {"omega": (0.65, 0.8)}
    found = steer(*given, samples=8, max_seconds=LIMIT, progress=clock.progress)
    assert (found.status, found.success, found.path) == ("time-limit", False, ())
    if at != "survey":
        assert found.forward.success
        assert found.backward.success
        assert found.forward.value > 0.2
        assert found.backward.value < -0.2
