"""Itineraries of sweeps: their texts and their codes.

A code is a hash: the same in every chunk, run and machine, without a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING

from capsule_sym._map.itinerary import begun
from capsule_sym._parameters import CAPSULE, Scene

if TYPE_CHECKING:
    import xarray as xr


def text(fields: Sequence[int], scene: Scene = CAPSULE) -> str:
    """Cyclic itinerary of fields, such as "F5 F2", starting as in the paper."""
    return " ".join(f"F{field}" for field in begun(fields, scene))


def code(itinerary: str) -> int:
    """48-bit code of an itinerary, exact in double precision too."""
    return int.from_bytes(blake2b(itinerary.encode(), digest_size=6).digest())


def texts(results: xr.Dataset) -> dict[int, str]:
    """Itineraries of a sweep's results by their codes."""
    flags = results["itinerary"].attrs
    meanings = [text.replace("_", " ") for text in flags["flag_meanings"].split()]
    return dict(zip(flags["flag_values"], meanings, strict=True))
