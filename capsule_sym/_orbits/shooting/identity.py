"""Identity of orbits: equal orbits, and orbits that repeat a shorter one."""

from __future__ import annotations

from math import gcd

import numpy as np
from numpy.typing import NDArray

from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary

_SAME = 1e-7  # states of an orbit found twice differ by less


def same(orbit: Orbit, other: Orbit) -> bool:
    """True if two orbits are equal, also if they begin at different switches."""
    if orbit.itinerary.period_number != other.itinerary.period_number or len(
        orbit.itinerary
    ) != len(other.itinerary):
        return False
    return any(
        orbit.itinerary.fields == other.itinerary.rotated(i).fields and _alike(orbit, 0, other, i)
        for i in range(len(other.itinerary))
    )


def same_start(orbit: Orbit, other: Orbit) -> bool:
    """True if two orbits of one itinerary begin in the same state."""
    return orbit.itinerary == other.itinerary and _alike(orbit, 0, other, 0)


def primitive(orbit: Orbit) -> Orbit:
    """The orbit traversed once: that of the shortest itinerary that it repeats."""
    itinerary, most = orbit.itinerary, gcd(len(orbit.itinerary), orbit.itinerary.period_number)
    for times in range(most, 1, -1):
        count = len(itinerary) // times
        if most % times or itinerary.fields != itinerary.fields[:count] * times:
            continue
        turns = itinerary.period_number // times
        once = Itinerary(itinerary.segments[:count], turns, scene=itinerary.scene)
        found = solve_itinerary(
            orbit.values, once, list(orbit.z[: 4 + count]), backend=orbit.backend
        )
        if found.success and all(_alike(orbit, i, found, i % count) for i in range(len(itinerary))):
            return found
    return orbit


def _alike(orbit: Orbit, segment: int, other: Orbit, its: int) -> bool:
    one, two = _place(orbit, segment), _place(other, its)
    return bool(abs(one - two).max() < _SAME * (1 + abs(one).max()))


def _place(orbit: Orbit, segment: int) -> NDArray[np.float64]:
    """State and forcing at a segment's start."""
    flow = orbit.system.flows[segment]
    angle = float(flow.angle)
    return np.array([*flow.start, np.cos(angle), np.sin(angle)], dtype=float)
