"""Every printed statement beside its derivation: the rows of `claims/` with all their checks."""

from __future__ import annotations

from capsule_sym._paper import Paper
from capsule_sym._symbolic.paper import (
    captions,
    dimensions,
    fields,
    motions,
    relations,
    space,
    tables,
)
from capsule_sym._symbolic.paper.rows import Row, rows
from capsule_sym._symbolic.proofs.items import Item

CHECKS = (captions, dimensions, fields, motions, relations, space, tables)
"""The modules that register checks, and what rows name."""


def items(paper: Paper) -> tuple[Item, ...]:
    """All comparisons with a transcription."""
    return tuple(item for row in rows() for item in row.items(paper))


__all__ = ["CHECKS", "Row", "items", "rows"]
