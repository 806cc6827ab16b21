"""Proofs about any scene, by section: all statements that do not concern the printed paper."""

from __future__ import annotations

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
from capsule_sym._symbolic.proofs.statement import Report, Sections, Statement, named

SECTIONS: Sections = {
    "Cells of the fields": cells.items,
    "Field graph": field_graph.items,
    "Saltation": switches.items,
    "Energy and mirror images": energy.items,
    "Response functions": basis_proofs.proofs,
    "Closed-form flow, its jets and Jacobians": flow_proofs.proofs,
}
"""Statements proved of a scene, in the order of the report."""

FAMILIES = dict(
    zip(
        SECTIONS,
        ("cells", "graph", "saltation", "energy mirror", "basis", "flow jets jacobian"),
        strict=True,
    )
)
"""First words of the names of the statements of each section."""

PAPERS_ALONE = (
    "of the paper alone, and proved by `capsule-sym verify` without --scene: its tables, printed "
    f"claims and Section 4, which are about {declaration.SHIPPED[0]}"
)
"""Statements that are not proved of a scene, in one line."""


def items(only: str | None = None) -> dict[str, tuple[Statement, ...]]:
    """All statements about the scene, or one, by section title; raises InvalidInput if none."""
    if only is not None:
        return named(only, SECTIONS, FAMILIES)
    return {title: section() for title, section in SECTIONS.items()}


_HEAD = """\
# Proved statements on the scene {scene}

Written by `capsule-sym verify --scene` and `--write`. Surfaces, lines and corners have the paper's
names where the paper has them. Every statement holds for all parameters, states and times in its
scope; each proof is a computation that the command repeats.
Not here, since it is {apart}.
"""


def markdown(report: Report) -> str:
    """Report on the scene."""
    return document(report, _HEAD.format(scene=declaration.path().stem, apart=PAPERS_ALONE))
