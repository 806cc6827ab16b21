"""Pieces of the parameters on which an itinerary holds, with its borders as constraints.

On the orbits of one itinerary objective and limits are smooth, also beyond the borders as far as
the orbits exist. A border is where one of the itinerary's inequalities is 0: its distance, to first
order in the scaled variables, is a further slack.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.borders import distances
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.program import Place, Program
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.performance import peaks_of_force
from capsule_sym._orbits.shooting.admissibility import DURATION, Inequality
from capsule_sym._orbits.shooting.closed import ClosedForms

_FREE = 1.0  # slack of an absent inequality
_AT = 1e-8  # of the bounds: at a border
_ALIKE = 0.9  # of the largest force: peaks that may become the largest
_KNOWN = 6  # places whose orbits are kept


class _Key(NamedTuple):
    """Inequality of a scenario's itinerary, numbered among its like, and its unit."""

    scenario: int
    name: tuple[object, ...]
    number: int
    unit: float


class Piece:
    """Program on the itineraries of a place; its places have borders as further slacks."""

    def __init__(self, program: Program, place: Place) -> None:
        self.program = program
        motions = tuple(_by_orbit(motion) for motion in place.motions)
        self.known = [(place.u, motions)]
        self.asked = len(program.scenarios) * len(program.texts)
        self.keys = tuple(self._keys(place.u, motions))
        self.peaks = tuple(self._peaks(place.u, motions))

    def by_u(self, rows: Matrix) -> Matrix:
        """Derivatives by the scaled variables, from those by all parameters."""
        return self.program.by_u(rows)

    def at(self, u: Vector) -> Place | None:
        """Place at variables, on the itineraries' orbits; None if one is lost."""
        _, near = min(self.known, key=lambda one: float(abs(one[0] - u).max()))
        motions = self.program.extended(near, u)
        if motions is None:
            return None
        try:
            place = self.program.at(u, motions)
            borders, objective, by, peaks = self.borders(u, motions), *self._by_peaks(u, place)
        except np.linalg.LinAlgError:
            return None
        self.known = [(u, motions), *self.known[: _KNOWN - 1]]
        values, rows = place.slacks.copy(), place.slacks_by.copy()
        if self.program.margin:
            each, m = len(self.program.texts), self.program.margin
            for i in range(each - 1, self.asked, each):
                stable = values[i] + m
                values[i] = (stable * abs(stable) - m**2) / (2 * m)
                rows[i] *= abs(stable) / m
        further = [*borders, *peaks]
        whole = replace(
            place,
            objective=objective,
            objective_by=by,
            slacks=np.append(values, [value for value, _ in further]),
            slacks_by=np.vstack([rows, *(slope for _, slope in further)]),
        )
        return whole if whole.finite else None

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at variables, for a search."""
        return self.at(u)

    def inequality(self, slack: int) -> tuple[int, Inequality]:
        """Scenario of a slack that is a border, and the inequality at the last place."""
        which, name, number, _ = self.keys[slack - self.asked]
        alike = [one for one in distances(self.known[0][1][which].orbit)]
        alike = [one for one in alike if one.inequality[:3] == name]
        return which, sorted(alike, key=lambda one: float(one.inequality.time))[number].inequality

    @property
    def borders_at(self) -> slice:
        """Slice of the slacks that are borders."""
        return slice(self.asked, self.asked + len(self.keys))

    def borders(self, u: Vector, motions: Sequence[Motion]) -> list[tuple[float, Vector]]:
        """Slacks of the borders, with derivatives by all parameters."""
        every = [_borders(motion) for motion in motions]
        found = []
        for which, name, number, unit in self.keys:
            alike = every[which].get(name, [])
            none = _FREE * unit, np.zeros(len(motions[which].metrics["work"].slope))
            value, slope = alike[number] if number < len(alike) else none
            by = self.program.by_all(u, self.program.scenarios[which], slope)
            found.append((value / unit, by / unit))
        return found

    def _by_peaks(
        self, u: Vector, place: Place
    ) -> tuple[Vector, Matrix, list[tuple[float, Vector]]]:
        """Objectives (m,) with derivatives and slacks, for each of several peaks of a force.

        The largest force has a kink where two peaks are equal; each of them is smooth.
        """
        objective, by = [*place.objective], [*place.objective_by]
        slacks, seen = list[tuple[float, Vector]](), set[int]()
        for which, key in self.peaks:
            one = self._with_peak(u, place.motions, which, key)
            if one is None:  # the peak no longer exists: use the largest
                one = place
            if which not in seen:
                objective[which], by[which] = one.objective[which], one.objective_by[which]
            else:
                objective.append(one.objective[which])
                by.append(one.objective_by[which])
            count = len(self.program.limits)
            first = which * (count if one is not place else len(self.program.texts))
            if which in seen:
                slacks += [
                    (float(one.slacks[i]), one.slacks_by[i]) for i in range(first, first + count)
                ]
            seen.add(which)
        return np.array(objective), np.array(by), slacks

    def _with_peak(
        self, u: Vector, motions: Sequence[Motion], which: int, key: tuple[int, int]
    ) -> Place | None:
        """Place with a given peak as the largest force of a scenario's motion."""
        peak = _forces(motions[which], 0.0).get(key)
        if peak is None:
            return None
        changed = copy(motions[which])
        changed.metrics = motions[which].metrics | {"peak_force": peak}
        swapped = tuple(changed if i == which else one for i, one in enumerate(motions))
        return replace(self.program, margin=None).at(u, swapped)

    def _peaks(
        self, u: Vector, motions: tuple[Motion, ...]
    ) -> Iterator[tuple[int, tuple[int, int]]]:
        """Scenarios and keys of peaks: the largest, and those that may be and make things worse.

        None where only one peak counts.
        """
        plain = replace(self.program, margin=None).at(u, motions)
        for which, motion in enumerate(motions):
            forces, kept, matters = _forces(motion, _ALIKE), list[tuple[int, int]](), False
            if len(forces) < 2:
                continue
            largest = max(force.value for force in forces.values())
            for key in sorted(forces, key=lambda key: -forces[key].value):
                one = self._with_peak(u, motions, which, key)
                assert one is not None
                less = one.objective - plain.objective, plain.slacks - one.slacks
                changes = any(np.any(row < 0) for row in less)
                matters |= changes
                if forces[key].value == largest or (
                    changes and all(np.all(row <= 0) for row in less)
                ):
                    kept.append(key)
            if matters or len(kept) > 1:
                yield from ((which, key) for key in kept)

    def _keys(self, u: Vector, motions: Sequence[Motion]) -> Iterator[_Key]:
        """All inequalities of the motions, in units of the variables."""
        for which, motion in enumerate(motions):
            for name, alike in _borders(motion).items():
                for number, (_, slope) in enumerate(alike):
                    by = self.program.by_all(u, self.program.scenarios[which], slope)
                    size = float(np.linalg.norm(self.program.by_u(by)))
                    if np.isfinite(size) and size > 0:
                        yield _Key(which, name, number, size)


def _by_orbit(motion: Motion) -> Motion:
    """The same motion from its orbit, if it has one."""
    orbit = motion.orbit
    return motion if orbit is None else Motion(motion.parameters, None, orbit=orbit)


def _forces(motion: Motion, least: float) -> dict[tuple[int, int], Slope]:
    """Peaks of |P| of a motion, of at least a share of the largest, with derivatives."""
    orbit = motion.orbit
    if orbit is None:
        return {}
    count = len(orbit.z)
    with backend(orbit.backend, orbit.scene) as numbers:
        found = peaks_of_force(ClosedForms(numbers, orbit.values), orbit, least)
    return {
        key: Slope(float(value), np.asarray(by[count:] + by[:count] @ orbit.by_parameter, float))
        for key, (value, by) in found.items()
    }


def _borders(motion: Motion) -> dict[tuple[object, ...], list[tuple[float, Vector]]]:
    """Inequalities of a motion by kind, segment and guard, similar ones in order of time.

    A segment that begins at a tangency has a duration proportional to the root of the distance in
    the parameters: the square of its duration is smooth.
    """
    found = dict[tuple[object, ...], list[tuple[float, Vector]]]()
    if motion.orbit is None:
        return found
    itinerary = motion.orbit.itinerary
    for one in sorted(distances(motion.orbit), key=lambda one: float(one.inequality.time)):
        (kind, segment, *_), value, by = one.inequality, float(one.inequality.value), one.by
        if kind == DURATION and len(itinerary) > 2:
            before, after = (itinerary.neighbour(segment + way) for way in (-1, 1))
            if before == after:
                value, by = value * abs(value), 2 * abs(value) * by
        found.setdefault(one.inequality[:3], []).append((value, by))
    return found
