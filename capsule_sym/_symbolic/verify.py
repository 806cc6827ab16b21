"""All proofs of the theory, by the sections of the report."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from capsule_sym._symbolic.proofs import basis_proofs, flow_proofs, theorems
from capsule_sym._symbolic.proofs.statement import Statement, named


def _flow_items() -> tuple[Statement, ...]:
    """Proofs of the closed-form flow."""
    return (*basis_proofs.proofs(), *flow_proofs.proofs())


_THEOREMS: dict[str, tuple[str, ...]] = {
    "State space, Eqs. (13)-(15)": ("geometry", "fields"),
    "Inner products, Eqs. (16)-(23)": ("inner",),
    "Table 2 as derived": ("table2",),
    "Table 3 as derived": ("table3",),
    "Appendices A and B": ("appendix",),
    "The resting orbit": ("grazing",),
    "Where every motion goes": ("attraction",),
}
_FLOW = "Closed-form flow, Eqs. (7)-(12)"

SECTIONS: dict[str, Callable[[], tuple[Statement, ...]]] = {
    **{title: partial(theorems.items, *families) for title, families in _THEOREMS.items()},
    _FLOW: _flow_items,
}
"""Statements to verify, in the order of the report: a title and its items."""

FAMILIES: dict[str, str] = {
    **{title: " ".join(families) for title, families in _THEOREMS.items()},
    _FLOW: "basis flow jets jacobian",
}
"""First words of the names of a section's statements, to find one without deriving all."""


def items() -> dict[str, tuple[Statement, ...]]:
    """All statements of the theory with their proofs, by section title."""
    return {title: section() for title, section in SECTIONS.items()}


def item(name: str) -> dict[str, tuple[Statement, ...]]:
    """Statement of this name with its proof, by section title; raises InvalidInput for none."""
    return named(name, SECTIONS, FAMILIES)
