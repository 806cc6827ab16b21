"""Statements of the theory of a scene in groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from capsule_sym._symbolic.model import declaration
from capsule_sym._symbolic.proofs import (
    basis_proofs,
    cells,
    energy,
    field_graph,
    flow_proofs,
    switches,
)
from capsule_sym._symbolic.proofs.markdown import document
from capsule_sym._symbolic.proofs.statement import Report, Statement, named

PAPERS = declaration.path() == declaration.home(declaration.SHIPPED[0])
"""True if the scene of this process is the paper's."""


@dataclass(frozen=True)
class Group:
    """Statements about one subject.

    `place` is where the paper has them, `about` the subject, and `families` the first words of
    their names.
    """

    place: str
    about: str
    derive: Callable[[], Iterable[Statement]]
    families: str


GROUPS = {
    "cells": Group("Eqs. (1)-(12)", "where each field acts", cells.items, "cells"),
    "basis": Group("Eqs. (7)-(12)", "response functions", basis_proofs.proofs, "basis"),
    "flow": Group(
        "Eqs. (7)-(12)", "closed forms, Jacobians", flow_proofs.proofs, "flow jets jacobian"
    ),
    "graph": Group("Table 1", "successor of each field", field_graph.items, "graph"),
    "saltation": Group("beyond the paper", "saltation matrices", switches.items, "saltation"),
    "energy": Group("beyond the paper", "energy balance", energy.items, "energy"),
}
"""Groups by name, about in the order of the paper."""


def statements(only: str | None = None) -> dict[str, tuple[Statement, ...]]:
    """All statements by group, in the order of the paper, or those of one name.

    `only` is a group, a statement, or the beginning of names up to a point. Raises InvalidInput if
    it is none of these.
    """
    sections = {name: group.derive for name, group in GROUPS.items()}
    if only is not None:
        return named(only, sections, {name: group.families for name, group in GROUPS.items()})
    return {name: tuple(derive()) for name, derive in sections.items()}


_HEAD = """\
# Proved statements

By `capsule-sym verify --out`, of the scene {scene}. Each proof is a computation that the command
repeats.
"""


def markdown(report: Report) -> str:
    """Report with every statement and its formula, by groups."""
    titled = {}
    for name, results in report.items():
        group = GROUPS[name]
        place = f"{group.place}: " if PAPERS else ""
        titled[place + group.about] = results
    return document(titled, _HEAD.format(scene=declaration.path().stem))
