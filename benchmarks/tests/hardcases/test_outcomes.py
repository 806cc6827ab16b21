"""Every typed outcome is reached, and is right."""

from __future__ import annotations

from math import nan, pi
from random import Random
from typing import Any

import pytest
from mpmath import mp, mpf

from benchmarks.hardcases.cases import cases, flow_from
from capsule_sym import InvalidInput, Parameters, simulate
from capsule_sym._map import location
from capsule_sym._map.backend import backend
from capsule_sym._native import core, watch
from capsule_sym.results import Outcome, Status
from tests.sampling import many, sampled

FREE = Parameters(alpha=0.0, zeta=0.0, omega=1.0)
CASES = {case.name: case for case in cases()}


def test_regular_and_end() -> None:
    run = simulate(Parameters(), periods=2)
    assert {s.outcome for s in run.segments[:-1]} == {Outcome.REGULAR}
    assert run.segments[-1].outcome is Outcome.END
    assert run.success


def test_an_exact_graze_is_a_graze() -> None:
    # x_r = -cos(h)/2 touches delta = 1/2 at h = pi, and nothing else happens.
    run = simulate(FREE.replace(delta=0.5), (-0.5, 0.0, 0.0), periods=3)
    first = run.segments[0]
    assert [outcome for outcome, _ in first.tangencies[:1]] == [Outcome.GRAZE]
    assert abs(first.tangencies[0][1] - pi) < 1e-7
    assert run.statistics.escalations > 0


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
        start.parameters, start.state, start.phase, escalate=settle, periods=1, max_segments=1
    )
    assert run.segments[0].outcome is (Outcome.REGULAR if settle else Outcome.CORNER)
    assert run.statistics.escalations == int(settle)
    assert abs(run.segments[0].duration - 0.25) < 1e-14


def test_a_graze_within_rounding_is_left_open_by_double_precision_alone() -> None:
    start = CASES["graze from F2, 1e-15 short of it"].build()
    run = simulate(start.parameters, start.state, start.phase, 2, escalate=False, max_segments=1)
    assert Outcome.GRAZE in {run.segments[0].outcome, *(o for o, _ in run.segments[0].tangencies)}


def test_rest_is_proved_to_last() -> None:
    run = simulate(Parameters(alpha=0.005), periods=100)
    assert run.segments[-1].outcome is Outcome.NEVER


def test_a_search_that_goes_on_for_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(location, "_MOST_EVALUATIONS", 1)
    run = simulate(Parameters(omega=1e-3, zeta=1e-3, alpha=0.03), (0.0, 0.005, 0.0))
    assert run.segments[-1].outcome is Outcome.UNDECIDED
    assert run.status is Status.UNDECIDED
    assert "undecided" in run.message


def test_a_run_that_is_cut_off_says_so() -> None:
    run = simulate(Parameters(), max_segments=3)
    assert len(run.segments) == 3
    assert run.status is Status.SEGMENT_LIMIT
    assert "3 segments" in run.message


def test_a_state_at_1e12_is_run() -> None:
    run = simulate(Parameters(), (1e12, -1e12, 1e12), periods=3)
    assert run.success
    assert {s.outcome for s in run.segments[:-1]} == {Outcome.REGULAR}


ABSURD: dict[str, tuple[object, ...]] = {
    "periods": (10**12 + 1, 10**30, 0, -1),
    "state": ((10**400, 0, 0), (1e308, 0, 0), "123", (1j, 0, 0), ((0, 0), 0, 0), None),
    "max_seconds": (0, -1.0, nan, "1", True, None),
    "max_segments": (0, -1, 1.5, "3", True, 10**13),
    "parameters": (None, {"alpha": 1.0}, (0.7,) * 7),
}


@pytest.mark.parametrize(
    ("name", "value"), [(name, value) for name, values in ABSURD.items() for value in values]
)
def test_absurd_arguments_are_refused(name: str, value: object) -> None:
    given: dict[str, Any] = {"parameters": Parameters(), name: value}
    with pytest.raises(InvalidInput, match=name):
        simulate(**given)


@pytest.mark.parametrize(
    ("name", "value"),
    [("omega", 1e40), ("omega", 1e-300), ("gamma", 1e-300), ("beta", 1e300), ("alpha", 1e308)],
)
def test_parameters_beyond_double_precision_are_refused(name: str, value: float) -> None:
    with pytest.raises(InvalidInput, match=name):
        simulate(Parameters(**{name: value}))


COMPILED = pytest.mark.skipif(core is None, reason="the C core was not compiled")
BACKENDS = ["numpy", pytest.param("c", marks=COMPILED)]


@pytest.mark.parametrize(
    ("backend", "periods"),
    [
        ("numpy", 10**4),
        ("numpy", 10**6),
        # The core keeps the state after every period, which takes its time.
        pytest.param("c", 10**5, marks=COMPILED),
        pytest.param("c", 10**6, marks=[COMPILED, pytest.mark.long]),
    ],
)
def test_a_million_periods_of_stick_end_as_accurately_as_a_few(backend: str, periods: int) -> None:
    p = Parameters(alpha=0.005)
    run = simulate(p, periods=periods, backend=backend)
    assert run.segments[-1].outcome is Outcome.NEVER
    # The transient is long gone; what is left is the forced response at phase 0.
    with mp.workdps(50):
        alpha, omega, zeta = mpf(p.alpha), mpf(p.omega), mpf(p.zeta)
        response = alpha / (1 - omega**2 + 2j * zeta * omega)
        truth = response.real, (1j * omega * response).real
        for x_r, v_r, v_c in (run.final[1], run.stroboscopic[-1], run.stroboscopic[-2]):
            assert abs(x_r - truth[0]) < 4e-16 * abs(response)
            assert abs(v_r - truth[1]) < 4e-16 * abs(response)
            assert v_c == 0


def test_a_billion_periods_are_no_worse() -> None:
    ends = [simulate(Parameters(alpha=0.005), periods=10**n).final[1] for n in (4, 9)]
    assert ends[0] == ends[1]


@pytest.mark.parametrize("field", range(1, 7))
def test_a_mark_is_the_same_by_its_forcing_angle(field: int) -> None:
    random = Random(field)
    for _ in range(6):
        p = Parameters(
            alpha=random.uniform(0.1, 3),
            omega=10 ** random.uniform(-1, 1),
            delta=random.uniform(0, 1),
            zeta=10 ** random.uniform(-2, 1),
            beta=10 ** random.uniform(-1, 2),
            gamma=10 ** random.uniform(-1, 1),
        )
        state = [random.gauss(0, 1) for _ in range(3)]
        with backend("mpmath") as numbers:
            flow = flow_from(numbers, p, field, *state, random.uniform(0, p.period))
            h = (100 * numbers.full_turn - flow.start.angle) / flow.c.omega
            known, plain = flow.at_mark(h), flow(h)
            assert known.sin_theta == 0 != plain.sin_theta
            for a, b in zip(known[:5], plain[:5], strict=True):
                assert abs(a - b) < 1e-52 * (1 + abs(b))


@sampled
def test_hundreds_of_periods_of_an_orbit_end_on_the_orbit() -> None:
    run = simulate(Parameters(), periods=many(1000, 250))
    _, state = run.final
    once = simulate(Parameters(), state, periods=1, backend="mpmath")
    with mp.workdps(50):
        moved = [abs(a - mpf(b)) for a, b in zip(once.final[1], state, strict=True)]
    assert max(moved) < 1e-14
    assert {s.outcome for s in run.segments[:-1]} == {Outcome.REGULAR}


@pytest.mark.parametrize(
    ("parameters", "state", "phase", "fields", "slip"),
    [
        # The force is above the friction bound by less than double precision sees, and falls.
        (
            Parameters(
                alpha=0.3644261347413191,
                omega=0.16478809519303977,
                delta=0.007201636077270911,
                zeta=0.30651082196100243,
                beta=8.452112370011369,
                gamma=1.613378666675064,
            ),
            (0.1945693748982153, -1.2694862663393862, 0.0),
            26.545657479605985,
            (4, 5, 2),
            6.493200738112968e-18,
        ),
        (Parameters(delta=0.0), (0.0, 0.0, 1e-100), 0.0, (4, 5, 2), 3.3e-100),
        (Parameters(), (0.02, 0.0, 1e-100), 0.0, (4, 5, 2), 3.3673469387755093e-100),
    ],
)
def test_a_slip_shorter_than_rounding_is_passed(
    parameters: Parameters,
    state: tuple[float, float, float],
    phase: float,
    fields: tuple[int, ...],
    slip: float,
) -> None:
    run = simulate(parameters, state, phase, 2, max_segments=3)
    assert tuple(segment.field for segment in run.segments) == fields
    # v_c / (f_b - P) gamma for the last two, and what 50 digits alone find for the first.
    assert run.segments[0].duration == pytest.approx(slip, rel=1e-9)
    assert run.status is not Status.UNDECIDED


def test_a_touch_beside_the_end_of_an_interval_is_passed() -> None:
    # x_r touches delta = 0 with v_r != 0 only after a period: the search once stood still there.
    p = Parameters(alpha=0.10458567678904376, omega=1.0, delta=0.0, zeta=0.0, beta=0.0, gamma=1.0)
    run = simulate(p, periods=2)
    assert run.success
    assert max(segment.evaluations for segment in run.segments) < 200


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.usefixtures("ticking")
def test_a_run_that_takes_too_long_stops_with_what_it_has(backend: str) -> None:
    run = simulate(Parameters(), periods=10**12, backend=backend, max_seconds=30)
    assert (run.status, run.message) == (Status.TIME_LIMIT, "the run stopped at its time limit")
    assert run.segments
    (turns, _), state = run.final
    assert 0 < turns < 10**5
    assert state == run.segments[-1].end_state


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_time_limit_of_the_true_clock_holds(backend: str) -> None:
    """However short: the run would take weeks."""
    run = simulate(Parameters(), periods=10**12, backend=backend, max_seconds=1e-3)
    assert (run.status, run.message) == (Status.TIME_LIMIT, "the run stopped at its time limit")


@pytest.fixture
def ticking(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that every look at it puts forward by a second."""
    clock = iter(range(10**6))
    monkeypatch.setattr(watch, "perf_counter", lambda: next(clock))


@pytest.mark.usefixtures("ticking")
def test_a_search_that_takes_too_long_stops_too() -> None:
    run = simulate(Parameters(omega=1e-3, zeta=1e-3, alpha=0.03), (0.0, 0.005, 0.0), max_seconds=9)
    assert (run.status, run.message) == (Status.TIME_LIMIT, "the run stopped at its time limit")
    assert run.segments[-1].outcome is Outcome.UNDECIDED
    assert 0 < run.segments[-1].duration < 2 * pi / 1e-3
