"""Successor field at a start on each surface, line and corner point.

Expected fields follow from Tables 1 and 2 and, where a row leaves a choice, from the sign of the
first derivative that does not vanish, worked out by hand in the comments. With zeta = 1/4 and
f_b = 1 the force is P3 = x_r + v_r/2, P4 = P3 + 3/2 (x_r - delta), and on the friction bound
P = +-1 with the capsule at rest its rate is P3' = v_r + (alpha cos(theta) -+ 1)/2 without contact,
P4' = 5/2 v_r + (alpha cos(theta) -+ 1)/2 in contact, Eqs. (22) and (23).
"""

from math import pi
from typing import Any

import pytest
from mpmath import mp

from capsule_sym import Parameters, results, simulate
from capsule_sym._map.backend import Backend, MpmathBackend, NumpyBackend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.transitions import State, select_field

NEAR = Parameters(alpha=0.7, gamma=3.0, zeta=0.25, delta=0.5)
FAR = NEAR.replace(delta=2.0)
EQUAL = NEAR.replace(delta=1.0)
GAP, DRIFT, UPPER, LOWER = Guard.GAP, Guard.DRIFT, Guard.UPPER, Guard.LOWER

# Parameters, alpha, place, (x_r, v_r, v_c), bound, angle; the field, and which guards vanish at
# the start with how many derivatives.
STARTS: list[tuple[Any, ...]] = [
    # Surfaces, Table 1.
    (NEAR, 0.7, "S1", (-0.5, 4.0, 0.0), 0, 1.0, 1, {DRIFT: 1}),  # P3 = 1.5
    (NEAR, 0.7, "S2", (0.0, 0.0, 0.0), 0, 1.0, 2, {}),
    (NEAR, 0.7, "S3", (-0.5, -4.0, 0.0), 0, 1.0, 3, {DRIFT: 1}),  # P3 = -2.5
    (NEAR, 0.7, "S4", (0.75, 2.0, 0.0), 0, 1.0, 4, {DRIFT: 1}),  # P4 = 2.125
    (NEAR, 0.7, "S5", (0.625, 0.0, 0.0), 0, 1.0, 5, {}),
    (NEAR, 0.7, "S6", (0.75, -9.0, 0.0), 0, 1.0, 6, {DRIFT: 1}),  # P4 = -3.375
    (NEAR, 0.7, "S7", (0.5, 4.0, 0.1), 0, 1.0, 4, {GAP: 1}),
    (NEAR, 0.7, "S8", (0.5, -4.0, 0.1), 0, 1.0, 1, {GAP: 1}),
    (NEAR, 0.7, "S9", (0.5, 4.0, -0.1), 0, 1.0, 6, {GAP: 1}),
    (NEAR, 0.7, "S10", (0.5, -4.0, -0.1), 0, 1.0, 3, {GAP: 1}),
    # L1: P3 = 1, P3' = v_r - 1/2 + alpha cos / 2.
    (NEAR, 0.7, "L1", (0.25, 1.5, 0.0), 1, pi, 1, {DRIFT: 2}),
    (FAR, 0.7, "L1", (1.5, -1.0, 0.0), 1, 0.0, 2, {UPPER: 1}),
    (FAR, 0.7, "L1", (0.75, 0.5, 0.0), 1, 0.0, 1, {DRIFT: 2}),
    (FAR, 0.7, "L1", (0.75, 0.5, 0.0), 1, pi, 2, {UPPER: 1}),
    # L2: P3 = -1, P3' = v_r + 1/2 + alpha cos / 2.
    (NEAR, 0.7, "L2", (-0.25, -1.5, 0.0), -1, 0.0, 3, {DRIFT: 2}),
    (NEAR, 0.7, "L2", (-1.5, 1.0, 0.0), -1, pi, 2, {LOWER: 1}),
    (NEAR, 0.7, "L2", (-0.75, -0.5, 0.0), -1, 0.0, 2, {LOWER: 1}),
    (NEAR, 0.7, "L2", (-0.75, -0.5, 0.0), -1, pi, 3, {DRIFT: 2}),
    # L3: P4 = 1, P4' = 5/2 v_r - 1/2 + alpha cos / 2.
    (NEAR, 0.7, "L3", (0.625, 0.375, 0.0), 1, pi, 4, {DRIFT: 2}),
    (NEAR, 0.7, "L3", (0.75, -0.25, 0.0), 1, 0.0, 5, {UPPER: 1}),
    (NEAR, 0.7, "L3", (0.65625, 0.21875, 0.0), 1, 0.0, 4, {DRIFT: 2}),
    (NEAR, 0.7, "L3", (0.65625, 0.21875, 0.0), 1, pi, 5, {UPPER: 1}),
    # L4: P4 = -1, P4' = 5/2 v_r + 1/2 + alpha cos / 2; in contact only where v_r < -3.
    (NEAR, 0.7, "L4", (0.75, -4.25, 0.0), -1, 0.0, 6, {DRIFT: 2}),
    (NEAR, 40.0, "L4", (0.75, -4.25, 0.0), -1, 0.0, 5, {LOWER: 1}),
    (NEAR, 40.0, "L4", (0.75, -4.25, 0.0), -1, pi, 6, {DRIFT: 2}),
    # Lines on the impact surface with the capsule at rest, Table 2; L10 exists for delta > f_b.
    (NEAR, 0.7, "L5", (0.5, 4.0, 0.0), 0, 1.0, 4, {GAP: 1, DRIFT: 1}),
    (NEAR, 0.7, "L6", (0.5, 0.5, 0.0), 0, 1.0, 5, {GAP: 1}),
    (NEAR, 0.7, "L7", (0.5, -0.5, 0.0), 0, 1.0, 2, {GAP: 1}),
    (NEAR, 0.7, "L8", (0.5, -4.0, 0.0), 0, 1.0, 3, {GAP: 1, DRIFT: 1}),
    (FAR, 0.7, "L5", (2.0, 0.5, 0.0), 0, 1.0, 4, {GAP: 1, DRIFT: 1}),
    (FAR, 0.7, "L10", (2.0, -1.0, 0.0), 0, 1.0, 1, {GAP: 1, DRIFT: 1}),
    (FAR, 0.7, "L7", (2.0, -4.0, 0.0), 0, 1.0, 2, {GAP: 1}),
    # L9, x_r'' = alpha cos - 4/3 P +- 1/3 with P = 1/2: the sign decides for contact.
    (NEAR, 0.7, "L9", (0.5, 0.0, 0.2), 0, 0.0, 4, {GAP: 2}),
    (NEAR, 0.7, "L9", (0.5, 0.0, 0.2), 0, pi / 2, 1, {GAP: 2}),
    (NEAR, 2.0, "L9", (0.5, 0.0, -0.2), 0, 0.0, 6, {GAP: 2}),
    (NEAR, 0.7, "L9", (0.5, 0.0, -0.2), 0, 0.0, 3, {GAP: 2}),
    # O3, the same at rest: x_r'' = alpha cos - 1/2.
    (NEAR, 0.7, "O3", (0.5, 0.0, 0.0), 0, 0.0, 5, {GAP: 2}),
    (NEAR, 0.7, "O3", (0.5, 0.0, 0.0), 0, pi / 2, 2, {GAP: 2}),
    # O1: P = 1; into contact for delta < f_b, out of it for delta > f_b.
    (NEAR, 0.7, "O1", (0.5, 1.0, 0.0), 1, pi, 4, {GAP: 1, DRIFT: 2}),
    (NEAR, 10.0, "O1", (0.5, 1.0, 0.0), 1, pi, 5, {GAP: 1, UPPER: 1}),
    (FAR, 0.7, "O1", (2.0, -2.0, 0.0), 1, 0.0, 2, {GAP: 1, UPPER: 1}),
    (FAR, 10.0, "O1", (2.0, -2.0, 0.0), 1, 0.0, 1, {GAP: 1, DRIFT: 2}),
    # delta = f_b: v_r = 0 on O1, and x_r'' = alpha cos - 1 leads the way for gap and force.
    (EQUAL, 2.0, "O1", (1.0, 0.0, 0.0), 1, 0.0, 4, {GAP: 2, DRIFT: 2}),
    (EQUAL, 2.0, "O1", (1.0, 0.0, 0.0), 1, pi / 2, 2, {GAP: 2, UPPER: 1}),
    # O2: P = -1, out of contact.
    (NEAR, 0.7, "O2", (0.5, -3.0, 0.0), -1, 0.0, 3, {GAP: 1, DRIFT: 2}),
    (NEAR, 10.0, "O2", (0.5, -3.0, 0.0), -1, 0.0, 2, {GAP: 1, LOWER: 1}),
]
BACKENDS = pytest.mark.parametrize(
    "numbers", [NumpyBackend(), MpmathBackend()], ids=lambda b: b.name
)


def state_of(
    numbers: Backend, case: Parameters, at: tuple[float, ...], bound: int, angle: float
) -> State:
    x_r, v_r, v_c = map(numbers.number, at)
    gap = x_r - numbers.number(case.delta)
    return State(x_r, gap, v_r, v_c, numbers.number(angle), bound)


def constants(numbers: Backend, case: Parameters) -> list[Any]:
    return [numbers.constants(field, case) for field in range(1, 7)]


@BACKENDS
@pytest.mark.parametrize(
    ("case", "alpha", "place", "at", "bound", "angle", "field", "zeros"),
    STARTS,
    ids=[f"{start[2]}-F{start[6]}-{n}" for n, start in enumerate(STARTS)],
)
def test_the_field_that_takes_over(
    numbers, case, alpha, place, at, bound, angle, field, zeros
) -> None:
    case = case.replace(alpha=alpha)
    with mp.workdps(50):
        state, every = state_of(numbers, case, at, bound, angle), constants(numbers, case)
        begin = select_field(numbers, every, state)
        assert (begin.field, begin.start.zeros) == (field, zeros)


@pytest.mark.parametrize(
    ("case", "alpha", "place", "at", "bound", "angle", "field", "zeros"),
    [start for start in STARTS if start[5] == 0.0 or start[4] == 0],
)
def test_a_run_from_there_begins_with_that_field(
    case, alpha, place, at, bound, angle, field, zeros
) -> None:
    # P = +-1 is not given to the run: it finds out.
    case = case.replace(alpha=alpha)
    run = simulate(case, at, angle / case.omega, 1)
    first = run.segments[0]
    assert (first.field, run.success) == (field, True)
    assert first.source == ("" if at[2] else f"Σ{field}")
    assert first.duration > 1e-3
    assert first.outcome in (results.Outcome.REGULAR, results.Outcome.END)


@BACKENDS
@pytest.mark.parametrize("angle", [0.0, pi / 3, 2.0, pi, 4.0, 6.0])
@pytest.mark.parametrize("offset", [-1e-6, 1e-6])
def test_on_the_friction_bound_the_phase_decides(numbers, angle, offset) -> None:
    # v_r so that the rate of the force is `offset`: slip begins where it leads out of the bound.
    with mp.workdps(50):
        for bound, contact in ((1, 0), (-1, 0), (1, 1)):
            case = NEAR if contact else FAR.replace(beta=7.0)
            stiffness = 2.5 if contact else 1.0
            v_r = (offset - float(0.7 * mp.cos(angle) - bound) / 2) / stiffness
            x_r = (bound + 0.75 * contact - v_r / 2) / stiffness
            assert (x_r > case.delta) == bool(contact)
            every = constants(numbers, case)
            state = state_of(numbers, case, (x_r, v_r, 0.0), bound, angle)
            slips = bound * offset > 0
            expected = {(0, 1): 1, (0, 0): 2, (0, -1): 3, (1, 1): 4, (1, 0): 5}
            assert select_field(numbers, every, state).field == expected[contact, slips * bound]


@BACKENDS
def test_a_force_within_rounding_of_the_bound_is_left_open(numbers: Backend) -> None:
    with mp.workdps(50):
        every = constants(numbers, FAR)
        # On L1 P3' = (0.7 cos - 1) / 2 < 0: stick, if the start is taken to be on it.
        state = state_of(numbers, FAR, (1.0, 0.0, 0.0), 0, 0.0)
        assert select_field(numbers, every, state) is None
        assert select_field(numbers, every, state, vanish=True).field == 2
        beside = state._replace(x_r=state.x_r * (1 + 16 * numbers.unit))
        assert select_field(numbers, every, beside).field == 1


def test_without_what_vanishes_exactly_no_start_on_a_line_is_decided(monkeypatch) -> None:
    numbers = NumpyBackend()
    every = constants(numbers, NEAR)
    lines = [start for start in STARTS if start[2].startswith(("L", "O")) and start[0] is NEAR]
    monkeypatch.setattr("capsule_sym._map.transitions._exact_zeros", lambda *_: ())
    for _, alpha, _, at, bound, angle, _, _ in lines:
        if alpha != NEAR.alpha:
            continue
        assert select_field(numbers, every, state_of(numbers, NEAR, at, bound, angle)) is None
