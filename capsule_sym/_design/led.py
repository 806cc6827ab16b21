"""Search of places on which the scenarios' starts settle, where these bound the best.

Beyond a basin boundary a start leads to another motion, and the objective jumps. The distance of
the boundary has no derivatives: batches of places are drawn around the best one, in boxes that
shrink if none is better. Then lines uphill are bisected to the boundary, and parabolas through
these places predict the best place along it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.survey import overview
from capsule_sym._map.labelled import package
from capsule_sym._native import check_time

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
_DRAWN = 40  # places per box and variable
_ROUNDS = 30  # largest number of boxes
_SHRINK = 4.0  # factor of a box without a better place
_LEAST = 3e-4  # size of the last box, in the bounds
_DECADES = 3.0  # range of sizes of steps uphill in one box, in decades
_PARTS = 24  # parts of a line
_FINEST = 1e-12  # size of the last part, in the bounds
_STEPS = 6  # largest number of steps along a boundary
_FARTHEST = 4.0  # largest step along a boundary, in distances of two lines
_JUMP = 3.0  # factor over the change that the gradient explains
_BETTER = 1e-12  # units of the objective
_ROUNDING = 1e-9  # the same, for one motion reached by two runs


def best_led(program: Program, place: Place, reach: float) -> Place:
    """Best place on which the starts settle near one, at first within `reach` of the bounds."""
    draw, size, best = np.random.default_rng(0), reach, place
    for _ in range(_ROUNDS):
        check_time()
        found = next_led(program, best, size, draw)
        best, size = found or best, size if found else size / _SHRINK
        if size < min(_LEAST, reach / _SHRINK):
            break
    return _Boundary(program, best).best


def next_led(program: Program, best: Place, size: float, draw: np.random.Generator) -> Place | None:
    """Best of many places in a box around one, if it is better; else None.

    Beside a boundary there is less room uphill than along it: half of the steps have a smaller part
    uphill.
    """
    count = _DRAWN * len(best.u)
    steps = draw.uniform(-size, size, (count, len(best.u)))
    if (uphill := _uphill(program, best)) is not None:
        less = 1.0 - 10.0 ** -draw.uniform(0.0, _DECADES, count // 2)
        steps[: count // 2] -= np.outer(less * (steps[: count // 2] @ uphill), uphill)
    points = np.clip(best.u + steps, 0.0, 1.0)
    worst = _worst(program, points)
    for i in np.argsort(worst)[:3].tolist():
        if not worst[i] < best.worst:
            break
        place = program.begin(points[i])
        if place is not None and place.rank < best.rank:
            return place
    return None


def _uphill(program: Program, place: Place) -> Vector | None:
    """Direction of steepest descent of the worst objective, within the bounds."""
    free = (place.u > 0.0) & (place.u < 1.0)
    found: Vector = -program.by_u(place.objective_by)[int(np.argmax(place.objective))] * free
    size = np.linalg.norm(found)
    return found / size if size > 0 else None


def _worst(program: Program, points: Matrix) -> Vector:
    """Worst objective at points (n,); infinite if a limit fails or there is no motion."""
    found = overview(program, points, program.scenarios)
    sizes = program.sizes[: found.slacks.shape[1]]
    within = (found.slacks / sizes).min(axis=1, initial=np.inf) >= -KEPT
    return np.where(within & np.isfinite(found.worst), found.worst / program.unit, np.inf)


class _Boundary:
    """Best place along a boundary beside a place, found on lines uphill."""

    def __init__(self, program: Program, place: Place) -> None:
        self.program, self.best = program, place
        width = _LEAST
        for _ in range(_STEPS):
            before, uphill = self.best, _uphill(program, self.best)
            if uphill is None:
                break
            free = np.eye(len(place.u))[(self.best.u > 0.0) & (self.best.u < 1.0)]
            along = free.T @ package("scipy.linalg", "design").null_space((free @ uphill)[None])
            offsets = np.vstack([np.zeros((1, len(place.u))), width * along.T, -width * along.T])
            points, values = self.met(offsets, uphill, width)
            self.take(points, values)
            if not along.size or not np.all(np.isfinite(values)):
                width /= _SHRINK
                if not along.size and before is self.best:
                    break
                continue
            count = along.shape[1]
            right, left = values[1 : 1 + count], values[1 + count :]
            slope, curve = (right - left) / 2, right + left - 2 * values[0]
            step = np.where(
                curve > 0, -slope / np.where(curve > 0, curve, 1.0), -np.sign(slope) * 4
            )
            step = np.clip(step, -_FARTHEST, _FARTHEST)
            points, values = self.met((width * along @ step)[None], uphill, width)
            self.take(points, values)
            if before.worst - self.best.worst < _BETTER:
                break
            width = width * float(np.clip(abs(step).max(), 1 / _SHRINK, _SHRINK))

    def take(self, points: Matrix, values: Vector) -> None:
        """Keep the best of some points, if it is better."""
        i = int(np.argmin(values))
        if values[i] < self.best.worst:
            place = self.program.begin(points[i])
            if place is not None and place.rank < self.best.rank:
                self.best = place

    def met(self, offsets: Matrix, uphill: Vector, width: float) -> tuple[Matrix, Vector]:
        """Points (n, k) where lines uphill leave the basin, and the objective there (n,).

        Infinite if a line does not leave it near to the place.
        """
        check_time()
        here, count = self.best, len(offsets)
        steep = float(abs(self.program.by_u(here.objective_by) @ uphill).max())
        low, high = np.full(count, -2 * width), np.full(count, 2 * width)
        values, shares = np.full(count, np.inf), np.linspace(0.0, 1.0, _PARTS + 1)
        while (high - low).max() > _FINEST:
            check_time()
            steps = low[:, None] + (high - low)[:, None] * shares
            points = (here.u + offsets)[:, None] + steps[:, :, None] * uphill
            worst = _worst(self.program, np.clip(points, 0.0, 1.0).reshape(-1, len(here.u)))
            worst = worst.reshape(count, -1)
            far = abs(steps) + np.linalg.norm(offsets, axis=1)[:, None]
            led = abs(worst - here.worst) <= _JUMP * steep * far + _ROUNDING
            last = len(shares) - 1 - np.argmax(led[:, ::-1], axis=1)
            last = np.where(led.any(axis=1), np.minimum(last, len(shares) - 2), 0)
            rows = np.arange(count)
            values = np.where(led.any(axis=1), worst[rows, last], values)
            low, high = steps[rows, last], steps[rows, last + 1]
        return np.clip(here.u + offsets + low[:, None] * uphill, 0.0, 1.0), values
