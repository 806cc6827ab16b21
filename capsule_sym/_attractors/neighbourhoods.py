"""Many runs at many parameter sets, and neighbourhoods of orbits that the map carries inward.

A neighbourhood of an orbit's state at phase 0 is an ellipsoid. Its shape follows from the monodromy
matrix M: with P - (M/q)^T P (M/q) = 1, q = (1 + rho)/2 and rho the spectral radius, the linear map
shrinks the norm (x^T P x)^(1/2) at least by q. The size up to which the map itself shrinks it, at
least by (1 + q)/2, is tested on shells about the state, each a quarter of the one before.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.many import Trajectories, simulate_many
from capsule_sym._native import check_time, core_of, present
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._orbits.shooting.stability import jacobian
from capsule_sym._parameters import Scene

NONE = -1
"""Number of a start that leads to none of the attractors."""
SHARE = 0.1
"""Share of the time left for runs side by side, since those the core cannot decide need more."""
MOST_OPEN = 100
"""Segments of a run that the core may fail to decide in one call; with more it does not finish."""
NEUTRAL = 1e-9
"""Distance below 1 within which a multiplier counts as 1, because of rounding."""

_SHELLS = 4.0 ** -np.arange(1, 13)  # radii over the orbit's size: from its quarter to 6e-8
_DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=float)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]
# A plane nearer to the centre than this share of a shell's radius cuts off more than a third of
# the shell, and so some of the directions: another itinerary there is detected.
_INSIDE = 0.25


class Runs:
    """Runs of one scene from many states, side by side in threads.

    Those that are followed together take at most a `share` of the time left. Runs that the core
    cannot decide may need more: they do not finish.
    """

    def __init__(self, scene: Scene, threads: int = 1, share: float = 1.0) -> None:
        self.scene, self.threads, self.share = scene, threads, share

    def run(
        self, rows: Vector, states: Vector, phases: ArrayLike, periods: int, keep: str = "final"
    ) -> Trajectories:
        """Runs at parameter rows from states and phases; raises TimeUp after the time limit."""
        check_time()
        of: dict[str, Any] = {"max_seconds": self.share * present().left, "max_open": MOST_OPEN}
        of |= {"threads": self.threads, "scene": self.scene, "keep": keep}
        found = simulate_many(rows, states, phases, periods, **of)
        check_time()
        return found

    def close(
        self, rows: Vector, states: Vector, periods: NDArray[Any]
    ) -> tuple[Vector, Vector, Vector]:
        """Orbits of so many periods near states at phase 0, (n, 3), with or without the core.

        Their states (n, 3), monodromy matrices (n, 3, 3) and derivatives of the states by the
        parameters (n, 3, k), not finite where Newton's method finds none. Without the core all
        derivatives are nan.
        """
        if core_of(self.scene) is not None:
            how: dict[str, Any] = {"threads": self.threads, "scene": self.scene}
            many = performance_many(rows, states, periods, energies=False, forces=False, **how)
            # Orbits of fewer periods have the status "changed" too: their marks decide.
            matrices = many.records["monodromy"].reshape(-1, 3, 3)
            return many.states.copy(), matrices.copy(), many.by_parameter
        found, matrices = np.full(states.shape, np.nan), np.full((*states.shape, 3), np.nan)
        for i, number in enumerate(periods.tolist()):
            parameters = self.scene.Parameters(*rows[i].tolist())
            orbit = orbit_at(parameters, states[i].tolist(), number)
            if orbit is not None:
                found[i] = stroboscopic(orbit)[0]
                matrices[i] = jacobian(simulate(parameters, found[i].tolist(), periods=number))
        return found, matrices, np.full((*states.shape, rows.shape[1]), np.nan)

    def axes_about(self, rows: Vector, centres: Vector, periods: NDArray[Any]) -> Vector:
        """Axes, (m, 3, 3), of ellipsoids |(x - centre) @ axes| <= 1 that the map carries inward.

        `centres`, (m, 3), are states at phase 0 of stable orbits of `periods`, (m,), at the
        parameters `rows`, (m, k). The map shrinks the ellipsoid in one turn of the orbit, or in 2
        to 32 if one is not enough. The axes are infinite or nan where no ellipsoid is found.
        """
        _, monodromies, _ = self.close(rows, centres, periods)
        for i in np.flatnonzero(~np.isfinite(monodromies).all(axis=(1, 2))).tolist():
            of = self.scene.Parameters(*rows[i]), centres[i].tolist()
            monodromies[i] = jacobian(simulate(*of, periods=int(periods[i])))
        shapes, shrink = _norms(monodromies)
        steps = _DIRECTIONS @ np.linalg.inv(shapes)  # (m, directions, 3)
        reach = _SHELLS * (1 + abs(centres).max(axis=1))[:, None]  # (m, shells)
        starts = centres[:, None, None] + reach[:, :, None, None] * steps[:, None]
        radius = np.zeros(len(rows))
        # The shells have shrunk after one turn, unless M is not the derivative on all sides, such
        # as where the drive's edge ends a stick at phase 0.
        for turns in (1, 2, 4, 8, 16, 32):
            for number in np.unique(periods[radius == 0]).tolist():
                these = np.flatnonzero((periods == number) & (radius == 0))
                begin = starts[these].reshape(-1, 3)
                of_these = rows[these].repeat(len(begin) // len(these), axis=0)
                ends = self.run(of_these, begin, 0.0, turns * number).states
                apart = ends.reshape(starts[these].shape) - centres[these, None, None]
                far = np.linalg.norm(apart @ shapes[these, None], axis=3).max(axis=2)
                inward = (far <= shrink[these, None] * reach[these])[:, ::-1]
                inward = np.logical_and.accumulate(inward, axis=1)[:, ::-1]  # on all smaller ones
                radius[these] = np.where(inward, reach[these], 0).max(axis=1) * _INSIDE
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(shapes / radius[:, None, None])


def spectral_radii(monodromies: Vector) -> Vector:
    """Largest modulus of the eigenvalues of each matrix, (n,); nan where it is not finite."""
    found, finite = np.full(len(monodromies), np.nan), np.isfinite(monodromies).all(axis=(1, 2))
    found[finite] = abs(np.linalg.eigvals(monodromies[finite])).max(axis=1, initial=0.0)
    return found


def _norms(monodromies: Vector) -> tuple[Vector, Vector]:
    """Matrices B (m, 3, 3) with |x M^T B| <= q |x B|, and shrinking factors for the map, (m,).

    The ellipsoid |x B| <= 1 is within the ball of radius 1. The factors are half-way from q to 1.
    For an unstable cycle the factor is 0, and B is 1.
    """
    largest = spectral_radii(monodromies)
    stable, q = largest < 1, (1 + largest) / 2
    scaled = np.where(stable, 1 / q, 0.0)[:, None, None] * monodromies.transpose(0, 2, 1)
    squared = np.einsum("mij,mkl->mikjl", scaled, scaled).reshape(-1, 9, 9)
    p = np.linalg.solve(np.eye(9) - squared, np.eye(3).reshape(9, 1)).reshape(-1, 3, 3)
    shapes = np.linalg.cholesky((p + p.transpose(0, 2, 1)) / 2)
    unit = np.linalg.norm(np.linalg.inv(shapes), ord=2, axis=(1, 2))
    return shapes * unit[:, None, None], np.where(stable, (1 + q) / 2, 0.0)


def states_at(trajectory: Trajectory, times: Vector) -> Vector:
    """States (n, 3) of an orbit at times (n,) from phase 0 on, within one period of the orbit.

    `trajectory` is one period of it, from any phase on.
    """
    first, end = trajectory.span
    inside = np.where(times < first, times + (end - first), times)
    return np.asarray(trajectory(np.clip(inside, first, end)))


def stroboscopic(orbit: Orbit) -> Vector:
    """States of a whole orbit at phase 0, in the order of time, shape (period_number, 3)."""
    times = np.arange(0.0, orbit.itinerary.period_number) * orbit.parameters.period
    return states_at(orbit.trajectory(), times)
