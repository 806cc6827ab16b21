"""The first switch: the closed form's error bounds, and no switch missed, invented or misplaced."""

from collections.abc import Iterator
from math import inf, pi
from random import Random
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym._map.backend import MpmathBackend, NumpyBackend
from capsule_sym._map.course import Begin, Course, SegmentStart
from capsule_sym._map.expansion import Guard
from capsule_sym._map.location import End, locate
from capsule_sym._map.transitions import State, select_field
from capsule_sym.results import Outcome
from tests.map import CASES, DIGITS, Motion
from tests.sampling import many, sampled, some

NUMPY = NumpyBackend()
UNIT = NUMPY.unit


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    with mp.workdps(DIGITS + 10):
        yield


def begin(parameters: Parameters, state: tuple[float, ...], angle: float) -> SegmentStart:
    every = [NUMPY.constants(field, parameters) for field in range(1, 7)]
    x_r, v_r, v_c = state
    return select_field(NUMPY, every, State(x_r, x_r - parameters.delta, v_r, v_c, angle))


def flow_of(parameters: Parameters, start: SegmentStart, precise: bool = False) -> Course:
    if not precise:
        return Course(NUMPY, NUMPY.constants(start.field, parameters), start)
    numbers = MpmathBackend()
    c = numbers.constants(start.field, parameters)
    given = start.start
    x_r, v_r = mpf(given.x_r), mpf(given.v_r)
    gap = x_r - mpf(parameters.delta)
    margin = x_r + c.kappa * gap + 2 * c.zeta * v_r - c.friction
    if given.margin == 0:
        margin = mpf(0)
    exact = Begin(x_r, gap, v_r, mpf(given.v_c), margin, mpf(given.angle), given.zeros)
    return Course(numbers, c, SegmentStart(start.field, exact))


def check_errors(motion: Motion, h: float, truth: Any) -> None:
    point = motion.flow(NUMPY)(h)
    found = (point.x_r, point.v_r, point.v_c)
    bounds = (point.error_x, point.error_v, point.error_v_c)
    for name, a, b, bound in zip(("x_r", "v_r", "v_c"), found, truth, bounds, strict=True):
        assert abs(a - b) <= bound, (name, motion, h, float(abs(a - b) / bound) if bound else inf)
    angle = mpf(motion.angle) + mpf(motion.parameters.omega) * mpf(h)
    size = 2 * UNIT * (1 + angle)
    assert abs(point.cos_theta - mp.cos(angle)) <= size
    assert abs(point.sin_theta - mp.sin(angle)) <= size


@sampled
def test_error_bounds_of_the_closed_form_hold() -> None:
    for motion, h in some(CASES, len(CASES) // 9):
        if h:
            vector = motion.state_at(h)
            check_errors(motion, h, vector[:3])


def test_error_bounds_hold_where_a_slip_begins_close_to_the_friction_bound() -> None:
    # With zeta = 0 the force x_r + beta (x_r - delta) exceeds f_b by some units of its rounding.
    case = Parameters(zeta=0.0)
    for seed in range(20):
        random = Random(seed)
        x_r = (1.03 + 10 ** random.uniform(-14, -10)) / 2.5
        motion = Motion(case, 4, (x_r, random.uniform(0, 1e-3), 0.0), random.uniform(0, 6))
        for h in (1e-6, 1e-3):
            point = motion.flow(MpmathBackend())(mpf(h))
            check_errors(motion, h, (point.x_r, point.v_r, point.v_c))


def switch_from(
    parameters: Parameters, state: tuple[float, ...], angle: float = 0.0, limit: float = inf
) -> tuple[SegmentStart, End]:
    start = begin(parameters, state, angle)
    return start, locate(flow_of(parameters, start), min(limit, 20 * parameters.period))


def guard_values(parameters: Parameters, start: SegmentStart, times: Any) -> dict[Guard, Any]:
    """All guards at many times, straight from the kernels."""
    c = NUMPY.constants(start.field, parameters)
    s = start.start
    cosine, sine = NUMPY.cos_sin(s.angle)
    given = NUMPY.kernels.Start(s.x_r, s.gap, s.v_r, s.v_c, s.margin, cosine, sine)
    values = np.transpose([NUMPY.kernels.flow(c, given, time) for time in times])
    gap = s.gap + values[0]
    found = {Guard.GAP: gap if c.contact else -gap}
    if c.drift:
        return found | {Guard.DRIFT: c.drift * (s.v_c + values[2])}
    push = s.x_r + values[0] + c.kappa * gap + 2 * c.zeta * values[1]
    return found | {Guard.UPPER: c.f_b - push, Guard.LOWER: c.f_b + push}


def guard_at(flow: Course, guard: Guard, point: Any) -> Any:
    """Value of a guard at a point."""
    if guard is Guard.GAP:
        return (1 if flow.c.contact else -1) * point.gap
    if guard is Guard.DRIFT:
        return flow.c.drift * point.v_c
    return flow.c.friction_guard(-1 if guard is Guard.UPPER else 1, point.margin)


def root_near(flow: Course, guard: Guard, guess: Any, width: Any) -> Any:
    """The root of a guard by bisection, in an interval on which its sign is seen to change."""
    low, high = guess - width, guess + width
    assert guard_at(flow, guard, flow(low)) > 0 > guard_at(flow, guard, flow(high))
    for _ in range(60):
        middle = (low + high) / 2
        if guard_at(flow, guard, flow(middle)) > 0:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def check_against_samples(parameters: Parameters, start: SegmentStart, switch: End) -> None:
    """No sample before the switch shows a guard negative; at the switch one guard crosses zero."""
    end = switch.duration
    samples = np.concatenate([np.linspace(0, end, 4001)[1:-1], end * np.geomspace(1e-9, 1e-3, 200)])
    for guard, values in guard_values(parameters, start, samples).items():
        assert values.min() >= -1e-13, (guard, start, switch)
    if not switch.certain:  # then it is typed, and true: each guard named is all but zero
        point = switch.point
        flow = flow_of(parameters, start)
        assert switch.guards
        assert all(abs(guard_at(flow, guard, point)) < 1e-12 for guard in switch.guards), switch
        return
    if switch.outcome is not Outcome.REGULAR:
        assert switch.guards == ()
        return
    (guard,) = switch.guards
    precise = flow_of(parameters, start, precise=True)
    at = precise(mpf(end))
    slope = (
        guard_at(precise, guard, precise(mpf(end) * (1 + mpf(2) ** -40)))
        - guard_at(precise, guard, at)
    ) / (end * mpf(2) ** -40)
    scale = 1 + max(map(abs, (at.x_r, at.v_r, at.v_c)))
    # The accuracy contract 8 u (t + M / |g'|), and room for the parameters' own rounding.
    allowed = 8 * UNIT * (end + 10 * scale / abs(slope))
    root = root_near(precise, guard, mpf(end), min(allowed, mpf(end) / 2))
    assert abs(root - end) <= allowed


SEEDS = many(150, 10)


def random_start(seed: int) -> tuple[Parameters, tuple[float, float, float], float]:
    random = Random(seed)
    parameters = Parameters(
        alpha=random.choice([0.0, 10 ** random.uniform(-2, 1)]),
        omega=10 ** random.uniform(-1, 1),
        delta=random.choice([0.0, 10 ** random.uniform(-2, 0.5)]),
        zeta=random.choice([0.0, 10 ** random.uniform(-2, 1)]),
        beta=10 ** random.uniform(-1, 3),
        gamma=10 ** random.uniform(-1.5, 1.5),
    )
    state = (
        parameters.delta + random.gauss(0, 1),
        random.gauss(0, 1),
        random.choice([0.0, random.gauss(0, 1)]),
    )
    return parameters, state, random.uniform(0, 2 * pi)


@sampled
@pytest.mark.parametrize("seed", range(SEEDS))
def test_the_first_switch_is_what_dense_sampling_and_bisection_find(seed: int) -> None:
    parameters, state, angle = random_start(seed)
    start, switch = switch_from(parameters, state, angle)
    check_against_samples(parameters, start, switch)


def test_most_first_switches_are_found_and_certain() -> None:
    # The comparison above would mean little if the outcomes were mostly something else.
    outcomes = [switch_from(*random_start(seed))[1].outcome for seed in range(SEEDS)]
    assert outcomes.count(Outcome.REGULAR) > SEEDS / 2


def on_impact(field: int, parameters: Parameters, v_r: float, angle: float = 0.0) -> SegmentStart:
    """A start on x_r = delta into a sticking field, the root at the start known exactly."""
    c = NUMPY.constants(field, parameters)
    margin = parameters.delta + 2 * parameters.zeta * v_r - c.friction
    start = Begin(parameters.delta, 0.0, v_r, 0.0, margin, angle, {Guard.GAP: 1})
    return SegmentStart(field, start)


@pytest.mark.parametrize("contact", [1e-1, 1e-3, 1e-6, 1e-8])
def test_a_shallow_contact_is_found_from_both_its_crossings(contact: float) -> None:
    # In F5 at tau = pi / omega the mass is pushed back, x_r'' = -(alpha + P) = -(0.7 + 0.02).
    case = Parameters(zeta=0.0)
    start = on_impact(5, case, v_r=0.36 * contact, angle=pi)
    switch = locate(flow_of(case, start), 10.0)
    assert (switch.outcome, switch.guards) == (Outcome.REGULAR, (Guard.GAP,))
    precise = flow_of(case, start, precise=True)
    root = root_near(precise, Guard.GAP, mpf(contact), mpf(contact) / 10)
    assert abs(switch.duration - root) <= 16 * UNIT * root


@pytest.mark.parametrize("exponent", [7, 10, 13])
def test_a_stiff_contact_is_found_from_both_its_crossings(exponent: int) -> None:
    # Without damping and forcing contact lasts pi / sqrt(1 + beta), up to the preload delta.
    case = Parameters(alpha=0.0, zeta=0.0, delta=0.0, beta=10.0**exponent, f_b=1e9)
    for v_r in (1e-3, 1.0):
        switch = locate(flow_of(case, on_impact(5, case, v_r)), 10.0)
        assert (switch.outcome, switch.guards) == (Outcome.REGULAR, (Guard.GAP,))
        assert switch.duration == pytest.approx(pi / (1 + case.beta) ** 0.5, rel=16 * UNIT)
        assert switch.point.v_r == pytest.approx(-v_r, rel=1e-14)


@pytest.mark.parametrize("field", [1, 4])
def test_a_slip_that_begins_at_the_friction_bound_does_not_end_at_its_start(field: int) -> None:
    case = Parameters(delta=0.5)
    every = [NUMPY.constants(f, case) for f in range(1, 7)]
    x_r = 0.3 if field == 1 else 0.6
    v_r = 10 * (1 - x_r - (1.5 * (x_r - 0.5) if field == 4 else 0.0))
    start = select_field(NUMPY, every, State(x_r, x_r - 0.5, v_r, 0.0, 0.3, bound=1))
    assert start.field == field
    assert start.start.zeros == {Guard.DRIFT: 2}
    switch = locate(flow_of(case, start), 100.0)
    check_against_samples(case, start, switch)
    assert switch.outcome is Outcome.REGULAR
    assert switch.duration > 1e-2


@pytest.mark.parametrize("push", [1e-2, 1e-5, 1e-8])
def test_a_micro_slip_is_found_to_its_end(push: float) -> None:
    # From the bound with P' = push and P'' < 0: v_c = push h^2/2 - |P''| h^3/6 + ... over gamma,
    # zero again near h = 3 push / |P''|. In F1 at zeta = 0, P' = v_r and P'' = alpha - f_b.
    case = Parameters(alpha=0.5, zeta=0.0, delta=2.0)
    every = [NUMPY.constants(field, case) for field in range(1, 7)]
    start = select_field(NUMPY, every, State(1.0, -1.0, push, 0.0, 0.0, bound=1))
    assert (start.field, start.start.zeros) == (1, {Guard.DRIFT: 2})
    switch = locate(flow_of(case, start), 100.0)
    assert (switch.outcome, switch.guards) == (Outcome.REGULAR, (Guard.DRIFT,))
    precise = flow_of(case, start, precise=True)
    guess = mpf(6 * push)
    root = root_near(precise, Guard.DRIFT, guess, guess / 10)
    assert abs(switch.duration - root) <= 64 * UNIT * root


def test_a_run_that_ends_before_the_switch_ends_in_no_switch() -> None:
    case = Parameters()
    start = begin(case, (0.0, 0.0, 0.0), 0.0)
    root = locate(flow_of(case, start), 10.0).duration
    assert 0 < root < 10
    for limit in (root / 2, root * (1 - 1e-12)):
        switch = locate(flow_of(case, start), limit)
        assert (switch.outcome, switch.guards, switch.duration) == (Outcome.END, (), limit)
    for limit in (root * (1 + 1e-12), 2 * root, 1e6):
        switch = locate(flow_of(case, start), limit)
        assert (switch.outcome, switch.duration) == (
            Outcome.REGULAR,
            pytest.approx(root, rel=1e-15),
        )


def test_a_pair_of_crossings_between_two_looks_is_found() -> None:
    # x_r = A cos(tau - t0) in F2 without forcing, delta below its top by 1e-8: in contact for
    # about 2.8e-4 only.
    delta = 1.0 - 1e-8
    case = Parameters(alpha=0.0, zeta=0.0, delta=delta, f_b=2.0)
    for top in (0.5, 1.7, 3.0):
        state = (float(mp.cos(top)), float(mp.sin(top)), 0.0)
        start, switch = switch_from(case, state)
        assert (start.field, switch.outcome, switch.guards) == (2, Outcome.REGULAR, (Guard.GAP,))
        amplitude = mp.hypot(*map(mpf, state[:2]))
        before = mp.acos(mpf(delta) / amplitude)
        root = mp.atan2(mpf(state[1]), mpf(state[0])) - before
        assert abs(switch.duration - root) < 8 * UNIT * (root + 2 / mp.sin(before))


def test_a_near_miss_is_no_switch() -> None:
    for above in (1e-3, 1e-8, 1e-13):
        case = Parameters(alpha=0.0, zeta=0.0, delta=1.0 + above, f_b=2.0)
        start, switch = switch_from(case, (0.0, 1.0, 0.0), limit=10.0)
        assert start.field == 2
        assert switch.guards == ()
        assert switch.outcome in (Outcome.NEVER, Outcome.END)
