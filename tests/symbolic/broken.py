"""Mutations of what is derived of a scene: in a process of its own, what notices them.

Each changes a fact as a wrong declaration or derivation would: `python -m tests.symbolic.broken
SCENE NAME ...` prints, for each name, the families of statements that do not notice it.
"""

import dataclasses
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from capsule_sym._symbolic.model import declaration

if __name__ == "__main__":
    declaration.choose(declaration.home(sys.argv[1]))

import sympy as sp

from capsule_sym._symbolic.model import basis, flow, jacobian, jets
from capsule_sym._symbolic.model.model import Linear, high
from capsule_sym._symbolic.proofs import (
    basis_proofs,
    cells,
    energy,
    field_graph,
    flow_proofs,
    switches,
)
from capsule_sym._symbolic.proofs.statement import Statement, settle

_GUARDS, _FIELD = Linear.guards.func, Linear.field.func
_INTERACTION, _PULL = Linear.interaction.fget, Linear.pull.fget


def _turned(values: tuple[sp.Expr, ...], at: int) -> tuple[sp.Expr, ...]:
    return (*values[:at], -values[at], *values[at + 1 :])


@dataclasses.dataclass(frozen=True)
class Mutation:
    """Replacement of an attribute, and the statements that have to fail for it."""

    owner: Any
    name: str
    value: Any
    noticed: str
    """Families of statements of which some fail, by blanks."""


_jet, _double, _formulas = jets.jet, basis.double, energy._formulas
_surfaces = field_graph.surface_transitions

MUTATIONS = {
    "a guard is missing": Mutation(
        Linear, "guards", property(lambda one: _GUARDS(one)[:-1]), "cells graph"
    ),
    "a guard has the other sign": Mutation(
        Linear, "guards", property(lambda one: _turned(_GUARDS(one), 0)), "cells graph"
    ),
    "friction pushes": Mutation(
        Linear,
        "friction",
        property(lambda one: -_PULL(one) if one.stick else -one.way.friction),
        "cells",
    ),
    "the force of the mass has the other sign": Mutation(
        Linear, "field", property(lambda one: _turned(_FIELD(one), 1)), "energy flow"
    ),
    "the capsule gains what the mass gains": Mutation(
        Linear, "field", property(lambda one: _turned(_FIELD(one), 2)), "energy flow"
    ),
    "a spring pulls": Mutation(
        Linear,
        "interaction",
        property(lambda one: _INTERACTION(one) * (-1 if one.contact else 1)),
        "cells",
    ),
    "the velocity's closed form": Mutation(
        flow_proofs,
        "_derive",
        lambda: dataclasses.replace(flow.derive(), velocity=-flow.derive().velocity),
        "flow",
    ),
    "the capsule's closed form": Mutation(
        flow_proofs,
        "_derive",
        lambda: dataclasses.replace(flow.derive(), drift_long=2 * flow.derive().drift_long),
        "flow",
    ),
    "a Jacobian": Mutation(
        flow_proofs, "_rows", lambda stick: jacobian.rows(stick)[::-1], "jacobian"
    ),
    "a derivative of the state": Mutation(
        jets,
        "jet",
        lambda order: [(x, -y if str(x) == "x3" else y) for x, y in _jet(order)],
        "jets",
    ),
    "a response to twice the duration": Mutation(
        basis, "double", lambda: {**_double(), basis.G: basis.G}, "basis"
    ),
    "a target of the field graph": Mutation(
        field_graph,
        "surface_transitions",
        lambda: tuple(dataclasses.replace(one, target=one.source) for one in _surfaces()),
        "graph",
    ),
    "the ratio of a landing": Mutation(
        switches,
        "at_landing",
        lambda switch: sp.ImmutableMatrix([[1, 0, 0], [0, 1, 1], [0, 0, 1]]),
        "saltation",
    ),
    "the drive's power": Mutation(
        energy,
        "_formulas",
        lambda: {**_formulas(), "drive_power": 2 * _formulas()["drive_power"]},
        "energy",
    ),
    "the damper's power": Mutation(
        energy,
        "_formulas",
        lambda: {**_formulas(), "damper_power": -_formulas()["damper_power"]},
        "energy",
    ),
}
"""By name; scenes with more than the capsule has are put to `FURTHER` too."""

FURTHER = {
    "levels the other way": Mutation(
        flow_proofs, "LEVEL", flow_proofs.LEVEL.subs(high, 1 - high), "flow"
    ),
    "a stop in the wrong place": Mutation(
        Linear, "stop", property(lambda one: -declaration.chosen().stops[0]), "energy"
    ),
}

_SOURCES: dict[str, Callable[[], tuple[Statement, ...]]] = {
    "cells": cells.items,
    "graph": field_graph.items,
    "saltation": switches.items,
    "energy": energy.items,
    "basis": basis_proofs.proofs,
    "flow": flow_proofs.proofs,
    "jets": flow_proofs.proofs,
    "jacobian": flow_proofs.proofs,
}


@contextmanager
def mutated(mutation: Mutation) -> Iterator[None]:
    """The derivation with one fact changed."""
    before = mutation.owner.__dict__[mutation.name]
    setattr(mutation.owner, mutation.name, mutation.value)
    try:
        yield
    finally:
        setattr(mutation.owner, mutation.name, before)


def failing(family: str) -> bool:
    """True if some statement of a family is not proved; cached derivations are cleared."""
    try:
        items = _SOURCES[family].__wrapped__()  # type: ignore[attr-defined]
        chosen = [one for one in items if one.name.partition(".")[0] == family]
        return any(not settle(one).settled for one in chosen)
    except Exception:  # nothing can be derived
        return True


def survivors(mutation: Mutation) -> list[str]:
    """The families that should notice a mutation, and do not."""
    for derived in _SOURCES.values():
        derived()  # what is kept of the derivation is right
    with mutated(mutation):
        return [family for family in mutation.noticed.split() if not failing(family)]


def accepted() -> list[str]:
    """The statements about cells, graph, switches and energy whose changed claim is not refused."""
    items = [one for module in (cells, field_graph, switches, energy) for one in module.items()]
    changed = (one.mutant for one in items)
    return [one.name for one in changed if settle(one).status != "failed"]


if __name__ == "__main__":
    known = {**MUTATIONS, **FURTHER}
    found = {name: survivors(known[name]) for name in sys.argv[2:]}
    print(json.dumps({**found, "changed claims": accepted()}))
