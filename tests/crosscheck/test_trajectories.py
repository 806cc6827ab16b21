"""Twenty periods of the case study from rest: double, 50 digits, and integrators that know neither.

The stored truth is the event judge's, to 40 digits (`tests.judges.taylor_events`).
"""

from functools import cache
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters, results, simulate
from tests.judges import Run, dop853
from tests.judges.test_judges_agree import CASES, DOP853_ERROR, TRUTH, exact

PERIODS = 20
QUICK = [("3.3", "0.45")]
SOME_QUICK = pytest.mark.parametrize(
    ("gamma", "alpha"),
    [pytest.param(*case, marks=[] if case in QUICK else pytest.mark.long) for case in TRUTH],
)


@cache
def run(gamma: str, alpha: str, backend: str) -> results.Trajectory:
    return simulate(
        Parameters(alpha=float(alpha), gamma=float(gamma)), periods=PERIODS, backend=backend
    )


def fields(trajectory: results.Trajectory) -> str:
    return "".join(str(segment.field) for segment in trajectory.segments)


def time(trajectory: results.Trajectory, instant: Any) -> Any:
    return instant.period * 2 * mp.pi / mpf(trajectory.parameters.omega) + instant.phase


def check_final(trajectory: results.Trajectory, truth: dict[str, Any], tolerance: float) -> None:
    assert fields(trajectory) == truth["fields"]
    end, state = trajectory.final
    assert end == (PERIODS, 0)
    for a, b in zip((*state, trajectory.advance), truth["final"], strict=True):
        assert abs(a - mpf(b)) <= tolerance * max(1, abs(mpf(b)))


def check_double(gamma: str, alpha: str) -> None:
    double, precise = run(gamma, alpha, "numpy"), run(gamma, alpha, "mpmath")
    assert fields(double) == fields(precise)
    assert len(double.segments) == len(precise.segments) > 40
    for a, b in zip(double.segments, precise.segments, strict=True):
        assert (a.source, a.target, a.outcome) == (b.source, b.target, b.outcome)
        for one, two in ((a.start, b.start), (a.end, b.end)):
            assert one.period == two.period
            assert abs(one.phase - two.phase) <= 1e-12
        assert abs(a.duration - b.duration) <= 1e-12
        for one, two in zip(
            (*a.start_state, *a.end_state), (*b.start_state, *b.end_state), strict=True
        ):
            assert abs(one - two) <= 1e-12


def check_judge(trajectory: results.Trajectory, judged: Run, tolerance: float) -> None:
    """Fields, switching times and states agree to the judge's own accuracy."""
    assert fields(trajectory) == judged.fields
    for segment, theirs in zip(trajectory.segments, judged.segments, strict=True):
        end = time(trajectory, segment.end)
        position = segment.position + segment.advance
        scale = max(1, *(abs(exact(a)) for a in theirs.state))
        # An integrator's clock loses digits as the time grows.
        assert abs(end - exact(theirs.end)) <= tolerance * max(1, end)
        for a, b in zip((*segment.end_state, position), theirs.state, strict=True):
            assert abs(a - exact(b)) <= tolerance * scale


@CASES
def test_double_agrees_with_truth(gamma: str, alpha: str) -> None:
    trajectory = run(gamma, alpha, "numpy")
    check_final(trajectory, TRUTH[gamma, alpha], 1e-12)
    assert {segment.outcome for segment in trajectory.segments[:-1]} == {results.Outcome.REGULAR}
    assert trajectory.segments[-1].outcome is results.Outcome.END
    assert trajectory.success
    assert trajectory.statistics.escalations == 0


@pytest.mark.long
@SOME_QUICK
def test_50_digits_agree_with_truth_and_double_with_them(gamma: str, alpha: str) -> None:
    with mp.workdps(60):
        check_final(run(gamma, alpha, "mpmath"), TRUTH[gamma, alpha], 1e-35)
        check_double(gamma, alpha)


@SOME_QUICK
def test_50_digits_agree_with_dop853(gamma: str, alpha: str) -> None:
    with mp.workdps(60):
        precise = run(gamma, alpha, "mpmath")
        check_judge(precise, dop853.run(precise.parameters, periods=PERIODS), DOP853_ERROR)


def test_a_wrong_mass_ratio_is_noticed() -> None:
    wrong = simulate(Parameters(alpha=0.7, gamma=3.3 * (1 + 1e-11)), periods=PERIODS)
    with pytest.raises(AssertionError):
        check_final(wrong, TRUTH["3.3", "0.7"], 1e-12)
