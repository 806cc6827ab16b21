"""Statements about the model by section: the rows of `statements/` and all their checks."""

from __future__ import annotations

from functools import cache
from itertools import chain

from capsule_sym._symbolic.proofs import (
    appendices,
    attraction,
    geometry_proofs,
    inner_products,
    relations,
    resting,
    table_proofs,
)
from capsule_sym._symbolic.proofs.rows import Row, read_rows
from capsule_sym._symbolic.proofs.statement import Statement

CHECKS = (appendices, attraction, geometry_proofs, inner_products, relations, resting, table_proofs)
"""Modules that register checks and the names used in rows."""

PARTS = ("geometry", "tables", "motions")
"""Files of rows."""


@cache
def rows() -> tuple[Row, ...]:
    """All rows."""
    return read_rows(__package__, "statements", PARTS)


_GENERATED = {"appendix": (appendices.appendix_a, appendices.appendix_b)}
"""Functions that yield statements, by the first word of their names."""


def items(*families: str) -> tuple[Statement, ...]:
    """Statements whose names begin with one of these words."""
    found = (row for row in rows() if row.name.partition(".")[0] in families)
    yielded = (group() for family in families for group in _GENERATED.get(family, ()))
    return tuple(chain(chain.from_iterable(row.items() for row in found), *yielded))
