"""Itineraries as texts and as codes without a table: the same in every chunk, run and machine."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b

# The paper begins a global map in contact, at rest if the motion has such a segment.
_RANK = {5: 0, 4: 1, 6: 2, 2: 3, 1: 4, 3: 5}


def text(fields: Sequence[int]) -> str:
    """The cyclic itinerary of fields (1 to 6), such as "F5 F2", begun where the paper begins it."""
    turns = [[*fields[i:], *fields[:i]] for i in range(len(fields))]
    first = min(turns, key=lambda turn: [_RANK[field] for field in turn])
    return " ".join(f"F{field}" for field in first)


def code(itinerary: str) -> int:
    """The 48-bit code of an itinerary, exact in double precision too."""
    return int.from_bytes(blake2b(itinerary.encode(), digest_size=6).digest())
