"""Touches of guards: against single runs from all over a bundle, and with each term taken away."""

from __future__ import annotations

import math
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm

from capsule_sym import Parameters, simulate
from capsule_sym._enclosures.numbers.balls import (
    Matrix,
    Unproved,
    arb,
    ball,
    floats,
    matrix,
    thin,
)
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.passage.guards import Line
from capsule_sym._enclosures.passage.segments import Leg
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym.results import Trajectory
from paper.proofs import touches, windows
from paper.proofs.case import EXACT
from paper.proofs.guesses import steps_of
from paper.proofs.segments import Bundle, Interval, Passage
from paper.proofs.touches import Soft
from paper.proofs.windows import Window
from tests.enclosures.case import precise

GAMMA, OMEGA, WIDE = 3.3, 0.8, 2e-4
PLACES = [(x, v) for x, v in product((-1.0, 0.0, 0.7, 1.0), repeat=2)]

bits = precise(80)


class Case(NamedTuple):
    """Bundle at the start of a window in which some of its motions touch a guard."""

    alpha: float
    field: int
    window: Window
    centre: tuple[float, float, float]

    @property
    def columns(self) -> np.ndarray:
        """Its states: a box in x_r and v_r."""
        x, v, c = self.centre
        return np.array([[x, 0.0, WIDE, 0.0], [v, 0.0, 0.0, WIDE], [c, 0.0, 0.0, 0.0]])

    def passed(self) -> tuple[Bundle, Matrix]:
        """The bundle at the end of the window, and the matrix of differences."""
        exact = EXACT | {"gamma": str(GAMMA)}
        values = {name: ball(exact[name]) for name in PARAMETERS if name != "alpha"}
        passage = Passage(values, Interval(self.alpha))
        begin, end = (
            values["omega"] * arb(time)
            for time in (self.window.begin, self.window.begin + self.window.length)
        )
        bundle = passage.section(thin(self.columns), begin)
        return Soft(passage)._window(passage.field(self.field), bundle, self.window, end)

    def member(self, place: tuple[float, float]) -> tuple[np.ndarray, bool]:
        """A motion of the bundle at the end of the window, and if it was in another field."""
        start = self.columns[:, 0] + self.columns[:, 2:] @ np.array(place)
        begin, length = self.window.begin, self.window.length
        parameters = Parameters(alpha=self.alpha, gamma=GAMMA)
        run = simulate(parameters, tuple(start), begin, periods=2)
        others = [s for s in run.segments if s.field != self.field]
        turn = math.tau / OMEGA
        touched = any(s.start.period * turn + float(s.start.phase) < begin + length for s in others)
        return run([begin + length])[0], touched


def about(alpha: float, field: int, guard: Guard, excess: float, length: float) -> Case:
    """Case about a guard that is `excess` beyond 0 in the middle of its window, at its turn.

    Where P or x_r has its greatest value, its rate is 0: for F5 at P = f_b + excess.
    """
    beta, zeta, delta = 1.5, 0.05, 0.02
    k = 1 + beta if field == 5 else 1.0
    turned = 0.4 * math.tau / OMEGA
    force = alpha * math.cos(OMEGA * turned)
    if guard is Guard.UPPER:  # P' = k v + 2 zeta v' = 0 with v' = force - P
        v = -2 * zeta * (force - 1 - excess) / k
        x = (1 + excess - 2 * zeta * v + (beta * delta if field == 5 else 0.0)) / k
    else:
        x, v = delta + excess, 0.0
    state, before = np.array([x, v]), length / 2
    # The field backwards over half of the window, by small steps.
    count = 4000
    for n in range(count):
        time = turned - before * (n + 0.5) / count
        here = state - 0.5 * before / count * _rate(state, alpha, time, field)
        state = state - before / count * _rate(here, alpha, time, field)
    window = Window(turned - before, length, guard)
    return Case(alpha, field, window, (float(state[0]), float(state[1]), 0.0))


def _rate(state: np.ndarray, alpha: float, time: float, field: int) -> np.ndarray:
    x, v = state
    spring = 1.5 * (x - 0.02) if field == 5 else 0.0
    return np.array([v, alpha * math.cos(OMEGA * time) - x - spring - 0.1 * v])


SLIP = about(0.3, 5, Guard.UPPER, 3e-4, 0.375)
CONTACT = about(0.9, 2, Guard.GAP, 2e-4, 0.25)
CASES = pytest.mark.parametrize("case", [SLIP, CONTACT], ids=["friction", "contact"])


def missed(case: Case, found: Bundle) -> float:
    """By how much members of a bundle are outside of it, beside its box."""
    rest = np.sum(abs(found[:3, 4:]), axis=1)
    worst = -math.inf
    for place in PLACES:
        middle = found[:3, 0] + found[:3, 2:4] @ np.array(place)
        worst = max(worst, float(np.max(abs(case.member(place)[0] - middle) - rest)))
    return worst


@CASES
def test_the_window_has_motions_of_both_kinds(case: Case) -> None:
    assert {case.member(place)[1] for place in PLACES} == {True, False}


@CASES
def test_all_motions_are_held_at_the_end(case: Case) -> None:
    found, _ = case.passed()
    assert missed(case, found) < 1e-12
    assert np.max(np.sum(abs(found[:3, 4:]), axis=1)) < 0.5 * WIDE


@CASES
def test_without_the_change_they_are_not(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    change = windows.Touch.change
    monkeypatch.setattr(windows.Touch, "change", lambda *given: ([arb(0)] * 3, change(*given)[1]))
    assert missed(case, case.passed()[0]) > 1e-8


@CASES
def test_differences_are_those_of_all_pairs(case: Case) -> None:
    _, by = case.passed()
    ends = {place: case.member(place)[0] for place in PLACES}
    outside = 0.0
    for one, other in product(PLACES, repeat=2):
        apart = thin(case.columns[:2, 2:] @ (np.array(one) - np.array(other)).reshape(2, 1))
        for i in range(2):
            reached = sum(by[i, j] * apart[j, 0] for j in range(2))
            nominal = sum(by[i, j].mid() * apart[j, 0] for j in range(2))
            away = arb(float(ends[one][i] - ends[other][i])) + arb(0, 1e-13)
            assert reached.overlaps(away)
            outside = max(outside, float(abs(away - nominal).lower()))
    assert outside > 1e-8  # the nominal flow alone does not hold them


def touch(field: int, guard: Guard, length: float) -> windows.Touch:
    values = {name: ball(EXACT.get(name, str(GAMMA))) for name in PARAMETERS if name != "alpha"}
    return windows.Touch(Field(field, values), values, Window(1.0, length, guard))


def constant(*values: float) -> list[windows.Piece]:
    """Pieces on which a guard is constant, each value on the same number of them."""
    each = windows.PIECES // len(values)
    return [windows.Piece(*[arb(one)] * 3) for one in values for _ in range(each)]


def test_slips_are_those_of_all_forces_within_the_slack() -> None:
    """Half of the time faster by the excess, then slower until it stops."""
    length, slack = 0.5, 1e-3
    pieces = constant(-1e-2, 4e-2)
    most, sizes, stopped = touch(5, Guard.UPPER, length)._slips(pieces, arb(slack))
    assert stopped
    part = length / windows.PIECES / GAMMA
    for off in (-slack, 0.0, slack):
        speed = 0.0
        for one, size in zip(pieces, sizes, strict=True):
            before, speed = speed, max(0.0, speed + (off - float(one.mean)) * part)
            for passed in (before, (before + speed) / 2, speed):
                assert size.contains(arb(passed)) or passed == before == 0.0
                assert most >= passed * (1 - 1e-12)
    assert not touch(5, Guard.UPPER, length)._slips(constant(-1e-2), arb(slack))[2]


def test_a_slip_that_goes_on_is_not_proved() -> None:
    with pytest.raises(Unproved, match="not proved to end"):
        touch(5, Guard.UPPER, 0.25).change(constant(-1e-3))


def test_the_slack_holds_the_change_of_force() -> None:
    case = touch(5, Guard.UPPER, 0.5)
    _, slack = case.change(constant(-1e-2, 8e-2))
    slip, *_ = case._slips(constant(-1e-2, 8e-2), arb(0))
    assert slack > 2.5 * 0.5 * float(slip.mid())


@pytest.mark.parametrize("guard", [Guard.UPPER, Guard.LOWER])
def test_a_change_is_the_integral_of_what_pushes(guard: Guard) -> None:
    """A speed of the capsule that is the same on all of the window moves the mass as it should."""
    length, speed = 0.75, 1e-3
    case = touch(5, guard, length)
    sign = 1.0 if guard is Guard.UPPER else -1.0
    found = case._pushed(
        [arb(speed)] * windows.PIECES, ((0, 0, arb(-sign)), (1, 0, arb(0.1 * sign)))
    )
    core = floats(case.field.A)[:2, :2]
    over = np.linalg.solve(core, expm(core * length) - np.eye(2))
    for i, true in enumerate(over @ [-sign * speed, 0.1 * sign * speed]):
        assert found[i].contains(arb(float(true)))
        assert float(found[i].rad()) < 0.1 * abs(float(true))


def test_the_change_of_a_slip_is_that_of_its_speed() -> None:
    """A mass that is pulled forwards less and damped more, by the speed of the capsule."""
    length, excess, later = 0.25, 1e-2, 4e-2
    case = touch(5, Guard.UPPER, length)
    found, _ = case.change(constant(-excess, later))
    core, step = floats(case.field.A)[:2, :2], length / 4000
    state, speed = np.zeros(2), 0.0
    for n in range(4000):
        before = speed
        speed = max(0.0, speed + (excess if n < 2000 else -later) * step / GAMMA)
        mean = (before + speed) / 2
        state += step * (core @ state - mean * np.array([1.0, -0.1]))
    for i in range(2):
        assert (found[i] + arb(0, 1e-9)).contains(arb(float(state[i])))
    assert found[1].rad() < 0.2 * abs(float(state[1]))


@pytest.mark.parametrize("field", [2, 5])
def test_contact_on_the_wrong_side_all_the_time_is_held(field: int) -> None:
    """In all of the window the other field acts: what it changes is not small."""
    depth, length = (1e-2, 0.25) if field == 2 else (-1e-2, 0.5)
    centre = (0.02 + depth, 0.0, 0.0)
    case = Case(0.3, field, Window(0.375 * math.tau / OMEGA, length, Guard.GAP), centre)
    found, _ = case.passed()
    assert missed(case, found) < 1e-12


def test_without_the_spring_the_mass_goes_farther(monkeypatch: pytest.MonkeyPatch) -> None:
    """Penetrations are those of the motion, whose spring does not pull it back."""
    depth, length, seen = 1e-2, 0.5, list[list[Any]]()
    pushed = windows.Touch._pushed
    monkeypatch.setattr(
        windows.Touch, "_pushed", lambda *given: seen.append(given[1]) or pushed(*given)
    )
    touch(5, Guard.GAP, length).change(constant(-depth))
    away = expm(np.array([[0.0, 1.0, 0.0], [-1.0, -0.1, 1.5 * depth], [0.0, 0.0, 0.0]]) * length)
    assert seen[0][-1].contains(arb(depth + float(away[0, 2])))


def test_another_guard_on_the_way_is_refused() -> None:
    near = (0.02, 0.0, 0.0)
    case = Case(0.3, 5, Window(0.375 * math.tau / OMEGA, 0.25, Guard.UPPER), near)
    with pytest.raises(Unproved, match="another guard"):
        case.passed()


def test_neglected_terms_are_part_of_the_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    case = touch(5, Guard.UPPER, 0.25)
    line = Line(case.field, 1)
    state = thin(np.array([[2.0], [0.0], [0.0], [0.0], [0.0], [1.0], [0.0]]))
    (before, *_), *_ = case.pieces(line, state)[0]
    along = windows._along
    monkeypatch.setattr(
        windows, "_along", lambda *given: [[(m, arb(1)) for m, _ in one] for one in along(*given)]
    )
    (after, *_), *_ = case.pieces(line, state)[0]
    assert before.low - after.low > 1.9
    assert after.high - before.high > 1.9
    assert after.mean.rad() > 1.9


def test_states_without_bound_are_refused() -> None:
    case = touch(5, Guard.GAP, 0.25)
    state = matrix(7, 1, [(0, 0, arb(math.inf))])
    with pytest.raises(Unproved, match="unbounded"):
        case.pieces(Line(case.field, 1), state)


def test_a_window_far_from_touches_changes_nothing() -> None:
    """Differences are those of the whole period, in order of time."""
    values = {name: ball(EXACT.get(name, "3.3")) for name in PARAMETERS if name != "alpha"}
    passage = Passage(values, Interval(0.3))
    run = simulate(Parameters(alpha=0.3, gamma=GAMMA), periods=300)
    turn = 2 * arb.pi() / values["omega"]
    steps = steps_of(run, 290.5, 291.5)
    state = run([float(turn.mid()) * 290.5])[0]
    bundle = passage.section(thin(np.column_stack([state, np.zeros(3)])), arb.pi())
    start = sum(one.duration for one in steps[:-1]) + 0.5
    places = [Window(0.5, 0.5, Guard.LOWER), Window(round(start * 128) / 128, 0.5, Guard.UPPER)]
    found, by = Soft(passage)._through(bundle, steps, places, turn, (arb.pi(), arb.pi()))
    whole, one = passage.period(bundle, steps, turn, arb.pi())
    assert np.max(abs(found[:3, 0] - whole[:3, 0])) < 1e-12
    for i in range(2):
        for j in range(2):
            assert by[i, j].overlaps(one[i, j])
            assert float(by[i, j].rad()) < 2


def test_a_brief_segment_is_left_out() -> None:
    steps = [Leg(2, 1.0, Guard.GAP), Leg(5, 0.5, Guard.UPPER), Leg(4, 0.25, Guard.DRIFT)]
    steps += [Leg(5, 0.125, Guard.GAP), Leg(2, 2.0, None)]
    kept = [Leg(2, 1.0, Guard.GAP), Leg(5, 0.875, Guard.GAP), Leg(2, 2.0, None)]
    assert touches.merged(steps) == kept
    ahead, left = touches._cut(kept, 1.5)
    assert ahead == [kept[0], Leg(5, 0.5, None)]
    assert left == [Leg(5, 0.375, Guard.GAP), kept[2]]


@pytest.mark.parametrize("guard", [Guard.UPPER, Guard.LOWER])
def test_friction_is_touched_in_stick_alone(guard: Guard) -> None:
    """A slip's second guard is its drift, and it has no third one."""
    with pytest.raises(Unproved, match="begins before its segment"):
        touch(4, guard, 0.25)


class Landing(NamedTuple):
    """Bundle at a section, of motions that drift back when a drift ends in the next period."""

    section: int
    wide: float
    alpha: float = 1.52

    @property
    def run(self) -> Trajectory:
        """The motion from rest."""
        return simulate(Parameters(alpha=self.alpha, gamma=GAMMA), periods=30)

    @property
    def time(self) -> float:
        """Time of the section, half a period after a multiple."""
        return (self.section + 0.5) * math.tau / OMEGA

    def passed(self) -> Bundle:
        """The bundle a period later, through the window of the landing."""
        values = {name: ball(EXACT.get(name, str(GAMMA))) for name in PARAMETERS if name != "alpha"}
        passage, turn = Passage(values, Interval(self.alpha)), 2 * arb.pi() / values["omega"]
        line = np.column_stack([self.run([self.time])[0], np.zeros(3), self.wide * np.eye(3)])
        bundle = passage.section(thin(line), arb.pi())
        steps = steps_of(self.run, self.section + 0.5, self.section + 1.5)
        error = Unproved("guards", "no landing")
        return Soft(passage)._landed(bundle, steps, turn, arb.pi(), error)

    def member(self, place: tuple[float, ...]) -> tuple[np.ndarray, list[int]]:
        """A motion of the bundle a period later, and its fields until then."""
        start = self.run([self.time])[0] + self.wide * np.array(place)
        parameters = Parameters(alpha=self.alpha, gamma=GAMMA)
        phase = 0.5 * math.tau / OMEGA
        run = simulate(parameters, tuple(start), phase, periods=3)
        fields = [one.field for one in steps_of(run, 0.5, 1.5)]
        return run([phase + math.tau / OMEGA])[0], fields

    def missed(self, found: Bundle) -> float:
        """By how much members are outside of a bundle's hull, or inside if negative."""
        size = np.sum(abs(found[:3, 1:]), axis=1)
        off = [abs(self.member(place)[0] - found[:3, 0]) - size for place in CORNERS]
        return float(np.max(off))


CORNERS = [*product((-1.0, 1.0), repeat=3), (0.0, 0.0, 0.0)]
DRIFTS_BACK = Landing(8, 1e-8)
"""All motions of it drift back."""


def test_some_motions_of_a_landing_drift_back() -> None:
    some = Landing(7, 2e-4)
    kinds = {tuple(some.member(place)[1]) for place in CORNERS}
    assert kinds == {(3, 6, 5, 4, 1, 2, 3), (3, 6, 5, 4, 1, 3, 2, 3)}
    found = some.passed()
    assert some.missed(found) < 0
    assert np.max(np.sum(abs(found[:3, 1:]), axis=1)) < 2 * some.wide


def test_motions_that_drift_back_are_held_only_with_their_change(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert DRIFTS_BACK.missed(DRIFTS_BACK.passed()) < 1e-13
    change = windows.Touch.change
    monkeypatch.setattr(windows.Touch, "change", lambda *given: ([arb(0)] * 3, change(*given)[1]))
    assert DRIFTS_BACK.missed(DRIFTS_BACK.passed()) > 1e-10


def test_a_window_of_friction_begins_at_rest() -> None:
    case = SLIP._replace(centre=(*SLIP.centre[:2], 1e-9))
    with pytest.raises(Unproved, match="does not begin at rest"):
        case.passed()


def test_a_period_without_a_landing_has_no_such_window() -> None:
    with pytest.raises(Unproved, match="no landing"):
        Landing(20, 1e-8, alpha=0.3).passed()
