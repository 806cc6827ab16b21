"""Which of several known attractors starts lead to.

A run has arrived at an attractor once its stroboscopic state is within an ellipsoid about one of
the attractor's states that the map carries into itself. The ellipsoid's shape follows from the
monodromy matrix M: with P - (M/q)^T P (M/q) = 1, q = (1 + rho)/2 and rho the largest modulus of a
multiplier, the linear map shrinks the norm (x^T P x)^(1/2) by q at least. How far this holds for
the map itself is tried on shells about the state, each a quarter of the one before.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map import simulate
from capsule_sym._map.checks import check_count
from capsule_sym._map.many import Trajectories, simulate_many, spread
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import check_time, core_of, present
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import jacobian
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import Scene

NONE = -1
"""Number of a start that leads to none of the attractors."""

_SHELLS = 4.0 ** -np.arange(1, 13)  # radii in units of the orbit's size
_DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=float)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]
# A plane that comes nearer to the middle than this share of a shell has more than a third of the
# shell beyond it, and so some of its directions: another itinerary there is seen.
_INSIDE = 0.25
# Turns of a cycle after which shells are nearer: one, but where M is not the derivative on all
# sides, as where the drive's edge ends a stick at phase 0.
_TURNS = (1, 2, 4, 8, 16, 32)
_FIRST, _MOST = 2 * LONGEST, 8192  # excitation periods: before the first look, and at most
_NEUTRAL = 1e-9  # below 1, of a multiplier of which rounding leaves open whether it attracts
_REPEATED = 1e-12  # change of a run, in units of its size, at which it has come to rest on an orbit
Vector = NDArray[np.float64]


class Neighbourhoods(NamedTuple):
    """Ellipsoids |(x - centre) @ axes| <= 1 about m states, which the map carries into themselves.

    Where none was found the `axes`, (m, 3, 3), are infinite.
    """

    centres: Vector
    axes: Vector

    def contain(self, states: Vector) -> NDArray[np.intp]:
        """Index of the ellipsoid that each state, (n, 3), is in, NONE if it is in none; (n,)."""
        if not len(self.centres) or not len(states):
            return np.full(len(states), NONE)
        apart = (states[:, None, :] - self.centres)[:, :, None, :]
        with np.errstate(invalid="ignore"):
            distance = np.linalg.norm((apart @ self.axes)[:, :, 0, :], axis=2)
        nearest = np.where(np.isnan(distance), np.inf, distance).argmin(axis=1)
        inside = distance[np.arange(len(states)), nearest] <= 1
        return np.where(inside, nearest, NONE)


class Arrivals(NamedTuple):
    """Where n runs came to."""

    numbers: NDArray[np.int16]
    """Number of each run's attractor, NONE for another one or for none."""
    repeats: NDArray[np.bool_]
    """Whether a run without attractor repeats itself: it is on one that is not among the known."""
    states: Vector
    """States at phase 0 where the runs ended, (n, 3)."""
    periods: NDArray[np.int64]
    """Excitation periods that each was followed."""


class Destinations:
    """Attractors of one parameter set, and which of them starts lead to.

    `orbits` are stable periodic orbits at the same parameters; `states` are those of each at phase
    0, shape (period_number, 3). All is dimensionless. Raises InvalidInput for orbits that are not
    stable, or not at the same parameters.
    """

    def __init__(self, orbits: Sequence[Orbit], *, threads: int = 1) -> None:
        if not orbits:
            raise InvalidInput("orbits", orbits, "one orbit or more")
        for orbit in orbits:
            if not orbit.success or not abs(orbit.multipliers[0]) < 1 - _NEUTRAL:
                raise InvalidInput("orbits", orbit, "stable periodic orbits")
            if orbit.parameters != orbits[0].parameters:
                raise InvalidInput("orbits", orbit, "orbits at the same parameters")
        self.orbits, self.threads = tuple(whole_orbit(orbit) for orbit in orbits), threads
        self.scene, values = self.orbits[0].scene, self.orbits[0].parameters.to_dict()
        self.row = np.array([[*values.values()]])
        self.states = tuple(stroboscopic(orbit) for orbit in self.orbits)
        counts = np.array([len(states) for states in self.states])
        self._owners = np.repeat(np.arange(len(counts)), counts)
        self.neighbourhoods = neighbourhoods(
            np.repeat(self.row, counts.sum(), axis=0),
            np.concatenate(self.states),
            np.repeat(counts, counts),
            self.scene,
            threads,
        )

    def of(
        self, states: ArrayLike, phases: ArrayLike = 0.0, periods: int = _MOST
    ) -> NDArray[np.int16]:
        """Number of the attractor that each start leads to, shape (n,), NONE for none of them.

        Arguments are those of `arrivals`.
        """
        return self.arrivals(states, phases, periods).numbers

    def arrivals(
        self, states: ArrayLike, phases: ArrayLike = 0.0, periods: int = _MOST
    ) -> Arrivals:
        """Where the runs from states, (n, 3), at phases, (n,) or one, come to.

        Each is followed for at most so many excitation `periods`, until it is so near to one of the
        attractors that it stays there, or repeats itself on another orbit. Raises TimeUp where the
        present watch is over, and InvalidInput as `simulate_many` does.
        """
        check_count("periods", periods, 2)
        ends = np.atleast_2d(np.array(states, dtype=float))
        times = spread("phases", phases, (len(ends),))
        found = Arrivals(
            np.full(len(ends), NONE, np.int16),
            np.zeros(len(ends), bool),
            ends,
            np.zeros(len(ends), np.int64),
        )
        left, done, length = np.arange(len(ends)), 0, min(_FIRST, periods)
        while left.size and length > 1:
            # Of the last periods all states are kept, to see whether the run repeats itself.
            short = min(LONGEST, length - 1)
            run = self._run(ends[left], times[left], length - short)
            left, begin = left[run.success], run.states[run.success]
            run = self._run(begin, np.zeros(len(left)), short, "stroboscopic")
            left = left[run.success]
            marks = run.kept[np.repeat(run.success, np.diff(run.offsets))]
            marks = marks.reshape(len(left), -1, 3)
            ends[left], times[left] = marks[:, -1], 0.0
            done += length
            found.periods[left] = done
            inside = self.neighbourhoods.contain(marks[:, -1])
            here = inside != NONE
            found.numbers[left[here]] = self._owners[inside[here]]
            change = abs(marks[:, :-1] - marks[:, -1:]).max(axis=2).min(axis=1, initial=np.inf)
            still = ~here & (change <= _REPEATED * (1 + abs(marks).max(axis=(1, 2))))
            found.repeats[left[still]] = True
            left = left[~here & ~still]
            length = min(2 * length, periods - done)
        return found

    def _run(
        self, states: Vector, phases: Vector, periods: int, keep: str = "final"
    ) -> Trajectories:
        rows = np.repeat(self.row, len(states), axis=0)
        return run_rows(rows, states, phases, periods, self.scene, self.threads, keep)


def run_rows(
    rows: Vector,
    states: Vector,
    phases: ArrayLike,
    periods: int,
    scene: Scene,
    threads: int = 1,
    keep: str = "final",
) -> Trajectories:
    """The runs of parameter rows from states and phases; raises TimeUp when the time is over."""
    check_time()
    left = present().left
    found = simulate_many(
        rows, states, phases, periods, keep=keep, max_seconds=left, threads=threads, scene=scene
    )
    check_time()
    return found


def neighbourhoods(
    rows: Vector, centres: Vector, periods: NDArray[Any], scene: Scene, threads: int = 1
) -> Neighbourhoods:
    """Ellipsoids about states of stable cycles that the map carries into themselves.

    `centres`, (m, 3), are states at phase 0 of cycles of so many `periods`, (m,), at the parameters
    `rows`, (m, k).
    """
    shapes, shrink = _norms(_monodromies(rows, centres, periods, scene))
    sizes = 1 + abs(centres).max(axis=1)
    # So that the ellipsoid of radius 1 is within a ball of radius 1.
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
            ends = run_rows(of, begin, 0.0, turns * number, scene, threads).states
            apart = ends.reshape(starts[these].shape) - centres[these, None, None]
            far = np.linalg.norm(apart @ shapes[these, None], axis=3).max(axis=2)
            inward = far <= shrink[these, None] * reach[these]
            inward = np.logical_and.accumulate(inward[:, ::-1], axis=1)[:, ::-1]  # and all within
            radius[these] = np.where(inward, reach[these], 0).max(axis=1) * _INSIDE
    with np.errstate(divide="ignore", invalid="ignore"):
        return Neighbourhoods(centres, shapes / radius[:, None, None])


def _norms(matrices: Vector) -> tuple[Vector, Vector]:
    """Matrices B (m, 3, 3), for which |x M^T B| <= q |x B|, and shares for the map, (m,).

    The shares are half-way from q to 1.
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


def stroboscopic(orbit: Orbit) -> Vector:
    """States of an orbit at phase 0, shape (period_number, 3)."""
    trajectory = orbit.trajectory()
    period, (first, end) = orbit.parameters.period, trajectory.span
    times = np.arange(orbit.itinerary.period_number) * period + (period if first > 0 else 0.0)
    return trajectory(np.clip(times, first, end))
