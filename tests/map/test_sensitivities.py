"""Derivatives of runs, against differences of an independent integrator's runs with 36 digits."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import InvalidInput, Parameters, results, sensitivities, simulate
from capsule_sym._map.sensitivities import columns_of
from capsule_sym._native import watch
from tests.judges import taylor_events
from tests.sampling import sampled, some

SLOPES = columns_of(Parameters.scene)
PERIODS = 1
STEP = mpf(10) ** -15
CASES = {
    "slips and impacts": (Parameters(alpha=0.8), (0.1, 0.2, 0.3), 0.4),
    "rest at first": (Parameters(alpha=1.2, gamma=3.0), (0.0, 0.0, 0.0), 0.0),
    "critical damping": (Parameters(alpha=1.4, zeta=1.0, beta=4.0), (0.0, 0.5, -0.3), 1.0),
    "resonance": (Parameters(alpha=0.6, omega=1.0, zeta=0.0), (0.2, 0.1, 0.0), 0.5),
}


@cache
def judged(name: str, column: int, sign: int):
    """Reference run with a small change in one of the columns."""
    parameters, state, phase = CASES[name]
    exact = [mpf(value) for value in (*state, phase, *parameters.to_dict().values())]
    if column >= 0:
        exact[column] += sign * STEP
    moved = SimpleNamespace(**dict(zip(SLOPES[4:], exact[4:], strict=True)))
    return taylor_events.run(moved, exact[:3], exact[3], PERIODS, digits=36)


def capsule_moves(name: str) -> bool:
    """True if the capsule moves at first; at rest its velocity is 0, and stays so."""
    return CASES[name][1][2] != 0.0


def found_of(name: str) -> tuple[results.Sensitivities, int]:
    parameters, state, phase = CASES[name]
    # The reference counts its periods from the start.
    run = simulate(parameters, state, phase, PERIODS + 1)
    end = phase + PERIODS * parameters.period
    found = sensitivities(run, [end])
    return found, int(np.sum(found.switching_times < end))


@sampled
@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_differences_of_the_judges_runs(name) -> None:
    found, switches = found_of(name)
    parameters, _, _ = CASES[name]
    assert switches == len(judged(name, -1, 0).segments) - 1 > 0
    tried = enumerate(SLOPES)
    for column, of in some([(k, n) for k, n in tried if n != "v_c" or capsule_moves(name)], 1):
        with mp.workdps(50):
            up, down = judged(name, column, 1), judged(name, column, -1)
            ends = [
                (a.end - b.end) / (2 * STEP)
                for a, b in zip(up.segments, down.segments, strict=True)
            ]
            states = [(a - b) / (2 * STEP) for a, b in zip(up.final, down.final, strict=True)]
        # Times are counted from the start; the end of the reference moves with the frequency.
        elapsed = np.array(ends[:switches], dtype=float) - (of == "phase")
        moved = -PERIODS * parameters.period / parameters.omega if of == "omega" else 0.0
        slopes = np.array(states, dtype=float) - found.rates[0] * moved
        size = max(1.0, np.abs(found.switching_slopes[:switches, column]).max())
        assert found.switching_slopes[:switches, column] == pytest.approx(elapsed, abs=1e-11 * size)
        size = max(1.0, np.abs(found.slopes[0, :, column]).max())
        assert found.slopes[0, :, column] == pytest.approx(slopes, abs=1e-11 * size)


def test_a_saltation_that_is_left_out_is_noticed() -> None:
    """The test above would fail without the derivatives of the times."""
    found, switches = found_of("slips and impacts")
    assert np.abs(found.switching_slopes[:switches]).max() > 0.1


def test_times_may_come_in_any_order_and_more_than_once() -> None:
    run = simulate(Parameters(alpha=0.8), periods=3)
    times = np.array([5.0, 0.0, 12.0, 5.0])
    found = sensitivities(run, times)
    for i, time in enumerate(times):
        assert np.array_equal(found.slopes[i], sensitivities(run, [time]).slopes[0])
    assert np.array_equal(found.states, run(times, position=True))


def test_derivatives_keep_to_a_limit_of_time() -> None:
    """The core looks at the time after some thousand segments."""
    run, done = simulate(Parameters(alpha=0.8), periods=6000), False
    with watch.Watch(1e-300):
        sensitivities(run, [run.span[1]])
        done = True
    assert not done


def test_beside_grazing_and_at_it() -> None:
    """Derivatives grow without bound as an impact becomes tangential."""
    sizes = []
    for distance in (1e-2, 1e-4, 1e-6):
        # At rest on the capsule, undamped and not driven: x_r = delta cos(h) + v_r sin(h).
        reach = 0.5 + distance
        parameters = Parameters(alpha=0.0, zeta=0.0, delta=0.5, gamma=1e6, f_b=10.0)
        run = simulate(parameters, (0.0, reach, 0.0), periods=1)
        found = sensitivities(run, [0.1])
        first = np.arcsin(0.5 / reach)
        assert found.switching_times[0] == pytest.approx(first, rel=1e-9)
        # d/dv of asin(delta/v)
        slope = -0.5 / (reach * np.sqrt(reach**2 - 0.25))
        assert found.switching_slopes[0, 1] == pytest.approx(slope, rel=1e-9)
        sizes.append(abs(slope))
    assert sizes[0] < sizes[1] < sizes[2]


def test_a_run_without_segments_is_refused() -> None:
    run = simulate(Parameters(), periods=2, keep="final")
    with pytest.raises(InvalidInput, match="segments"):
        sensitivities(run, [0.0])
    with pytest.raises(InvalidInput, match="t ="):
        sensitivities(simulate(Parameters(), periods=2), [1e6])


def test_a_scene_without_a_core_is_refused(monkeypatch) -> None:
    run = simulate(Parameters(), periods=2)
    monkeypatch.setattr("capsule_sym._map.native.core_of", lambda _: None)
    with pytest.raises(InvalidInput, match="the C core was not compiled"):
        sensitivities(run, [1.0])


def test_columns_have_names() -> None:
    found = sensitivities(simulate(Parameters(), periods=2), [1.0, 2.0])
    assert np.array_equal(found.by("alpha"), found.slopes[:, :, 4])
    assert found.by("alpha", "f_b").shape == (2, 4, 2)
    with pytest.raises(InvalidInput, match="mass"):
        found.by("mass")
    assert repr(found).startswith("<Sensitivities: 2 times")
