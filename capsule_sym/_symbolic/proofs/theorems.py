"""Statements about the model by section."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from capsule_sym._symbolic.proofs.appendices import appendix_a, appendix_b
from capsule_sym._symbolic.proofs.attraction import attraction
from capsule_sym._symbolic.proofs.geometry_proofs import fields_at_boundaries, state_space
from capsule_sym._symbolic.proofs.inner_products import inner
from capsule_sym._symbolic.proofs.resting import resting_orbit
from capsule_sym._symbolic.proofs.statement import Statement
from capsule_sym._symbolic.proofs.table_proofs import table_2, table_3

GROUPS: dict[str, tuple[Callable[[], Iterator[Statement]], ...]] = {
    "geometry": (state_space,),
    "fields": (fields_at_boundaries,),
    "inner": (inner,),
    "table2": (table_2,),
    "table3": (table_3,),
    "appendix": (appendix_a, appendix_b),
    "grazing": (resting_orbit,),
    "attraction": (attraction,),
}
"""Functions that yield statements, by the first word of their names."""


def items(*families: str) -> tuple[Statement, ...]:
    """Statements whose names begin with one of these words."""
    return tuple(one for family in families for group in GROUPS[family] for one in group())
