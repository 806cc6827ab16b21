"""Growth of errors: shift of each switch of a run by an error of an earlier segment."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map import Trajectory
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.closed import ClosedForms, guard_by
from capsule_sym._orbits.shooting.equations import BY_TIME, STATES
from capsule_sym._orbits.shooting.itinerary import contact, drift, guard_between

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
    records, scene, carried = run.records, run.scene, np.empty((STATES, 0))
    found = np.full(max(len(records) - 1, 0), np.inf)
    with backend("numpy", scene) as numbers:
        forms = ClosedForms(numbers, tuple(run.parameters.to_dict().values()))
        for place, (record, following) in enumerate(pairwise(records)):
            begun = np.eye(STATES)
            if not drift(int(record["field"]), scene):
                begun[-1, -1] = 0.0  # a capsule at rest stays at rest
            if place % _BLOCK == 0:
                carried = _large(carried)
            by, rate = _derivatives(forms, record, record["duration"])
            carried = by @ np.hstack([carried, begun])
            row = _ending_by(forms, record, int(following["field"]), rate)
            shifts = row @ carried
            found[place] = np.linalg.norm(row)
            found[place] += np.linalg.norm(shifts.reshape(-1, STATES), axis=1).sum()
            if not found[place] < _FAR:
                found[place:] = np.inf
                break
            after = _derivatives(forms, following, 0.0)[1]
            carried += np.outer(rate - after, shifts)
            if not drift(int(following["field"]), scene):
                carried[-1] = 0.0
    return found


def _large(carried: NDArray[np.float64]) -> NDArray[np.float64]:
    """Row of (3, 3) blocks, without those whose norm is 1e-12 or less; shape (3, 3 n)."""
    blocks = carried.reshape(STATES, -1, STATES)
    kept = np.linalg.norm(blocks, axis=(0, 2)) > _NEGLIGIBLE
    return blocks[:, kept].reshape(STATES, -1)


def _derivatives(forms: ClosedForms, record: Any, h: float) -> tuple[NDArray[Any], NDArray[Any]]:
    """Derivatives of the state after a part h of a segment: by its start, (3, 3), and by h."""
    field, start = int(record["field"]), record["start"]
    known = (record[name] for name in ("margin", "cosine", "sine"))
    closed = forms.numbers.kernels.Start(start[0], record["gap"], *start[1:], *known)
    rows = forms.run(field, forms.constants(field), closed, h)[1][:STATES]
    by = rows[:, :STATES].copy()
    if not drift(field, forms.scene):
        by[-1, -1] = 1.0
    return by, rows[:, BY_TIME]


def _ending_by(forms: ClosedForms, record: Any, following: int, rate: NDArray[Any]) -> NDArray[Any]:
    """Derivatives (3,) of the time at which a segment ends, by the state there.

    0 at an edge of the drive, and if the field stays.
    """
    field, scene = int(record["field"]), forms.scene
    touching = contact(following, scene)
    leaving = contact(field, scene) != touching
    turning = drift(field, scene) != drift(following, scene)
    edge = scene.facts.LEVELS[field] != scene.facts.LEVELS[following]
    if edge or not (leaving or turning):  # the end has an angle of its own, or the field stays
        return np.zeros(STATES)
    # If both change, the contact ends the segment.
    guard = Guard.GAP if leaving else guard_between(field, following, scene)
    c, (x_r, v_r, _) = forms.constants(following if leaving and touching else field), record["end"]
    turned = forms.numbers.cos_sin(float(record["end_angle"]))
    by = np.zeros((STATES + 1, BY_TIME + 1 + len(forms.values)))
    by[:STATES, :STATES], by[:, BY_TIME] = np.eye(STATES), [*rate, forms.value("omega")]
    row = guard_by(c, guard, x_r - c.own_stop(), v_r, by[:STATES], turned, by[STATES])
    return np.asarray(row[:STATES] / -float(row[BY_TIME]))
