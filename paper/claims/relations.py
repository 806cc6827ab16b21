"""Consequences of relations: the language of rows for sets of states, and checks of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    LINES,
    P3,
    PIECES,
    SEGMENTS,
    STATE,
    Relation,
    StateSet,
    consistent,
    empty,
    force,
    implies,
    meets,
)
from paper.claims.formula import NAMES, formula, relations
from paper.derived.inner_products import STICK_EDGE, along, outward
from paper.derived.local_maps import SCENARIOS
from paper.derived.parts import part

Texts = Iterable[str | Relation]
"""Relations as text: printed, or the name of a piece, a part or a position of the gap."""

_SETS: dict[str, tuple[Relation, ...]] = {
    **{name: piece.relations for name, piece in PIECES.items()},
    **{f"cl {name}": piece.closure.relations for name, piece in PIECES.items()},
    **{name: (relation,) for name, relation in SCENARIOS.items()},
}
_NAMES = {
    **NAMES,
    "u": force,
    "P3_F2": along(P3, SEGMENTS[1]),
    **{f"n_{line}": outward(line) for line in STICK_EDGE},
    **{f"{s.name}_{x}": rate for s in SEGMENTS for x, rate in zip(STATE, s.field, strict=True)},
}
"""Names in rows: n_L1 is the inner product out of stick on L1, F1_v_c the v_c' of F1."""


def derived(text: str) -> Any:
    """Expression or relation of a row."""
    return formula(text, _NAMES)


@cache
def _relations(text: str) -> tuple[Relation, ...]:
    if "^(" in text:
        return part(text).relations
    return _SETS[text] if text in _SETS else relations([text], _NAMES)


def scope(texts: Texts) -> tuple[Relation, ...]:
    """Relations of a set of states."""
    return tuple(
        relation
        for text in texts
        for relation in (_relations(text) if isinstance(text, str) else (text,))
    )


@cache
def _within(inner: tuple[Relation, ...], outer: tuple[Relation, ...]) -> bool:
    return all(implies(inner, relation) for relation in outer)


def same_sets(printed: Sequence[Texts], expected: Sequence[Texts]) -> bool:
    """Check that sets of states are, one by one, those expected: each includes the other."""
    pairs = [(scope(a), scope(b)) for a, b in zip(printed, expected, strict=False)]
    return len(printed) == len(expected) and all(_within(a, b) and _within(b, a) for a, b in pairs)


def follows(here: Texts, printed: Texts) -> bool:
    """Check that printed relations hold everywhere in a set."""
    hypotheses = scope(here)
    return all(implies(hypotheses, relation) for relation in scope(printed))


def absent(piece: str, within: Texts) -> bool:
    """Check that a piece holds no state under conditions on the parameters."""
    return empty(PIECES[piece], scope(within))


def listed(names: Any) -> str:
    """Names separated by commas."""
    return ", ".join(map(str, names)) or "none"


def latex(of: Iterable[Relation]) -> str:
    """Relations in LaTeX."""
    return r",\ ".join(map(sp.latex, of))


def corner_lines(corner: str, printed: Sequence[str], within: Texts) -> bool:
    """Check that the lines that meet at a corner are those printed."""
    return lines_at(corner, scope(within)) == set(printed)


def disjoint(first: StateSet, second: StateSet, hypotheses: Iterable[Relation] = ()) -> bool:
    """True if two pieces have no state in common under the hypotheses."""
    return not consistent([*first.relations, *second.relations, *hypotheses])


def lines_at(corner: str, hypotheses: Iterable[Relation]) -> frozenset[str]:
    """Lines whose closure contains a corner under hypotheses on the parameters."""
    hypotheses = list(hypotheses)
    return frozenset(name for name in LINES if meets(PIECES[name], PIECES[corner], hypotheses))
