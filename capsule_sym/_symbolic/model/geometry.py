"""Surfaces, lines, points, planes and subspaces of the state space, Eqs. (13)-(15) and (24).

A piece is a set of states given by linear relations. Surfaces, lines L1-L4 and L9 are those of
Eqs. (13)-(14). The lines on P1 = 0, P2 = delta are given here by the sign of v_r and the value of
P3, by which the fields differ; Eq. (14) gives them by bounds on v_r that hold for
zeta > 0 and delta < f_b only (see paper/claims). That adds the line L10, present when delta > f_b,
and the points O1, O2 (the corners) and O3 (where the line L9 crosses P1 = 0).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.model import (
    ANY_LEVEL,
    BACKWARD,
    FORWARD,
    P1,
    P2,
    Q3,
    REACTS,
)
from capsule_sym._symbolic.model.proof import consistent, implies
from capsule_sym._symbolic.model.symbols import MODEL, STATE, v_r


@dataclass(frozen=True)
class StateSet:
    """A named set of states: where all its relations hold."""

    name: str
    relations: tuple[Relation, ...]

    @property
    def closure(self) -> StateSet:
        """The closed set of the same relations; the closure of the piece unless it is empty."""
        return StateSet(f"cl {self.name}", tuple(one.weak for one in self.relations))

    @property
    def latex(self) -> str:
        """The piece by its relations, in LaTeX."""
        listed = r",\ ".join(map(sp.latex, self.relations))
        return rf"{self.name[0]}_{{{self.name[1:]}}}=\{{{listed}\}}"

    def contains(self, state: Iterable[sp.Expr], hypotheses: Iterable[Relation] = ()) -> bool:
        """True if a state (x_r, v_r, v_c) lies in the piece whenever the hypotheses hold."""
        place = dict(zip(STATE, state, strict=True))
        return all(implies(hypotheses, r.subs(place)) for r in self.relations)


def empty(piece: StateSet, hypotheses: Iterable[Relation] = ()) -> bool:
    """True if the piece holds no state under the hypotheses."""
    return not consistent([*piece.relations, *hypotheses])


def meets(piece: StateSet, point: StateSet, hypotheses: Iterable[Relation]) -> bool:
    """True if a piece is not empty and its closure holds a point, under the hypotheses.

    The point has to exist under them.
    """
    hypotheses = list(hypotheses)
    return not empty(piece, hypotheses) and all(
        implies([*point.relations, *hypotheses], relation) for relation in piece.closure.relations
    )


_REST = sp.Eq(P1, 0)
_PLANES = tuple(sp.Eq(P2, place) for place in MODEL.stops)
_SIDES = tuple(region.where for region in MODEL.regions)  # between the stops, and beyond each
_FORCES = tuple(one.pull for one in ANY_LEVEL if one.stick)
_RISING = sp.Gt(v_r, 0)
_FALLING = sp.Lt(v_r, 0)
_FORWARD = sp.Gt(P1, 0)
_BACKWARD = sp.Lt(P1, 0)


IMPACTS = tuple(product(range(1, len(MODEL.stops) + 1), (1, -1), (1, -1)))
"""Stop and signs of v_c and v_r of each surface of impacts of a moving capsule, in their order."""


def _ahead(force: sp.Expr) -> Relation:
    return sp.Gt(force, FORWARD)


def _behind(force: sp.Expr) -> Relation:
    return sp.Lt(force, -BACKWARD)


def _within(force: sp.Expr) -> tuple[Relation, Relation]:
    return sp.Lt(force, FORWARD), sp.Gt(force, -BACKWARD)


def _numbered(letter: str, pieces: Iterable[tuple[Relation, ...]]) -> tuple[StateSet, ...]:
    """Pieces by a letter and a number from 1 on."""
    return tuple(StateSet(f"{letter}{n}", relations) for n, relations in enumerate(pieces, start=1))


def _surfaces() -> Iterator[tuple[Relation, ...]]:
    """Rest by contact and force; then impacts of a moving capsule, four for each stop."""
    for side, force in zip(_SIDES, _FORCES, strict=True):
        for levels in ((_ahead(force),), _within(force), (_behind(force),)):
            yield (_REST, *side, *levels)
    ways, speeds = {1: _FORWARD, -1: _BACKWARD}, {1: _RISING, -1: _FALLING}
    for stop, way, speed in IMPACTS:
        yield ways[way], _PLANES[stop - 1], speeds[speed]


def _lines() -> Iterator[tuple[Relation, ...]]:
    """Rest at a friction bound by contact; then six for each stop, at its plane.

    The fifth of these is v_r = 0 at any v_c, the others are impacts at rest. Those behind mirror
    those in front, with all signs reversed. A drive that reacts can pull the capsule back while the
    mass moves in, which adds a seventh.
    """
    for side, force in zip(_SIDES, _FORCES, strict=True):
        yield (_REST, *side, sp.Eq(force, FORWARD))
        yield (_REST, *side, sp.Eq(force, -BACKWARD))
    ahead, behind = _ahead(Q3), _behind(Q3)
    signs = ((_RISING, _FALLING, ahead, behind), (_FALLING, _RISING, behind, ahead))
    for plane, (inward, outward, pressed, pulled) in zip(_PLANES, signs, strict=False):
        yield _REST, plane, inward, pressed
        yield (_REST, plane, inward, *_within(Q3))
        yield (_REST, plane, outward, *_within(Q3))
        yield _REST, plane, outward, pulled
        yield plane, sp.Eq(v_r, 0)
        yield _REST, plane, outward, pressed
        if REACTS:
            yield _REST, plane, inward, pulled


def _points() -> Iterator[tuple[Relation, ...]]:
    """Three points at rest of each stop: both bounds and v_r = 0; behind they are mirrored."""
    for plane, levels in zip(_PLANES, ((FORWARD, -BACKWARD), (-BACKWARD, FORWARD)), strict=False):
        yield from ((_REST, plane, sp.Eq(Q3, level)) for level in levels)
        yield _REST, plane, sp.Eq(v_r, 0)


_PARTS = _numbered("S", _surfaces()), _numbered("L", _lines()), _numbered("O", _points())
PIECES: dict[str, StateSet] = {piece.name: piece for pieces in _PARTS for piece in pieces}
"""Pieces by name; with one stop S1-S10, L1-L10 (L11 if the drive reacts) and O1-O3."""

SURFACES, LINES, POINTS = (tuple(piece.name for piece in pieces) for pieces in _PARTS)
