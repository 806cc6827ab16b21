"""Motions without forcing that die away on the impact surface, switching for ever."""

import pytest

from capsule_sym import Parameters, results, simulate
from capsule_sym._map.backend import default_backend

OFF_REST = (0.5, 0.3, -0.2)
BACKENDS = sorted({default_backend(), "numpy"})


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_from_rest_rests(backend: str) -> None:
    parameters = Parameters(alpha=0, delta=0.1, zeta=0.3)
    run = simulate(parameters, periods=2, backend=backend)
    motion = run.steady()
    assert motion is not None
    assert (motion.itinerary, motion.period_number, motion.progression) == (("F2",), 1, 0)
    assert motion.global_map == "Id_{Σ2,F2,Σ2}"
    (segment,) = motion.segments
    assert segment.start_state == segment.end_state == (0, 0, 0)
    assert segment.duration == parameters.period


def test_undamped_motion_is_not_rest() -> None:
    assert simulate(Parameters(alpha=0, delta=0, zeta=0), OFF_REST, periods=50).steady() is None


def test_a_force_that_can_still_move_the_capsule_is_not_rest() -> None:
    weak = Parameters(alpha=0, delta=0, zeta=0, f_b=1e-3)
    run = simulate(weak, (0.0, 2e-3, 0.0), phase=0.0, periods=1, max_segments=2000)
    assert len({s.field for s in run.segments}) > 2  # it slips
    motion = simulate(weak, (0.0, 0.9e-3, 0.0), periods=20).steady(1e-2)
    assert motion is None or motion.itinerary != ("F5",)


@pytest.mark.parametrize("zeta", [0.3, 1.0])
def test_a_motion_that_has_died_away_beyond_what_doubles_hold_rests(zeta: float) -> None:
    run = simulate(Parameters(alpha=0, delta=0, zeta=zeta), OFF_REST, periods=400)
    assert run.success
    assert run.final[1] == (0, 0, 0)
    assert run.segments[-1].outcome is results.Outcome.END
    assert run.segments[-1].duration > 100
