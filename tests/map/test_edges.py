"""Edges of the map: a rest exactly at friction, stiff segments, instants, and settings of NumPy."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from capsule_sym import Parameters, scenes, simulate
from capsule_sym._map.backend import default_backend
from capsule_sym.inputs import SceneParameters
from capsule_sym.results import Outcome, Status

LIGHT = Parameters(3.362, 0.52426, 0.0923, 0.03656, 439.31, 1e-6, 1.43944)
BACKENDS = sorted({default_backend(), "numpy", "mpmath"})
PROTOTYPE, SLOPE = scenes.prototype.Parameters, scenes.slope.Parameters


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("parameters", "x_r"),
    [
        (PROTOTYPE(alpha=1.0, alpha_low=1.0, s=0.0), 1.0),
        (PROTOTYPE(alpha=1.0, alpha_low=1.0, s=0.0, f_plus=3.0), 1.0),
        (PROTOTYPE(alpha=0.0, alpha_low=0.0, s=0.5, f_minus=0.5), -0.5),
        (PROTOTYPE(alpha=1.0, alpha_low=1.0, s=0.0, delta_1=1.0), 1.0),
    ],
)
def test_a_rest_exactly_at_the_friction_bound_lasts(
    parameters: SceneParameters, x_r: float, backend: str
) -> None:
    run = simulate(parameters, (x_r, 0.0, 0.0), periods=3, backend=backend)
    assert run.status is Status.FINISHED
    assert [*map(float, run.final[1])] == [x_r, 0.0, 0.0]
    assert all("-S" in segment.mode for segment in run.segments)


STIFF = [
    *(LIGHT.replace(gamma=gamma) for gamma in (4e-6, 3e-6, 1e-6, 1e-8)),
    # The slow mode is slower than the forcing.
    scenes.reaction.Parameters(alpha=1.25, omega=0.51, zeta=1.33, gamma=8e-7),
    scenes.slope.Parameters(alpha=1.21, omega=2.4, zeta=1.4, gamma=3e-7),
]


@pytest.mark.parametrize("parameters", STIFF)
def test_steps_of_a_stiff_segment_are_those_of_its_slow_motion(parameters: SceneParameters) -> None:
    run = simulate(parameters, periods=1, backend="numpy", max_seconds=20)
    assert sum(segment.evaluations for segment in run.segments) < 100
    assert run.success


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("zeta", [0.0, 1e-16])
def test_a_rest_that_resonance_ends_late_takes_few_steps(backend: str, zeta: float) -> None:
    pinned = Parameters(0.05, 1.0, 1e9, zeta, f_b=1e9)
    run = simulate(pinned, periods=100_000, backend=backend)
    (segment,) = run.segments
    assert segment.evaluations < 50
    # v_r grows by alpha/2 per unit of time.
    assert float(run.final[1][1]) == pytest.approx(0.025 * float(run.final[0]), rel=1e-9)


def test_a_growth_at_resonance_ends_where_friction_does() -> None:
    """After 800 periods, of which the proof of rest passes half of what is left in each step."""
    pinned = Parameters(0.05, 1.0, 1e9, 0.0, f_b=125.0)
    run = simulate(pinned, periods=1000, backend="numpy", max_segments=2)
    first, second = run.segments[:2]
    assert first.outcome is Outcome.REGULAR
    assert second.mode in ("NC-FD", "NC-BD")
    assert 0.025 * float(first.duration) == pytest.approx(125.0, rel=1e-3)
    assert first.evaluations < 1000


def test_an_instant_is_a_number() -> None:
    run = simulate(Parameters(), periods=20)
    end, begun = run.final[0], run.segments[3].start
    time = 20 * run.parameters.period
    assert float(end) == time
    assert (end + 1, 1 + end, 2 * end, end / 2) == (time + 1, 1 + time, 2 * time, time / 2)
    assert end - begun == time - float(begun)
    assert np.array_equal(run(end), run(time))
    assert run([begun, end]).shape == (2, 3)
    assert [float(one(end)) for one in (copy.copy, copy.deepcopy)] == [time, time]
    assert float(pickle.loads(pickle.dumps(end))) == time
    assert tuple(end) == (20, 0.0)


@pytest.mark.parametrize("parameters", [Parameters(), LIGHT, Parameters(zeta=50.0)])
def test_settings_of_numpy_change_nothing(parameters: Parameters) -> None:
    plain = simulate(parameters, (0.1, 0.0, 0.0), periods=2, backend="numpy")
    with np.errstate(all="raise"):
        strict = simulate(parameters, (0.1, 0.0, 0.0), periods=2, backend="numpy")
    assert strict.final == plain.final
