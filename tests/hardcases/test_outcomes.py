"""Every typed outcome is reached, and says what is there."""

from __future__ import annotations

from math import pi

import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters, simulate
from capsule_sym.errors import InvalidInput, Outcome
from capsule_sym.hardcases.cases import cases
from capsule_sym.map import location

FREE = Parameters(alpha=0.0, zeta=0.0, omega=1.0)
CASES = {case.name: case for case in cases()}


def test_regular_and_end() -> None:
    run = simulate(Parameters(), periods=2)
    assert {s.outcome for s in run.segments[:-1]} == {Outcome.REGULAR}
    assert run.segments[-1].outcome is Outcome.END
    assert not run.stopped


def test_an_exact_graze_is_a_graze() -> None:
    # x_r = -cos(h)/2 touches delta = 1/2 at h = pi, and nothing else happens.
    run = simulate(FREE.replace(delta=0.5), (-0.5, 0.0, 0.0), periods=3)
    first = run.segments[0]
    assert [outcome for outcome, _ in first.tangencies[:1]] == [Outcome.GRAZE]
    assert abs(first.tangencies[0][1] - pi) < 1e-7
    assert run.settled > 0


def test_an_exact_sliding_tangency_is_one() -> None:
    # P = x_r = sin(h) touches f_b = 1 at h = pi/2.
    run = simulate(FREE.replace(delta=2.0), (0.0, 1.0, 0.0), periods=1)
    first = run.segments[0]
    assert [outcome for outcome, _ in first.tangencies[:1]] == [Outcome.SLIDING_TANGENCY]
    assert abs(first.tangencies[0][1] - pi / 2) < 1e-7


@pytest.mark.parametrize("settle", [True, False])
def test_a_corner_is_left_open_by_double_precision_alone(settle: bool) -> None:
    start = CASES["corner on L6 from F1"].build()
    run = simulate(
        start.parameters, start.state, start.phase, settle=settle, periods=1, max_segments=1
    )
    assert run.segments[0].outcome is (Outcome.REGULAR if settle else Outcome.CORNER)
    assert run.settled == int(settle)
    assert abs(run.segments[0].duration - 0.25) < 1e-14


def test_a_graze_within_rounding_is_left_open_by_double_precision_alone() -> None:
    start = CASES["graze from F2, 1e-15 short of it"].build()
    run = simulate(start.parameters, start.state, start.phase, 2, settle=False, max_segments=1)
    assert Outcome.GRAZE in {run.segments[0].outcome, *(o for o, _ in run.segments[0].tangencies)}


def test_rest_is_proved_to_last() -> None:
    run = simulate(Parameters(alpha=0.005), periods=100)
    assert run.segments[-1].outcome is Outcome.NEVER


def test_a_search_that_goes_on_for_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(location, "_MOST_EVALUATIONS", 1)
    run = simulate(Parameters(omega=1e-3, zeta=1e-3, alpha=0.03), (0.0, 0.005, 0.0))
    assert run.segments[-1].outcome is Outcome.UNDECIDED
    assert "undecided" in run.stopped


def test_a_run_that_is_cut_off_says_so() -> None:
    run = simulate(Parameters(), max_segments=3)
    assert len(run.segments) == 3
    assert "3 segments" in run.stopped


def test_a_state_at_1e12_is_run() -> None:
    run = simulate(Parameters(), (1e12, -1e12, 1e12), periods=3)
    assert not run.stopped
    assert {s.outcome for s in run.segments[:-1]} == {Outcome.REGULAR}


@pytest.mark.parametrize("periods", [10**12 + 1, 10**30, 0, -1])
def test_absurd_numbers_of_periods_are_refused(periods: int) -> None:
    with pytest.raises(InvalidInput, match="periods"):
        simulate(Parameters(), periods=periods)


@pytest.mark.parametrize(
    "state", [(10**400, 0, 0), (1e308, 0, 0), "123", (1j, 0, 0), ((0, 0), 0, 0), None]
)
def test_absurd_states_are_refused(state: object) -> None:
    with pytest.raises(InvalidInput, match="state"):
        simulate(Parameters(), state)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "change",
    [{"omega": 1e40}, {"omega": 1e-300}, {"gamma": 1e-300}, {"beta": 1e300}, {"alpha": 1e308}],
)
def test_parameters_beyond_double_precision_are_refused(change: dict[str, float]) -> None:
    (name,) = change
    with pytest.raises(InvalidInput, match=name):
        simulate(Parameters(**change))


@pytest.mark.xfail(
    reason="one segment over very many periods takes the sine of its whole duration", strict=True
)
def test_a_million_periods_of_stick_end_as_accurately_as_ten() -> None:
    p = Parameters(alpha=0.005)
    run = simulate(p, periods=10**6)
    assert run.segments[-1].outcome is Outcome.NEVER
    # The transient is long gone; what is left is the forced response at phase 0.
    with mp.workdps(50):
        alpha, omega, zeta = mpf(p.alpha), mpf(p.omega), mpf(p.zeta)
        response = alpha / (1 - omega**2 + 2j * zeta * omega)
        truth = response.real, (1j * omega * response).real
        _, (x_r, v_r, v_c) = run.final
        assert abs(x_r - truth[0]) < 4e-16 * abs(response)
        assert abs(v_r - truth[1]) < 4e-16 * abs(response)
        assert v_c == 0


def test_a_thousand_periods_of_an_orbit_end_on_the_orbit() -> None:
    run = simulate(Parameters(), periods=1000)
    _, state = run.final
    once = simulate(Parameters(), state, periods=1, backend="mpmath")
    with mp.workdps(50):
        moved = [abs(a - mpf(b)) for a, b in zip(once.final[1], state, strict=True)]
    assert max(moved) < 1e-14
    assert {s.outcome for s in run.segments[:-1]} == {Outcome.REGULAR}
