"""Bounds on what a touch changes, in drift and at other parameters, against single motions."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm

from capsule_sym import Parameters, simulate
from capsule_sym._enclosures.numbers.balls import Matrix, arb, ball, floats, thin
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.passage.segments import Leg
from capsule_sym._map.expansion import Guard
from paper.proofs import windows
from paper.proofs.segments import Bundle, Interval, Passage
from paper.proofs.touches import Soft
from paper.proofs.windows import Piece, Touch, Window
from tests.enclosures.case import precise

DEVICE = {"omega": 0.8, "delta": 0.02, "zeta": 0.05, "beta": 1.5, "gamma": 3.3, "f_b": 1.0}
PLACES = [*product((-1.0, -0.3, 0.4, 1.0), repeat=2)]

bits = precise(80)


class Case(NamedTuple):
    """Bundle at the begin of a window: where its middle is a moment later, and how wide it is."""

    field: int
    guard: Guard
    length: float
    there: tuple[float, float, float]
    wide: float
    device: dict[str, float] = DEVICE
    alpha: float = 0.9
    angle: float = 2.5

    def passed(self) -> tuple[np.ndarray, float, Bundle, Matrix]:
        """Columns of the bundle, its time, the bundle after the window, and the differences."""
        values = {name: ball(repr(value)) for name, value in self.device.items()}
        passage = Passage(values, Interval(self.alpha))
        field = passage.field(self.field)
        drive = self.alpha * np.array([math.cos(self.angle), math.sin(self.angle)])
        state = expm(floats(field.A) * -self.length / 2) @ [*self.there, *drive, 1.0]
        begin = self.angle / self.device["omega"] - self.length / 2
        columns = np.zeros((3, 4))
        columns[:, 0], columns[:2, 2:] = state[:3], self.wide * np.eye(2)
        bundle = passage.section(thin(columns), values["omega"] * arb(begin))
        window = Window(begin, self.length, self.guard)
        end = values["omega"] * (arb(begin) + arb(self.length))
        return columns, begin, *Soft(passage)._window(field, bundle, window, end)

    def end(self, start: np.ndarray, begin: float) -> np.ndarray:
        """State of a single motion at the end of the window."""
        run = simulate(Parameters(alpha=self.alpha, **self.device), tuple(start), begin, periods=2)
        return run([begin + self.length])[0]


def touched(field: int, length: float, wide: float, gamma: float = 3.3) -> Case:
    """Case in which some motions of a drift pass delta, and turn there."""
    drift = {1: 1, 3: -1, 4: 1, 6: -1}[field]
    beyond = 0.3 * wide * (1 if field in (1, 3) else -1)
    there = (0.02 + beyond, 0.0, 0.4 * drift)
    return Case(field, Guard.GAP, length, there, wide, DEVICE | {"gamma": gamma})


@pytest.mark.parametrize("field", [1, 3, 4, 6])
def test_motions_of_a_drift_and_their_differences_are_held(field: int) -> None:
    """Contact pulls at a capsule that slips: its speed changes too."""
    case = touched(field, 0.25, 3e-3, gamma=0.5)
    columns, begin, found, by = case.passed()
    rest = np.sum(abs(found[:3, 4:]), axis=1)
    ends = {p: case.end(columns[:, 0] + columns[:, 2:] @ p, begin) for p in PLACES}
    for place, state in ends.items():
        assert np.all(abs(state - found[:3, 0] - found[:3, 2:4] @ place) <= rest + 1e-12)
    room = np.array([[float(x.rad()) for x in row] for row in by.tolist()])
    nominal, used = floats(by), 0.0
    for one, other in combinations(PLACES, 2):
        apart = columns[:, 2:] @ (np.array(one) - np.array(other))
        away = abs(ends[one] - ends[other] - nominal @ apart)
        assert np.all(away <= room @ abs(apart) + 1e-12)
        used = max(used, away[2])
    assert used > 1e-6


def touch(field: int, guard: Guard, length: float, **device: float) -> Touch:
    values = {name: ball(repr(value)) for name, value in (DEVICE | device).items()}
    return Touch(Field(field, values), values, Window(1.0, length, guard))


def flow(field: int, length: float, **device: float) -> np.ndarray:
    values = {name: ball(repr(value)) for name, value in (DEVICE | device).items()}
    return expm(floats(Field(field, values).A) * length)


@pytest.mark.parametrize("gamma", [0.3, 3.3])
@pytest.mark.parametrize("beta", [1.5, 10.0])
@pytest.mark.parametrize(("field", "guard", "slip"), [(2, Guard.LOWER, 3), (5, Guard.UPPER, 4)])
def test_differences_hold_those_of_slips_without_end(
    field: int, guard: Guard, slip: int, beta: float, gamma: float
) -> None:
    """Of two motions that slip all the time, in x_r and in the velocity of the mass."""
    length = 0.125
    by = touch(field, guard, length, beta=beta, gamma=gamma).by()
    true = flow(slip, length, beta=beta, gamma=gamma)
    true[1] += true[2]
    for i, j in product(range(2), repeat=2):
        assert by[i, j].contains(arb(true[i, j], 1e-13))


@pytest.mark.parametrize("gamma", [0.3, 3.3])
@pytest.mark.parametrize(("field", "pressed"), [(1, 4), (2, 5), (3, 6), (4, 1), (5, 2), (6, 3)])
def test_differences_hold_those_of_contact_without_end(
    field: int, pressed: int, gamma: float
) -> None:
    length = 0.125
    by = touch(field, Guard.GAP, length, gamma=gamma).by()
    true = flow(pressed, length, gamma=gamma)
    for i, j in product(range(2 if field in (2, 5) else 3), range(2)):
        assert by[i, j].contains(arb(true[i, j], 1e-13))


def pieces(*values: tuple[float, float]) -> list[Piece]:
    """Pieces with the lowest and the highest value of a guard, each on the same number of them."""
    each = windows.PIECES // len(values)
    found = [Piece(arb(low), arb(high), arb(low + high) / 2) for low, high in values]
    return [one for one in found for _ in range(each)]


@pytest.mark.parametrize(
    ("field", "length", "gamma"), [(2, 0.125, 3.3), (1, 1 / 32, 0.002), (1, 0.25, 0.1)]
)
def test_the_slack_of_a_contact_holds_force_and_speed(
    field: int, length: float, gamma: float
) -> None:
    """A nominal motion at rest beyond delta, and what the spring makes of it."""
    depth, beta = 1e-3, DEVICE["beta"]
    _, slack = touch(field, Guard.GAP, length, gamma=gamma).change(pieces((-depth, -depth)))
    share = 1.0 if field == 2 else 1 + 1 / gamma
    push = beta * depth
    A = np.zeros((4, 4))  # x_r, v_r and v_c, as far as they differ, and 1
    A[0, 1] = 1.0
    A[1] = -share * (1 + beta), -share * 0.1, 0.0, -share * push
    if field == 1:
        A[2] = (1 + beta) / gamma, 0.1 / gamma, 0.0, push / gamma
    for part in np.linspace(0, 1, 9):
        x, v, c, _ = (expm(A * length * part) @ [0.0, 0.0, 0.0, 1.0]).tolist()
        assert slack >= abs((1 + beta) * x + 0.1 * v + push) * (1 - 1e-9)
        assert slack >= abs(c) * (1 - 1e-9)


def test_a_swing_back_is_deeper_than_the_nominal_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pushed out at first, a mass is back after half of a swing."""
    length, gamma, depth, beta = 1.25, 0.1, 1e-3, 0.05
    share = 1 + 1 / gamma
    state, deepest, count = np.zeros(2), 0.0, 4000
    for n in range(count):
        nominal = depth if n < count / 4 else 0.0
        pressed = max(0.0, nominal + state[0])
        deepest = max(deepest, pressed if n > count / 2 else 0.0)
        rate = -share * (state[0] + 0.1 * state[1] + beta * pressed)
        state += length / count * np.array([state[1] + rate * length / count / 2, rate])
    assert deepest > depth / 200
    sizes = list[list[arb]]()
    monkeypatch.setattr(Touch, "_pushed", lambda self, found, entries: sizes.append(found) or [])
    given = pieces((-depth, -depth), *[(0.0, 0.0)] * 3)
    touch(1, Guard.GAP, length, gamma=gamma, beta=beta).change(given)
    assert max(one.abs_upper() for one in sizes[0][windows.PIECES // 2 :]) > deepest


def test_a_slip_may_begin_at_the_end_of_a_piece() -> None:
    """A guard that is positive in the mean, and not at last."""
    most, sizes, stopped = touch(5, Guard.UPPER, 0.5)._slips(pieces((-1e-2, 3e-2)), arb(0))
    assert not stopped
    part = 0.5 / windows.PIECES / DEVICE["gamma"]
    assert most >= 2e-2 * part  # over the last of one piece and the first of the next one
    assert sizes[-1].contains(arb(1e-2 * part))


def test_differences_go_on_after_the_last_window() -> None:
    """A window in which nothing happens, and half of a period of the same field after it."""
    values = {name: ball(repr(value)) for name, value in DEVICE.items()}
    passage, alpha = Passage(values, Interval(0.005)), 0.005
    run = simulate(Parameters(alpha=alpha, **DEVICE), periods=300)
    turn = 2 * arb.pi() / values["omega"]
    state = run([float(turn.mid()) * 290])[0]
    bundle = passage.section(thin(np.column_stack([state, np.zeros(3)])), arb(0))
    steps = [Leg(2, float(turn.mid()), None)]
    window = Window(0.5, 1 / 32, Guard.UPPER)
    _, by = Soft(passage)._through(bundle, steps, [window], turn, (arb(0), arb(0)))
    true = flow(2, float(turn.mid()))
    for i, j in product(range(2), repeat=2):
        assert by[i, j].contains(arb(true[i, j], 1e-12))
        assert float(by[i, j].rad()) < 0.01
