"""Checks of the state space, Eqs. (13)-(15), and of the fields on its boundaries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import LINES, PIECES, disjoint, empty, meets
from capsule_sym._symbolic.model.model import P3, P4, SEGMENTS
from capsule_sym._symbolic.model.proof import always_solvable
from capsule_sym._symbolic.model.switching import derivatives
from capsule_sym._symbolic.model.symbols import delta, f_b, omega, v_c, v_r, x_r, zeta
from capsule_sym._symbolic.proofs.field_graph import covered
from capsule_sym._symbolic.proofs.relations import Texts, derived, scope
from capsule_sym._symbolic.proofs.rows import FACTS, FILTERS, checker
from capsule_sym._symbolic.proofs.statement import vanishes

_SIGNS = (sp.Lt, sp.Eq, sp.Gt)
_MOVING = ("S7", "S8", "S9", "S10", "L9")


def _cases(functions: tuple[sp.Expr, ...]) -> Iterator[tuple[Relation, ...]]:
    for relations in product(_SIGNS, repeat=len(functions)):
        yield tuple(r(f, 0) for r, f in zip(relations, functions, strict=True))


def _rest_cases() -> tuple[tuple[Relation, ...], ...]:
    rest = sp.Eq(v_c, 0)
    free = ((rest, sp.Lt(x_r, delta), *c) for c in _cases((P3 - f_b, P3 + f_b)))
    pressed = ((rest, sp.Gt(x_r, delta), *c) for c in _cases((P4 - f_b, P4 + f_b)))
    touching = ((rest, sp.Eq(x_r, delta), *c) for c in _cases((v_r, P3 - f_b, P3 + f_b)))
    return (*free, *pressed, *touching)


def _impact_cases() -> tuple[tuple[Relation, ...], ...]:
    cases = ((sp.Eq(x_r, delta), *c) for c in _cases((v_c, v_r)))
    return tuple(case for case in cases if not isinstance(case[1], sp.Eq))


checker(covered)


@checker
def separate(without: Sequence[str]) -> bool:
    """Check that all pieces except these are pairwise disjoint."""
    pieces = [piece for name, piece in PIECES.items() if name not in without]
    return all(disjoint(a, b) for a, b in combinations(pieces, 2))


@checker
def exists_when(piece: str, condition: str, within: Texts) -> bool:
    """Check that, under hypotheses, a piece exists if and only if the condition holds."""
    one, hypotheses, relation = PIECES[piece], scope(within), derived(condition)
    return empty(one, [*hypotheses, sp.Not(relation)]) and always_solvable(
        [*hypotheses, relation], one.relations, (x_r, v_r, v_c)
    )


def lines_at(corner: str, hypotheses: tuple[Relation, ...]) -> frozenset[str]:
    """Lines whose closure contains a corner under hypotheses on the parameters."""
    point = PIECES[corner]
    return frozenset(name for name in LINES if meets(PIECES[name], point, hypotheses))


@checker
def corner_lines(corner: str, printed: Sequence[str], within: Texts) -> bool:
    """Check that the lines that meet at a corner are those printed."""
    return lines_at(corner, scope(within)) == set(printed)


@checker
def mixes(fields: Sequence[int], share: str) -> bool:
    """Check that a share of the first field and the rest of the second make the third."""
    part, rates = derived(share), [SEGMENTS[field - 1].field for field in fields]
    return all(vanishes(part * a + (1 - part) * b - c) for a, b, c in zip(*rates, strict=True))


@checker
def differ_by(drift: int, stick: int, excess: str) -> bool:
    """Check that a drift is the field of stick plus (0, -excess, excess)."""
    size = derived(excess)
    rates = (SEGMENTS[field - 1].field for field in (drift, stick))
    change = (sp.S.Zero, -size, size)
    return all(vanishes(a - b - c) for a, b, c in zip(*rates, change, strict=True))


@checker
def agree_at_impact(free: int, pressed: int) -> bool:
    """Check that two fields agree on P2 = delta."""
    rates = (SEGMENTS[field - 1].field for field in (free, pressed))
    return all(vanishes((a - b).subs(x_r, delta)) for a, b in zip(*rates, strict=True))


@checker
def fourth_follows(field: int, stiffness: str) -> bool:
    """Check that the fourth derivative of P in stick follows from the lower ones."""
    y, y1, y2, y3, y4 = derivatives(SEGMENTS[field - 1].interaction, field, 4)
    k = derived(stiffness)
    return vanishes(y4 + omega**2 * (k * y + 2 * zeta * y1 + y2) + k * y2 + 2 * zeta * y3)


FACTS |= {
    "at_rest": lambda _: tuple(name for name in PIECES if name not in _MOVING),
    "rest_cases": lambda _: _rest_cases(),
    "impact_cases": lambda _: _impact_cases(),
}
FILTERS["closures"] = lambda names: r"\cap".join(rf"\bar L_{{{name[1:]}}}" for name in names)
