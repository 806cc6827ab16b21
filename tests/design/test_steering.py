"""Ways between the best drives: driven slowly by the map itself, and where they are broken."""

import json

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, SteeringStatus, simulate, steer
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
    assert one.by is None
    assert 0.68 < one.at["omega"] < 0.682
    assert "boundary-intersection crossing on L7" in one.why
    # There the map leaves the orbits that come from the forward drive.
    state = tuple(simulate(found.forward.system, periods=200).final[1])
    velocities = []
    for omega in (one.at["omega"] + 1e-3, one.at["omega"] - 1e-3):
        for step in np.linspace(found.forward.over["omega"], omega, 25):
            run = simulate(Parameters(alpha=1.0, zeta=0.01, omega=float(step)), state, periods=60)
            state = tuple(run.final[1])
        further = simulate(run.parameters, state, periods=200)
        velocities.append(float(further.advance) / (200 * run.parameters.period))
    assert abs(velocities[0] - velocities[1]) > 0.05


def test_where_the_capsule_goes_one_way_only_that_is_said() -> None:
    found = steer(Parameters(), {"alpha": (0.6, 0.8)}, samples=4)
    assert found.status is SteeringStatus.ONE_WAY
    assert "only goes forward" in found.message
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
