"""How far an orbit is from a change of its itinerary, with derivatives by the parameters.

Each inequality of an itinerary is a duration, the least of a guard in a segment, or the force where
a segment ends with v_c = 0. At a minimum the time at which it is taken counts for nothing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import (
    DURATION,
    LANDING,
    Inequality,
    inequalities,
)
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import PARAMETERS, force_by
from capsule_sym._orbits.shooting.orbit import Orbit

_F_B = -7 + PARAMETERS.index("f_b")
_DELTA = -7 + PARAMETERS.index("delta")
_ZETA = -7 + PARAMETERS.index("zeta")
_BETA = -7 + PARAMETERS.index("beta")
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
    with backend("numpy") as numbers:
        found = inequalities(numbers, orbit.itinerary, orbit.system)
        forms = ClosedForms(numbers, orbit.values)
        return [
            Distance(one, _along(orbit, _slope(forms, orbit, one)))
            for one in sorted(found, key=lambda one: float(one.value))
        ]


def _along(orbit: Orbit, by: Vector) -> Vector:
    """Derivatives along the branch from those by unknowns and parameters (n + 11,)."""
    found: Vector = np.asarray(by[-7:] + by[:-7] @ orbit.by_parameter, dtype=float)
    return found


def _slope(forms: ClosedForms, orbit: Orbit, one: Inequality) -> Vector:
    """Derivatives of an inequality's value by unknowns and parameters (n + 11,)."""
    flow, n = orbit.system.flows[one.segment], len(orbit.itinerary)
    by: Vector = np.zeros(n + 11)
    if one.kind == DURATION:
        by[4 + one.segment] = 1.0
        return by
    if one.kind == LANDING:
        following = orbit.system.flows[(one.segment + 1) % n]
        by = np.asarray(force_by(following.c, flow.end[0], flow.end[1], flow.end_by)) * flow.c.drift
        by[_F_B] += 1.0  # the guard is the bound and the force along the drift
        return -by if following.c.drift else by
    rows = forms.run(flow.segment.field, flow.c, flow.closed, one.time)[1].copy()
    if not flow.c.drift:
        rows[2, 2] = 1.0
    rows[:, 4] = 0.0  # the time is that of a minimum
    state_by = flow.total(rows)
    return _guard_by(forms, flow, one, state_by)


def _guard_by(forms: ClosedForms, flow: Any, one: Inequality, by: Vector) -> Vector:
    """Derivatives of a guard, from those of the state at its time."""
    found: Vector
    if one.guard is Guard.GAP:
        found = np.array(by[0])
        found[_DELTA] -= 1.0
        return found if flow.c.contact else -found
    if one.guard is Guard.DRIFT:
        found = np.array(by[2]) * flow.c.drift
        return found
    (position, v_r, *_), _ = forms.run(flow.segment.field, flow.c, flow.closed, one.time)
    found = np.asarray(force_by(flow.c, flow.closed.x_r + position, v_r, by))
    found = found if one.guard is Guard.LOWER else -found
    found[_F_B] += 1.0
    return found
