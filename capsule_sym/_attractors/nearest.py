"""Point of a basin's boundary nearest to the motion.

A run from the boundary stays on it; runs from both sides part in one direction. Differences of runs
in that direction give the tangent plane of the boundary, in the knock and its time.

The nearest point is often on an edge of the boundary, where runs change their itinerary. So the
tangents found so far are kept. By a linear program, the least knock beyond all of them within some
distance is tried next [1].

[1] Kelley, Journal of the SIAM 8, 703-712 (1960), doi:10.1137/0108053.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import Basin, bisect
from capsule_sym._map.labelled import package

ACCURACY = 1e-4
"""Relative accuracy of a minimal shock."""
WIDTH = 0.01 * ACCURACY
"""Relative distance of two knocks between which the boundary is."""
_STEP = 1e-7  # of time (periods) and knock (its size) for differences, less than WIDTH
_PARTED = 1e-4  # distance, over the motion's size, at which runs are compared: where it is linear
_RUN = 256  # excitation periods within which two runs WIDTH apart part, at 2 % a period
_FIRST = 0.03  # distance in time (periods) and knock (its size) of the first points that are tried
_CLOSER = 4.0 ** -np.arange(4)  # shares of the distance that are tried at once, some 60 runs in all
_ALONG = 0.08 * 4.0 ** -np.arange(8)  # shares by which knocks are changed, from 8 % to WIDTH
_MOST = 60  # times that points are tried, some 10 ms each


class Knocks:
    """Knocks of a motion, and which of them lose it.

    A knock is a point: its time, in excitation periods, and m components; `units`, (3, m), has the
    change of the state by each of them. Points are (n, 1 + m).
    """

    def __init__(self, basin: Basin, units: Vector) -> None:
        self.basin, self.units = basin, units

    def starts(self, points: Vector) -> tuple[Vector, Vector]:
        """Times within the motion's period, (n,), and states after knocks at them, (n, 3)."""
        times = np.mod(points[:, 0] * self.basin.period, self.basin.length)
        return times, self.basin.state(times) + points[:, 1:] @ self.units.T

    def lost(self, points: Vector) -> NDArray[np.bool_]:
        """True for knocks after which the motion is lost, (n,)."""
        return self.basin.lost(*self.starts(points))

    def neighbours(self, points: Vector, beyond: Vector) -> Vector:
        """Pairs of neighbours on both sides of the boundary next to points, (2, n, 1 + m).

        They differ in size if the boundary is within 8 % of a point's size; else they are on the
        line to a point `beyond`, (1 + m,), which loses the motion.
        """
        rays = np.repeat(points[:, None], 2 * len(_ALONG), axis=1)
        rays[:, :, 1:] *= 1 + np.append(-_ALONG, _ALONG[::-1])[:, None]
        lost = self.lost(rays.reshape(-1, len(beyond))).reshape(rays.shape[:2])
        rows, first, crossed = np.arange(len(points)), lost.argmax(axis=1), lost.any(axis=1)
        inside, outside = rays[rows, first - 1], rays[rows, first]
        inside[~crossed], outside[~crossed] = points[~crossed], beyond
        inside[crossed & (first == 0), 1:] = 0  # the motion itself
        apart = (abs(inside - outside) / scales(outside)).max(axis=1)
        return bisect(self.lost, inside, outside, np.minimum(WIDTH / apart, 1))

    def gradients(self, inside: Vector, outside: Vector) -> Vector:
        """Gradients across the boundary between neighbours, (n, 1 + m); nan if runs do not part.

        They point to the side on which the motion is lost.
        """
        n, m = inside.shape
        steps = _STEP * scales(outside)
        steps[np.mod(inside[:, 0], 1) > 0.5, 0] *= -1  # no step passes phase 0
        points = np.stack([inside, outside, *inside + steps * np.eye(m)[:, None]])
        times, states = self.starts(points.reshape(-1, m))
        run = self.basin.run(self.basin.phases(times), states, _RUN, "stroboscopic")
        # All end at the same phase 0; a run that starts there has one state more.
        marks = run.kept[run.offsets[1:, None] + np.arange(-_RUN, 0)].reshape(m + 2, n, _RUN, 3)
        apart = np.linalg.norm(marks[1] - marks[0], axis=2) > _PARTED * self.basin.size
        at = marks[:, np.arange(n), apart.argmax(axis=1)]
        found: Vector = np.einsum("knd,nd->nk", at[2:] - at[0], at[1] - at[0]) / steps
        found[~apart.any(axis=1) | ~run.success.reshape(m + 2, n).all(axis=0)] = np.nan
        return found


def sizes(points: Vector) -> Vector:
    """Sizes of knocks, (n,)."""
    found: Vector = np.linalg.norm(points[:, 1:], axis=1)
    return found


def scales(points: Vector) -> Vector:
    """Scales of the coordinates of points, (n, 1 + m): a period, and the knock's size."""
    return np.column_stack(
        [np.ones(len(points)), np.outer(sizes(points), np.ones(len(points.T) - 1))]
    )


def nearest(knocks: Knocks, point: Vector) -> Vector:
    """Least knock near one that loses the motion, (1 + m,); it loses the motion too.

    Each next point is the least beyond all tangents within a distance, which grows while the points
    gain what the tangents promise.
    """
    best, trials, far, promised = point, point[None], _FIRST, 0.0
    gradients, levels = np.empty((0, len(point))), np.empty(0)
    for _ in range(_MOST):
        pairs = knocks.neighbours(trials, best)
        new = knocks.gradients(*pairs)
        found = np.isfinite(new).all(axis=1)
        gradients = np.vstack([gradients, new[found]])
        levels = np.append(levels, np.sum(new * pairs[1], axis=1)[found])
        outer = np.vstack([best, pairs[1]])
        best, before = outer[sizes(outer).argmin()], float(sizes(outer)[0])
        gained = before - float(sizes(outer).min())
        far *= 2 if gained >= 0.1 * promised else 0.25
        trials, promised = _least(gradients, levels, best, far)
        if promised < WIDTH * before:
            break
    # Tangents of parts that bend inwards cut off nearer points: it begins again without them.
    gained = 1 - float(sizes(best[None])[0] / sizes(point[None])[0])
    return nearest(knocks, best) if gained > 0.1 * ACCURACY else best


def _least(gradients: Vector, levels: Vector, point: Vector, far: float) -> tuple[Vector, float]:
    """Least points beyond planes within shares of a distance of a point, and what they gain.

    The size of a knock counts along the point's own. Planes beyond the point itself are moved to
    it, since they are tangents of another part of the boundary.
    """
    scale, linprog = far * scales(point[None])[0], package("scipy.optimize").linprog
    goal, rows = point * scale, gradients * scale
    goal[0] = 0
    goal /= np.linalg.norm(point[1:])
    norms = np.linalg.norm(rows, axis=1)
    rest = np.maximum(gradients @ point - levels, 0) / norms
    steps = [
        linprog(goal, -rows / norms[:, None], rest, bounds=(-share, share)).x for share in _CLOSER
    ]
    return point + np.array(steps) * scale, -float(goal @ steps[0])
