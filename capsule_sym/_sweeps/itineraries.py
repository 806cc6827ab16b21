"""Itineraries as texts and as codes without a table: the same in every chunk, run and machine."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING

from capsule_sym._map.itinerary import begun

if TYPE_CHECKING:
    import xarray as xr


def text(fields: Sequence[int]) -> str:
    """The cyclic itinerary of fields (1 to 6), such as "F5 F2", begun where the paper begins it."""
    return " ".join(f"F{field}" for field in begun(fields))


def code(itinerary: str) -> int:
    """The 48-bit code of an itinerary, exact in double precision too."""
    return int.from_bytes(blake2b(itinerary.encode(), digest_size=6).digest())


def texts(results: xr.Dataset) -> dict[int, str]:
    """The itineraries of a sweep's results by their codes."""
    flags = results["itinerary"].attrs
    meanings = [text.replace("_", " ") for text in flags["flag_meanings"].split()]
    return dict(zip(flags["flag_values"], meanings, strict=True))
