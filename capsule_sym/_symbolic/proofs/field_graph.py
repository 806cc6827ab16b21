"""Proofs of the field graph of a scene: the successor fields at each surface, line and corner.

`switching` derives the graph by the functions that derive Table 1. On surfaces it is proved again
by first derivatives alone: the source's guard falls through 0, and the successor's guard rises.
Elsewhere higher derivatives prove that motions continue, and in one way only.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import product, starmap

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation, Sign
from capsule_sym._symbolic.model.geometry import LINES, PIECES, POINTS, SURFACES
from capsule_sym._symbolic.model.model import ANY_LEVEL, BACKWARD, FORWARD, Linear, segment
from capsule_sym._symbolic.model.proof import consistent, implies, sign_under
from capsule_sym._symbolic.model.switching import leaves_of, surface_transitions, time_derivative
from capsule_sym._symbolic.model.symbols import MODEL, PULSED, alpha, force, v_c, v_r, x_r
from capsule_sym._symbolic.proofs.cells import cell, exclude
from capsule_sym._symbolic.proofs.statement import Statement

Ways = Mapping[int, int]
"""Successor field of each field that arrives."""
Fields = frozenset[int]


def _passes(field: Linear, here: tuple[Relation, ...], sense: Sign) -> bool:
    """True if a field's motion enters its cell (sense 1) or leaves it (-1).

    Each guard is positive, or 0 with a rate of that sign.
    """
    if field.stick and sign_under(v_c, here) != 0:
        return False
    for guard in field.guards:
        sign = sign_under(guard, here)
        if sign == 0:
            sign = sign_under(sense * time_derivative(guard, field), here)
        if sign != 1:
            return False
    return True


def leads(surface: str, ways: Ways) -> bool:
    """Check that on a surface exactly these fields arrive, and continue with their successors."""
    here = PIECES[surface].relations
    arriving = {one.index for one in ANY_LEVEL if _passes(one, here, -1)}
    leaving = {one.index for one in ANY_LEVEL if _passes(one, here, 1)}
    return len(leaving) == 1 and {*ways.values()} == leaving and arriving - leaving == {*ways}


def go_on(place: str, fields: Fields) -> bool:
    """Check that one field continues from each state of a line or corner, and in all these.

    Where all considered derivatives vanish, some field may still continue, but higher derivatives
    decide which.
    """
    found = leaves_of(place)
    return fields == frozenset().union(*(leaf.may_depart for leaf in found)) and all(
        leaf.departs == leaf.may_depart if len(leaf.may_depart) == 1 else not leaf.departs
        for leaf in found
    )


def _signs(function: sp.Expr) -> tuple[Relation, ...]:
    return sp.Gt(function, 0), sp.Eq(function, 0), sp.Lt(function, 0)


def _pulls(pull: sp.Expr) -> tuple[tuple[Relation, ...], ...]:
    """Relations of a pull beyond a bound, on it, or within both."""
    within = (pull < FORWARD, pull > -BACKWARD)
    levels = sp.Eq(pull, FORWARD), sp.Eq(pull, -BACKWARD)
    return (pull > FORWARD,), (pull < -BACKWARD,), within, *((one,) for one in levels)


def _boundary() -> Iterator[tuple[Relation, ...]]:
    """All states with the capsule at rest or the mass at a stop, by cases."""
    rest = sp.Eq(v_c, 0)
    for region, pull in zip(MODEL.regions, _PULLS, strict=True):
        yield from ((rest, *region.where, *level) for level in _pulls(pull))
    for place, speed in product(MODEL.stops, _signs(v_r)):
        yield from ((rest, sp.Eq(x_r, place), speed, *level) for level in _pulls(_PULLS[0]))
        yield from ((way, sp.Eq(x_r, place), speed) for way in (v_c > 0, v_c < 0))


_PULLS = tuple(one.pull for one in ANY_LEVEL if one.stick)


def covered(pieces: Sequence[str], cases: Iterable[tuple[Relation, ...]]) -> bool:
    """Check that every consistent case lies in one of the pieces."""
    sets = [PIECES[name].relations for name in pieces]
    return all(
        any(all(implies(case, relation) for relation in one) for one in sets)
        for case in cases
        if consistent(case)
    )


def complete(names: Sequence[str]) -> bool:
    """Check that each state at rest or at a stop is on one of the surfaces, lines and corners."""
    return covered(names, _boundary())


@cache
def _beginnings() -> Mapping[int, tuple[tuple[Relation, ...], ...]]:
    """Sets of states from which a field continues: its cell, and surfaces at rest."""
    found = {one.index: [cell(one).relations] for one in ANY_LEVEL}
    for name in SURFACES:
        relations = PIECES[name].relations
        if implies(relations, sp.Eq(v_c, 0)):
            for leaf in leaves_of(name):
                for field in leaf.departs:
                    found[field].append(relations)
    return {field: tuple(sets) for field, sets in found.items()}


def after_edge(source: int, rises: bool, fields: Fields) -> bool:
    """Check that at an edge of pulses a field's motions continue with these fields.

    The high level is alpha, the low one the symbol u, of any value.
    """
    old, new = (force, alpha) if rises else (alpha, force)
    before = [relation.subs(force, old) for relation in cell(segment(source)).relations]

    def meets(begins: tuple[Relation, ...]) -> bool:
        then = [relation.subs(force, new) for relation in begins]
        return not any(starmap(exclude, product(before, then))) and consistent([*before, *then])

    return fields == frozenset(f for f, sets in _beginnings().items() if any(map(meets, sets)))


def _edges() -> Iterator[Statement]:
    kinds = len(ANY_LEVEL)
    for source, rises in ((one.index, rises) for rises in (False, True) for one in ANY_LEVEL):
        field = segment(source)
        reached = _reached(field)
        first, then = (kinds, 0) if rises else (0, kinds)
        names = ", ".join(f"F{index + then}" for index in sorted(reached))
        edge = "rise" if rises else "fall"
        more = frozenset({*reached, source % kinds + 1})
        wrong = more if len(reached) < 3 else reached - {source}
        yield Statement(
            f"graph.{edge}.F{source + first}",
            f"{edge} of the drive",
            f"from F{source + first} motions continue with {names} at the {edge}",
            after_edge,
            {"source": source, "rises": rises, "fields": reached},
            {"fields": wrong},
        )


def _reached(field: Linear) -> Fields:
    """Successors of a field at an edge: itself; from rest with a reaction, any of its region."""
    alike = (one for one in ANY_LEVEL if one.region == field.region)
    jumps = field.stick and field.pull.has(force)
    return frozenset(one.index for one in alike if jumps or one == field)


def _surface(name: str) -> Statement:
    ways = {one.source: one.target for one in surface_transitions() if one.surface == name}
    told = ", ".join(f"F{source} to F{target}" for source, target in sorted(ways.items()))
    (target,) = {*ways.values()}
    return Statement(
        f"graph.{name}",
        name,
        f"motions go from {told}",
        leads,
        {"surface": name, "ways": ways},
        {"ways": dict.fromkeys(ways, target % len(ANY_LEVEL) + 1)},
        formula=PIECES[name].latex,
    )


def _further(name: str) -> Statement:
    reached: Fields = frozenset().union(*(leaf.may_depart for leaf in leaves_of(name)))
    names = ", ".join(f"F{index}" for index in sorted(reached))
    return Statement(
        f"graph.{name}",
        name,
        f"from each state one field leads on, of {names}",
        go_on,
        {"place": name, "fields": reached},
        {"fields": reached - {min(reached)}},
        formula=PIECES[name].latex,
    )


@cache
def items() -> tuple[Statement, ...]:
    """All statements about the field graph."""
    edges = _edges() if PULSED else ()
    whole = Statement(
        "graph.complete",
        "field graph",
        "each state at rest, or at a stop, is on a surface, line or corner",
        complete,
        {"names": (*PIECES,)},
        {"names": (*SURFACES, *LINES)},
    )
    return (whole, *map(_surface, SURFACES), *map(_further, (*LINES, *POINTS)), *edges)
