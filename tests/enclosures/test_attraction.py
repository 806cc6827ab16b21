"""Boxes about a line of states that a turn shrinks, for turns that are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    floats,
    precision,
    symmetric,
    thin,
)
from capsule_sym._enclosures.passage.segments import Bundle, Step
from capsule_sym._enclosures.regions import attraction
from capsule_sym._enclosures.regions.attraction import Motions, contraction, farthest
from capsule_sym._map.expansion import Guard


@pytest.fixture(autouse=True)
def bits():
    with precision(80):
        yield


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

    def steps(self, section: int) -> list[Step]:
        return [Step(self.field, 1.0, Guard.GAP), Step(self.field, 1.0, None)]

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
