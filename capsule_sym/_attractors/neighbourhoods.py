"""Neighbourhoods of stable closed orbits that the map carries into themselves.

A neighbourhood of an orbit's state at phase 0 is an ellipsoid. Its shape follows from the monodromy
matrix M: with P - (M/q)^T P (M/q) = 1, q = (1 + rho)/2 and rho the spectral radius, the linear map
shrinks the norm (x^T P x)^(1/2) at least by q. The size up to which this holds for the map itself
is tested on shells about the state, each a quarter of the one before.
"""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._map import simulate
from capsule_sym._map.many import Trajectories, simulate_many
from capsule_sym._native import check_time, core_of, present
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import jacobian
from capsule_sym._parameters import Scene

NONE = -1
"""Number of a start that leads to none of the attractors."""

_SHELLS = 4.0 ** -np.arange(1, 13)  # radii in units of the orbit's size
_DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=float)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]
# A plane nearer to the centre than this share of a shell's radius cuts off more than a third of
# the shell, and so some of the directions: another itinerary there is detected.
_INSIDE = 0.25
# Turns of a cycle after which shells have shrunk: one, unless M is not the derivative on all
# sides, such as where the drive's edge ends a stick at phase 0.
_TURNS = (1, 2, 4, 8, 16, 32)
NEUTRAL = 1e-9  # distance below 1 of a multiplier within rounding
_MOST_OPEN = 100  # segments of a run that the core may fail to decide, before it counts as unknown
_AT_ONCE = 10**5  # distances that are computed together


class Neighbourhoods(NamedTuple):
    """Ellipsoids |(x - centre) @ axes| <= 1 about m states that the map carries into themselves.

    If none was found the `axes`, (m, 3, 3), are infinite.
    """

    centres: Vector
    axes: Vector

    def contain(self, states: Vector) -> NDArray[np.intp]:
        """Index of the ellipsoid that contains each state, (n, 3), NONE if none does; (n,)."""
        found = np.full(len(states), NONE)
        count = _AT_ONCE // max(1, len(self.centres))
        for first in range(0, len(states) if len(self.centres) else 0, count):
            apart = (states[first : first + count, None] - self.centres)[:, :, None]
            with np.errstate(invalid="ignore"):
                distance = np.linalg.norm((apart @ self.axes)[:, :, 0], axis=2)
            distance = np.where(np.isnan(distance), np.inf, distance)
            nearest, inside = distance.argmin(axis=1), distance.min(axis=1) <= 1
            found[first : first + count][inside] = nearest[inside]
        return found


def run_rows(
    rows: Vector,
    states: Vector,
    phases: ArrayLike,
    periods: int,
    scene: Scene,
    threads: int = 1,
    keep: str = "final",
    share: float = 1.0,
) -> Trajectories:
    """Runs of parameter rows from states and phases; raises TimeUp after the time limit.

    They take at most a share of the time left; runs that need more do not finish.
    """
    check_time()
    left = share * present().left
    found = simulate_many(
        rows,
        states,
        phases,
        periods,
        keep=keep,
        max_seconds=left,
        max_open=_MOST_OPEN,
        threads=threads,
        scene=scene,
    )
    check_time()
    return found


def neighbourhoods(
    rows: Vector, centres: Vector, periods: NDArray[Any], scene: Scene, threads: int = 1
) -> Neighbourhoods:
    """Ellipsoids about states of stable cycles that the map carries into themselves.

    `centres`, (m, 3), are states at phase 0 of cycles of `periods`, (m,), at the parameters `rows`,
    (m, k).
    """
    shapes, shrink = _norms(_monodromies(rows, centres, periods, scene))
    sizes = 1 + abs(centres).max(axis=1)
    # Scale so that the ellipsoid of radius 1 is within a ball of radius 1.
    unit = np.linalg.norm(np.linalg.inv(shapes), ord=2, axis=(1, 2))
    shapes = shapes * unit[:, None, None]
    steps = _DIRECTIONS @ np.linalg.inv(shapes)  # (m, directions, 3)
    reach = _SHELLS * sizes[:, None]  # (m, shells)
    starts = centres[:, None, None] + reach[:, :, None, None] * steps[:, None]
    radius = np.zeros(len(rows))
    for turns in _TURNS:
        for number in np.unique(periods[radius == 0]).tolist():
            these = np.flatnonzero((periods == number) & (radius == 0))
            of = np.repeat(rows[these], starts[0, :, :, 0].size, axis=0)
            begin = starts[these].reshape(-1, 3)
            given = of, begin, 0.0, turns * number, scene, threads
            ends = run_rows(*given).states
            apart = ends.reshape(starts[these].shape) - centres[these, None, None]
            far = np.linalg.norm(apart @ shapes[these, None], axis=3).max(axis=2)
            inward = far <= shrink[these, None] * reach[these]
            inward = np.logical_and.accumulate(inward[:, ::-1], axis=1)[:, ::-1]  # on all smaller
            radius[these] = np.where(inward, reach[these], 0).max(axis=1) * _INSIDE
    with np.errstate(divide="ignore", invalid="ignore"):
        return Neighbourhoods(centres, shapes / radius[:, None, None])


def _norms(matrices: Vector) -> tuple[Vector, Vector]:
    """Matrices B (m, 3, 3) with |x M^T B| <= q |x B|, and shrinking factors for the map, (m,).

    The factors are half-way from q to 1.
    """
    largest = abs(np.linalg.eigvals(matrices)).max(axis=1)
    q = (1 + np.minimum(largest, 1)) / 2
    shapes, eye = np.tile(np.eye(3), (len(matrices), 1, 1)), np.eye(9)
    for i in np.flatnonzero(largest < 1).tolist():
        scaled = matrices[i].T / q[i]
        p = np.linalg.solve(eye - np.kron(scaled, scaled), np.eye(3).ravel()).reshape(3, 3)
        shapes[i] = np.linalg.cholesky((p + p.T) / 2)
    return shapes, np.where(largest < 1, (1 + q) / 2, 0.0)


def _monodromies(rows: Vector, centres: Vector, periods: NDArray[Any], scene: Scene) -> Vector:
    """Monodromy matrices (m, 3, 3) of cycles at phase 0."""
    found = np.full((len(rows), 3, 3), np.nan)
    if core_of(scene) is not None:
        of = performance_many(rows, centres, periods, energies=False, forces=False, scene=scene)
        found = of.records["monodromy"].reshape(-1, 3, 3).copy()
    for i in np.flatnonzero(~np.isfinite(found).all(axis=(1, 2))).tolist():
        parameters = scene.Parameters(*rows[i].tolist())
        found[i] = jacobian(simulate(parameters, centres[i].tolist(), periods=int(periods[i])))
    return found


def stroboscopic(orbit: Orbit, phase: float = 0.0) -> Vector:
    """States of an orbit at a phase, shape (period_number, 3)."""
    trajectory = orbit.trajectory()
    period, (first, end) = orbit.parameters.period, trajectory.span
    times = phase + np.arange(orbit.itinerary.period_number) * period
    times += np.where(times < first, end - first, 0.0)
    return trajectory(np.clip(times, first, end))
