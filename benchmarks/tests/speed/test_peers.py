"""The peers, one against another and against the 50-digit truth of the case study."""

import numpy as np
import pytest

from benchmarks.speed import reference
from benchmarks.speed.compare import error, wrong_switches
from benchmarks.speed.model import CONTACT, DRIFT, Clock, Locked, guards, rates
from benchmarks.speed.peers import compiled, cvode, scipy_events, taylor
from capsule_sym import Parameters
from tests.judges import dop853

needs_cc = pytest.mark.skipif(compiled.compiler() is None, reason="there is no C compiler cc")


@pytest.fixture(scope="module")
def cases():
    return reference.cases("case study")


def judge(run, cases):
    """Missed, invented and largest error over the cases."""
    results = run([case.start for case in cases])
    wrong = [
        wrong_switches(r.itinerary, c.truth.itinerary) for r, c in zip(results, cases, strict=True)
    ]
    errors = [error(r.state, c.truth.state) for r, c in zip(results, cases, strict=True)]
    return sum(m for m, _ in wrong), sum(i for _, i in wrong), max(errors)


@pytest.mark.parametrize("field", range(1, 7))
def test_equations_are_those_of_the_tests_own_judge(field) -> None:
    p = Parameters(alpha=1.3, zeta=0.07)
    z = np.array([0.31, -0.2, 0.4])
    other = dop853.derivative(p, field, 0.9, np.array([*z, 0.0]))
    assert rates(p, field)(0.9, z[0], z[1]) == pytest.approx(other[:3], rel=1e-14)
    mine = [guard(*z) for guard in guards(p, field, 1e-16)]
    assert mine == [guard(0.9, np.array([*z, 0.0])) for guard in dop853.guards(p, field)]
    assert len(mine) == (2 if DRIFT[field] else 3)
    assert (mine[0] > 0) == (CONTACT[field] == 1)


@needs_cc
def test_compiled_dop853_is_as_accurate_as_its_tolerance(cases) -> None:
    *_, loose = judge(compiled.dop853(1e-6, interior=True), cases)
    missed, invented, sharp = judge(compiled.dop853(1e-13, interior=True), cases)
    assert (missed, invented) == (0, 0)
    assert sharp < 1e-12 < loose < 1e-4


@needs_cc
def test_compiled_dop853_looks_inside_steps_if_asked() -> None:
    near = reference.cases("tangencies")
    ends = judge(compiled.dop853(1e-9, interior=False), near)
    inside = judge(compiled.dop853(1e-9, interior=True), near)
    assert inside[0] < ends[0]


@needs_cc
def test_runge_kutta_with_naive_switching_is_of_first_order(cases) -> None:
    errors = [judge(compiled.rk4(steps), cases)[2] for steps in (100, 1000, 10000)]
    assert errors[0] > errors[1] > errors[2] > 1e-5
    assert errors[1] / errors[2] < 100


@needs_cc
def test_a_compiled_run_without_end_is_locked() -> None:
    # Switches every step: a gap without size and friction without bound are met at once.
    p = Parameters(alpha=1e-3, omega=0.01)
    start = reference.Start(p.replace(delta=0.0, beta=1e6), (0.0, 0.0, 0.0), 1)
    (result,) = compiled.rk4(200000)([start])
    assert result.state is None
    assert len(result.itinerary) == 80


def test_scipy_finds_the_case_study(cases) -> None:
    missed, invented, worst = judge(scipy_events.build("DOP853", 1e-12, careful=True), cases[:2])
    assert (missed, invented) == (0, 0)
    assert worst < 1e-10


def test_cvode_finds_the_case_study(cases) -> None:
    pytest.importorskip("sksundae")
    missed, invented, worst = judge(cvode.build("Adams", 1e-9, careful=True), cases[:2])
    assert (missed, invented) == (0, 0)
    assert worst < 1e-6


@pytest.mark.parametrize("lanes", [None, 4])
def test_heyoka_is_right_if_careful_and_not_if_naive(cases, lanes) -> None:
    pytest.importorskip("heyoka")
    missed, invented, worst = judge(taylor.build(1e-15, careful=True, lanes=lanes), cases)
    assert (missed, invented) == (0, 0)
    assert worst < 1e-12
    missed, *_ = judge(taylor.build(1e-15, careful=False, lanes=lanes), cases)
    assert missed > 0


@pytest.mark.parametrize("lanes", [None, 4])
def test_heyoka_stops_in_switches_without_end(cases, lanes, monkeypatch) -> None:
    pytest.importorskip("heyoka")
    monkeypatch.setattr(taylor, "MOST", 1)
    results = taylor.build(1e-9, careful=True, lanes=lanes)([case.start for case in cases[:3]])
    assert [result.state for result in results] == [None] * 3
    assert max(len(result.itinerary) for result in results) == 20 + 2


def test_switches_without_time_are_a_lock() -> None:
    start = reference.Start(Parameters(), (0.0, 0.0, 0.0), 2)
    clock = Clock(start)
    for _ in range(49):
        clock.advance(0.0)
    clock.advance(1.0)
    for _ in range(49):
        clock.advance(1.0)
    with pytest.raises(Locked):
        clock.advance(1.0)
    clock = Clock(start)
    for k in range(119):
        clock.advance(0.01 * k)
    with pytest.raises(Locked):
        clock.advance(2.0)
