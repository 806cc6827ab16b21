"""Runs and what is read off them: states at any time, how segments join, steady motion, input."""

from itertools import pairwise
from math import inf, isfinite, nan, pi
from random import Random
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import InvalidInput, Parameters, results, simulate
from capsule_sym._map.backend import MpmathBackend, NumpyBackend
from tests.judges import dop853, taylor
from tests.sampling import sampled, some

# Two periods of motion, one of them with an impact every second period only.
DOUBLED = [
    Parameters(alpha=1.07, omega=2.71, delta=0.0, zeta=0.05, beta=47.8, gamma=1.0),
    Parameters(alpha=0.67, omega=3.49, delta=0.0, zeta=0.1, beta=245.6, gamma=5.2),
]


@pytest.fixture(scope="module")
def run() -> results.Trajectory:
    """A run that starts at a phase and visits all six fields."""
    trajectory = simulate(Parameters(alpha=1.5, gamma=3.0), (0.1, -0.2, 0.3), 1.25, 12)
    assert {segment.field for segment in trajectory.segments} == set(range(1, 7))
    return trajectory


def start_time(trajectory: results.Trajectory, index: int) -> float:
    begin = trajectory.segments[index].start
    return begin.period * trajectory.parameters.period + float(begin.phase)


@sampled
def test_states_in_between_are_those_of_the_motion(run: results.Trajectory) -> None:
    random, position = Random(0), run.segments[0].position
    judged = some(range(len(run.segments)), 20)
    for index, segment in enumerate(run.segments):
        assert segment.position == position
        if index in judged:
            tau, h = start_time(run, index), random.random() * segment.duration
            truth = taylor.integrate(
                run.parameters, segment.field, (*segment.start_state, 0.0), tau, h, digits=25
            )
            assert run(tau + h) == pytest.approx([float(a) for a in truth[:3]], abs=2e-13)
            assert run.position(tau + h) == pytest.approx(float(position + truth[3]), abs=2e-13)
        position += segment.advance
    assert run.advance == position


def test_times_may_have_any_shape(run: results.Trajectory) -> None:
    stop = 12 * run.parameters.period
    times = np.random.default_rng(0).uniform(1.25, stop, (3, 4, 5))
    states, positions = run(times), run.position(times)
    assert (states.shape, positions.shape) == ((3, 4, 5, 3), (3, 4, 5))
    for place in np.ndindex(3, 4, 5):
        one = float(times[place])
        assert run(one).shape == (3,)
        assert run.position(one).shape == ()
        np.testing.assert_allclose(states[place], run(one), rtol=0, atol=1e-15)
        assert positions[place] == pytest.approx(float(run.position(one)), abs=1e-14)
    assert run(np.empty((0, 2))).shape == (0, 2, 3)
    np.testing.assert_array_equal(run([1.25, 2]), np.stack([run(1.25), run(2.0)]))


def test_both_ends_belong_to_the_run(run: results.Trajectory) -> None:
    np.testing.assert_array_equal(run(1.25), [0.1, -0.2, 0.3])
    assert run.position(1.25) == 0
    end, state = run.final
    assert end == (12, 0.0)
    np.testing.assert_allclose(run(12 * run.parameters.period), state, rtol=0, atol=1e-13)
    assert run.position(12 * run.parameters.period) == pytest.approx(run.advance, abs=1e-13)


@pytest.mark.parametrize("t", [1.0, -1.0, 95.0, nan, inf, [2.0, 1.2], [[2.0, nan]]])
def test_times_outside_the_run_are_refused(run: results.Trajectory, t: Any) -> None:
    for evaluate in (run, run.position):
        with pytest.raises(InvalidInput, match=r"t = .*must be a time in") as caught:
            evaluate(t)
        assert caught.value.field == "t"


def test_segments_join(run: results.Trajectory) -> None:
    for before, after in pairwise(run.segments):
        assert before.end_state == after.start_state
        assert before.end == after.start
        assert before.target == after.source != ""
        assert before.field != after.field
        assert before.outcome is results.Outcome.REGULAR
    last = run.segments[-1]
    assert (last.target, last.outcome) == ("", results.Outcome.END)
    assert run.segments[0].source == ""  # it starts off every plane, moving


def test_each_end_lies_on_its_plane(run: results.Trajectory) -> None:
    for segment in run.segments[:-1]:
        x_r, v_r, v_c = segment.end_state
        if int(segment.target[1:]) < 7:
            assert v_c == 0
        else:
            assert x_r == run.parameters.delta
            rising, forward = segment.target in ("Σ7", "Σ9"), segment.target in ("Σ7", "Σ8")
            assert ((v_r > 0), (v_c > 0)) == (rising, forward)


def test_times_are_periods_and_phases(run: results.Trajectory) -> None:
    period = run.parameters.period
    for segment in run.segments:
        for instant in (segment.start, segment.end):
            assert isinstance(instant.period, int)
            assert 0 <= instant.phase < period
        assert segment.duration > 0
        whole, part = (b - a for a, b in zip(segment.start, segment.end, strict=True))
        assert segment.duration == pytest.approx(whole * period + part, abs=1e-14)
        assert segment.start < segment.end


def test_notation() -> None:
    names = ["NC-FD", "NC-S", "NC-BD", "C-FD", "C-S", "C-BD"]
    for segment in simulate(Parameters(alpha=1.5, gamma=3.0), periods=4).segments[:-1]:
        assert segment.name == f"F{segment.field}"
        assert segment.mode == names[segment.field - 1]
        expected = "P_{" + f"{segment.target},{segment.name},{segment.source}" + "}"
        assert segment.local_map == expected


def test_states_at_whole_periods(run: results.Trajectory) -> None:
    period = run.parameters.period
    assert len(run.stroboscopic) == 12
    for number, state in enumerate(run.stroboscopic, start=1):
        np.testing.assert_allclose(run(number * period), state, rtol=0, atol=1e-12)
    from_rest = simulate(Parameters(), periods=3)
    assert len(from_rest.stroboscopic) == 4
    np.testing.assert_array_equal(from_rest.stroboscopic[0], 0.0)


@pytest.mark.parametrize("numbers", [NumpyBackend(), MpmathBackend()], ids=lambda b: b.name)
def test_an_angle_is_split_into_whole_turns_and_a_rest(numbers: Any) -> None:
    with mp.workdps(50):
        for count in (0, 1, 2, 3, 10, 1000):
            for offset in (-1e-3, -1e-12, 0.0, 1e-12, 1.0, 3.0):
                angle = numbers.number(2 * pi * count + offset)
                if angle < 0:
                    continue
                whole, rest = numbers.turns(angle)
                assert 0 <= rest < 2 * mp.pi
                assert abs(2 * mp.pi * whole + mpf(rest) - mpf(angle)) <= 4 * 2.0**-53 * angle


def test_a_state_after_many_turns_of_fast_forcing_is_at_the_right_phase() -> None:
    case = Parameters(alpha=30.0, omega=40.0, delta=0.5)
    for phase in (0.0, 0.03, 0.15):
        one = simulate(case, (0.0, 0.0, 0.0), phase, 60)
        other = dop853.run(case, (0.0, 0.0, 0.0), phase, 2)
        assert "".join(str(s.field) for s in one.segments).startswith(other.fields[:-1])
        for segment, theirs in zip(one.segments, other.segments[:-1], strict=False):
            end = segment.end.period * case.period + segment.end.phase
            assert end == pytest.approx(theirs.end, abs=1e-10)


def test_a_switch_at_a_whole_period_does_not_lose_it() -> None:
    # At resonance without damping the motion comes back to x_r = delta after exactly one period.
    case = Parameters(
        alpha=0.29868932310650864, omega=1.0, delta=0.02, zeta=0.0, beta=0.0, gamma=1.0
    )
    run = simulate(case, (0.02, 0.0, 0.0), periods=2)
    judged = dop853.run(case, (0.02, 0.0, 0.0), periods=2)
    assert "".join(str(segment.field) for segment in run.segments) == judged.fields
    for segment, theirs in zip(run.segments, judged.segments, strict=True):
        assert segment.end.period * case.period + segment.end.phase == pytest.approx(theirs.end)
    assert run.final[1] == pytest.approx(judged.final[:3], abs=1e-10)


def test_a_steady_motion_of_one_period() -> None:
    run = simulate(Parameters(alpha=0.7), periods=60)
    motion = run.steady()
    assert motion is not None
    assert motion.itinerary == ("F5", "F4", "F1", "F2")
    assert motion.global_map == ("P_{Σ5,F2,Σ2} ∘ P_{Σ2,F1,Σ8} ∘ P_{Σ8,F4,Σ4} ∘ P_{Σ4,F5,Σ5}")
    assert motion.period_number == 1
    check_steady(run, motion)


def check_steady(run: results.Trajectory, motion: Any) -> None:
    """The motion repeats by an independent integrator, and advances by its progression."""
    period_number, period = motion.period_number, run.parameters.period
    count = len(run.stroboscopic) - 1
    ends = run.position([(count - period_number) * period, count * period])
    assert period_number * motion.progression == pytest.approx(ends[1] - ends[0], abs=1e-8)
    _, state = run.final
    again = dop853.run(run.parameters, [float(a) for a in state], 0.0, period_number)
    assert again.final[:3] == pytest.approx(state, abs=1e-8)
    assert again.final[3] == pytest.approx(period_number * motion.progression, abs=1e-8)
    for shorter in range(1, period_number):
        between = dop853.run(run.parameters, [float(a) for a in state], 0.0, shorter)
        assert max(abs(a - b) for a, b in zip(between.final, state, strict=False)) > 1e-3
    cycle = [*motion.segments, motion.segments[0]]
    assert all(a.target == b.source for a, b in pairwise(cycle))


@pytest.mark.parametrize("case", DOUBLED)
def test_a_steady_motion_of_two_periods(case: Parameters) -> None:
    run = simulate(case, periods=120)
    motion = run.steady()
    assert motion is not None
    assert motion.period_number == 2
    check_steady(run, motion)
    assert run.steady(longest=1) is None
    assert run.steady(longest=2) == motion
    with pytest.raises(InvalidInput, match="longest = 0"):
        run.steady(longest=0)


def test_rest_is_a_steady_motion_without_switches() -> None:
    motion = simulate(Parameters(alpha=0.005), periods=100).steady()
    assert motion is not None
    assert motion.global_map == "Id_{Σ2,F2,Σ2}"
    assert (motion.itinerary, motion.period_number, motion.progression) == (("F2",), 1, 0)


@pytest.mark.long
def test_slow_alternating_convergence_is_not_taken_for_a_doubled_period() -> None:
    # At alpha = 0.3 a multiplier near -0.98 leaves differences of alternating sign.
    run = simulate(Parameters(alpha=0.3), periods=60)
    last = np.array(run.stroboscopic[-3:], dtype=float)
    once, twice = np.abs(last[2] - last[1]).max(), np.abs(last[2] - last[0]).max()
    assert 1e-9 < twice < once / 10
    assert run.steady() is None
    assert run.steady(tolerance=2 * twice) is None
    later = simulate(Parameters(alpha=0.3), periods=500).steady(tolerance=1e-4)
    assert later is not None
    assert later.period_number == 1


@pytest.mark.parametrize("phase", [0.0, 3.0])
def test_a_steady_motion_is_read_off_the_last_periods(phase: float) -> None:
    run = simulate(Parameters(alpha=0.7), (0.0, 0.0, 0.0), phase, 60)
    motion = run.steady()
    assert motion is not None
    assert run.segments[-1].outcome is results.Outcome.END
    assert max(segment.end for segment in motion.segments) == run.segments[-2].end


BAD = [
    ("state", {"state": (0.0, 0.0)}),
    ("state", {"state": (0.0, 0.0, 0.0, 0.0)}),
    ("state", {"state": (0.0, nan, 0.0)}),
    ("state", {"state": (inf, 0.0, 0.0)}),
    ("state", {"state": ("0", "0", "0")}),
    ("state", {"state": "000"}),
    ("state", {"state": (0.0, None, 0.0)}),
    ("state", {"state": (10**400, 0.0, 0.0)}),
    ("state", {"state": 1.0}),
    ("state", {"state": None}),
    ("phase", {"phase": -1e-9}),
    ("phase", {"phase": 2 * pi / 0.8}),
    ("phase", {"phase": nan}),
    ("phase", {"phase": "0"}),
    ("phase", {"phase": True}),
    ("periods", {"periods": 0}),
    ("periods", {"periods": -1}),
    ("periods", {"periods": 1.5}),
    ("periods", {"periods": True}),
    ("periods", {"periods": "3"}),
    ("backend", {"backend": "fortran"}),
]


@pytest.mark.parametrize(("field", "bad"), BAD, ids=lambda value: str(value)[:40])
def test_bad_input_is_refused_by_name(field: str, bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput) as caught:
        simulate(Parameters(), **{"periods": 1, **bad})
    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field} = ")
    assert "must be" in str(caught.value)


def test_whole_numbers_are_numbers_too() -> None:
    one, other = simulate(Parameters(), (0, 0, 0), 0, 2), simulate(Parameters(), periods=2)
    assert one.final == other.final
    array = simulate(Parameters(), np.zeros(3), np.float64(0.0), 2)
    assert array.final == other.final


def test_fifty_digits_are_kept() -> None:
    run = simulate(Parameters(), periods=2, backend="mpmath")
    with mp.workdps(60):
        for value in (*run.final[1][:2], run.advance, run.segments[1].duration):
            assert mpf(value) != mpf(float(value))
    times = np.linspace(0, 2 * run.parameters.period, 50)
    double = simulate(Parameters(), periods=2)
    np.testing.assert_allclose(run(times), double(times), rtol=0, atol=1e-14)
    np.testing.assert_allclose(run.position(times), double.position(times), rtol=0, atol=1e-14)
    assert all(isfinite(float(a)) for a in run.final[1])
