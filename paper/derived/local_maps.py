"""Local maps P_{target, field, source} that the switching mechanisms allow: Table 3.

A plane Sigma_1..Sigma_6 holds the points at which the capsule is at rest and the motion continues
with field F1..F6; Sigma_7..Sigma_10 hold the impacts of a moving capsule.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product

import sympy as sp

from capsule_sym._symbolic.theory import (
    PIECES,
    SEGMENTS,
    Linear,
    P,
    Relation,
    consistent,
    delta,
    f_b,
    gamma,
    implies,
    leaves_of,
    surface_transitions,
    time_derivative,
    v_c,
    v_r,
    x_r,
)

SCENARIOS: dict[str, Relation] = {
    "δ < f_b": sp.Lt(delta, f_b),
    "δ = f_b": sp.Eq(delta, f_b),
    "δ > f_b": sp.Gt(delta, f_b),
}
"""The three positions of the corner O1 (Fig. 2b-d)."""


@dataclass(frozen=True, order=True)
class LocalMap:
    """P_{target, F field, source}: field `field` from a source plane to a target plane (Table 3).

    Planes are named Σ1 to Σ10.
    """

    target: str
    field: int
    source: str

    def __str__(self) -> str:
        return f"P_{{{self.target},F{self.field},{self.source}}}"

    @property
    def formula(self) -> str:
        """The map in LaTeX."""
        target, source = (rf"\Sigma_{{{plane[1:]}}}" for plane in (self.target, self.source))
        return f"P_{{{target},F_{self.field},{source}}}"


@dataclass(frozen=True)
class _Event:
    """A leaf's switch: the plane it lies on, the field before it and the field after it."""

    plane: str
    before: int
    after: int
    at_rest: bool
    relations: tuple[Relation, ...]


def _switches(may: bool) -> Iterator[_Event]:
    """Switches on all pieces; with `may`, also those that higher derivatives decide."""
    impacts = {(t.source, t.target): t.surface for t in surface_transitions()}
    for name, piece in PIECES.items():
        rest = implies(piece.relations, sp.Eq(v_c, 0))
        for leaf in leaves_of(name):
            sources, targets = leaf.arrives, leaf.departs
            if may:
                sources, targets = leaf.may_arrive, leaf.may_depart
            for source, target in product(sorted(sources), sorted(targets)):
                if source != target:
                    plane = f"Σ{target}" if rest else impacts[source, target].replace("S", "Σ")
                    relations = (*piece.relations, *leaf.condition)
                    yield _Event(plane, source, target, rest, relations)


@cache
def _events() -> tuple[_Event, ...]:
    return tuple(_switches(may=False))


def end_planes() -> frozenset[tuple[int, str]]:
    """Fields with the planes on which they may end, undecided higher derivatives included."""
    return frozenset((one.before, one.plane) for one in _switches(may=True))


def momentum(field: Linear) -> sp.Expr:
    """Capsule's velocity in the direction of drift, without the damper's part.

    Its rate along a drift field contains springs and friction only; the damper's impulse
    2 zeta (x_r - stop) / gamma is subtracted.
    """
    return field.drift * (v_c - P.diff(v_r) * (x_r - field.stop) / gamma)


def never_rests(field: Linear, hypotheses: Iterable[Relation]) -> bool:
    """True if a drift that begins at an impact of the moving capsule cannot end at rest.

    That holds if `momentum` is positive at the impact, never decreases in the cell, and is not
    positive where the capsule is at rest.
    """
    *sides, speed = field.guards
    if len(sides) > 1:  # it may begin at either stop
        return False
    (side,) = sides
    hypotheses = list(hypotheses)
    held = momentum(field)
    return (
        implies([*hypotheses, sp.Eq(side, 0), speed > 0], held > 0)
        and implies([*hypotheses, side >= 0], time_derivative(held, field) >= 0)
        and implies([*hypotheses, side >= 0, sp.Eq(speed, 0)], held <= 0)
    )


def allowed_maps(hypotheses: Iterable[Relation]) -> frozenset[LocalMap]:
    """Local maps that nothing excludes under the hypotheses on the parameters."""
    hypotheses = list(hypotheses)
    possible = [e for e in _events() if consistent([*e.relations, *hypotheses])]
    barred = {
        field.index for field in SEGMENTS if not field.stick and never_rests(field, hypotheses)
    }
    return frozenset(
        LocalMap(target=end.plane, field=end.before, source=start.plane)
        for end in possible
        for start in possible
        if start.after == end.before
        and not (end.before in barred and end.at_rest and not start.at_rest)
    )


@cache
def local_maps() -> tuple[LocalMap, ...]:
    """Table 3, derived: the local maps that occur for some parameters, in the paper's order.

    A map takes a field from a plane where it can begin to a plane where it can end. Witnesses of
    `reachability` show that each of them occurs.
    """
    maps = frozenset[LocalMap]().union(*(allowed_maps([r]) for r in SCENARIOS.values()))
    return tuple(sorted(maps, key=_table_order))


def _table_order(local_map: LocalMap) -> tuple[int, int, int]:
    return local_map.field, int(local_map.source[1:]), int(local_map.target[1:])
