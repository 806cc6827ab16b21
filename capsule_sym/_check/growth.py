"""Growth of errors: shift of each switch of a run by an error of an earlier segment."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.sensitivities import ending_guard
from capsule_sym._map import Segment, Trajectory
from capsule_sym._map.backend import backend
from capsule_sym._orbits.shooting.closed import ClosedForms, guard_by
from capsule_sym._orbits.shooting.itinerary import drift, level
from capsule_sym._orbits.shooting.stability import field, flows, landing

_STATES = 3
_FAR = 1e30  # growth beyond which nothing is left of a start in any double
_BLOCK, _NEGLIGIBLE = 64, 1e-12  # segments after which errors that decayed to this are dropped


def growth_of_errors(run: Trajectory) -> NDArray[np.float64]:
    """Largest shift of each switching time by errors of size 1 in the state, one a segment; (m,).

    To the first order: an error of at most e in the state (x_r, v_r, v_c), made at the start of
    each segment and at the switch itself, shifts the time by at most e times this. All
    dimensionless. Sums beyond 10^30 are infinite, and so are those of all later switches. Edges of
    the drive do not shift.
    """
    parameters, segments = run.parameters, run.segments
    found = np.full(max(len(segments) - 1, 0), np.inf)
    carried = np.empty((_STATES, 0))
    with backend("numpy", parameters.scene) as numbers:
        forms = ClosedForms(numbers, list(parameters.to_dict().values()))
        for place, (segment, following) in enumerate(pairwise(segments)):
            begun = np.eye(_STATES)
            if place % _BLOCK == 0:
                carried = _large(carried)
            if not drift(segment.field, run.scene):
                begun[2, 2] = 0.0  # a capsule at rest stays at rest
            carried = np.hstack([carried, begun])
            for flow, _ in flows(forms, segment):
                carried = flow @ carried
            row = _time_by_state(forms, segment, following)
            parts = (row @ carried).reshape(-1, _STATES)
            found[place] = np.linalg.norm(row) + np.linalg.norm(parts, axis=1).sum()
            if not found[place] < _FAR:
                found[place:] = np.inf
                break
            if (saltation := landing(forms, segment, following)) is not None:
                carried = saltation @ carried
    return found


def _large(carried: NDArray[np.float64]) -> NDArray[np.float64]:
    """Blocks (3, 3) of a row of them, but for those that the motion has made negligible."""
    blocks = carried.reshape(_STATES, -1, _STATES)
    kept = np.linalg.norm(blocks, axis=(0, 2)) > _NEGLIGIBLE
    return blocks[:, kept].reshape(_STATES, -1)


def _time_by_state(forms: ClosedForms, segment: Segment, following: Segment) -> NDArray[np.float64]:
    """Gradient (3,) of the time of a switch by the state just before it."""
    fields, scene = (segment.field, following.field), forms.scene
    guard = ending_guard(*fields, scene)
    if guard is None or level(fields[0], scene) != level(fields[1], scene):
        return np.zeros(_STATES)
    c = forms.constants(segment.field)
    state = np.array([float(value) for value in segment.end_state])
    turned = forms.numbers.cos_sin(float(segment.end.phase) * c.omega)
    by = np.zeros((_STATES, _STATES + 1 + len(forms.values)))
    by[:, :_STATES], by[:, _STATES] = np.eye(_STATES), field(c, state, turned[0])
    angle_by = np.zeros(by.shape[1])
    angle_by[_STATES] = c.omega
    x_r, v_r, _ = state
    row: Any = guard_by(c, guard, x_r - c.own_stop(), v_r, by, turned, angle_by)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = -row[:_STATES] / row[_STATES]
    return np.where(row[:_STATES] == 0, 0.0, slopes)
