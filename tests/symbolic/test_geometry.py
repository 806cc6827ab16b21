"""Pieces of the state space against plain arithmetic at random states."""

import random

import pytest
import sympy as sp

from capsule_sym._symbolic.model.geometry import LINES, PIECES, empty, meets
from capsule_sym._symbolic.model.symbols import STATE, beta, delta, f_b, v_r, x_r, zeta
from capsule_sym._symbolic.proofs.cells import CELLS

SCENARIOS = sp.Lt(delta, f_b), sp.Eq(delta, f_b), sp.Gt(delta, f_b)
NARROW = SCENARIOS[0]


def _by_hand(x: float, v: float, c: float, gap: float, damping: float, stiffness: float) -> str:
    """The surface or line that holds a state, by arithmetic; an empty name for an open cell."""
    free = x + 2 * damping * v
    force = free + (stiffness * (x - gap) if x > gap else 0)
    if c:
        if x != gap:
            return ""
        if not v:
            return "L9"
        return f"S{(7 if v > 0 else 8) + (0 if c > 0 else 2)}"
    if x == gap:
        if abs(force) == 1:
            return "O1" if force > 0 else "O2"
        if not v:
            return "O3"
        if abs(force) < 1:
            return "L6" if v > 0 else "L7"
        return ("L5" if v > 0 else "L10") if force > 0 else "L8"
    contact = x > gap
    if abs(force) == 1:
        return f"L{(1 if force > 0 else 2) + 2 * contact}"
    return f"S{(1 if force > 1 else 3 if force < -1 else 2) + 3 * contact}"


def test_membership_by_arithmetic() -> None:
    generator = random.Random(3)
    seen = set()
    for _ in range(4000):
        gap, damping = generator.choice((0.5, 1.0, 1.5)), generator.choice((0.25, 0.5))
        x = gap + generator.choice((0, generator.randint(-8, 8) / 4, generator.randint(1, 4) / 4))
        v, c = generator.randint(-16, 16) / 2, generator.choice((-1.0, 0.0, 0.0, 1.0))
        name = _by_hand(x, v, c, gap, damping, 2.0)
        numbers = [sp.Rational(n) for n in (x, v, c, gap, damping, 2, 1)]
        values = dict(zip((*STATE, delta, zeta, beta, f_b), numbers, strict=True))
        if name and name not in seen:
            seen.add(name)
            assert all(relation.subs(values) == sp.true for relation in PIECES[name].relations)
            others = set(PIECES) - {name, "O3", "L9"} - ({"O1"} if gap == 1 else set())
            for other in others:
                assert any(r.subs(values) == sp.false for r in PIECES[other].relations), other
    assert seen == set(PIECES)


def test_membership_under_hypotheses() -> None:
    origin = (sp.S.Zero,) * 3
    assert PIECES["S2"].contains(origin, [delta > 0])
    assert not PIECES["S2"].contains(origin)
    assert PIECES["O1"].contains((delta, 0, 0), [sp.Eq(delta, f_b)])
    assert not PIECES["O1"].contains((delta, 0, 0), [sp.Lt(delta, f_b)])


def test_corner_lies_on_closures_only() -> None:
    hypotheses = (zeta > 0, NARROW)
    assert meets(PIECES["L1"], PIECES["O1"], hypotheses)
    assert not meets(PIECES["L2"], PIECES["O1"], hypotheses)
    assert not meets(PIECES["L10"], PIECES["O1"], hypotheses)  # empty, so without closure
    lines = {name for name in LINES if meets(PIECES[name], PIECES["O2"], hypotheses)}
    assert lines == {"L2", "L4", "L7", "L8"}


@pytest.mark.parametrize(("scenario", "exists"), list(zip(SCENARIOS, (1, 0, 0), strict=True)))
def test_line_of_impacts_in_stick(scenario: sp.Basic, exists: int) -> None:
    assert empty(PIECES["L6"], [scenario]) == (not exists)


def test_cells_are_open_and_apart() -> None:
    assert [cell.name for cell in CELLS] == [f"cell of F{i}" for i in range(1, 7)]
    stick = CELLS[1].relations
    assert all(r in stick for r in (sp.Lt(x_r, delta), sp.Lt(x_r + 2 * zeta * v_r, f_b)))
