"""Runs from random states at random admissible parameters, in the three scenarios of delta."""

from itertools import pairwise, zip_longest
from math import isfinite, pi
from typing import Any

import numpy as np
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from capsule_sym import Parameters, results, simulate
from tests.judges import CONTACT, DRIFT, taylor
from tests.sampling import many, sampled

# A run is reported as found: shrinking takes longer than it is worth.
FOUND = (Phase.explicit, Phase.reuse, Phase.generate)


def magnitude(low: float, high: float) -> st.SearchStrategy[float]:
    """Powers of ten between two exponents."""
    return st.floats(low, high).map(lambda exponent: float(10**exponent))


@st.composite
def parameters(draw: st.DrawFn) -> Parameters:
    f_b = draw(st.sampled_from([1.0, 0.3]))
    return Parameters(
        alpha=draw(st.just(0.0) | magnitude(-2, 1)),
        omega=draw(magnitude(-0.7, 0.7)),
        # delta < f_b, delta = f_b, delta > f_b
        delta=f_b * draw(st.sampled_from([0.0, 0.02, 0.7, 1.0, 1.5, 4.0])),
        zeta=draw(st.just(0.0) | magnitude(-3, 1)),
        beta=draw(st.just(0.0) | magnitude(-1, 4)),
        gamma=draw(magnitude(-1.5, 1.5)),
        f_b=f_b,
    )


@st.composite
def starts(draw: st.DrawFn) -> tuple[Parameters, tuple[float, float, float], float]:
    """Parameters, a state anywhere or on an impact surface or at rest, and a phase."""
    case = draw(parameters())
    # Without forcing and damping a start at rest comes back to its own tangency for ever.
    assume(case.alpha or case.zeta)
    # Not smaller than 1e-6: sizes at which doubles end are cases of their own.
    number = st.integers(-3_000_000, 3_000_000).map(lambda millionths: millionths / 1e6)
    x_r = draw(st.just(case.delta) | number)
    state = (x_r, draw(st.just(0.0) | number), draw(st.just(0.0) | number))
    return case, state, draw(st.integers(0, 999)) / 1000 * 2 * pi / case.omega


def check(run: results.Trajectory) -> None:
    """Nothing but finite numbers, states within each segment's region, segments that join."""
    case = run.parameters
    assert run.success
    assert run.final[0] == (2, 0)
    for segment in run.segments:
        numbers = (*segment.start_state, *segment.end_state, segment.duration, segment.advance)
        assert all(isfinite(float(value)) for value in numbers)
        assert 0 <= segment.start.phase <= case.period
        assert segment.start <= segment.end
        assert segment.duration > 0
        # Within the segment the state stays in its region, Eqs. (7)-(12), up to rounding.
        begin = segment.start.period * case.period + float(segment.start.phase)
        stop = segment.end.period * case.period + float(segment.end.phase)
        states = run(np.linspace(begin, min(stop, begin + float(segment.duration)), 9)[1:-1])
        slack = 1e-9 * (1 + np.abs(states).max())
        side = 1 if CONTACT[segment.field] else -1
        assert np.all(side * (states[:, 0] - case.delta) >= -slack)
        push = states[:, 0] + 2 * case.zeta * states[:, 1]
        if CONTACT[segment.field]:
            push += case.beta * (states[:, 0] - case.delta)
        if drift := DRIFT[segment.field]:
            assert np.all(drift * states[:, 2] >= -slack)
        else:
            assert np.all(np.abs(push) <= case.f_b + slack * (1 + case.beta + case.zeta))
    for before, after in pairwise(run.segments):
        assert before.end_state == after.start_state
        assert before.end == after.start
        assert before.target == after.source
    assert run.segments[-1].outcome in (results.Outcome.END, results.Outcome.NEVER)


@sampled
@given(starts())
@settings(max_examples=many(120, 20), phases=FOUND)
def test_every_run_is_complete_and_stays_in_its_regions(start: Any) -> None:
    case, state, phase = start
    check(simulate(case, state, phase, 2))


@sampled
@given(starts())
@settings(max_examples=many(12, 3), phases=FOUND)
def test_double_agrees_with_50_digits_on_the_list_of_fields(start: Any) -> None:
    case, state, phase = start
    double = simulate(case, state, phase, 2)
    precise = simulate(case, state, phase, 2, backend="mpmath")
    fields = [[segment.field for segment in run.segments] for run in (double, precise)]
    # Two systems that switch at almost the same time may part: then the segment is as short.
    if fields[0] != fields[1]:
        parted = next(i for i, pair in enumerate(zip_longest(*fields)) if len(set(pair)) > 1)
        shortest = min(float(run.segments[parted].duration) for run in (double, precise))
        assert shortest < 1e-9, (fields, shortest)


@sampled
@given(starts())
@settings(max_examples=many(10, 3), phases=FOUND)
def test_every_segment_is_the_motion_that_the_judge_integrates(start: Any) -> None:
    case, state, phase = start
    for segment in simulate(case, state, phase, 1).segments[:6]:
        tau = segment.start.period * case.period + segment.start.phase
        truth = taylor.integrate(
            case, segment.field, (*segment.start_state, 0.0), tau, segment.duration, digits=20
        )
        scale = 1 + max(map(abs, (*segment.start_state, *segment.end_state)))
        found = (*segment.end_state, segment.advance)
        for one, other in zip(found, truth, strict=True):
            assert abs(one - other) <= 1e-10 * scale * (1 + segment.duration) * (1 + case.alpha)
