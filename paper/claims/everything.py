"""Every printed statement with its derivation: the rows of `claims/` and all their checks."""

from __future__ import annotations

from functools import cache

from capsule_sym._symbolic.proofs.items import Item
from capsule_sym._symbolic.proofs.rows import Row, read_rows
from paper.claims import (
    captions,
    dimensions,
    errata,
    fields,
    motions,
    segments,
    space,
    tables,
)
from paper.printed import Paper

CHECKS = (captions, dimensions, errata, fields, motions, segments, space, tables)
"""Modules that register checks and the names used in rows."""

PARTS = ("section_2", "section_3", "tables", "appendices", "section_4", "captions")
"""Files of rows, in the order of the paper."""


@cache
def rows(parts: tuple[str, ...] = PARTS) -> tuple[Row, ...]:
    """Rows of these files."""
    return read_rows(__package__, "claims", parts)


def items(paper: Paper) -> tuple[Item, ...]:
    """All comparisons with a transcription."""
    return tuple(item for row in rows() for item in row.items(paper))
