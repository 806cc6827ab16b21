"""Steady motions that drift, and those that only seem to."""

import numpy as np
import pytest

from capsule_sym import Parameters, scenes, simulate, solve_orbit
from capsule_sym._map.steady import shown_progression

RESONANT = Parameters(alpha=5.0, omega=0.8, delta=1e3, zeta=0.0, gamma=1 / (1.6**2 - 1))
"""Without damping, the slipping capsule on its spring swings freely twice per excitation period."""


def advance_of_last_half(parameters: Parameters, state: tuple[float, float, float]) -> float:
    """Advance per excitation period over the last 60 of 120 periods."""
    run = simulate(parameters, state, periods=120)
    ends = run(np.array([run.span[1] / 2, run.span[1]]), position=True)[:, 3]
    return float(ends[1] - ends[0]) / 60


@pytest.mark.parametrize("zeta", [0.0, 0.1])
def test_without_damping_a_free_swing_keeps_a_motion_without_contact_drifting(zeta: float) -> None:
    parameters, state = RESONANT.replace(zeta=zeta), (1.0, -0.5, 2.0)
    motion = simulate(parameters, state, periods=120).steady()
    assert motion is not None
    assert motion.itinerary == ("F1", "F3")
    if zeta:
        assert shown_progression(motion) == 0.0
        return
    advance = advance_of_last_half(parameters, state)
    assert abs(advance) > 0.1
    assert shown_progression(motion) == pytest.approx(advance, rel=1e-6)
    assert repr(motion).endswith(f", progression {advance:.6g}>")


def test_contact_is_told_by_the_field_and_not_by_what_its_mode_is_called(monkeypatch) -> None:
    drifting = solve_orbit(Parameters(alpha=1.2)).motion
    resting = solve_orbit(RESONANT.replace(zeta=0.1), (1.0, -0.5, 2.0)).motion
    for modes in (("NC",) * 6, ("C",) * 6):
        monkeypatch.setattr(scenes.capsule.facts, "MODES", modes)
        assert shown_progression(drifting) == float(drifting.progression) != 0.0
        assert shown_progression(resting) == 0.0 != float(resting.progression)


def test_a_stop_of_no_stiffness_makes_no_drift() -> None:
    orbit = solve_orbit(Parameters(alpha=1.2, beta=0.0))
    assert shown_progression(orbit.motion) == 0.0
    stiff = solve_orbit(Parameters(alpha=1.2, beta=1e-4))
    assert shown_progression(stiff.motion) == float(stiff.progression) != 0.0
