"""Checks of the state space: subspaces, planes, corners, and normals with their products."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    CELLS,
    LINES,
    P1,
    P2,
    P3,
    P4,
    PIECES,
    SEGMENTS,
    STATE,
    SURFACES,
    Leaf,
    StateSet,
    consistent,
    delta,
    derivatives,
    empty,
    f_b,
    implies,
    leaves_of,
    meets,
    sign_under,
    surface_transitions,
    x_r,
)
from paper.claims.errata import CASE_STUDY, CREST, point_text
from paper.claims.fields import domain
from paper.claims.formula import formula, same
from paper.claims.relations import Texts, disjoint, lines_at, scope
from paper.claims.tables import Rows, pairs_of, spaces
from paper.derived.inner_products import STICK_EDGE, along, inner_products
from paper.derived.local_maps import SCENARIOS
from paper.derived.points import evaluate, example
from paper.derived.tables import ASSUMED, Pairs, on, passages_at
from paper.printed import Paper

_DAMPED = scope(["zeta > 0"])
_NARROW = scope(["zeta > 0", "δ < f_b"])


@cache
def _holders(name: str) -> frozenset[int]:
    """Subspaces of Eqs. (7)-(12), with |P4| in (11), that contain all of a piece."""
    piece = PIECES[name].relations
    return frozenset(
        field
        for field in range(1, 7)
        if any(all(implies(piece, r) for r in part) for part in domain(field))
    )


def held_by(piece: str, subspace: int) -> bool:
    """Check that a piece is in one subspace of Eqs. (7)-(12) only."""
    return _holders(piece) == {subspace}


def outside_all(point: str, sets: Sequence[Texts], within: Texts) -> bool:
    """Check that a point exists under conditions on the parameters and is in none of the sets."""
    piece, hypotheses = PIECES[point], scope(within)
    return consistent([*piece.relations, *hypotheses]) and all(
        disjoint(piece, StateSet("set", scope(one)), hypotheses) for one in sets
    )


def never_ends_on(ends: Sequence[tuple[int, str]], planes: Mapping[str, str]) -> bool:
    """Check that fields never end on planes, taken as the pieces that are printed."""
    return not any(
        field in leaf.may_arrive
        for field, plane in ends
        for name, printed in planes.items()
        if printed == plane
        for leaf in leaves_of(name)
    )


def impact_planes(planes: Sequence[str], names: Sequence[str], maps: Sequence[Any]) -> bool:
    """Check that every impact plane is one surface, on which maps of Table 3 begin and end."""
    surfaces = dict(zip(planes, names, strict=True))
    passages = {t.surface: (t.source, t.target) for t in surface_transitions()}
    return len(surfaces) == 4 and all(
        (one.target not in surfaces or passages[surfaces[one.target]][0] == one.field)
        and (one.source not in surfaces or passages[surfaces[one.source]][1] == one.field)
        for one in maps
    )


def derived_uses() -> dict[str, frozenset[str]]:
    """Surfaces and lines by their use, according to the derivation."""

    def impacts(change: int) -> frozenset[str]:
        return frozenset(
            t.surface
            for t in surface_transitions()
            if SEGMENTS[t.target - 1].contact - SEGMENTS[t.source - 1].contact == change
        )

    stick = {n for n in SURFACES if {2, 5} & {f for o in leaves_of(n) for f in o.departs}}
    others = (n for n in LINES if n != "L9" and n not in STICK_EDGE)
    return {
        "stick_on": frozenset(stick),
        "impact_entered_by": impacts(1),
        "impact_left_by": impacts(-1),
        "sliding_lines": frozenset(STICK_EDGE),
        "crossing_lines": frozenset(n for n in others if not empty(PIECES[n], _NARROW)),
    }


_FUNCTIONS = {"P1": P1, "P2": P2, "P3": P3, "P4": P4}


def _normal(name: str) -> tuple[sp.Expr, int]:
    """Function and side of a normal such as P3-."""
    return _FUNCTIONS[name[:2]], 1 if name[2] == "+" else -1


def gradient(normal: str, printed: Sequence[str]) -> bool:
    """Check that a printed normal is the gradient of its function, with the sign of its side."""
    function, side = _normal(normal)
    slopes = [side * sp.diff(function, symbol) for symbol in STATE]
    return all(same(formula(text), slope) for text, slope in zip(printed, slopes, strict=True))


def points(line: str, printed: Sequence[str]) -> bool:
    """Check that the normal out of stick on a line points from one surface to the other."""
    inside, outside = printed
    function, side = STICK_EDGE[line]
    beyond = side * function - f_b
    return (
        implies(PIECES[inside].relations, sp.Lt(beyond, 0))
        and implies(PIECES[outside].relations, sp.Gt(beyond, 0))
        and implies(PIECES[outside].relations, PIECES[line].relations[1])
    )


def _product(normal: str, field: int) -> sp.Expr:
    function, side = _normal(normal)
    return side * along(function, SEGMENTS[field - 1])


def product(place: str, normal: str, field: int, printed: str) -> bool:
    """Check that a printed value is the inner product of its normal and field on the place.

    The place is on the boundary of the field's cell, or the line whose bound the normal crosses.
    """
    value, text = _product(normal, field), formula(printed)
    if normal[:2] in ("P1", "P2"):
        cell = CELLS[field - 1].closure
        beside = all(implies(PIECES[place].relations, relation) for relation in cell.relations)
        return beside and same(value, text)
    edge, sense = STICK_EDGE[place]
    root = sp.solve(sp.Eq(edge, sense * f_b), x_r)[0]
    found = [sp.expand(sp.together(e.subs(x_r, root))) for e in (value, text)]
    return (edge, sense) == _normal(normal) and same(*found)


def product_sign(place: str, normal: str, field: int, printed: str) -> bool:
    """Check that the inner product has the printed sign all over the place."""
    sign = sign_under(_product(normal, field), PIECES[place].relations)
    return sign == {"<": -1, ">": 1}[printed]


_MEANS = {(False, True): "repelling", (True, False): "attracting", (True, True): "grazing"}


def _passes(leaf: Leaf, field: int) -> tuple[bool, bool]:
    """True where trajectories of a field come from its cell, and where they go into it."""
    return field in leaf.arrives, field in leaf.departs


def _touching() -> Iterator[tuple[bool, bool]]:
    """Passages of drifts on lines where an inner product is 0 and the next derivative is not."""
    for leaf in (leaf for name in (*STICK_EDGE, "L9") for leaf in leaves_of(name)):
        known = (*leaf.piece.relations, *leaf.condition)
        for field in (one.index for one in SEGMENTS if not one.stick):
            for guard in SEGMENTS[field - 1].guards:
                signs = [sign_under(rate, known) for rate in derivatives(guard, field, 2)]
                if signs[:2] == [0, 0] and signs[2] in (1, -1):
                    yield _passes(leaf, field)


def product_means(sign: int, printed: str) -> bool:
    """Check what the sign of a drift's inner product with a surface's normal means.

    For 0 every drift with a trajectory there comes from its cell and goes back into it.
    """
    if sign == 0:
        found = set(_touching()) - {(False, False)}
    else:
        found = {
            _passes(leaf, one.field)
            for one in inner_products()
            if one.place in SURFACES and one.sign == sign and not SEGMENTS[one.field - 1].stick
            for leaf in leaves_of(one.place)
        }
    return {_MEANS[one] for one in found} == {printed}


def _mechanism(surface: str) -> tuple[int, bool, bool]:
    """Number of sources of a surface; True if contact changes there, and if stick follows."""
    rows = [t for t in surface_transitions() if t.surface == surface]
    before, after = (SEGMENTS[i - 1] for i in (rows[0].source, rows[0].target))
    return len(rows), before.contact != after.contact, after.stick


def alike(surface: str, printed: Sequence[str]) -> bool:
    """Check that the other surfaces with the mechanism of a surface are those printed."""
    others = [name for name in SURFACES if name != surface]
    return [name for name in others if _mechanism(name) == _mechanism(surface)] == list(printed)


@cache
def crossing_sources(line: str) -> dict[int, int]:
    """Sources with a boundary-intersection crossing on a line of P2 = delta, and their targets.

    Beside the line such a trajectory has one of two fields in between.
    """
    near = [name for name in SURFACES if meets(PIECES[name], PIECES[line], _NARROW)]
    steps = {(t.source, t.target) for t in surface_transitions() if t.surface in near}
    steps |= {(s, t) for s, t in on(line) if SEGMENTS[s - 1].stick}
    return {
        source: target
        for source, target in on(line)
        if sum((source, i) in steps and (i, target) in steps for i in range(1, 7)) == 2
    }


def crosses(line: str, sources: Sequence[int], target: int) -> bool:
    """Check from where trajectories have a boundary-intersection crossing, and where they go."""
    return crossing_sources(line) == dict.fromkeys(sources, target)


def crossing_lines(printed: Sequence[str]) -> bool:
    """Check that the lines with boundary-intersection crossings are those printed."""
    lines = (name for name in LINES if name not in (*STICK_EDGE, "L9"))
    return [
        one for one in lines if not empty(PIECES[one], _NARROW) and crossing_sources(one)
    ] == list(printed)


def tangent(line: str) -> bool:
    """Check that on P2 = delta all fields have inner product 0 with its normal on a line only."""
    here, plane = PIECES[line].relations, sp.Eq(P2, delta)
    return all(
        all(implies(here, one) for one in (plane, zero))
        and all(implies([plane, zero], one) for one in here)
        for zero in (sp.Eq(along(P2, field), 0) for field in SEGMENTS)
    )


def subspace_of(paper: Paper) -> dict[str, int]:
    """Subspace of each surface and line on P1 = 0, Eq. (15)."""
    sets = paper["equation.15"]["members"]
    return {name: index for index, names in enumerate(sets, start=1) for name in names}


def leads_elsewhere(printed: Texts, rows: Rows, piece: str) -> bool:
    """Check that a printed set holds states of a piece with none of the printed passages."""
    pairs = pairs_of(rows)
    holds = consistent([*scope(printed), *PIECES[piece].relations, *_DAMPED])
    return holds and bool(pairs and on(piece)) and not pairs & on(piece)


def unlike_its_lines(
    corner: str, printed: str, expected: Rows, lines: Sequence[tuple[str, Pairs]]
) -> bool:
    """Check that a corner has the expected passages, which no row of Table 2 for a line there has.

    The printed line has to be one of the lines that meet there.
    """
    narrow = (*_DAMPED, SCENARIOS["δ < f_b"])
    here, rows = (*PIECES[corner].relations, *narrow, ASSUMED["L1"]), dict(lines)
    return (
        passages_at(corner, here, may=True) == set(expected)
        and printed in rows
        and rows.keys() == lines_at(corner, narrow)
        and all(row != set(expected) for row in rows.values())
    )


def elsewhere(printed: Sequence[str], rows: Rows, piece: str) -> dict[str, str]:
    """State of a printed set with wide gap, its printed relations there, and what follows."""
    values = {**CASE_STUDY, delta: Fraction(3, 2)}
    here = [*scope(printed), *PIECES[piece].relations, CREST]
    point = example(here, values)
    there = (formula(text) for text in printed[2:])
    sides = (f"{evaluate(r.lhs, point)} {r.rel_op} {evaluate(r.rhs, point)}" for r in there)
    return {
        **point_text(point),
        "printed relations there": f"{'; '.join(sides)}, true",
        "passage there": f"{spaces(on(piece))}, not {spaces(pairs_of(rows))}",
    }
