"""Itineraries of sweeps: their texts, their codes, and their exact orbits.

A code is a hash: the same in every chunk, run and machine, without a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING

from capsule_sym._errors import CapsuleError
from capsule_sym._map.itinerary import begun
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import solve_orbit
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters

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


class NotSolved(CapsuleError):
    """Raised if Newton's method finds no orbit of this itinerary at the end of a run."""


def orbit_at_end(
    parameters: SceneParameters,
    state: tuple[float, float, float],
    period_number: int,
    itinerary: int,
) -> Orbit:
    """Orbit of an itinerary (its code) and period number at a state of phase 0.

    Raises NotSolved if Newton's method finds none, or one of another itinerary.
    """
    orbit = solve_orbit(parameters, state, 0.0, 2 * period_number + 1)
    if not orbit.success:
        raise NotSolved(f"{orbit.status}: {orbit.message}")
    found = text(orbit.itinerary.fields, parameters.scene)
    if (orbit.itinerary.period_number, code(found)) != (period_number, itinerary):
        raise NotSolved(
            f"the orbit's itinerary is {found}, its period number {orbit.itinerary.period_number}"
        )
    return orbit
