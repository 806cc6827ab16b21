"""Pieces of the parameters on which an itinerary holds, with its borders as constraints.

On the orbits of one itinerary objective and limits are smooth, also beyond the borders as far as
the orbits exist. A border is where one of the itinerary's inequalities is 0: its distance, to first
order in the scaled variables, is a further slack.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.borders import distances
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.program import Place, Program
from capsule_sym._orbits.shooting.admissibility import DURATION, Inequality
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import names_of

_Name = tuple[object, ...]


class _Border(NamedTuple):
    """Inequality of a scenario's itinerary, numbered among similar ones, and its unit."""

    scenario: int
    name: _Name
    number: int
    unit: float


class Piece:
    """Program on the itineraries of a place; its places have borders as further slacks."""

    def __init__(self, program: Program, place: Place) -> None:
        self.program = program
        motions = tuple(
            motion if motion.orbit is None else Motion(motion.parameters, None, orbit=motion.orbit)
            for motion in place.motions
        )
        self.known = [(place.u, motions)]
        """Variables and motions of the places so far."""
        self.n_constraints = len(program.scenarios) * len(program.texts)
        """Number of slacks that are limits; borders follow them."""
        self.borders = tuple(self._borders(place.u, motions))

    def by_u(self, rows: Vector) -> Vector:
        """Derivatives by the scaled variables, from those by all parameters."""
        return self.program.by_u(rows)

    def at(self, u: Vector) -> Place | None:
        """Place at variables, on the itineraries' orbits; None if one is lost."""
        _, near = min(self.known, key=lambda one: float(abs(one[0] - u).max()))
        motions = self.program.extended(near, u)
        place = self.program.place(u, motions)
        if motions is None or place is None:
            return None
        values, rows = place.slacks, place.slacks_by
        if margin := self.program.margin:
            # The modulus of a multiplier has a root at a fold; the square of its slack is smooth.
            which = range(len(self.program.texts) - 1, self.n_constraints, len(self.program.texts))
            for i in which:
                stable = values[i] + margin
                values[i] = (stable * abs(stable) - margin**2) / (2 * margin)
                rows[i] *= abs(stable) / margin
        further = [*self._slacks(u, motions)]
        self.known.append((u, motions))
        whole = replace(
            place,
            slacks=np.append(values, [value for value, _ in further]),
            slacks_by=np.vstack([rows, *(slope for _, slope in further)]),
        )
        return whole if whole.finite else None

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at variables, for a search."""
        return self.at(u)

    def inequality(self, slack: int) -> tuple[Orbit, Inequality]:
        """Orbit and inequality of a slack that is a border, at the last place."""
        scenario, name, number, _ = self.borders[slack - self.n_constraints]
        orbit = self.known[-1][1][scenario].orbit
        alike = [one.inequality for one in distances(orbit) if one.inequality[:3] == name]
        assert orbit is not None
        return orbit, sorted(alike, key=lambda one: float(one.time))[number]

    def _slacks(self, u: Vector, motions: Sequence[Motion]) -> Iterator[tuple[float, Vector]]:
        """Slacks of the borders, with derivatives by all parameters; 1 of one that is absent."""
        every = [_inequalities(motion) for motion in motions]
        for scenario, name, number, unit in self.borders:
            alike = every[scenario].get(name, [])[number:]
            if not alike:
                yield 1.0, np.zeros(len(names_of(self.program.system)))
                continue
            value, slope = alike[0]
            by = self.program.by_all(u, self.program.scenarios[scenario], slope)
            yield value / unit, by / unit

    def _borders(self, u: Vector, motions: Sequence[Motion]) -> Iterator[_Border]:
        """All inequalities of the motions, in units of the variables."""
        for scenario, motion in enumerate(motions):
            for name, alike in _inequalities(motion).items():
                for number, (_, slope) in enumerate(alike):
                    by = self.program.by_all(u, self.program.scenarios[scenario], slope)
                    unit = float(np.linalg.norm(self.program.by_u(by)))
                    if 0 < unit < np.inf:
                        yield _Border(scenario, name, number, unit)


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
