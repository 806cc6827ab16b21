"""Point of a basin's boundary nearest to the motion.

The boundary is the stable manifold of its edge state. A run from the boundary tends to that orbit;
a run from beside it leaves along the unstable direction. The component of a run in that direction,
where the run is nearest to the edge state, is 0 on the boundary and smooth across it. Secants find
this root to rounding, and differences its slopes by time and direction.

The least radius is often at a kink of the boundary, where runs change their itinerary. The BFGS
method descends along kinks too, if a step ends where the slope along it has risen [1]. Where it
stalls, the shortest mean of the slopes on all sides of the kink shows the way [2].

[1] Lewis, Overton, Mathematical Programming 141, 135-163 (2013), doi:10.1007/s10107-012-0514-2.
[2] Burke, Lewis, Overton, SIAM Journal on Optimization 15, 751-779 (2005),
doi:10.1137/030601296.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import Basin
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._map import simulate
from capsule_sym._map.labelled import package
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import jacobian
from capsule_sym._orbits.shooting.symmetry import whole_orbit

_STEP = 1e-8  # share of a radius for its finite difference, and steps of time and direction
_SECANTS = 8
_SOLVED = 1e-13  # relative change of a radius by a secant at which it is the root
_ACCEPTED = 1e-10  # the same for acceptance after all secants
_MOST_MOVED, _FARTHEST = 0.1, 0.5  # largest relative change of a radius by one secant, and by all
_NEAR = 0.2  # distance, over the size, at which a run is near its edge state
_ON = 1e-3  # the same, at which it is on it, so that the root is one of the boundary
_LONGEST = 1024  # excitation periods from the boundary to the edge state, and along it
_TRANSIT, _DIGITS = 24, 23.0  # of these, the approach; logarithm of the growth along the edge state
_FIRST_DIGITS = 6.0  # the same for the first secants, doubled for each next one
_STEPS = 100  # largest number of steps of the descent
_WIDE = 2e-2  # length of the first one, in direction and time as a share of the forcing's period
_SHARES = 2.0 ** np.arange(2, -14, -1)  # shares of a step that are tried at once
_ZOOMS = 3  # times that shares are tried
_RISEN = 0.5  # largest share of the first slope that is left at the end of a step
_FLAT = 1e-11  # relative gain of a step at which it stalls
_BESIDE = 1e-3, 1e-5, 1e-7  # distances of points beside a kink
_AT_KINK = 16  # number of these points
_WHOLE = 1e3  # weight of the condition that the weights of a mean have the sum 1


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
            (here, beyond), near = self._components(np.tile(phases[left], (2, 1)), states, periods)
            with np.errstate(divide="ignore", invalid="ignore"):
                steps = -here / (beyond - here)
            steps = np.where((near <= _NEAR) & np.isfinite(steps), steps, np.inf)
            most = _MOST_MOVED * guess[left]
            step = np.clip(steps * radii[left] * _STEP, -most, most)
            radii[left] += step
            moved[left] = np.where(near <= _ON, abs(step) / guess[left], np.inf)
            far = abs(radii[left] / guess[left] - 1) > _FARTHEST
            left = left[(moved[left] > _SOLVED) & ~far]
            if not left.size:
                break
        return np.where(moved <= _ACCEPTED, radii, np.inf)

    def slopes(self, times: Vector, directions: Vector, radii: Vector) -> Vector:
        """Derivatives of the boundary's radii by time and direction, (n, 1 + m).

        Time is counted in periods of the forcing. A step along the direction changes nothing.
        """
        n, m = directions.shape
        phases = self.basin.phases(times)
        # No step passes the phase at which runs are compared.
        way = np.where(phases < self.basin.period / 2, 1.0, -1.0)
        moved_times = np.tile(times, (m + 2, 1))
        moved_times[1] = np.mod(times + way * _STEP * self.basin.period, self.basin.length)
        moved = np.tile(directions, (m + 2, 1, 1))
        moved[2:] += _STEP * np.eye(m)[:, None]
        origin = self.basin.state(moved_times.ravel()).reshape(m + 2, n, 3)
        states = origin + radii[:, None] * (moved @ self.knocks.T)
        phases = self.basin.phases(moved_times)
        at, _ = self._components(phases, states, self.periods[-1])
        change = at[1:] - at[0]
        change[0] *= way
        # A step of the knock by a share of itself is one of all its components.
        grown = np.einsum("mn,nm->n", change[1:], directions)
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes: Vector = (-change * radii / grown).T
        slopes[:, 1:] -= np.sum(slopes[:, 1:] * directions, axis=1)[:, None] * directions
        return slopes

    def _components(self, phases: Vector, states: Vector, periods: int) -> tuple[Vector, Vector]:
        """Components of runs in the unstable direction, (k, n), where they are near the edge state.

        The k runs of each of n groups, from phases (k, n) and states (k, n, 3), are compared at the
        same time. Also the groups' distances from the edge state then, over the size, (n,).
        """
        run = self.basin.run(phases.ravel(), states.reshape(-1, 3), periods, "stroboscopic")
        # All end at the same phase 0; runs that start at another phase have one state less.
        common = int(np.diff(run.offsets).min())
        last = run.offsets[1:, None] + np.arange(-common, 0)
        apart = run.kept[last].reshape(*phases.shape, common, 1, 3) - self.marks
        distance = np.linalg.norm(apart, axis=4).max(axis=0).reshape(phases.shape[1], -1)
        nearest_at = distance.argmin(axis=1)
        rows, (k, j) = np.arange(phases.shape[1]), np.divmod(nearest_at, len(self.marks))
        near = distance[rows, nearest_at] / self.basin.size
        return np.einsum("pni,ni->pn", apart[:, rows, k, j], self.left[j]), near


class _Points(NamedTuple):
    """Points of the boundary: places in time and direction, (n, 1 + m), radii, and their slopes.

    Time is counted in periods of the forcing.
    """

    places: Vector
    radii: Vector
    slopes: Vector

    def at(self, rows: Any) -> _Points:
        """Some of the points."""
        return _Points(self.places[rows], self.radii[rows], self.slopes[rows])

    def lowest(self) -> _Points:
        """Point with the least radius."""
        return self.at([self.radii.argmin()])


def nearest(surface: Surface, place: Place, random: np.random.Generator) -> Place:
    """Point of the boundary with the least radius near a given one."""
    first = np.array([[place.time / surface.basin.period, *place.direction]])
    point, metric = _boundary(surface, first, np.array([place.radius])), None
    for _ in range(_STEPS if len(point.radii) else 0):
        slope = point.slopes[0]
        if metric is None:
            metric = _WIDE / float(np.linalg.norm(slope)) * np.eye(len(slope))
        new = _along(surface, point, -metric @ slope)
        if new is None or _stalls(point, new):
            new, metric = _beside_kink(surface, point, random), None
            if new is None:
                break
        else:
            metric = _updated(metric, new.places[0] - point.places[0], new.slopes[0] - slope)
        point = new
    if not len(point.radii):
        return place
    time, direction = point.places[0, 0] * surface.basin.period, point.places[0, 1:]
    return Place(float(np.mod(time, surface.basin.length)), direction, float(point.radii[0]))


def _stalls(old: _Points, new: _Points) -> bool:
    """True if a new point is hardly lower than an old one."""
    return bool(new.radii[0] >= (1 - _FLAT) * old.radii[0])


def _updated(metric: Vector, step: Vector, turn: Vector) -> Vector | None:
    """Inverse curvature after a step, on which the slope turns; None if it has not risen."""
    risen = float(step @ turn)
    if risen <= 0:
        return None
    one = np.eye(len(step)) - np.outer(step, turn) / risen
    updated: Vector = one @ metric @ one.T + np.outer(step, step) / risen
    return updated


def _along(surface: Surface, point: _Points, way: Vector) -> _Points | None:
    """Lowest point on a way down, among those where the slope has risen if there are such."""
    place, radius = point.places[0], float(point.radii[0])
    fall, shares = float(way @ point.slopes[0]), _SHARES
    for _ in range(_ZOOMS):
        guess = radius + np.maximum(shares * fall, -_MOST_MOVED * radius)
        points = _boundary(surface, place + shares[:, None] * way, guess)
        lower = points.radii < radius
        risen = points.at(lower & (points.slopes @ way > _RISEN * fall))
        if len(risen.radii):
            return risen.lowest()
        reached = (points.places - place) @ way / (way @ way)
        low = float(reached[lower].max(initial=0.0))
        high = float(shares[shares > low].min(initial=2 * shares.max()))
        shares = low + (high - low) * np.linspace(0, 1, len(shares) + 2)[1:-1]
    return points.at(lower).lowest() if lower.any() else None


def _beside_kink(surface: Surface, point: _Points, random: np.random.Generator) -> _Points | None:
    """Lower point on the way that leads down on all sides of a kink; None if there is none."""
    for distance in _BESIDE:
        moves = random.normal(size=(_AT_KINK, len(point.places[0])))
        moves *= distance / np.linalg.norm(moves, axis=1)[:, None]
        beside = _boundary(surface, point.places + moves, np.repeat(point.radii, _AT_KINK))
        slopes = np.concatenate([point.slopes, beside.slopes])
        slopes /= np.linalg.norm(slopes, axis=1).max()
        # The shortest mean has an angle of less than 90 degrees with each slope.
        equations = np.vstack([slopes.T, np.full(len(slopes), _WHOLE)])
        nnls = package("scipy.optimize").nnls
        mean = nnls(equations, np.append(np.zeros(len(slopes.T)), _WHOLE))[0] @ slopes
        size = float(np.linalg.norm(mean))
        if size * distance <= _FLAT:
            continue
        new = _along(surface, point, -distance / size * mean)
        if new is not None and not _stalls(point, new):
            return new
    return None


def _boundary(surface: Surface, places: Vector, guess: Vector) -> _Points:
    """Points of the boundary at places, (n, 1 + m); those where none is found are left out."""
    times = np.mod(places[:, 0] * surface.basin.period, surface.basin.length)
    directions = places[:, 1:] / np.linalg.norm(places[:, 1:], axis=1)[:, None]
    radii = surface.radii(times, directions, guess)
    slopes = surface.slopes(times, directions, np.where(np.isfinite(radii), radii, guess))
    found = np.isfinite(radii) & np.isfinite(slopes).all(axis=1)
    return _Points(np.column_stack([places[:, 0], directions]), radii, slopes).at(found)
