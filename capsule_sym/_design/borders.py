"""Borders of an itinerary: distance of an orbit from each, with derivatives.

Each inequality of an itinerary is a duration, the least value of a guard in a segment, or the force
where a segment ends with v_c = 0. Where it is 0, the itinerary changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.evaluation import Motion
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.labelled import package
from capsule_sym._orbits.shooting.admissibility import (
    BEFORE_END,
    DURATION,
    EDGE,
    LANDING,
    MINIMUM,
    Inequality,
    inequalities,
)
from capsule_sym._orbits.shooting.closed import ClosedForms, chained, guard_by
from capsule_sym._orbits.shooting.equations import BY_TIME, angle_row
from capsule_sym._orbits.shooting.itinerary import contact, drift, field_of, level
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import monodromy_matrix
from capsule_sym._orbits.shooting.taylor import monodromy_derivative


class Distance(NamedTuple):
    """An inequality, and the derivatives (7,) of its value along the branch."""

    inequality: Inequality
    by: Vector


def distances(orbit: Orbit | None) -> list[Distance]:
    """All inequalities of an orbit's itinerary, the tightest first.

    A motion that is its own mirror image has none here, since their derivatives are not available.
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
            # In stick the force is within the bound of the opposite drift, otherwise beyond it.
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
    rows[:, BY_TIME] = 0.0  # at a minimum the derivative by its time is 0
    assert one.guard is not None
    gap, by = flow.closed.gap + position, flow.total(rows[:3])
    scene, field = forms.scene, flow.segment.field
    if one.guard is Guard.BACK:  # without contact, for the stop behind
        behind = field_of(scene, 2, drift(field, scene), level(field, scene))
        return chained(forms.constants(behind).gap_gradient(), by)
    if one.guard is Guard.GAP and contact(field, scene) == 2:  # negative in contact behind
        return -chained(c.gap_gradient(), by)
    return guard_by(c, one.guard, gap, v_r, by, turned, angle)


def multiplier_by(motion: Motion) -> Vector:
    """Derivatives (7,) of the largest modulus of a multiplier along the branch; 0 without an orbit.

    A multiplier m with left and right eigenvectors w and v changes with the matrix M by
    `w dM v / (w v)`.
    """
    orbit, count = motion.orbit, len(motion.parameters.scene.facts.PARAMETERS)
    if orbit is None:
        return np.zeros(count)
    matrix = monodromy_matrix(orbit).astype(float)
    values, left, right = package("scipy.linalg").eig(matrix, left=True, right=True)
    largest = int(np.argmax(abs(values)))
    w, v, modulus = left[:, largest].conj(), right[:, largest], abs(values[largest])
    by = np.einsum("i,kij,j->k", w, monodromy_derivative(orbit, np.eye(count)), v) / (w @ v)
    by = (by * values[largest].conj()).real / (modulus or 1.0)
    if orbit.itinerary.mirrored:  # the matrix is that of half the motion
        by = 2 * modulus * by
    found: Vector = by[-count:] + by[:-count] @ orbit.by_parameter.astype(float)
    return found
