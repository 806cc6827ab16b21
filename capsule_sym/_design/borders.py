"""Borders of an itinerary: distance of an orbit from each, with derivatives.

Each inequality of an itinerary is a duration, the least value of a guard in a segment, or the force
where a segment ends with v_c = 0. Where it is 0, the itinerary changes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._design.evaluation import Motion
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
from capsule_sym._orbits.shooting.closed import ClosedForms, chained, guard_by
from capsule_sym._orbits.shooting.equations import BY_TIME, angle_row, shooting
from capsule_sym._orbits.shooting.itinerary import contact, drift, field_of, level
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers

_STEP = 1e-5  # step of a multiplier's differences, in the unknowns and the parameters
Mask = NDArray[np.bool_]


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


def multiplier_by(motion: Motion, which: Mask) -> Vector:
    """Derivatives (7,) of the largest modulus of a multiplier along the branch; 0 without an orbit.

    They are taken by parameters in the mask `which` (7,), the others are 0. The monodromy matrix is
    that of the segments, whether or not the orbit is closed: it is smooth in the unknowns and the
    parameters, also at a fold. The differences are along the branch's tangent.
    """
    parameters, orbit = motion.parameters, motion.orbit
    found = np.zeros(len(parameters.scene.facts.PARAMETERS))
    if orbit is None:
        return found
    for k in np.flatnonzero(which).tolist():
        along = orbit.by_parameter[:, k].astype(float)
        step, ends = _STEP / max(1.0, abs(along).max()), []
        for way in (-step, step):
            values = [float(value) + way * (i == k) for i, value in enumerate(orbit.values)]
            z = orbit.z + way * along
            with backend("numpy", orbit.scene) as numbers:
                system = shooting(numbers, values, orbit.itinerary, z)
            beside = replace(orbit, values=tuple(values), z=z, system=system)
            ends.append(float(abs(floquet_multipliers(beside)[0])))
        found[k] = (ends[1] - ends[0]) / (2 * step)
    return found
