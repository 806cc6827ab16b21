"""The way downhill along limits: it ends where starts lead elsewhere, or at the best of a limit."""

import numpy as np
import pytest

from capsule_sym import Parameters, optimise, performance_many, simulate_many
from capsule_sym._design.optimise import program_of
from capsule_sym._design.program import Place, Program
from capsule_sym._design.slide import room, slid

pytestmark = pytest.mark.long

REST = ((0.0, 0.0, 0.0),)


def place(base: Parameters, over: dict, limits: list[str], at: dict) -> tuple[Program, Place]:
    program = program_of("speed", over, base, True, limits, None, REST, None)
    found = program.begin(program.u_of(base.replace(**at)))
    assert found is not None
    return program, found


def speed(system: Parameters) -> float:
    """Speed of the motion of period 1 on which a long run from rest ends; nan if it does not."""
    row = np.array([[*system.to_dict().values()]])
    run = simulate_many(row, REST[0], periods=4096)
    found = performance_many(row, run.states)
    near = abs(found.states - run.states).max() < 1e-6
    return abs(float(found["velocity"][0])) if near else np.nan


def test_a_way_ends_at_the_boundary_of_the_basin() -> None:
    base, over = Parameters(zeta=0.02, beta=10.0), {"alpha": (0.2, 3.0), "omega": (0.3, 2.5)}
    program, first = place(base, over, ["peak_force <= 8.2635"], {"alpha": 1.78, "omega": 0.974})
    end = slid(program, first)
    here = program.system_at(end.u)
    assert speed(here) == pytest.approx(-end.worst, rel=1e-9)
    assert -end.worst > -first.worst + 1e-3
    assert not end.beyond
    assert room(end) == 1
    uphill = end.u - first.u
    beyond = end.u + 1e-5 * uphill / np.linalg.norm(uphill)
    assert speed(program.system_at(beyond)) != pytest.approx(-end.worst, rel=1e-3)


def test_a_way_follows_a_limit_to_its_best() -> None:
    over, limit = {"alpha": (0.3, 2.0), "omega": (0.6, 1.2)}, ["peak_force <= 3"]
    program, first = place(Parameters(), over, limit, {"alpha": 0.6, "omega": 0.8})
    end = slid(program, first)
    assert abs(end.slacks).max() < 1e-8
    assert room(end) == 0
    best = optimise("speed", over, subject_to=limit, samples=64)
    assert best.value > -first.worst + 1e-3
    assert -end.worst == pytest.approx(best.value, rel=1e-5)
