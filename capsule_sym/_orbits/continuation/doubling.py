"""Where a period-doubled branch ends: its two halves become one, at a period doubling.

Followed further it would come back along itself, with its halves exchanged.
"""

from __future__ import annotations

import numpy as np

from capsule_sym._orbits.continuation.bifurcations import (
    SmoothEvent,
    zero_of_test_function,
)
from capsule_sym._orbits.continuation.events import PERIOD_DOUBLING
from capsule_sym._orbits.continuation.states import Axis
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary

# Of the interval around a doubling, over that of the step: the parameter may turn back within it.
_WIDTHS = 10.0 ** np.arange(-3, 4)


def halved(old: Orbit, new: Orbit, axis: Axis) -> SmoothEvent | None:
    """The period doubling between two orbits of one branch at which the halves exchange places.

    The root's orbit is that of half the period; its share and doubt are of the axis. None where
    the itinerary's halves have other fields, or keep their places, or where no doubling is near.
    """
    half, itinerary = len(old.itinerary) // 2, old.itinerary
    if (
        itinerary.period_number % 2
        or half == 0
        or itinerary.fields[:half] != itinerary.fields[half:]
    ):
        return None
    before, after = _difference(old), _difference(new)
    if not before @ after < 0:
        return None
    # The doubled orbit's equations are singular there; those of half the period are not.
    share = before @ before / (before @ before - before @ after)
    middle = old.z + share * (new.z - old.z)
    durations = (middle[4 : 4 + half] + middle[4 + half :]) / 2
    guess = [*middle[:4], *durations]
    values = list(old.values)
    first, last = (axis.share(one.values) for one in (old, new))
    once = Itinerary(itinerary.segments[:half], itinerary.period_number // 2)
    reach = abs(new.z - old.z).max()

    def at(q: float) -> Orbit | None:
        found = solve_itinerary(axis.placed(values, q), once, guess)
        near = found.success and abs(found.durations - durations).max() <= reach
        return found if near and found.success else None

    for factor in _WIDTHS.tolist():
        width = factor * abs(last - first)
        low = first + share * (last - first) - width / 2

        def between(part: float, low: float = low, width: float = width) -> Orbit | None:
            return at(low + part * width)

        found = zero_of_test_function(PERIOD_DOUBLING, between)
        if found is not None:
            return found._replace(share=low + found.share * width, doubt=found.doubt * width)
    return None


def _difference(orbit: Orbit) -> Vector:
    """How the durations of the two halves differ, (n/2,)."""
    half = len(orbit.itinerary) // 2
    return orbit.durations[:half] - orbit.durations[half:]


def apart(orbit: Orbit, least: float) -> bool:
    """Whether the two halves of an orbit differ by so much."""
    n = len(orbit.itinerary) // 2
    begin, middle = orbit.system.flows[0].start, orbit.system.flows[n].start
    return bool(np.max(np.abs([*(begin - middle), *_difference(orbit)])) > least)
