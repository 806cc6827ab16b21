"""Pieces of the parameters on which an itinerary holds, with its borders as constraints.

On the orbits of one itinerary objective and limits are smooth, also beyond the borders as far as
the orbits exist. A border is where one of the itinerary's inequalities is 0: its distance, to first
order in the scaled variables, is a further slack.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.borders import distances
from capsule_sym._design.evaluation import Motion, same_itinerary_at
from capsule_sym._design.program import Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._orbits.shooting.admissibility import DURATION
from capsule_sym._parameters import names_of

_Name = tuple[object, ...]


class _Border(NamedTuple):
    """Inequality of the itinerary, numbered among similar ones, and its unit."""

    name: _Name
    number: int
    unit: float


class Piece:
    """Program on the itinerary of a place; its places have borders as further slacks."""

    def __init__(self, program: Program, place: Place) -> None:
        motion, orbit = place.motion, place.motion.orbit
        motion = motion if orbit is None else Motion(motion.parameters, None, orbit=orbit)
        self.program = program
        self.known = [(place.u, motion)]
        """Variables and motions of the places so far."""
        self.borders = tuple(self._borders(place.u, motion))

    def by_u(self, rows: Vector) -> Vector:
        """Derivatives by the scaled variables, from those by all parameters."""
        return self.program.by_u(rows)

    def at(self, u: Vector) -> Place | None:
        """Place at variables, on the itinerary's orbit; None if it is lost."""
        _, near = min(self.known, key=lambda one: float(abs(one[0] - u).max()))
        motion = same_itinerary_at(near, dimensionless(self.program.system_at(u)))
        place = self.program.place(u, motion)
        if motion is None or place is None:
            return None
        values, rows = place.slacks, place.slacks_by
        if margin := self.program.margin:
            # The modulus of a multiplier has a root at a fold; the square of its slack is smooth.
            stable = values[-1] + margin
            values[-1] = (stable * abs(stable) - margin**2) / (2 * margin)
            rows[-1] *= abs(stable) / margin
        further = [*self._slacks(u, motion)]
        self.known.append((u, motion))
        whole = replace(
            place,
            slacks=np.append(values, [value for value, _ in further]),
            slacks_by=np.vstack([rows, *(slope for _, slope in further)]),
        )
        return whole if whole.finite else None

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at variables, for a search."""
        return self.at(u)

    def _slacks(self, u: Vector, motion: Motion) -> Iterator[tuple[float, Vector]]:
        """Slacks of the borders, with derivatives by all parameters; 1 of one that is absent."""
        every = _inequalities(motion)
        for name, number, unit in self.borders:
            alike = every.get(name, [])[number:]
            if alike:
                value, slope = alike[0]
                yield value / unit, self.program.by_all(u, slope) / unit
            else:
                yield 1.0, np.zeros(len(names_of(self.program.system)))

    def _borders(self, u: Vector, motion: Motion) -> Iterator[_Border]:
        """All inequalities of the motion, in units of the variables."""
        for name, alike in _inequalities(motion).items():
            for number, (_, slope) in enumerate(alike):
                unit = float(np.linalg.norm(self.program.by_u(self.program.by_all(u, slope))))
                if 0 < unit < np.inf:
                    yield _Border(name, number, unit)


def _inequalities(motion: Motion) -> dict[_Name, list[tuple[float, Vector]]]:
    """Inequalities of a motion by kind, segment and guard, similar ones in order of time.

    A segment that begins at a tangency has a duration proportional to the root of the distance in
    the parameters: the square of its duration is smooth.
    """
    found = dict[_Name, list[tuple[float, Vector]]]()
    for one in sorted(distances(motion.orbit), key=lambda one: float(one.inequality.time)):
        (kind, segment, *_), value, by = one.inequality, float(one.inequality.value), one.by
        itinerary = motion.orbit.itinerary  # type: ignore[union-attr]
        if kind == DURATION and len(itinerary) > 2:
            before, after = (itinerary.neighbour(segment + way) for way in (-1, 1))
            if before == after:
                value, by = value * abs(value), 2 * abs(value) * by
        found.setdefault(one.inequality[:3], []).append((value, by))
    return found
