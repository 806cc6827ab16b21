"""Proofs of the cells of a scene: the states in which each field acts, by its guards.

A cell is defined by physics: which stop's spring is compressed, and whether the capsule drifts
forward, drifts backward or is held by friction. Fields and guards are compared with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations, product

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation, Undecided
from capsule_sym._symbolic.model.geometry import StateSet
from capsule_sym._symbolic.model.model import (
    ANY_LEVEL,
    BACKWARD,
    FORWARD,
    PULL,
    Linear,
    P,
    kappa,
)
from capsule_sym._symbolic.model.proof import consistent, implies, negations
from capsule_sym._symbolic.model.symbols import MODEL, stop, v_c, x_r
from capsule_sym._symbolic.proofs.statement import Statement, vanishes

Guards = tuple[sp.Expr, ...]


def cell(field: Linear) -> StateSet:
    """States in which a field acts, by the place of the mass and Coulomb's law."""
    ahead, *behind = MODEL.stops
    sides = {
        0: [x_r < ahead, *(x_r > place for place in behind)],
        1: [x_r > ahead],
        2: [x_r < place for place in behind],
    }
    # Without contact the stiffness is 0, so any stop may be taken.
    place = MODEL.stops[max(field.contact - 1, 0)]
    held = PULL.subs({kappa: field.region.stiffness, stop: place})
    ways = {1: [v_c > 0], 0: [sp.Eq(v_c, 0), held < FORWARD, held > -BACKWARD], -1: [v_c < 0]}
    return StateSet(f"cell of {field.name}", (*sides[field.contact], *ways[field.drift]))


CELLS = tuple(map(cell, ANY_LEVEL))
"""Cells of the fields, for any level of the drive."""


def bound_cell(field: Linear, guards: Guards) -> bool:
    """Check that guards are positive exactly in a field's cell (at rest: where v_c is 0)."""
    inside = [*(sp.Gt(guard, 0) for guard in guards), *([sp.Eq(v_c, 0)] if field.stick else [])]
    here = cell(field).relations
    return all(implies(here, sp.Gt(guard, 0)) for guard in guards) and all(
        implies(inside, relation) for relation in here
    )


def needed(guard: sp.Expr, field: Linear, guards: Guards) -> bool:
    """Check that a guard vanishes at states where the others are positive: it bounds the cell."""
    rest = [sp.Eq(v_c, 0)] if field.stick else []
    others = (sp.Gt(other, 0) for other in guards if other is not guard)
    return consistent([*rest, sp.Eq(guard, 0), *others])


@cache
def exclude(one: Relation, other: Relation) -> bool:
    """True if two relations are proved to have no state in common; False if that is undecided."""
    try:
        return not consistent([one, other])
    except Undecided:
        return False


def apart(cells: Sequence[StateSet]) -> bool:
    """Check that a relation of each cell excludes one of every other cell."""
    return all(
        any(exclude(a, b) for a, b in product(one.relations, other.relations))
        for one, other in combinations(cells, 2)
    )


def cover(cells: Sequence[StateSet]) -> bool:
    """Check that every state, under any force, is in a cell or on the boundary of one.

    A state outside all of them violates a relation of each: two of these exclude one another.
    """
    return not _left((), [one.closure for one in cells])


def _left(known: tuple[Relation, ...], cells: list[StateSet]) -> bool:
    if not cells:
        return True
    first, *others = cells
    outside = (opposite for relation in first.relations for opposite in negations(relation))
    return any(
        not any(exclude(relation, opposite) for relation in known)
        and _left((*known, opposite), others)
        for opposite in outside
    )


def pushes_back(field: Linear, spring: sp.Expr) -> bool:
    """Check that in its cell a field's spring never pulls the mass, and is slack at the stop."""
    side, here = {1: 1, 2: -1}[field.contact], cell(field).relations
    return implies(here, sp.Ge(side * spring, 0)) and vanishes(
        spring.subs(x_r, MODEL.stops[field.contact - 1])
    )


def resists(field: Linear, friction: sp.Expr) -> bool:
    """Check that friction dissipates power in drift, or holds a capsule at rest within bounds."""
    if field.stick:
        here = cell(field).relations
        within = implies(here, friction < BACKWARD) and implies(here, friction > -FORWARD)
        return within and vanishes(friction + field.pull)
    return implies(cell(field).relations, friction * field.drift < 0)


def _of(field: Linear) -> Iterator[Statement]:
    name, guards = field.name, field.guards
    place = f"cell of {name}"
    yield Statement(
        f"cells.{name}.guards",
        place,
        f"the guards of {name} are positive in its cell ({field.mode}), and nowhere else",
        bound_cell,
        {"field": field, "guards": guards},
        {"guards": guards[1:]},
        formula=", ".join(f"{sp.latex(guard)}>0" for guard in guards),
    )
    for number, guard in enumerate(guards, start=1):
        yield Statement(
            f"cells.{name}.bound{number}",
            place,
            f"{guard} vanishes on the boundary of the cell of {name}",
            needed,
            {"guard": guard, "field": field, "guards": guards},
            {"guard": sp.Add(*guards) if len(guards) > 1 else guard**2 + 1},
        )
    if field.contact:
        spring = field.interaction - P.subs(kappa, 0)
        yield Statement(
            f"cells.{name}.spring",
            place,
            f"the spring of the stop pushes the mass back in {name}, and is slack at the stop",
            pushes_back,
            {"field": field, "spring": spring},
            {"spring": -spring},
        )
    yield Statement(
        f"cells.{name}.friction",
        place,
        f"friction {'holds the capsule' if field.stick else 'works against the drift'} in {name}",
        resists,
        {"field": field, "friction": field.friction},
        {"friction": -field.friction},
    )


@cache
def items() -> tuple[Statement, ...]:
    """All statements about the cells of the fields."""
    found = [
        Statement(
            "cells.apart",
            "cells",
            "no two cells have a state in common",
            apart,
            {"cells": CELLS},
            {"cells": (*CELLS, StateSet("", CELLS[0].relations[1:]))},
        ),
        Statement(
            "cells.cover",
            "cells",
            "cells and their boundaries cover all states, whatever the drive's force",
            cover,
            {"cells": CELLS},
            {"cells": CELLS[1:]},
        ),
    ]
    for field in ANY_LEVEL:
        found += _of(field)
    return tuple(found)
