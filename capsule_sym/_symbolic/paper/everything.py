"""Every printed statement beside its derivation, by the part of the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from capsule_sym._paper import Paper
from capsule_sym._symbolic.paper import (
    appendix,
    bifurcations,
    captions,
    fields,
    lines,
    motions,
    physics,
    products,
    scenarios,
    space,
    tables,
)
from capsule_sym._symbolic.proofs.items import Item

PARTS: dict[str, Callable[[Paper], Iterator[Item]]] = {
    "Section 2, Eqs. (1)-(5)": physics.items,
    "Section 2, Eqs. (6)-(12)": fields.items,
    "Eqs. (13)-(15), (24)": space.items,
    "Section 3.1": scenarios.items,
    "Eqs. (16)-(23)": products.items,
    "Tables 1-3": tables.items,
    "Appendices A and B": appendix.items,
    "Section 3.3": lines.items,
    "Section 4, motions": motions.items,
    "Section 4, bifurcations": bifurcations.items,
    "Captions": captions.items,
}
"""The comparisons of each part of the paper with a transcription."""


def items(paper: Paper) -> tuple[Item, ...]:
    """All comparisons with a transcription."""
    return tuple(item for part in PARTS.values() for item in part(paper))
