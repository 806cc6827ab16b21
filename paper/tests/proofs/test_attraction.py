"""Boxes about a line of states that a turn shrinks, for turns that are known."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import arb_mat

from capsule_sym import Parameters, simulate
from capsule_sym._enclosures.numbers.balls import Unproved, arb, floats, symmetric, thin
from capsule_sym._enclosures.passage.segments import Leg
from capsule_sym._map.expansion import Guard
from paper.proofs import attraction
from paper.proofs.attraction import (
    Motions,
    attempt,
    contraction,
    farthest,
    grouped,
)
from paper.proofs.parts import AlphaPart
from paper.proofs.segments import Bundle
from tests.enclosures.case import precise

bits = precise(80)


class Started:
    """A run that is at rest."""

    parameters = SimpleNamespace(omega=1.0)

    def __call__(self, times: list[float]) -> np.ndarray:
        return np.zeros((len(times), 3))


class Turn(Motions):
    """A turn x -> L x + offset in x_r and v_r, of which L is known up to `bent` times the width."""

    def __init__(
        self, shrinks: tuple[float, float], offset: float = 0.0, bent: float = 0.0, field: int = 2
    ) -> None:
        self.L, self.offset_, self.bent, self.field = np.diag([*shrinks, 0.0]), offset, bent, field
        self.angle = arb(0)
        self.turn, self._soft = arb(1), self
        self.passage: Any = SimpleNamespace(
            directions=2, section=lambda states, angle: floats(states)
        )
        self.offset = 0.0
        self.run: Any = Started()

    @property
    def _goal(self) -> attraction._Goal:
        """The line of states at rest, which the turn moves."""
        line = np.zeros((3, 2))
        there, by = self.passed(line, 0)
        sides = attraction.sides_of(by, 2)
        inverse, factor = contraction(by, sides)
        return attraction._Goal(
            0, line, there, sides, farthest(there, line, inverse) / (1 - factor)
        )

    def steps(self, section: int) -> list[Leg]:
        return [Leg(self.field, 1.0, Guard.GAP), Leg(self.field, 1.0, None)]

    def passed(self, bundle: Bundle, section: int) -> tuple[Bundle, arb_mat]:
        moved = self.L @ bundle[:3]
        moved[:2, 0] += self.offset_
        width = float(np.sum(abs(bundle[:3, 2:])))
        entry = symmetric(self.bent * width)
        return moved, thin(self.L) + arb_mat([[entry, entry, 0], [entry, entry, 0], [0, 0, 0]])

    def hard(self, bundle: Bundle, *_: Any) -> tuple[Bundle, arb_mat]:
        return self.passed(bundle, 0)

    period = hard


def bundle(wide: float, speed: float = 0.0) -> Bundle:
    return np.array([[0.0, 0.0, wide, 0.0], [0.0, 0.0, 0.0, wide], [speed, 0.0, 0.0, 0.0]])


def test_a_turn_that_shrinks_a_box_is_proved() -> None:
    found = Turn((0.5, -0.3), 1e-3)._entered(bundle(1e-3), 7, True)
    assert 0.5 <= found.factor < 0.5 + 1e-9
    assert found.periods == 7


@pytest.mark.parametrize("shrinks", [(1.1, 0.0), (1.0, 0.5), (0.5, -1.01)])
def test_a_turn_that_does_not_shrink_is_not(shrinks: tuple[float, float]) -> None:
    with pytest.raises(Unproved, match="the factor of the line"):
        Motions._goal.func(Turn(shrinks))


def test_the_derivative_is_that_of_the_whole_box() -> None:
    """About the line itself the turn is a contraction."""
    turn = Turn((0.5, 0.5), 1e-3, bent=1e3)
    with pytest.raises(Unproved, match="is not within it"):
        turn._entered(bundle(1e-3), 0, True)
    Turn((0.5, 0.5), 1e-3, bent=1.0)._entered(bundle(1e-3), 0, True)


@pytest.mark.parametrize(
    ("shrink", "offset", "room"),
    [(0.5, 1e-2, 0.9), (0.0, 1e-2, 0.9), (0.5, 1e-2, 0.6)],
    ids=["both", "moved", "moved more"],
)
def test_a_box_is_as_large_as_the_turn_moves_its_line(
    shrink: float, offset: float, room: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    turn = Turn((shrink, shrink), offset)
    turn._entered(bundle(1e-6), 0, True)
    monkeypatch.setattr(attraction, "_ROOM", room)
    with pytest.raises(Unproved, match="is not within it"):
        turn._entered(bundle(1e-6), 0, True)


def test_a_motion_outside_of_the_box_has_not_entered_it(monkeypatch: pytest.MonkeyPatch) -> None:
    turn = Turn((0.5, 0.5))
    turn._entered(bundle(1e-3), 0, True)
    monkeypatch.setattr(attraction, "_ROOM", 0.9)
    with pytest.raises(Unproved, match="is not within it"):
        turn._entered(bundle(1e-3), 0, True)


def test_a_stick_at_a_section_begins_at_rest() -> None:
    with pytest.raises(Unproved, match="does not begin at rest"):
        Turn((0.5, 0.5))._entered(bundle(1e-3, speed=1e-9), 0, True)


def test_the_farthest_is_of_all_directions() -> None:
    line = np.array([[1.0, 0.5], [2.0, 0.25], [0.0, 0.0]])
    away = np.array([[0.5, 0.0], [0.0, 0.125], [0.0, 0.0]])
    found = np.column_stack([line + away, [0.25, 0.0, 0.0]])
    inverse = thin(np.array([[2.0, 0.0], [0.0, 1.0]]))
    assert farthest(found, line, inverse) >= 1.5
    assert farthest(found, line, inverse) < 1.5 + 1e-9
    assert farthest(found[:, [0, 1]], line, inverse) >= 1.0


def test_a_factor_is_the_largest_that_any_member_has() -> None:
    by = arb_mat([[arb("0.5") + symmetric(0.25), arb("0.125"), 0], [0, arb("0.25"), 0], [0, 0, 0]])
    inverse, factor = contraction(by, np.eye(2))
    assert 0.875 <= factor < 0.875 + 1e-8
    assert inverse[0, 0] == 1


def test_the_line_is_that_of_the_fixed_points() -> None:
    goal = Motions._goal.func(Turn((0.5, -0.3), 1e-3))
    assert goal.moved < 1e-12
    assert abs(goal.line[:2, 0] - 1e-3 / np.array([0.5, 1.3])).max() < 1e-15


SIDES = np.array([[1.0, 0.3], [0.2, -1.0]])
MANY = 40


def columns(seed: int = 5) -> np.ndarray:
    """Bundle of a line and many columns, of which the last three are of v_c, alpha and the time."""
    found = np.zeros((7, 2 + MANY))
    found[:2] = np.random.default_rng(seed).normal(size=(2, 2 + MANY)) * 1e-3
    found[:, -3:] = 0.0
    found[[2, 3, 6], [-3, -2, -1]] = 1e-12
    return found


def reach(bundle: np.ndarray) -> np.ndarray:
    """Farthest that the short columns of a bundle reach in each of many directions, as a set."""
    turned = np.linspace(0.0, math.pi, 200)
    rows = np.column_stack([np.cos(turned), np.sin(turned)])
    return np.sum(abs(rows @ bundle[:2, 2:]), axis=1)


def test_a_group_holds_the_columns_that_it_replaces() -> None:
    before = columns()
    after = grouped(before, SIDES, 2)
    assert after.shape[1] == 2 + attraction._KEPT + 3 + 2
    assert np.array_equal(after[:, :2], before[:, :2])
    assert np.all(reach(after) >= reach(before))
    assert np.array_equal(np.sum(abs(after[2:]), axis=1), np.sum(abs(before[2:]), axis=1))


def test_a_box_that_does_not_hold_the_columns_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = np.linalg.solve
    monkeypatch.setattr(np.linalg, "solve", lambda a, b: solve(a, b) * (1 - 1e-6))
    assert np.array_equal(grouped(columns(), SIDES, 2), columns())


def test_a_set_in_groups_shrinks_as_its_motions_do() -> None:
    """Along the axes a box would grow, as a row of the matrix has the sum 1.32."""
    turn = SIDES @ np.diag([0.95, -0.9]) @ np.linalg.inv(SIDES)
    assert np.max(np.sum(abs(turn), axis=1)) > 1.3
    bundle = columns()
    for _ in range(100):
        bundle[:2] = turn @ bundle[:2]
        bundle = grouped(bundle, SIDES, 2)
    assert np.max(reach(bundle)) < 2 * 0.95**100 * np.max(reach(columns()))


@pytest.mark.long
@pytest.mark.parametrize(
    "part", [AlphaPart(0, 18, 138874), AlphaPart(2, 22, 4180926), AlphaPart(2, 26, 66894826)]
)
def test_a_part_across_a_bifurcation_has_no_itinerary(part: AlphaPart) -> None:
    """All its motions are in the last box, through a window in which a guard is touched or not."""
    alphas, gamma = part.alphas, float(part.gammas[0])
    ends = (alphas.middle - alphas.radius, alphas.middle + alphas.radius)
    motions = [simulate(Parameters(alpha=a, gamma=gamma), periods=1200).steady() for a in ends]
    assert len({motion.itinerary for motion in motions if motion is not None}) == 2
    assert attempt(part).itinerary is None
