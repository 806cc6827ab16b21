"""Orbits beyond a point where events lie too close together to be located one by one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map import simulate
from capsule_sym._orbits.continuation.families.family import Problem
from capsule_sym._orbits.shooting.admissibility import tightest
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import newton_orbit, orbit_at
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import SceneParameters

_GAPS = 10.0 ** np.arange(-10, -3)
"""Distances beyond a point, as shares of the range: from rounding of an event to a short step."""
_HALVINGS = 24
"""Halvings of the interval in which the itinerary changes: to rounding from the longest gap."""
_LEAP = 10.0
"""Largest change of an orbit over a gap, in units of what its tangent leads to."""
_TRANSIENT = 200
"""Excitation periods after which a run next to a stable orbit is on it."""


class Junction(NamedTuple):
    """Orbits next to each other, before and after a change of itinerary."""

    before: Orbit
    after: Orbit


class Rejoining:
    """Search beyond an orbit of a branch, in the direction `way` of its parameter.

    `itinerary` is that of the branch before the orbit, which may have segments of duration 0;
    `steepness` is the change of the orbit's unknowns over that of the parameter's coordinate.
    """

    def __init__(
        self, problem: Problem, itinerary: Itinerary, orbit: Orbit, way: float, steepness: float
    ) -> None:
        (self.axis,), self.way, self.steepness = problem.axes, way, steepness
        self.itinerary = itinerary.whole.cyclic
        self.orbit = whole_orbit(orbit)
        self.q = float(self.axis.share(self.orbit.values))
        self.number = self.orbit.itinerary.period_number
        self.state = _strobe(self.orbit, self.number)

    def junction(self) -> Junction | None:
        """The nearest change of itinerary and the orbits beside it; None if no orbit is beyond."""
        here = self.orbit, 0.0
        for gap in _GAPS.tolist():
            found = self._at(gap)
            if found is not None and not self._same_itinerary(found):
                return self._between(here, (found, gap))
            here = here if found is None else (found, gap)
        return None

    def _between(self, low: tuple[Orbit, float], high: tuple[Orbit, float]) -> Junction | None:
        """Orbits beside the change of itinerary between two distances, by bisection."""
        before, (below, above), beyond = low[0], (low[1], high[1]), [high[0]]
        for _ in range(_HALVINGS):
            gap = (below + above) / 2
            found = self._at(gap)
            if found is None:
                break
            if self._same_itinerary(found):
                before, below = found, gap
            else:
                above = gap
                beyond.append(found)
        # At the change itself the inequalities of both sides are 0.
        alike = (one for one in beyond[::-1] if one.itinerary.cyclic == beyond[-1].itinerary.cyclic)
        after = next((one for one in alike if tightest(one).value > 0), None)
        return None if after is None else Junction(before, after)

    def _same_itinerary(self, found: Orbit) -> bool:
        """True if an orbit has the itinerary of the branch."""
        return found.itinerary.cyclic == self.itinerary

    def _at(self, gap: float) -> Orbit | None:
        """Admissible orbit so far beyond, if it is near.

        The map runs from the state of the branch, in the fields that this selects, and Newton's
        method closes the run.
        """
        q = self.q + self.way * gap
        values = self.axis.placed([float(value) for value in self.orbit.values], q)
        names = self.orbit.scene.facts.PARAMETERS
        # Beyond a grazing the orbit changes by the square root of the distance.
        near = (_LEAP * self.steepness * gap + math.sqrt(gap)) * (1 + abs(self.state).max())
        try:
            parameters = self.orbit.parameters.replace(**dict(zip(names, values, strict=True)))
            found = _closed(parameters, self.state, self.number) if 0 <= q <= 1 else iter(())
            return next((one for one in found if self._apart(one) < near), None)
        except InvalidInput:  # of parameters, or of a state that Newton's method leads to
            return None

    def _apart(self, orbit: Orbit) -> float:
        """Least distance between the orbits' states at phase 0."""
        numbers = range(1, orbit.itinerary.period_number + 1)
        return float(min(abs(_strobe(orbit, number) - self.state).max() for number in numbers))


def _strobe(orbit: Orbit, number: int) -> Vector:
    """State of an orbit at phase 0, after so many excitation periods."""
    return np.array(orbit.trajectory()(number * orbit.parameters.period), dtype=float)


def _closed(parameters: SceneParameters, state: Vector, number: int) -> Iterator[Orbit]:
    """Orbits that Newton's method finds from a state, and from the state of a settled run."""
    found = newton_orbit(parameters, state, number)
    if found is not None:
        yield found
    run = simulate(parameters, state.tolist(), periods=_TRANSIENT * number, keep="final")
    for multiple in (1, 2):
        settled = orbit_at(parameters, run.final[1], number * multiple) if run.success else None
        if settled is not None:
            yield settled
