"""Where a cyclic itinerary is begun to be written."""

from __future__ import annotations

from collections.abc import Sequence

from capsule_sym.generated.capsule.facts import FIELDS


def _rank(field: int) -> tuple[int, int, int]:
    contact, drift = FIELDS[field]
    return -contact, abs(drift), -drift


_RANK = {field: rank for rank, field in enumerate(sorted(FIELDS, key=_rank))}
"""Fields in contact first, and of these rest, then forward and backward drift."""


def cyclic_start(fields: Sequence[int]) -> int:
    """Index of the segment at which the paper begins a cycle of fields F1 to F6.

    It is in contact, at rest if there is such a segment; what follows decides between several.
    """
    ranks = [_RANK[field] for field in fields]
    return min(range(len(ranks)), key=lambda i: ranks[i:] + ranks[:i])


def begun(fields: Sequence[int]) -> list[int]:
    """The same cycle of fields, begun where the paper begins it."""
    first = cyclic_start(fields)
    return [*fields[first:], *fields[:first]]
