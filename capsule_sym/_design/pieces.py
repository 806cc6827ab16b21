"""Pieces of the parameters on which an itinerary holds, with its borders as constraints.

On the orbits of one itinerary objective and limits are smooth, also beyond the borders as far as
the orbits exist. A border is where one of the itinerary's inequalities is 0: its distance, to first
order in the scaled variables, is a further slack.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.evaluation import Motion, same_itinerary_at
from capsule_sym._design.program import Place, Program
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
from capsule_sym._orbits.shooting.equations import BY_TIME, angle_row
from capsule_sym._orbits.shooting.itinerary import contact, drift, field_of, level
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._systems import dimensionless

_Name = tuple[object, ...]


class Piece:
    """Program on the itinerary of a place; its places have borders as further slacks."""

    def __init__(self, program: Program, place: Place) -> None:
        motion, orbit = place.motion, place.motion.orbit
        motion = motion if orbit is None else Motion(motion.parameters, None, orbit=orbit)
        self.program = program
        self.known = [(place.u, motion)]
        """Variables and motions of the places so far."""
        self.borders = dict[_Name, float]()
        """Unit of each of the motion's inequalities: the norm of its slope by the variables.

        Those of slope 0 are left out."""
        for name, (_, slope) in distances(motion.orbit).items():
            unit = float(np.linalg.norm(self.by_u(program.by_all(place.u, slope))))
            if 0 < unit < np.inf:
                self.borders[name] = unit

    def by_u(self, rows: Vector) -> Vector:
        """Derivatives by the scaled variables, from those by all parameters."""
        return self.program.by_u(rows)

    def at(self, u: Vector) -> Place | None:
        """Place at variables, on the itinerary's orbit; None if it is lost or not finite."""
        _, near = min(self.known, key=lambda one: float(abs(one[0] - u).max()))
        parameters = self.program.parameters_at(u)
        motion = same_itinerary_at(near, parameters) if parameters else None
        place = self.program.place(u, motion)
        if motion is None or place is None:
            return None
        values, rows = place.slacks, place.slacks_by
        if margin := self.program.margin:
            # At a fold 1 - multiplier is like a square root: the square, with its sign, is smooth.
            stable = values[-1] + margin
            values[-1] = (stable * abs(stable) - margin**2) / (2 * margin)
            rows[-1] *= abs(stable) / margin
        self.known.append((u, motion))
        every, none = (
            distances(motion.orbit),
            np.zeros(len(dimensionless(self.program.system).to_dict())),
        )
        for name, unit in self.borders.items():
            value, slope = every.get(name, (unit, none))  # if absent
            values = np.append(values, value / unit)
            rows = np.vstack([rows, self.program.by_all(u, slope) / unit])
        whole = replace(place, slacks=values, slacks_by=rows)
        return whole if whole.finite else None

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at variables as by `at`, for a search; `near` has no effect."""
        return self.at(u)


def distances(orbit: Orbit | None) -> dict[_Name, tuple[float, Vector]]:
    """Value of each inequality of an orbit's itinerary, with derivatives (p,) along the branch.

    By kind, segment, guard, and number in the order of time. The first half of a symmetric motion
    has none here, since their derivatives are not available. A segment that begins at a tangency
    has a duration proportional to the root of the distance in the parameters: its value is the
    square of the duration, with its sign, which is smooth.
    """
    found = dict[_Name, tuple[float, Vector]]()
    if orbit is None or (itinerary := orbit.itinerary).mirrored:
        return found
    count = len(orbit.parameters.scene.facts.PARAMETERS)
    with backend("numpy", orbit.parameters.scene) as numbers:
        forms = ClosedForms(numbers, orbit.values)
        every = inequalities(numbers, itinerary, orbit.system)
        for one in sorted(every, key=lambda one: float(one.time)):
            gradient, value = _gradient(forms, orbit, one), float(one.value)
            by = np.asarray(gradient[-count:] + gradient[:-count] @ orbit.by_parameter, dtype=float)
            beside = [itinerary.neighbour(one.segment + way) for way in (-1, 1)]
            if one.kind == DURATION and len(itinerary) > 2 and beside[0] == beside[1]:
                value, by = value * abs(value), 2 * abs(value) * by
            number = sum(name[:3] == one[:3] for name in found)
            found[*one[:3], number] = value, by
    return found


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
