"""Optima on a border between itineraries, where the gradients of the two sides differ.

On the side whose itinerary goes on beyond the border, objective and border are smooth: the place is
one at which the objective's gradient is a multiple of the border's normal. That it is an optimum
takes the other side too: away from the border the objective rises on both.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.borders import Distance, distances
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.program import Place, Program
from capsule_sym._design.quantities import dimensionless_slopes
from capsule_sym._design.stationary import SOLVED, Stationary, stationary

Vector = NDArray[np.float64]
_NEAR = 0.05  # of the bounds: how far from the place where the search rested
_TRIED = 3  # borders of one motion
_BESIDE = 1e-5  # of the bounds: where the sides are looked at
_JUMP = 100  # times what the gradient explains


@dataclass(frozen=True, eq=False)
class Kink:
    """An optimum on a border: the conditions there, the places beside it, and the slopes."""

    found: Stationary
    sides: tuple[Place, Place]
    slopes: tuple[float, float]
    """The objective's slopes away from the border, by the scaled variables along its normal, each
    less what the active limits let it gain."""
    which: int
    """The scenario whose motion changes its itinerary."""
    border_by: Vector
    """Derivatives by all parameters of the inequality that is 0 there."""


def kink_beside(program: Program, places: Sequence[Place]) -> Kink | None:
    """The optimum on a border next to the first of the places, the best; None if none is found."""
    best = places[0]
    for place in _different(places):
        for which, motion in enumerate(place.motions):
            for distance in _closest(program, best.u, which, motion):
                border = _Border(program, which, distance)
                found = stationary(program, best, border, place.motions)
                if found is None or not found.residual < SOLVED or not found.minimal:
                    continue
                if abs(found.place.u - best.u).max() < _NEAR:
                    kink = _seen_from_both(program, found, border)
                    if kink is not None:
                        return kink
    return None


def _different(places: Sequence[Place]) -> Iterator[Place]:
    """Places near the first whose itineraries differ."""
    seen = set[tuple[tuple[str, ...], ...]]()
    for place in places:
        itineraries = tuple(motion.itinerary for motion in place.motions)
        if itineraries not in seen and abs(place.u - places[0].u).max() < _NEAR:
            seen.add(itineraries)
            yield place


def _closest(program: Program, u: Vector, which: int, motion: Motion) -> list[Distance]:
    """The inequalities of a motion that may fail nearby, the nearest first."""
    near = []
    for one in distances(motion.orbit):
        slope = float(np.linalg.norm(by_u(program, u, which, one.by)))
        if abs(one.inequality.value) < _NEAR * slope:
            near.append((abs(one.inequality.value) / slope, one))
    return [one for _, one in sorted(near, key=lambda pair: pair[0])[:_TRIED]]


class _Border:
    """The value of one inequality of one scenario's motion at a place."""

    def __init__(self, program: Program, which: int, distance: Distance) -> None:
        self.program, self.which = program, which
        self.inequality = distance.inequality

    def __call__(self, place: Place) -> tuple[float, Vector]:
        one = self.inequality
        found = [
            other
            for other in distances(place.motions[self.which].orbit)
            if other.inequality[:3] == one[:3]
        ]
        if not found:
            return float("nan"), np.full(len(place.objective_by[0]), np.nan)
        nearest = min(found, key=lambda other: abs(float(other.inequality.time - one.time)))
        scenario = self.program.scenarios[self.which]
        system = scenario.system(self.program.system_at(place.u))
        by = nearest.by @ dimensionless_slopes(system) * scenario.weights(system)
        return float(nearest.inequality.value), by


def by_u(program: Program, u: Vector, which: int, by: Vector) -> Vector:
    """Derivatives by the scaled variables, from those (7,) by the dimensionless parameters."""
    scenario = program.scenarios[which]
    system = scenario.system(program.system_at(u))
    whole = by @ dimensionless_slopes(system) * scenario.weights(system)
    found: Vector = whole[program.columns] * (program.high - program.low)
    return found


def _seen_from_both(program: Program, found: Stationary, border: _Border) -> Kink | None:
    """The kink, if both sides have a motion and the objective rises away from the border there."""
    place = found.place
    normal = border(place)[1][program.columns] * (program.high - program.low)
    inside = (place.u > 0.0) & (place.u < 1.0)
    normal = np.where(inside, normal, 0.0)
    if not np.linalg.norm(normal) > 0:
        return None
    normal /= np.linalg.norm(normal)
    sides, slopes = [], []
    for way in (1.0, -1.0):
        u = place.u + way * _BESIDE * normal
        motions = program.followed(place.motions, u)
        if motions is None:
            return None
        side = program.at(u, motions)
        worst = int(np.argmax(side.objective))
        # Along the border both sides agree on what the limits cost.
        whole = side.objective_by[worst] - found.multipliers @ side.slacks_by
        by = whole[program.columns] * (program.high - program.low)
        if abs(side.objective - place.objective).max() > _JUMP * _BESIDE * (
            1 + abs(side.objective_by).max()
        ):
            return None  # the motion beyond is another one: the objective jumps
        sides.append(side)
        slopes.append(way * float(by @ normal))
    if (
        min(slopes) < 0
        or sides[0].motions[border.which].itinerary == sides[1].motions[border.which].itinerary
    ):
        return None
    by = border(place)[1]
    return Kink(found, (sides[0], sides[1]), (slopes[0], slopes[1]), border.which, by)
