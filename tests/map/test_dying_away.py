"""Motions without forcing that die away on the impact surface, switching for ever."""

import math

import pytest

from capsule_sym import Parameters, results, simulate
from capsule_sym._map.backend import default_backend

OFF_REST = (0.5, 0.3, -0.2)
BACKENDS = sorted({default_backend(), "numpy"})


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("delta", "field"), [(0.0, "F5"), (1e-300, "F2")])
def test_what_has_died_away_is_rest(backend: str, delta: float, field: str) -> None:
    """At delta = 0 both fields meet at rest, and the region with contact is the closed one."""
    parameters = Parameters(alpha=0, delta=delta, zeta=0.3)
    run = simulate(parameters, OFF_REST, periods=20, backend=backend)
    assert len([s for s in run.segments if s.start.period >= 10]) > 5  # it switches on
    motion = run.steady()
    assert motion is not None
    assert (motion.itinerary, motion.period_number, motion.progression) == ((field,), 1, 0)
    assert motion.global_map == f"Id_{{Σ{field[1]},{field},Σ{field[1]}}}"
    (segment,) = motion.segments
    assert segment.start_state == segment.end_state == (0, 0, 0)
    assert segment.duration == parameters.period
    assert segment.position == run.advance
    at_rest = simulate(parameters, periods=2, backend=backend).steady()
    assert at_rest is not None
    assert at_rest.global_map == motion.global_map


def test_rest_is_not_claimed_before_it_is_within_the_tolerance() -> None:
    run = simulate(Parameters(alpha=0, delta=0), OFF_REST, periods=10)
    assert run.steady() is None
    # Twice the energy, which bounds what is to come: so near to rest it is, and no nearer.
    x_r, v_r, _ = run.final[1]
    size = math.hypot(x_r, v_r, math.sqrt(1.5) * max(0.0, x_r))
    assert run.steady(1.01 * size) is not None
    assert run.steady(0.99 * size) is None


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
