"""Switching mechanisms on surfaces, lines and points, from which Tables 1 and 2 follow.

A trajectory of a field arrives at a boundary point from the field's cell, or leaves it into the
cell, according to the first non-vanishing time derivative of each function that bounds the cell
(velocity of the capsule, penetration, force against the friction bound). Those derivatives are
the paper's inner products of normals and fields, Eqs. (16)-(23), and the next ones. Their signs
are decided by `proof`; where a sign depends on state, time or parameters, the piece is split into
the three cases, and each part keeps its condition.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import chain, product

import sympy as sp

from capsule_sym._symbolic.model.elimination import GAPS, Relation, Sign
from capsule_sym._symbolic.model.geometry import (
    LINES,
    PIECES,
    POINTS,
    SURFACES,
    StateSet,
)
from capsule_sym._symbolic.model.model import ANY_LEVEL, BACKWARD, FORWARD, REACTS, Linear
from capsule_sym._symbolic.model.proof import consistent, sign_under
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    STATE,
    force,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
)

# The state, the force and its first rate of change: derivatives that hold no more than these.
_ORDERS_OF_MOTION = 3
_ORDERS_OF_FORCE = 2


@dataclass(frozen=True)
class Transition:
    """On a surface, trajectories from Omega_source continue in Omega_target."""

    source: int
    surface: str
    target: int


@dataclass(frozen=True)
class Leaf:
    """A part of a piece, given by `condition`, where all signs are the same.

    `arrives` and `departs` hold the fields whose trajectories reach it from, or leave it into,
    their own cell; `may_arrive` and `may_depart` add those that higher derivatives decide.
    """

    piece: StateSet
    condition: tuple[Relation, ...]
    arrives: frozenset[int]
    departs: frozenset[int]
    may_arrive: frozenset[int]
    may_depart: frozenset[int]


def time_derivative(expression: sp.Expr, field: Linear) -> sp.Expr:
    """Rate of change of a function of state and time along a field."""
    along = sum(expression.diff(s) * rate for s, rate in zip(STATE, field.field, strict=True))
    return sp.expand(along + expression.diff(tau))


@cache
def derivatives(expression: sp.Expr, index: int, orders: int) -> tuple[sp.Expr, ...]:
    """A function and its time derivatives along F`index`, orders 0 to `orders`."""
    found = [sp.expand(expression)]
    for _ in range(orders):
        found.append(time_derivative(found[-1], ANY_LEVEL[index - 1]))
    return tuple(found)


class _Split(Exception):
    """Raised for a sign that varies over the piece."""

    def __init__(self, expression: sp.Expr) -> None:
        self.expression = expression


def _first_sign(guard: sp.Expr, field: Linear, known: tuple[Relation, ...]) -> tuple[int, Sign]:
    """Order and sign of the first derivative of a guard that does not vanish; sign 0 if all do.

    Raises _Split where a sign varies.
    """
    orders = _ORDERS_OF_FORCE if guard.has(FORWARD, BACKWARD) else _ORDERS_OF_MOTION
    for order, expression in enumerate(derivatives(guard, field.index, orders)):
        sign = sign_under(expression, known)
        if sign is None:
            raise _Split(expression)
        if sign:
            return order, sign
    return orders + 1, 0


def _passage(field: Linear, known: tuple[Relation, ...]) -> tuple[bool | None, bool | None]:
    """Two answers: the field's trajectory comes from its cell, and leaves into it.

    None if nothing excludes it and some guard vanishes with all considered derivatives. Raises
    _Split where a sign varies that decides.
    """
    if field.stick and sign_under(v_c, known) != 0:
        return False, False
    arrives: bool | None = True
    departs: bool | None = True
    split: _Split | None = None
    for guard in field.guards:
        try:
            order, sign = _first_sign(guard, field, known)
        except _Split as found:
            split = split or found
            continue
        if sign == 0:
            arrives, departs = arrives and None, departs and None
            continue
        if sign * (-1) ** order < 0:
            arrives = False
        if sign < 0:
            departs = False
        if arrives is False and departs is False:
            return False, False
    if split:
        raise split
    return arrives, departs


def reduced(expression: sp.Expr, known: Iterable[Relation]) -> sp.Expr:
    """Shorter expression with the same sign where the known equations hold."""
    roots: list[tuple[sp.Expr, sp.Expr]] = []
    for relation in known:
        if isinstance(relation, sp.Eq):
            equation = sp.expand((relation.lhs - relation.rhs).subs(roots))
            for unknown in (v_c, x_r, v_r, sp.cos(omega * tau), force, *GAPS):
                slope = equation.coeff(unknown)
                if slope.is_nonzero:
                    roots.append((unknown, sp.expand(unknown - equation / slope)))
                    break
    expression = expression.subs(roots)
    numerator = sp.numer(sp.factor(expression))
    parts = [f for f in sp.Mul.make_args(numerator) if f == omega or not f.is_positive]
    rest = sp.expand(sp.Mul(*parts))
    return sp.expand(rest / gamma ** sp.degree(rest, gamma))


def leaves(piece: StateSet, condition: tuple[Relation, ...] = ()) -> Iterator[Leaf]:
    """Parts of a piece on which every field arrives, leaves or does neither."""
    known = (*piece.relations, *condition)
    passages: dict[int, tuple[bool | None, bool | None]] = {}
    try:
        for field in ANY_LEVEL:
            passages[field.index] = _passage(field, known)
    except _Split as split:
        expression = reduced(split.expression, known)
        for relation in (sp.Gt, sp.Lt, sp.Eq):
            case = relation(expression, 0)
            if consistent([*known, case]):
                yield from leaves(piece, (*condition, case))
        return
    yield Leaf(
        piece,
        condition,
        arrives=frozenset(index for index, (before, _) in passages.items() if before),
        departs=frozenset(index for index, (_, after) in passages.items() if after),
        may_arrive=frozenset(i for i, (before, _) in passages.items() if before is not False),
        may_depart=frozenset(i for i, (_, after) in passages.items() if after is not False),
    )


@cache
def leaves_of(name: str) -> tuple[Leaf, ...]:
    """The leaves of a piece by its name; L9 and O1 without the point O3, which has its own.

    With two stops these are L11, O1 and O3 in front, and L17 (L18 if the drive reacts), O4 and O6
    behind.
    """
    stops, edges = range(len(MODEL.stops)), 2 * len(MODEL.regions)
    impacts = 6 + REACTS  # lines a stop
    apart = {LINES[edges + impacts * k + 4]: v_c for k in stops} | {
        POINTS[3 * k]: v_r for k in stops
    }
    if name not in apart:
        return tuple(leaves(PIECES[name]))
    sides = (sp.Gt(apart[name], 0), sp.Lt(apart[name], 0))
    return tuple(chain.from_iterable(leaves(PIECES[name], (side,)) for side in sides))


def surface_transitions() -> tuple[Transition, ...]:
    """Table 1, derived: sources and targets of trajectories on each surface."""
    return tuple(
        Transition(source, name, target)
        for name in SURFACES
        for leaf in leaves_of(name)
        for source, target in product(sorted(leaf.arrives), sorted(leaf.departs))
        if source != target
    )
