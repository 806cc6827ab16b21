"""Point of a basin's boundary nearest to the motion, where the boundary is smooth.

There the boundary is the stable manifold of its edge state. A run from the boundary tends to that
orbit; a run from beside it leaves along the unstable direction. The component of a run in that
direction, where the run is nearest to the edge state, is 0 on the boundary and smooth across it.
Secants find this root to rounding. Sampling minimises the root over direction and time; the spread
of the samples follows the best samples. This also works at kinks of the boundary, where runs change
their itinerary.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._attractors.boundary import Basin
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._map import simulate
from capsule_sym._map.many import Trajectories
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import jacobian
from capsule_sym._orbits.shooting.symmetry import whole_orbit

_STEP = 1e-8  # share of a radius for its finite difference
_SECANTS = 8
_SOLVED = 1e-13  # relative change of a radius by a secant at which it is the root
_ACCEPTED = 1e-10  # the same for acceptance after all secants
_MOST_MOVED, _FARTHEST = 0.1, 0.5  # largest relative change of a radius by one secant, and by all
_NEAR = 0.2  # distance, over the size, at which a run is near its edge state
_ON = 1e-3  # the same, at which it is on it, so that the root is one of the boundary
_LONGEST = 1024  # excitation periods from the boundary to the edge state, and along it
_TRANSIT, _DIGITS = 24, 23.0  # of these, the approach; logarithm of the growth along the edge state
_FIRST_DIGITS = 6.0  # the same for the first secants, doubled for each next one
_SAMPLES, _KEPT = 32, 8  # number of samples of a generation, and of those kept
_GENERATIONS = 60
# Of directions at the start of a descent, and of time as a share of the forcing's period.
_SPREADS = (2e-2, 1e-3, 1e-3, 1e-4, 1e-4, 1e-5)
_GAINED = 1e-9  # relative gain of a descent below which the search ends
_THINNEST = 1e-6  # least spread, as a share of the largest
_FITS = 0.05  # share of the spread of values by which a model may differ from them
_FARTHEST_TRIAL = 3.0  # distance of a model's minimum, in units of the spread
_FLAT = 1e-10  # relative difference of the best radii at which the search ends
Vector = NDArray[np.float64]


class Place(NamedTuple):
    """Knock onto the boundary: time in the motion's period, direction (unit vector), radius."""

    time: float
    direction: Vector
    radius: float


class Surface:
    """Stable manifold of an edge state, as seen from a motion.

    `knocks`, (3, m), has the knock for each of the m components of a direction.
    """

    def __init__(self, basin: Basin, edge: Orbit, knocks: Vector) -> None:
        self.basin, self.knocks = basin, knocks
        whole = whole_orbit(edge)
        self.marks, left = stroboscopic(whole), []
        for mark in self.marks:
            turn = simulate(edge.parameters, mark.tolist(), periods=len(self.marks))
            values, vectors = np.linalg.eig(jacobian(turn).T)
            left.append(np.real(vectors[:, abs(values).argmax()]))
        self.left = np.array(left)
        """Left eigenvectors of the unstable multiplier at the states of phase 0."""
        rate = math.log(abs(whole.multipliers[0])) / len(self.marks)
        digits = np.minimum(_FIRST_DIGITS * 2.0 ** np.arange(_SECANTS), _DIGITS)
        self.periods = np.minimum(_LONGEST, _TRANSIT + np.ceil(digits / rate).astype(int)).tolist()
        """Excitation periods of the runs for each secant."""

    def radii(self, times: Vector, directions: Vector, guess: Vector) -> Vector:
        """Radii near a guess at which knocks reach the boundary, (n,); inf if none is found.

        Times are (n,), directions (n, m).
        """
        radii, moved = guess.copy(), np.full(len(guess), np.inf)
        origin, along = self.basin.state(times), directions @ self.knocks.T
        phases, left = self.basin.phases(times), np.arange(len(guess))
        for periods in self.periods:
            pair = np.stack([radii[left], radii[left] * (1 + _STEP)])
            states = origin[left] + pair[..., None] * along[left]
            twice = np.tile(phases[left], 2)
            run = self.basin.run(twice, states.reshape(-1, 3), periods, "stroboscopic")
            steps, near = self._steps(run, len(left))
            most = _MOST_MOVED * guess[left]
            step = np.clip(steps * radii[left] * _STEP, -most, most)
            radii[left] += step
            moved[left] = np.where(near <= _ON, abs(step) / guess[left], np.inf)
            far = abs(radii[left] / guess[left] - 1) > _FARTHEST
            left = left[(moved[left] > _SOLVED) & ~far]
            if not left.size:
                break
        return np.where(moved <= _ACCEPTED, radii, np.inf)

    def _steps(self, run: Trajectories, count: int) -> tuple[Vector, Vector]:
        """Steps to the roots, (count,), in units of the difference of each pair of runs.

        Also the least distances of the runs from the edge state, over the size.
        """
        # All end at the same phase 0; runs that start at another phase have one state less.
        parts = [run[i] for i in range(len(run))]
        common = min(map(len, parts))
        pairs = np.stack([part[len(part) - common :] for part in parts]).reshape(
            2, count, common, 3
        )
        apart = pairs[:, :, :, None] - self.marks
        distance = np.linalg.norm(apart, axis=4).max(axis=0).reshape(count, -1)
        nearest_at = distance.argmin(axis=1)
        rows, (k, j) = np.arange(count), np.divmod(nearest_at, len(self.marks))
        near = distance[rows, nearest_at] / self.basin.size
        along = np.einsum("pni,ni->pn", apart[:, rows, k, j], self.left[j])
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = -along[0] / (along[1] - along[0])
        return np.where((near <= _NEAR) & np.isfinite(steps), steps, np.inf), near


def nearest(surface: Surface, place: Place, random: np.random.Generator) -> Place:
    """Point of the boundary with the least radius near a given one.

    Each descent starts at the best point of the one before. The search ends when a descent finds no
    better point, or ends in a smooth minimum.
    """
    for spread in _SPREADS:
        before = place.radius
        place, smooth = _descend(surface, place, spread, random)
        if smooth or (spread < _SPREADS[0] and place.radius > before * (1 - _GAINED)):
            break
    return place


def _descend(
    surface: Surface, place: Place, wide: float, random: np.random.Generator
) -> tuple[Place, bool]:
    """Point of a smaller radius, and True if it is a smooth minimum.

    Samples are normal about a mean, with the spread of the better samples of the last generation. A
    quadratic model of a generation proposes one sample of the next.
    """
    count, best = len(place.direction), place
    basis = np.linalg.svd(place.direction[None])[2][1:]  # at right angles to the direction
    mean, trial, slope, known, centre = *np.zeros((4, count)), place.radius
    spread: Any = wide * np.eye(count)
    for _ in range(_GENERATIONS):
        w = random.normal(size=(_SAMPLES, count))
        w[0] = np.linalg.solve(spread, trial - mean)
        z = mean + w @ spread.T
        times = np.mod(place.time + z[:, 0] * surface.basin.period, surface.basin.length)
        directions = place.direction + z[:, 1:] @ basis
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        most = _MOST_MOVED * centre
        radii = surface.radii(times, directions, centre + np.clip(w @ slope, -most, most))
        found, order = np.isfinite(radii), np.argsort(radii)[:_KEPT]
        first = order[0]
        if radii[first] < best.radius:
            best, known = (
                Place(float(times[first]), directions[first], float(radii[first])),
                z[first],
            )
        if found.sum() < _SAMPLES // 2:
            # The boundary exists on a part of the rays only; more of them reach it near the best
            # one.
            spread, slope, mean, trial, centre = spread / 3, 0 * slope, known, known, best.radius
            continue
        model = _model(w[found], radii[found])
        if model.gain <= _FLAT * best.radius:
            return best, True
        if radii[order[-1]] - radii[first] <= _FLAT * best.radius:
            break
        around = z[order] - mean
        sizes, axes = np.linalg.svd(around / math.sqrt(_KEPT), full_matrices=False)[1:]
        narrower = axes.T * np.maximum(sizes, _THINNEST * sizes[0])
        slope = np.linalg.solve(spread.T, model.gradient) @ narrower
        trial, centre = mean + spread @ model.least, float(radii[first])
        mean, spread = z[order].mean(axis=0), narrower
    return best, False


class _Model(NamedTuple):
    """Quadratic model of values: gradient (m,) at 0, place of its minimum, and its gain.

    The gain is infinite if there is no minimum, or if the model does not fit.
    """

    gradient: Vector
    least: Vector
    gain: float


def _model(w: Vector, values: Vector) -> _Model:
    """Quadratic model of values, (n,), at places w, (n, m)."""
    count = w.shape[1]
    rows, columns = np.triu_indices(count)
    terms = np.column_stack([np.ones(len(w)), w, w[:, rows] * w[:, columns]])
    fit: Any = np.linalg.lstsq(terms, values, rcond=None)[0]
    gradient, curvature = fit[1 : 1 + count], np.zeros((count, count))
    curvature[rows, columns] = fit[1 + count :]
    curvature = curvature + curvature.T
    if not (np.linalg.eigvalsh(curvature) > 0).all():
        return _Model(gradient, np.zeros(count), math.inf)
    least: Any = np.linalg.solve(curvature, -gradient)
    gain = float(-gradient @ least) / 2
    fits = np.std(values - terms @ fit) <= _FITS * np.std(values)
    within = least * min(1.0, _FARTHEST_TRIAL / float(np.linalg.norm(least)))
    return _Model(gradient, within, gain if fits else math.inf)
