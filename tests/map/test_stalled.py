"""A run that rounding keeps from advancing ends with this status."""

import math

import pytest

from capsule_sym import Parameters, results, simulate
from capsule_sym._map import isolation
from capsule_sym._map.backend import default_backend

_GENEROUS = 120  # seconds, for what takes a few; before, these took hours


def test_a_search_whose_steps_do_not_advance_ends() -> None:
    """Drift in F1 with P - f_b within rounding of zero and v_c as small, for much longer."""
    run = simulate(
        Parameters(0.5, 1e-6, 0.02, 1e4, 1, 1e-8, 1e-10),
        (1e-10, 1e-17, 1e-100),
        backend="numpy",
        escalate=False,
        max_seconds=_GENEROUS,
    )
    segment = run.segments[0]
    assert (segment.outcome, segment.target, len(run.segments)) == (results.Outcome.STALLED, "", 1)
    assert segment.evaluations < 1000
    assert (run.status, run.message[:7]) == (results.Status.STALLED, "stalled")


def test_a_run_that_cannot_advance_says_so() -> None:
    run = simulate(Parameters(1, 1, 1, 0, 1, 1, 0.5), (0.5, 0.0, 5e-324), max_seconds=_GENEROUS)
    assert (run.status, run.message[:7]) == (results.Status.STALLED, "stalled")
    assert run.segments[-1].outcome is results.Outcome.STALLED
    assert run.segments[-1].target == ""


@pytest.mark.parametrize("backend", ["numpy", "mpmath"])
@pytest.mark.parametrize("v_c", [1e-292, 1e-300, 1e-310])
def test_a_root_nearer_than_its_bracket_in_doubles_is_found(v_c, backend, monkeypatch) -> None:
    value, calls = isolation._value, iter(range(50_000))  # or StopIteration: it does not end
    monkeypatch.setattr(isolation, "_value", lambda *of: (next(calls), value(*of))[1])
    short, of_doubles = (
        simulate(Parameters(), (0.02, 0.0, v), periods=1, max_segments=1, backend=backend)
        for v in (v_c, 1e-20)
    )
    found, expected = (float(run.segments[0].duration) for run in (short, of_doubles))
    assert found / v_c == pytest.approx(expected / 1e-20, rel=1e-12)


@pytest.mark.long
def test_segments_of_no_duration_do_not_follow_each_other_for_ever() -> None:
    run = simulate(
        Parameters(1e10, 1, 1, 1e4, 1e10, 3, 1),
        (1.0, -1e-323, 0.0),
        math.pi,
        escalate=False,
        max_segments=500,
        max_seconds=_GENEROUS,
    )
    assert (run.status, run.message[:7]) == (results.Status.STALLED, "stalled")
    assert run.segments[-1].outcome is results.Outcome.STALLED
    assert len(run.segments) < 50


@pytest.mark.parametrize("backend", sorted({default_backend(), "numpy"}))
def test_progress_counts_the_periods_passed(backend: str) -> None:
    passed: list[int] = []
    simulate(Parameters(), periods=5, backend=backend, progress=passed.append)
    assert passed == sorted(passed)
    assert passed[-1] == 5
