"""Assignment of starts to known attractors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arguments import checked
from capsule_sym._attractors.neighbourhoods import NEUTRAL, Neighbourhoods, stroboscopic
from capsule_sym._attractors.settling import Arrivals, Cycle, Settling
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._map.checks import check_count
from capsule_sym._map.many import spread
from capsule_sym._map.result import brief
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit

MOST = 8192
"""Largest number of excitation periods of a run."""


@checked
class Destinations:
    """Known attractors of one parameter set, to which starts are assigned.

    `orbits` are stable periodic orbits at the same parameters; `states` are those of each at phase
    0, shape (period_number, 3). All quantities are dimensionless. Raises InvalidInput for orbits
    that are unstable, or not at the same parameters.
    """

    def __init__(self, orbits: Sequence[Orbit], *, threads: int = 1) -> None:
        self._settling = settling_of(orbits, threads)
        self.orbits = tuple(whole_orbit(orbit) for orbit in orbits)
        self.states = tuple(cycle.states for cycle in self._settling.cycles[0])

    @property
    def neighbourhoods(self) -> Neighbourhoods:
        """Neighbourhoods of the attractors' states within which a run has arrived."""
        return self._settling.near[0]

    def __repr__(self) -> str:
        return brief(self, counted(len(self.states), "attractor"))

    @checked
    def of(
        self, states: ArrayLike, phases: ArrayLike = 0.0, periods: int = MOST
    ) -> NDArray[np.int16]:
        """Attractor number of each start, shape (n,), NONE for none of them.

        Arguments are those of `arrivals`.
        """
        return self.arrivals(states, phases, periods).numbers

    @checked
    def arrivals(self, states: ArrayLike, phases: ArrayLike = 0.0, periods: int = MOST) -> Arrivals:
        """Attractors at which runs from states, (n, 3), at phases, (n,) or one, arrive.

        Each run lasts at most `periods` excitation periods, until it is so near to an attractor
        that it stays there, or repeats itself on another orbit. Raises TimeUp if the present watch
        is over, and InvalidInput as `simulate_many` does.
        """
        check_count("periods", periods, 2)
        starts = np.atleast_2d(np.asarray(states, dtype=float))
        starts = spread("states", starts, (len(starts), 3))
        groups = np.zeros(len(starts), np.intp)
        return self._settling.follow(groups, Arrivals.begun(starts), phases, periods, find=False)


def settling_of(orbits: Sequence[Orbit], threads: int = 1, share: float = 1.0) -> Settling:
    """Runs at the parameters of stable orbits, with the orbits known, in this order.

    Raises InvalidInput as `Destinations` does.
    """
    if not orbits:
        raise InvalidInput("orbits", orbits, "one orbit or more")
    for orbit in orbits:
        if not orbit.success or not abs(orbit.multipliers[0]) < 1 - NEUTRAL:
            raise InvalidInput("orbits", orbit, "stable periodic orbits")
        if orbit.parameters != orbits[0].parameters:
            raise InvalidInput("orbits", orbit, "orbits at the same parameters")
    row = [[*orbits[0].parameters.to_dict().values()]]
    found = Settling(np.array(row), orbits[0].scene, threads, share)
    largest = (float(abs(orbit.multipliers[0])) for orbit in orbits)
    states = (stroboscopic(whole_orbit(orbit)) for orbit in orbits)
    found.add([(0, Cycle(*one)) for one in zip(states, largest, strict=True)])
    return found
