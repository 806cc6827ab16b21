"""The judges are independent of each other, and agree; a judge made wrong does not."""

import json
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from capsule_sym import Parameters
from tests.judges import DRIFT, Run, dop853, taylor, taylor_events
from tests.sampling import sampled, some

TRUTH = {
    (gamma, entry["alpha"]): entry
    for gamma in taylor_events.GAMMAS
    for entry in json.loads(taylor_events.truth_file(gamma).read_text(encoding="utf-8"))["runs"]
}
CASES = pytest.mark.parametrize(("gamma", "alpha"), TRUTH)

# Global errors relative to the state, after up to 1,000 steps of DOP853 and 120 switches. The
# largest seen are 7e-13.
DOP853_ERROR = 2e-12

# The field with the friction of the opposite drift.
FLIPPED = {1: 3, 2: 2, 3: 1, 4: 6, 5: 5, 6: 4}

# Off the case study: stiff contact, strong damping, slow and fast forcing, light capsule.
ELSEWHERE = (
    (Parameters(1.9, 0.45, 0.31, 0.002, 40.0, 0.4, 0.7), (0.3, -0.8, 0.2), 1.5),
    (Parameters(0.8, 1.7, 0.02, 0.9, 3.0, 5.0, 0.3), (-0.4, 0.6, -0.5), 0.0),
    (Parameters(2.6, 0.9, 0.4, 0.03, 0.2, 0.25, 1.2), (0.1, 0.9, 0.7), 4.0),
)


def parameters(gamma: str, alpha: str) -> Parameters:
    return Parameters(alpha=float(alpha), gamma=float(gamma))


def exact(number: Any) -> Any:
    """The number as an mpf: floats, long doubles (64 bits of mantissa) and mpf alike."""
    high = float(number)
    return mpf(high) + mpf(float(number - high)) if isinstance(number, np.floating) else mpf(number)


def gap(run: Run, final: Any) -> float:
    """Largest difference of the final states, relative to their largest component above 1."""
    with mp.workdps(50):
        wanted = [mpf(number) for number in final]
        found = [abs(exact(a) - b) for a, b in zip(run.final, wanted, strict=True)]
        return float(max(found) / max(1, *map(abs, wanted)))


@sampled
@pytest.mark.parametrize(("gamma", "alpha"), some(TRUTH, 2))
def test_dop853_agrees_with_truth(gamma: str, alpha: str) -> None:
    run = dop853.run(parameters(gamma, alpha))
    assert run.fields == TRUTH[gamma, alpha]["fields"]
    assert gap(run, TRUTH[gamma, alpha]["final"]) < DOP853_ERROR


@pytest.mark.long
@pytest.mark.parametrize("gamma", taylor_events.GAMMAS)
def test_truth_files_are_what_the_judge_computes(gamma: str) -> None:
    stored = json.loads(taylor_events.truth_file(gamma).read_text(encoding="utf-8"))
    assert taylor_events.truth(gamma) == stored


@pytest.mark.parametrize("case", ELSEWHERE)
def test_judges_agree_elsewhere(case: tuple[Parameters, tuple[float, ...], float]) -> None:
    truth = taylor_events.run(*case, periods=3, digits=30)
    weak = dop853.run(*case, periods=3)
    assert truth.fields == weak.fields
    assert len(set(truth.fields)) > 2
    assert gap(weak, truth.final) < DOP853_ERROR


@pytest.fixture(scope="module")
def all_fields() -> tuple[Parameters, Run]:
    """A run to 50 digits that visits all six fields."""
    case = parameters("3.0", "1.5")
    run = taylor_events.run(case, periods=3)
    assert set(run.fields) == set("123456")
    return case, run


def _segment_gaps(case: Parameters, run: Run) -> dict[int, float]:
    """Largest difference by field between the run and the one-segment judge, segment by segment."""
    gaps = dict.fromkeys(DRIFT, 0.0)
    start: tuple[Any, ...] = (0, 0, 0, 0)
    with mp.workdps(60):
        for segment in run.segments:
            end = taylor.integrate(
                case, segment.field, start, segment.start, segment.end - segment.start
            )
            found = max(abs(a - b) for a, b in zip(end, segment.state, strict=True))
            gaps[segment.field] = max(gaps[segment.field], float(found))
            start = segment.state
    return gaps


@pytest.mark.long
def test_one_segment_judge_agrees_with_the_event_judge(all_fields: tuple[Parameters, Run]) -> None:
    assert max(_segment_gaps(*all_fields).values()) < 1e-48


@pytest.mark.long
def test_one_segment_judge_with_reversed_friction_disagrees(all_fields, monkeypatch) -> None:
    right = taylor.system
    monkeypatch.setattr(taylor, "system", lambda p, field: right(p, FLIPPED[field]))
    gaps = _segment_gaps(*all_fields)
    assert all((gaps[field] > 1e-6) == (drift != 0) for field, drift in DRIFT.items())


@pytest.mark.parametrize("field", DRIFT)
@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.9, 4.0])
def test_one_segment_judge_agrees_with_dop853(field: int, zeta: float) -> None:
    case = Parameters(alpha=1.1, omega=1.3, delta=0.2, zeta=zeta, beta=7.0, gamma=0.6, f_b=0.8)
    start, tau, duration = (0.3, -0.4, 0.5, -0.6), 1.7, 3.0
    weak = solve_ivp(
        lambda t, z: dop853.derivative(case, field, t, z),
        (tau, tau + duration),
        start,
        method="DOP853",
        rtol=dop853.RTOL,
        atol=dop853.ATOL,
    )
    strong = taylor.integrate(case, field, start, tau, duration)
    assert [float(a) for a in strong] == pytest.approx(list(weak.y[:, -1]), rel=0, abs=DOP853_ERROR)


def test_one_segment_judge_measures_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def three_terms(matrix: Any) -> Any:
        return mp.eye(7) + matrix + matrix**2 / 2

    monkeypatch.setattr(mp, "expm", three_terms)
    with pytest.raises(ArithmeticError, match="x_r: the run in three parts differs"):
        taylor.integrate(Parameters(), 1, (0.1, 0.2, 0.3, 0.0), 0.0, 1e-3)


def test_dop853_with_reversed_friction_disagrees(monkeypatch: pytest.MonkeyPatch) -> None:
    case, right = parameters("3.3", "0.7"), dop853.derivative
    truth = dop853.run(case, periods=2)
    monkeypatch.setattr(
        dop853, "derivative", lambda p, field, tau, z: right(p, FLIPPED[field], tau, z)
    )
    assert dop853.run(case, periods=2).fields != truth.fields


def test_event_judge_with_reversed_friction_finds_no_field(monkeypatch: pytest.MonkeyPatch) -> None:
    right = taylor_events._series
    monkeypatch.setattr(
        taylor_events, "_series", lambda p, field, *rest: right(p, FLIPPED[field], *rest)
    )
    with pytest.raises(taylor_events.Undecided, match="one field must hold"):
        taylor_events.run(parameters("3.3", "0.7"), periods=2, digits=20)
