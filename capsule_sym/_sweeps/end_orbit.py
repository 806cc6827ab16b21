"""The exact orbit that a run has come to."""

from __future__ import annotations

from capsule_sym._errors import CapsuleError
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import solve_orbit
from capsule_sym._parameters import Parameters
from capsule_sym._sweeps import itineraries


class NotSolved(CapsuleError):
    """Newton's method finds no orbit of this itinerary at the end of a run."""


def orbit_at_end(
    parameters: Parameters, state: tuple[float, float, float], period_number: int, itinerary: int
) -> Orbit:
    """The orbit of an itinerary (its code) and period number at a state of phase 0.

    Raises NotSolved where Newton's method leads to none, or to one of another itinerary.
    """
    orbit = solve_orbit(parameters, state, 0.0, 2 * period_number + 1)
    if not orbit.success:
        raise NotSolved(f"{orbit.status}: {orbit.message}")
    found = itineraries.text(orbit.itinerary.fields)
    if (orbit.itinerary.period_number, itineraries.code(found)) != (period_number, itinerary):
        raise NotSolved(
            f"the orbit's itinerary is {found}, its period number {orbit.itinerary.period_number}"
        )
    return orbit
