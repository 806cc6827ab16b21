"""A segment of duration h1 + h2 is one of h1 followed by one of h2, in double precision."""

from __future__ import annotations

import math

from hypothesis import example, given, settings
from hypothesis import strategies as st

from capsule_sym import Parameters
from tests.crosscheck import UNIT, Case, double, flow_scale

# 16 for each of three flows; the halfway state's error is carried on with a gain of order one.
BOUND = 48.0

durations = st.floats(1e-6, 20.0)
parameters = st.builds(
    Parameters,
    alpha=st.floats(0, 2),
    omega=st.floats(1e-2, 1e2),
    delta=st.floats(0, 0.5),
    zeta=st.just(0.0) | st.floats(1e-6, 20),
    beta=st.floats(0, 100),
    gamma=st.floats(0.1, 100),
    f_b=st.just(1.0),
)
states = st.tuples(*[st.floats(-1, 1)] * 3)


def advanced(case: Case) -> tuple[tuple[float, float, float], float]:
    """State at the end, and the advance of the capsule."""
    c, start = case.constants(double, float), case.start(double, float)
    position, velocity, *rest = double.flow(c, start, case.duration, advance=True)
    change, advance = rest or (0.0, case.state[2] * case.duration)
    return (case.state[0] + position, velocity, case.state[2] + change), advance


@settings(max_examples=300)
@example(  # x_r = -f_b: no margin at the start, and a rounded one halfway
    Parameters(0.0, 1.0, 0.0, 0.0, 0.0, 8.0, 1.0), 3, (-1.0, 0.0, 0.0), 0.0, 0.015625, 0.0625
)
@given(parameters, st.integers(1, 6), states, st.floats(0, 6.28), durations, durations)
def test_durations_add(
    p: Parameters,
    field: int,
    state: tuple[float, float, float],
    theta: float,
    first: float,
    second: float,
) -> None:
    whole = Case(p, field, state, theta, first + second)
    half = Case(p, field, state, theta, first)
    halfway, gained = advanced(half)
    rest = Case(p, field, halfway, math.fmod(theta + p.omega * first, 2 * math.pi), second)
    end, more = advanced(rest)
    direct, advance = advanced(whole)
    position, velocity, drift, path = flow_scale(whole)
    # The rounding of a state that is added to, and of the angle in between, come on top.
    angle = UNIT * p.omega * first * p.alpha * second
    # So does the rounding of the x_r halfway in a margin that cancels: it is carried to v_c.
    c = rest.constants(double, float)
    carried = abs(c.drift) * (1 + c.kappa) * abs(halfway[0]) * second / p.gamma
    sizes = (
        abs(state[0]) + position,
        velocity,
        abs(state[2]) + drift + carried,
        abs(state[2]) + path + carried * second,
    )
    pairs = zip((*direct, advance), (*end, gained + more), sizes, strict=True)
    for one, two, size in pairs:
        assert abs(one - two) <= BOUND * (UNIT * size + angle * (1 + second))
