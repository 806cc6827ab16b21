"""Borders of an itinerary: how far an orbit is from each, and optima that lie on one.

Each inequality of an itinerary is a duration, the least of a guard in a segment, or the force where
a segment ends with v_c = 0; where it is 0, the itinerary changes. On a border the gradients of the
two sides differ. On the side whose itinerary goes on beyond it, objective and border are smooth:
the place is one at which the objective's gradient is a multiple of the border's normal. That it is
an optimum takes the other side too: away from the border the objective rises on both.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.evaluation import Motion
from capsule_sym._design.program import Place, Program
from capsule_sym._design.stationary import Border, Stationary, stationary
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import (
    BEFORE_END,
    DURATION,
    EDGE,
    LANDING,
    MINIMUM,
    Inequality,
    inequalities,
)
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import BY_TIME, angle_row
from capsule_sym._orbits.shooting.guards import chained, guard_by
from capsule_sym._orbits.shooting.itinerary import contact, drift, field_of, level
from capsule_sym._orbits.shooting.orbit import Orbit

_NEAR = 0.05  # of the bounds: how far from the place where the search rested
_TRIED = 3  # borders of one motion
_BESIDE = 1e-5  # of the bounds: where the sides are looked at
_JUMP = 100  # times what the gradient explains
Vector = NDArray[np.float64]


class Distance(NamedTuple):
    """An inequality, and the derivatives (7,) of its value along the branch."""

    inequality: Inequality
    by: Vector


def distances(orbit: Orbit | None) -> list[Distance]:
    """All inequalities of an orbit's itinerary, the tightest first.

    Those of a motion that is its own mirror image have no derivatives here, and are left out.
    """
    if orbit is None or orbit.itinerary.mirrored:
        return []
    count = len(orbit.parameters.scene.facts.PARAMETERS)
    with backend("numpy", orbit.parameters.scene) as numbers:
        found = inequalities(numbers, orbit.itinerary, orbit.system)
        forms = ClosedForms(numbers, orbit.values)
        rows = []
        for one in sorted(found, key=lambda one: float(one.value)):
            by = _gradient(forms, orbit, one)
            along = by[-count:] + by[:-count] @ orbit.by_parameter
            rows.append(Distance(one, np.asarray(along, dtype=float)))
        return rows


def _gradient(forms: ClosedForms, orbit: Orbit, one: Inequality) -> Vector:
    """Derivatives of an inequality's value by unknowns and parameters."""
    flow = orbit.system.flows[one.segment]
    c = flow.c
    if one.kind == DURATION:
        by = np.zeros_like(flow.angle_by, dtype=float)
        by[flow.column] = 1.0
        return by
    following = orbit.system.flows[(one.segment + 1) % len(orbit.itinerary)].c
    turning = angle_row(forms, one.time, flow.matrix[0])
    if one.kind == MINIMUM:
        turning[BY_TIME] = 0.0
    angle = flow.total(turning[None])[0]
    turned = forms.numbers.cos_sin(flow.angle + forms.value("omega") * one.time)
    if one.kind in (LANDING, EDGE, BEFORE_END):
        own, guard = following if one.kind == EDGE else c, one.guard
        if one.kind == LANDING:
            # At rest the force is to be within the bound of the other drift, or is beyond it.
            guard = Guard.LOWER if c.drift > 0 else Guard.UPPER
        if guard is Guard.DRIFT:
            own = c
        assert guard is not None
        x_r, v_r, _ = flow.end
        by = guard_by(own, guard, x_r - own.own_stop(), v_r, flow.end_by, turned, angle)
        beyond = following.drift and one.kind != BEFORE_END and guard is not Guard.DRIFT
        return -by if beyond else by
    (position, v_r, *_), rows = forms.run(flow.segment.field, c, flow.closed, one.time)
    rows = rows.copy()
    if not c.drift:
        rows[2, 2] = 1.0
    rows[:, BY_TIME] = 0.0  # at a minimum its time counts for nothing
    assert one.guard is not None
    gap, by = flow.closed.gap + position, flow.total(rows[:3])
    scene, field = forms.scene, flow.segment.field
    if one.guard is Guard.BACK:  # without contact, of the stop behind
        behind = field_of(scene, 2, drift(field, scene), level(field, scene))
        return chained(forms.constants(behind).gap_gradient(), by)
    if one.guard is Guard.GAP and contact(field, scene) == 2:  # negative in contact behind
        return -chained(c.gap_gradient(), by)
    return guard_by(c, one.guard, gap, v_r, by, turned, angle)


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
    for which, inequality, orbits in _candidates(program, places):
        border = border_of(program, which, inequality)
        found = stationary(program, best, border, orbits)
        if found and found.minimal and abs(found.place.u - best.u).max() < _NEAR:
            kink = _seen_from_both(program, found, which, border(found.place)[1])
            if kink is not None:
                return kink
    return None


def _candidates(
    program: Program, places: Sequence[Place]
) -> Iterator[tuple[int, Inequality, tuple[Motion, ...]]]:
    """Borders near the first of the places, of motions whose itineraries differ, nearest first."""
    best, seen = places[0], set[tuple[tuple[str, ...], ...]]()
    for place in places:
        itineraries = tuple(motion.itinerary for motion in place.motions)
        if itineraries in seen or abs(place.u - best.u).max() >= _NEAR:
            continue
        seen.add(itineraries)
        for which, motion in enumerate(place.motions):
            near = sorted(reached(program, best.u, which, motion), key=lambda pair: abs(pair[0]))
            for far, one in near[:_TRIED]:
                if abs(far) < _NEAR:
                    yield which, one.inequality, place.motions


def reached(
    program: Program, u: Vector, which: int, motion: Motion
) -> Iterator[tuple[float, Distance]]:
    """The borders of a scenario's motion, with how far the variables have to go, to first order."""
    for one in distances(motion.orbit):
        by = program.by_u(program.by_all(u, program.scenarios[which], one.by))
        slope = float(np.linalg.norm(by))
        value = float(one.inequality.value)
        yield value / slope if slope else np.inf, one


def border_of(program: Program, which: int, inequality: Inequality) -> Border:
    """The value of one inequality of one scenario's motion at a place."""

    def border(place: Place) -> tuple[float, Vector]:
        found = [
            one
            for one in distances(place.motions[which].orbit)
            if one.inequality[:3] == inequality[:3]
        ]
        if not found:
            raise np.linalg.LinAlgError("the border is left behind")
        nearest = min(found, key=lambda one: abs(float(one.inequality.time - inequality.time)))
        by = program.by_all(place.u, program.scenarios[which], nearest.by)
        return float(nearest.inequality.value), by

    return border


def _seen_from_both(program: Program, found: Stationary, which: int, by: Vector) -> Kink | None:
    """The kink, if both sides have a motion and the objective rises away from the border there."""
    place = found.place
    normal = np.where((place.u > 0.0) & (place.u < 1.0), program.by_u(by), 0.0)
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
        # Along the border both sides agree on what the limits cost.
        worst = int(np.argmax(side.objective))
        gained = side.objective_by[worst] - found.multipliers @ side.slacks_by
        if abs(side.objective - place.objective).max() > _JUMP * _BESIDE * (
            1 + abs(side.objective_by).max()
        ):
            return None  # the motion beyond is another one: the objective jumps
        sides.append(side)
        slopes.append(way * float(program.by_u(gained) @ normal))
    same = sides[0].motions[which].itinerary == sides[1].motions[which].itinerary
    if min(slopes) < 0 or same:
        return None
    return Kink(found, (sides[0], sides[1]), (slopes[0], slopes[1]), which, by)
