"""The best place near another to which the scenarios' starts lead, where they bound the best.

Beyond a basin boundary a start leads to another motion, and the objective jumps. How far the
boundary is has no derivatives here: batches of places are drawn around the best one, in boxes
that shrink where none of them is better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.survey import overview
from capsule_sym._native import check_time

Vector = NDArray[np.float64]
_DRAWN = 120  # places a box
_ROUNDS = 60  # boxes at most
_LEAST = 1e-12  # of the bounds: the last box
_SHRINK = 4.0
_DECADES = 3.0  # of the sizes of a step uphill, in one box


def best_led(program: Program, place: Place, reach: float) -> Place:
    """The best place near one, within `reach` of the bounds at first, that the starts lead to."""
    draw, size, best = np.random.default_rng(0), reach, place
    for _ in range(_ROUNDS):
        check_time()
        found = next_led(program, best, size, draw)
        if found is not None:
            # Where all of the way was of use, the box may be too small.
            size = 2 * size if abs(found.u - best.u).max() > size / 2 else size
            best = found
        else:
            size /= _SHRINK
        if size < _LEAST:
            break
    return best


def next_led(program: Program, best: Place, size: float, draw: np.random.Generator) -> Place | None:
    """A better place in a box around one, the best of many; None if there is none.

    Beside a boundary there is less room uphill than along it: steps uphill have many sizes.
    """
    steps = draw.uniform(-size, size, (_DRAWN, len(best.u)))
    free = (best.u > 0.0) & (best.u < 1.0)
    uphill = -program.by_u(best.objective_by)[np.argmax(best.objective)] * free
    if np.any(uphill):
        uphill /= np.linalg.norm(uphill)
        along = 10.0 ** -draw.uniform(0.0, _DECADES, _DRAWN)[:, None]
        steps += ((along - 1.0) * (steps @ uphill)[:, None] * uphill) * (draw.random(_DRAWN) < 0.5)[
            :, None
        ]
    points = np.clip(best.u + steps, 0.0, 1.0)
    found = overview(program, points, program.scenarios)
    worst = found.worst / program.unit
    sizes = program.sizes[: found.slacks.shape[1]]
    within = (found.slacks / sizes).min(axis=1, initial=np.inf) >= -KEPT
    for i in np.argsort(np.where(within & np.isfinite(worst), worst, np.inf))[:3].tolist():
        if not (within[i] and worst[i] < best.worst):
            break
        place = program.begin(points[i])
        if place is not None and place.rank < best.rank:
            return place
    return None
