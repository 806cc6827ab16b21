"""Statements about the model by section: the rows of `statements/` with all their checks."""

from __future__ import annotations

from functools import cache

from capsule_sym._symbolic.proofs import (
    appendices,
    attraction,
    geometry_proofs,
    inner_products,
    relations,
    resting,
    table_proofs,
)
from capsule_sym._symbolic.proofs.items import Item
from capsule_sym._symbolic.proofs.rows import Row, read_rows

CHECKS = (appendices, attraction, geometry_proofs, inner_products, relations, resting, table_proofs)
"""The modules that register checks, and what rows name."""

PARTS = ("geometry", "tables", "appendices", "motions")
"""The files of rows."""


@cache
def rows() -> tuple[Row, ...]:
    """All rows."""
    return read_rows(__package__, "statements", PARTS)


def items(*families: str) -> tuple[Item, ...]:
    """The statements whose names begin with one of these words."""
    found = (row for row in rows() if row.name.partition(".")[0] in families)
    return tuple(item for row in found for item in row.items())
