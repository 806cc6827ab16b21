"""Growth of errors: shift of each switch of a run by an error of an earlier segment."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.sensitivities import STATE, columns_of, derivatives, duration_by
from capsule_sym._map import Trajectory
from capsule_sym._map.backend import backend
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.itinerary import drift

_STATES = 3
_V_C = STATE.index("v_c")
_FAR = 1e30  # growth beyond which nothing is left of a start in any double
_BLOCK, _NEGLIGIBLE = 64, 1e-12  # segments after which errors that decayed to this are dropped


@np.errstate(divide="ignore", invalid="ignore")  # of tangential switches
def growth_of_errors(run: Trajectory) -> NDArray[np.float64]:
    """Largest shift of each switching time by errors of size 1 in the state, one a segment; (m,).

    To the first order: an error of at most e in the state (x_r, v_r, v_c), made at the start of
    each segment and at the switch itself, shifts the time by at most e times this. All
    dimensionless. Sums beyond 10^30 are infinite, and so are those of all later switches. Edges of
    the drive do not shift.
    """
    records, scene, carried = run.records, run.scene, np.empty((_STATES, 0))
    found = np.full(max(len(records) - 1, 0), np.inf)
    count = len(columns_of(scene))
    unit, fixed = np.eye(len(STATE), count), np.zeros(count)  # by the state, at a fixed phase
    with backend("numpy", scene) as numbers:
        forms = ClosedForms(numbers, tuple(run.parameters.to_dict().values()))
        for place, (record, following) in enumerate(pairwise(records)):
            begun = np.eye(_STATES)
            if not drift(int(record["field"]), scene):
                begun[_V_C, _V_C] = 0.0  # a capsule at rest stays at rest
            if place % _BLOCK == 0:
                carried = _large(carried)
            by, rate = derivatives(forms, record, unit, fixed, record["duration"])
            carried = by[:_STATES, :_STATES] @ np.hstack([carried, begun])
            field = int(following["field"])
            row = duration_by(forms, record, field, unit, rate, fixed)[:_STATES]
            shifts = row @ carried
            found[place] = np.linalg.norm(row)
            found[place] += np.linalg.norm(shifts.reshape(-1, _STATES), axis=1).sum()
            if not found[place] < _FAR:
                found[place:] = np.inf
                break
            after = derivatives(forms, following, unit, fixed, 0.0)[1]
            carried += np.outer((rate - after)[:_STATES], shifts)
            if not drift(field, scene):
                carried[_V_C] = 0.0
    return found


def _large(carried: NDArray[np.float64]) -> NDArray[np.float64]:
    """Blocks (3, 3) of a row of them, but for those that the motion has made negligible."""
    blocks = carried.reshape(_STATES, -1, _STATES)
    kept = np.linalg.norm(blocks, axis=(0, 2)) > _NEGLIGIBLE
    return blocks[:, kept].reshape(_STATES, -1)
