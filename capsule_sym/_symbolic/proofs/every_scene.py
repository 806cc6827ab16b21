"""Proofs about any scene, by section: all statements that do not concern the printed paper."""

from __future__ import annotations

from difflib import get_close_matches

from capsule_sym._errors import InvalidInput
from capsule_sym._symbolic.model import declaration
from capsule_sym._symbolic.proofs import (
    basis_proofs,
    cells,
    energy,
    field_graph,
    flow_proofs,
    switches,
)
from capsule_sym._symbolic.proofs.items import Item, Report, Sections
from capsule_sym._symbolic.proofs.markdown import document

SECTIONS: Sections = {
    "Cells of the fields": cells.items,
    "Field graph": field_graph.items,
    "Saltation": switches.items,
    "Energy and mirror images": energy.items,
    "Response functions": basis_proofs.proofs,
    "Closed-form flow, its jets and Jacobians": flow_proofs.proofs,
}
"""Statements proved of a scene, in the order of the report."""

FAMILIES = ("cells", "graph", "saltation", "energy mirror", "basis", "flow jets jacobian")
"""First words of the names of the statements of each section."""

PAPERS_ALONE = (
    "of the paper alone, and proved by `capsule-sym verify` without --scene: its tables, printed "
    f"claims and Section 4, which are about {declaration.SHIPPED[0]}"
)
"""Statements that are not proved of a scene, in one line."""


def items(only: str | None = None) -> dict[str, tuple[Item, ...]]:
    """All statements about the scene, or one, by section title; raises InvalidInput if none."""
    if only is None:
        return {title: section() for title, section in SECTIONS.items()}
    known: list[str] = []
    for (title, section), families in zip(SECTIONS.items(), FAMILIES, strict=True):
        if only.partition(".")[0] in families.split():
            if found := tuple(item for item in section() if item.id == only):
                return {title: found}
            known = [item.id for item in section()]
    alike = get_close_matches(only, known, n=5, cutoff=0.3)
    told = f", such as {', '.join(alike)}" if alike else f", which begins with {_BEGINS}"
    raise InvalidInput("--only", only, f"the name of a statement{told}")


_BEGINS = ", ".join(" ".join(FAMILIES).split())


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
