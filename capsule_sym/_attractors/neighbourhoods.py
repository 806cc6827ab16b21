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
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._orbits.shooting.stability import jacobian
from capsule_sym._parameters import Scene

NONE = -1
"""Number of a start that leads to none of the attractors."""

_SHELLS = 4.0 ** -np.arange(1, 13)  # radii over the orbit's size: from its quarter down to rounding
_DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=float)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]
# A plane nearer to the centre than this share of a shell's radius cuts off more than a third of
# the shell, and so some of the directions: another itinerary there is detected.
_INSIDE = 0.25
_MOST_OPEN = 100  # segments of a run that the core may fail to decide, before it counts as unknown


class Neighbourhoods(NamedTuple):
    """Ellipsoids |(x - centre) @ axes| <= 1 about m states that the map carries into themselves.

    If none was found the `axes`, (m, 3, 3), are infinite. `owners`, (m,), are numbers of orbits.
    """

    centres: Vector
    axes: Vector
    owners: NDArray[np.intp]

    def contain(self, states: Vector) -> NDArray[np.int16]:
        """Owner of the innermost ellipsoid about each state, (n, 3), NONE without one; (n,)."""
        found, least = np.full(len(states), NONE, np.int16), np.ones(len(states))
        for centre, axes, owner in zip(*self, strict=True):
            with np.errstate(invalid="ignore"):  # infinite axes: nan is inside of nothing
                distance = np.linalg.norm((states - centre) @ axes, axis=1)
            inside = distance <= least
            found[inside], least[inside] = owner, distance[inside]
        return found


NOWHERE = Neighbourhoods(np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0, np.intp))
"""No neighbourhoods."""


class Closings(NamedTuple):
    """Orbits that Newton's method finds: states, monodromy matrices, derivatives by parameters."""

    states: Vector
    monodromies: Vector
    by_parameter: Vector

    @property
    def found(self) -> NDArray[np.bool_]:
        """True where an orbit with its derivative is found, (n,)."""
        return np.asarray(np.isfinite(self.monodromies).all(axis=(1, 2)))

    @property
    def multipliers(self) -> Vector:
        """Largest modulus of the Floquet multipliers, (n,); nan where no orbit is found."""
        largest, found = np.full(len(self.states), np.nan), self.found
        largest[found] = abs(np.linalg.eigvals(self.monodromies[found])).max(axis=1, initial=0.0)
        return largest


def close_many(
    rows: Vector, states: Vector, periods: NDArray[Any], scene: Scene, threads: int = 1
) -> Closings:
    """Orbits of so many periods near states at phase 0, (n, 3), with or without the core."""
    count = len(rows)
    if core_of(scene) is not None:
        many = performance_many(
            rows, states, periods, energies=False, forces=False, threads=threads, scene=scene
        )
        # Orbits of fewer periods have the status "changed" too: their marks decide.
        matrices = many.records["monodromy"].reshape(-1, 3, 3).copy()
        return Closings(many.states.copy(), matrices, many.by_parameter)
    found, matrices = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    for i, number in enumerate(periods.tolist()):
        parameters = scene.Parameters(*rows[i].tolist())
        orbit = orbit_at(parameters, states[i].tolist(), number)
        if orbit is not None:
            found[i] = stroboscopic(orbit)[0]
            matrices[i] = jacobian(simulate(parameters, found[i].tolist(), periods=number))
    return Closings(found, matrices, np.full((count, 3, rows.shape[1]), np.nan))


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
    of: dict[str, Any] = {"max_seconds": left, "max_open": _MOST_OPEN, "threads": threads}
    found = simulate_many(rows, states, phases, periods, keep=keep, scene=scene, **of)
    check_time()
    return found


def axes_about(
    rows: Vector, centres: Vector, periods: NDArray[Any], scene: Scene, threads: int = 1
) -> Vector:
    """Axes, (m, 3, 3), of ellipsoids about states of stable cycles, as in `Neighbourhoods`.

    `centres`, (m, 3), are states at phase 0 of cycles of `periods`, (m,), at the parameters `rows`,
    (m, k).
    """
    closings = close_many(rows, centres, periods, scene, threads)
    monodromies = closings.monodromies
    for i in np.flatnonzero(~closings.found).tolist():
        run = simulate(scene.Parameters(*rows[i]), centres[i].tolist(), periods=int(periods[i]))
        monodromies[i] = jacobian(run)
    shapes, shrink = _norms(monodromies)
    steps = _DIRECTIONS @ np.linalg.inv(shapes)  # (m, directions, 3)
    reach = _SHELLS * (1 + abs(centres).max(axis=1))[:, None]  # (m, shells)
    starts = centres[:, None, None] + reach[:, :, None, None] * steps[:, None]
    radius = np.zeros(len(rows))
    # The shells have shrunk after one turn, unless M is not the derivative on all sides, such as
    # where the drive's edge ends a stick at phase 0.
    for turns in (1, 2, 4, 8, 16, 32):
        for number in np.unique(periods[radius == 0]).tolist():
            these = np.flatnonzero((periods == number) & (radius == 0))
            begin = starts[these].reshape(-1, 3)
            of = rows[these].repeat(len(begin) // len(these), axis=0)
            ends = run_rows(of, begin, 0.0, turns * number, scene, threads).states
            apart = ends.reshape(starts[these].shape) - centres[these, None, None]
            far = np.linalg.norm(apart @ shapes[these, None], axis=3).max(axis=2)
            inward = far <= shrink[these, None] * reach[these]
            inward = np.logical_and.accumulate(inward[:, ::-1], axis=1)[:, ::-1]  # on all smaller
            radius[these] = np.where(inward, reach[these], 0).max(axis=1) * _INSIDE
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(shapes / radius[:, None, None])


def _norms(monodromies: Vector) -> tuple[Vector, Vector]:
    """Matrices B (m, 3, 3) with |x M^T B| <= q |x B|, and shrinking factors for the map, (m,).

    The ellipsoid |x B| <= 1 is within the ball of radius 1. The factors are half-way from q to 1,
    and 0 for an unstable cycle.
    """
    largest = abs(np.linalg.eigvals(monodromies)).max(axis=1)
    stable, q = largest < 1, (1 + largest) / 2
    scaled = np.where(stable, 1 / q, 0.0)[:, None, None] * monodromies.transpose(0, 2, 1)
    squared = np.einsum("mij,mkl->mikjl", scaled, scaled).reshape(-1, 9, 9)
    p = np.linalg.solve(np.eye(9) - squared, np.eye(3).reshape(9, 1)).reshape(-1, 3, 3)
    shapes = np.linalg.cholesky((p + p.transpose(0, 2, 1)) / 2)
    unit = np.linalg.norm(np.linalg.inv(shapes), ord=2, axis=(1, 2))
    return shapes * unit[:, None, None], np.where(stable, (1 + q) / 2, 0.0)


def stroboscopic(orbit: Orbit, phase: float = 0.0) -> Vector:
    """States of an orbit at a phase, shape (period_number, 3)."""
    trajectory = orbit.trajectory()
    period, (first, end) = orbit.parameters.period, trajectory.span
    times = phase + np.arange(orbit.itinerary.period_number) * period
    times += np.where(times < first, end - first, 0.0)
    return trajectory(np.clip(times, first, end))
