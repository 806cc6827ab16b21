"""Each certificate is needed: without it a switch is missed, invented or misdated."""

from __future__ import annotations

from functools import cache
from math import pi

import pytest
from mpmath import findroot

from benchmarks.hardcases.cases import cases, flow_from
from benchmarks.hardcases.reference import Start, check
from benchmarks.tests.hardcases.mutations import MUTATIONS
from capsule_sym import Parameters, simulate
from capsule_sym._map.backend import backend
from capsule_sym.results import Outcome, Trajectory

CASES = {case.name: case for case in cases()}


# Cases by how their names begin. The effect of rounding on a case may change with any formula, so
# that those which only rounding decides stand together.
NEEDED = [
    ("no remainder", "graze from F2, 1e-02 past it"),
    ("no remainder", "graze from F2, 1e-06 past it"),
    ("no rounding errors", "corner from F"),
    ("no errors of the closed form", "corner from F"),
    ("no monotonicity", "graze from F1, 1e-06 past it"),
    ("no rivals", "sliding tangency on L3, 1e-10 past it"),
    ("no rivals", "sliding tangency on L2, 1e-10 past it"),
    ("no doubt about the order", "corner from F"),
]


@cache
def passed(names: str) -> list[Start]:
    """The cases whose names begin so, all of which pass."""
    starts = [case.build() for name, case in CASES.items() if name.startswith(names)]
    assert starts
    assert all(check(start).passed for start in starts)
    return starts


@pytest.mark.parametrize(("mutation", "names"), NEEDED)
def test_without_it_a_hard_case_fails(
    monkeypatch: pytest.MonkeyPatch, mutation: str, names: str
) -> None:
    starts = passed(names)
    MUTATIONS[mutation](monkeypatch)
    assert not all(check(start).passed for start in starts)


def first(parameters: Parameters, state: tuple[float, float, float], phase: float = 0.0) -> Outcome:
    """Outcome of the first segment in double precision alone."""
    return run(parameters, state, phase).segments[0].outcome


def run(parameters: Parameters, state: tuple[float, float, float], phase: float) -> Trajectory:
    return simulate(parameters, state, phase, 1, escalate=False, max_segments=1)


@pytest.mark.parametrize(
    ("mutation", "parameters", "state"),
    [
        # x_r passes delta = 0.02 by its free part, of amplitude 1/2; the forced one is 0.005.
        (
            "no energy in the proof of rest",
            Parameters(alpha=0.005, omega=0.2),
            (0.0, 0.5, 0.0),
        ),
        # Forced amplitude 0.3 beyond delta = 0.02, force far below friction's.
        ("no gap in the proof of rest", Parameters(alpha=0.3, omega=0.2), (0.0, 0.0, 0.0)),
        # Force about 3 beyond f_b = 1, impact far away.
        (
            "no friction bound in the proof of rest",
            Parameters(alpha=3.0, omega=0.2, delta=1e3),
            (0.0, 0.0, 0.0),
        ),
    ],
)
def test_without_it_rest_is_claimed_before_a_switch(
    monkeypatch: pytest.MonkeyPatch,
    mutation: str,
    parameters: Parameters,
    state: tuple[float, float, float],
) -> None:
    assert first(parameters, state) is Outcome.REGULAR
    MUTATIONS[mutation](monkeypatch)
    assert first(parameters, state) is Outcome.NEVER


def test_near_resonance_rounding_of_the_detuning_does_not_prove_rest() -> None:
    # In 50 digits x_r exceeds delta by 2e-12 at the top of a beat, h = 2.81e8: 1 - omega^2 in
    # double precision is off by 4e-9 of itself, and so would be the amplitude.
    p = Parameters(
        alpha=1.1175870957835788e-11,
        omega=1.000000011175871,
        delta=0.000999999997826914,
        zeta=0.0,
    )
    assert simulate(p, periods=10, escalate=False).segments[0].outcome is not Outcome.NEVER


def test_without_division_of_the_start_zeros_a_slip_ends_at_its_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    p, state = Parameters(zeta=0.0, delta=2.0, omega=1.0), (1.0, 0.25, 0.0)
    whole = run(p, state, 0.0).segments[0]
    assert whole.outcome is Outcome.REGULAR
    assert whole.duration > 1.0
    MUTATIONS["no division of the start's zeros"](monkeypatch)
    cut = run(p, state, 0.0).segments[0]
    assert cut.outcome is Outcome.SLIDING_TANGENCY
    assert cut.duration == 0.0


def test_without_the_free_part_an_impact_at_the_top_of_a_swing_is_missed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # x_r = 0.05 sin(omega tau) rises slowly through delta = 0.02, with swings of 0.005 on it.
    p = Parameters(alpha=0.05, omega=1e-3, zeta=1e-5)
    start = (0.0, 0.005, 0.0), 1.5 * pi / p.omega
    true = run(p, *start).segments[0]
    assert true.outcome is Outcome.REGULAR
    assert true.duration < 320  # 0.05 sin(omega tau) = 0.015
    MUTATIONS["no free part beside the forced response"](monkeypatch)
    assert run(p, *start).segments[0].duration > true.duration + 1


def test_without_the_other_guards_a_switch_is_stepped_over_with_a_tangency(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # From x_r = -0.3 at this velocity x_r just touches delta, and v_c vanishes 1e-9 later.
    p, phase, after = Parameters(omega=1.0), 2.5, 1e-9
    touching = CASES["graze from F1, 1e-15 short of it"].build()
    v_r = touching.state[1]
    with backend("mpmath") as numbers:
        flow = flow_from(numbers, p, 1, -0.3, v_r, 0, phase)
        touch = findroot(lambda h: flow(h).v_r, 1.48)
        v_c = -float(flow(touch + numbers.number(after)).v_c)
    start = (-0.3, v_r, v_c)
    open_ = run(p, start, phase).segments[0]
    assert open_.outcome is Outcome.GRAZE
    settled = simulate(p, start, phase, 1, max_segments=1).segments[0]
    assert abs(settled.duration - float(touch) - after) < 1e-14
    MUTATIONS["no others at a tangency"](monkeypatch)
    wrong = run(p, start, phase).segments[0]
    assert wrong.outcome is Outcome.REGULAR
    assert abs(wrong.duration - settled.duration) > 1e-6
