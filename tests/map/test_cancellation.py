"""Near exact cancellation: a computed zero is no knowledge, and itineraries are those of 50 digits.

A start on the impact surface at v_r = 0 where the forcing balances friction (alpha cos theta = f_b)
leaves it with x_r'' = 0 too, so that a drift of a duration h moves x_r by no more than some h^3.
"""

from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from capsule_sym import Parameters, results, simulate
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.location import End
from capsule_sym._map.transitions import reached, tells
from capsule_sym._native import core
from tests.map import Motion
from tests.sampling import many, sampled

BACKENDS = ["numpy", "mpmath"] if core is None else ["c", "numpy", "mpmath"]
NAMED = Parameters(0.5, 1, 0, 0, 0, 1, 0.5), (0.0, 0.0, -1e-9), 0.0
CERTAIN = (results.Outcome.REGULAR, results.Outcome.END, results.Outcome.NEVER)
Start = tuple[Parameters, tuple[float, float, float], float]


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_rounding_makes_zero_is_not_taken_to_be_zero(backend: str) -> None:
    parameters, state, phase = NAMED
    run = simulate(parameters, state, phase, periods=1, backend=backend, max_segments=3)
    assert [s.name for s in run.segments] == ["F3", "F2", "F5"]
    # By the series at the start: v_c = -v + h/2 + ..., x_r'''' = -1/2 and P = x_r, so that after
    # h = 2 v the position is -(2 v)^4/48 and its rate -(2 v)^3/12.
    x_r, v_r, v_c = run.segments[0].end_state
    assert float(x_r) == pytest.approx(-((2e-9) ** 4) / 48, rel=1e-9)
    assert float(v_r) == pytest.approx(-((2e-9) ** 3) / 12, rel=1e-9)
    assert v_c == 0
    assert float(run.segments[1].end_state[0]) == 0


def test_where_fifty_digits_are_not_asked_the_proved_sign_is_kept() -> None:
    parameters, state, phase = NAMED
    run = simulate(parameters, state, phase, 1, backend="numpy", escalate=False, max_segments=2)
    assert run.segments[0].end_state[0] < 0
    assert [s.name for s in run.segments] == ["F3", "F2"]


@pytest.mark.parametrize(
    ("guards", "name", "sign"),
    [
        ((Guard.DRIFT,), "gap", -1),  # F3 has no contact
        ((), "gap", -1),
        ((Guard.GAP,), "v_r", 1),  # into contact
        ((Guard.GAP,), "v_c", -1),  # F3 drifts back
        ((), "v_c", -1),
    ],
)
def test_every_sign_that_is_proved_shows(guards: tuple[Guard, ...], name: str, sign: int) -> None:
    flow = Motion(Parameters(), 3, (-0.5, 0.7, -1.0), 0.3).flow(NumpyBackend())
    point = flow(0.1)
    assert point.gap < 0 < point.v_r
    assert point.v_c < 0
    outcome = results.Outcome.REGULAR if guards else results.Outcome.END
    assert tells(flow, End(outcome, guards, 0.1, point, 1))
    for hidden in (0.0, -sign * 1e-40):
        switch = End(outcome, guards, 0.1, point._replace(**{name: hidden}), 1)
        assert not tells(flow, switch)
        state = reached(flow, switch, 0.4)
        error = {"gap": point.error_x, "v_r": point.error_v, "v_c": point.error_v_c}[name]
        assert 0 < sign * getattr(state, name) <= error


tiny = st.tuples(st.sampled_from([-1.0, 1.0]), st.integers(3, 17)).map(
    lambda t: t[0] * 10.0 ** -t[1]
)


@st.composite
def starts(draw: Any) -> Start:
    """Starts from round numbers and tiny ones, many of them where several terms cancel."""
    f_b, delta = draw(st.sampled_from([0.5, 1.0])), draw(st.sampled_from([0.0, 0.5, 0.02]))
    parameters = Parameters(
        alpha=draw(st.sampled_from([0.0, f_b, 2 * f_b, 0.25])),
        omega=draw(st.sampled_from([0.5, 1.0, 2.0])),
        delta=delta,
        zeta=draw(st.sampled_from([0.0, 0.05, 1.0])),
        beta=draw(st.sampled_from([0.0, 1.0, 1.5])),
        gamma=draw(st.sampled_from([0.5, 1.0, 3.0])),
        f_b=f_b,
    )
    x_r = draw(
        st.one_of(st.just(delta), tiny.map(lambda t: delta + t), st.sampled_from([0.0, f_b]))
    )
    v_r = draw(st.one_of(st.just(0.0), tiny, st.sampled_from([0.5, -0.5])))
    v_c = draw(st.one_of(st.just(0.0), tiny))
    return parameters, (x_r, v_r, v_c), draw(st.sampled_from([0.0, parameters.period / 8]))


@sampled
@settings(max_examples=many(24, 8), deadline=None, derandomize=True)
@given(starts())
@example(NAMED)
# A slope that is proved not to vanish, and that is computed as zero.
@example((Parameters(0.25, 0.5, 1, 0.25, 1, 3, 1), (1.0, 1e-17, 0.0), 3.141592653589793))
@example((Parameters(0.5, 1, 0, 0.05, 1, 1, 0.5), (0.0, 0.0, -1e-11), 0.0))
@example((Parameters(1, 0.5, 0, 1, 0, 1, 1), (0.0, 0.0, -1e-13), 0.0))
@example((Parameters(1.5, 2, 0.5, 0, 1, 1, 0.5), (0.5, 0.0, -1e-8), 0.0))
def test_first_switch_and_what_follows_are_those_of_fifty_digits(start: Start) -> None:
    parameters, state, phase = start
    exact = simulate(parameters, state, phase, 1, backend="mpmath", max_segments=2).segments
    for backend in BACKENDS[:-1]:
        found = simulate(parameters, state, phase, 1, backend=backend, max_segments=2).segments
        for one, true in zip(found, exact, strict=True):
            if one.outcome not in CERTAIN or true.outcome not in CERTAIN:
                return
            assert one.field == true.field
        assert found[0].target == exact[0].target
        assert found[0].duration == pytest.approx(float(exact[0].duration), rel=1e-12)
