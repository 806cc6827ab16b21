"""Surfaces, lines, points, planes and subspaces of the state space, Eqs. (13)-(15) and (24).

A piece is a set of states given by linear relations. Surfaces, lines L1-L4 and L9 are those of
Eqs. (13)-(14). The lines on P1 = 0, P2 = delta are given here by the sign of v_r and the value of
P3, which is how the fields tell them apart; Eq. (14) gives them by bounds on v_r that hold for
zeta > 0 and delta < f_b only (see `errata`). That adds the line L10, present when delta > f_b,
and the points O1, O2 (the corners) and O3 (where the line L9 crosses P1 = 0).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.model import BACKWARD, FORWARD, P1, P2, P3, P4, segment
from capsule_sym._symbolic.model.proof import consistent, implies
from capsule_sym._symbolic.model.symbols import STATE, delta, v_r

SCENARIOS: dict[str, Relation] = {
    f"δ < {FORWARD}": sp.Lt(delta, FORWARD),
    f"δ = {FORWARD}": sp.Eq(delta, FORWARD),
    f"δ > {FORWARD}": sp.Gt(delta, FORWARD),
}
"""The three positions of the corner O1 (Fig. 2b-d)."""


@dataclass(frozen=True)
class Piece:
    """A named set of states: where all its relations hold."""

    name: str
    relations: tuple[Relation, ...]

    @property
    def closure(self) -> Piece:
        """The closed set of the same relations; the closure of the piece unless it is empty."""
        return Piece(f"cl {self.name}", tuple(map(_closed, self.relations)))

    @property
    def latex(self) -> str:
        """The piece by its relations, in LaTeX."""
        listed = r",\ ".join(map(sp.latex, self.relations))
        return rf"{self.name[0]}_{{{self.name[1:]}}}=\{{{listed}\}}"

    def contains(self, state: Iterable[sp.Expr], hypotheses: Iterable[Relation] = ()) -> bool:
        """Whether a state (x_r, v_r, v_c) lies in the piece whenever the hypotheses hold."""
        place = dict(zip(STATE, state, strict=True))
        return all(implies(hypotheses, r.subs(place)) for r in self.relations)


def _closed(relation: Relation) -> Relation:
    if isinstance(relation, sp.StrictGreaterThan):
        return sp.Ge(relation.lhs, relation.rhs)
    return (
        sp.Le(relation.lhs, relation.rhs) if isinstance(relation, sp.StrictLessThan) else relation
    )


def empty(piece: Piece, hypotheses: Iterable[Relation] = ()) -> bool:
    """Whether the piece holds no state under the hypotheses."""
    return not consistent([*piece.relations, *hypotheses])


def disjoint(first: Piece, second: Piece, hypotheses: Iterable[Relation] = ()) -> bool:
    """Whether two pieces have no state in common under the hypotheses."""
    return not consistent([*first.relations, *second.relations, *hypotheses])


def meets(piece: Piece, point: Piece, hypotheses: Iterable[Relation]) -> bool:
    """Whether the closure of a piece holds the point (which must exist) under the hypotheses."""
    hypotheses = list(hypotheses)
    return not empty(piece, hypotheses) and all(
        implies([*point.relations, *hypotheses], relation) for relation in piece.closure.relations
    )


_REST = sp.Eq(P1, 0)
_NO_CONTACT = sp.Lt(P2, delta)
_CONTACT = sp.Gt(P2, delta)
_PLANE = sp.Eq(P2, delta)
_RISING = sp.Gt(v_r, 0)
_FALLING = sp.Lt(v_r, 0)
_FORWARD = sp.Gt(P1, 0)
_BACKWARD = sp.Lt(P1, 0)


def _within(force: sp.Expr) -> tuple[Relation, Relation]:
    return sp.Lt(force, FORWARD), sp.Gt(force, -BACKWARD)


_PIECES = (
    Piece("S1", (_REST, _NO_CONTACT, sp.Gt(P3, FORWARD))),
    Piece("S2", (_REST, _NO_CONTACT, *_within(P3))),
    Piece("S3", (_REST, _NO_CONTACT, sp.Lt(P3, -BACKWARD))),
    Piece("S4", (_REST, _CONTACT, sp.Gt(P4, FORWARD))),
    Piece("S5", (_REST, _CONTACT, *_within(P4))),
    Piece("S6", (_REST, _CONTACT, sp.Lt(P4, -BACKWARD))),
    Piece("S7", (_FORWARD, _PLANE, _RISING)),
    Piece("S8", (_FORWARD, _PLANE, _FALLING)),
    Piece("S9", (_BACKWARD, _PLANE, _RISING)),
    Piece("S10", (_BACKWARD, _PLANE, _FALLING)),
    Piece("L1", (_REST, _NO_CONTACT, sp.Eq(P3, FORWARD))),
    Piece("L2", (_REST, _NO_CONTACT, sp.Eq(P3, -BACKWARD))),
    Piece("L3", (_REST, _CONTACT, sp.Eq(P4, FORWARD))),
    Piece("L4", (_REST, _CONTACT, sp.Eq(P4, -BACKWARD))),
    Piece("L5", (_REST, _PLANE, _RISING, sp.Gt(P3, FORWARD))),
    Piece("L6", (_REST, _PLANE, _RISING, *_within(P3))),
    Piece("L7", (_REST, _PLANE, _FALLING, *_within(P3))),
    Piece("L8", (_REST, _PLANE, _FALLING, sp.Lt(P3, -BACKWARD))),
    Piece("L9", (_PLANE, sp.Eq(v_r, 0))),
    Piece("L10", (_REST, _PLANE, _FALLING, sp.Gt(P3, FORWARD))),
    Piece("O1", (_REST, _PLANE, sp.Eq(P3, FORWARD))),
    Piece("O2", (_REST, _PLANE, sp.Eq(P3, -BACKWARD))),
    Piece("O3", (_REST, _PLANE, sp.Eq(v_r, 0))),
)
PIECES: dict[str, Piece] = {piece.name: piece for piece in _PIECES}
"""Surfaces S1-S10, lines L1-L10 and points O1-O3 by name."""

SURFACES = tuple(f"S{i}" for i in range(1, 11))
LINES = tuple(f"L{i}" for i in range(1, 11))
POINTS = ("O1", "O2", "O3")


def cell(index: int) -> Piece:
    """The part of subspace Omega `index` off its boundary: where field F`index` alone acts."""
    field = segment(index)
    side = _CONTACT if field.contact else _NO_CONTACT
    if field.stick:
        return Piece(f"cell {index}", (_REST, side, *_within(field.interaction)))
    return Piece(f"cell {index}", (_FORWARD if field.drift > 0 else _BACKWARD, side))


CELLS: tuple[Piece, ...] = tuple(cell(index) for index in range(1, 7))
