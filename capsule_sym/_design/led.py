"""The best places that the scenarios' starts lead to, near others, where no gradient shows the way.

Beyond a basin boundary a start leads to another motion, and the objective jumps. Searches by
covariance matrix adaptation (Hansen, arXiv:1604.00772) go side by side in batches of places.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import agrees, alike
from capsule_sym._design.overview import overview
from capsule_sym._design.program import KEPT, STABLE, Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._map.many import simulate_many
from capsule_sym._native import check_time, core_of

_GENERATIONS = 120, 40  # of a search at most: at least so many, and so many a variable
_LOOK = 8  # generations after which searches that promise nothing end
_PROMISED = 4.0  # times what a search gained in these it may gain later
_MERGED = 1e-3  # of the bounds, between two searches that are one
_KNOWN = 1e-9  # units of the objective, by which a search betters a known optimum
LAST, FINEST = 1e-4, 1e-11  # of the bounds: steps of a search that decides a result
LONGER = 2  # times, that runs may take where a result is decided
_REFUSED = 1e6  # units of the objective, beyond a limit
_AROUND = 64  # places close around one
_JUMP = 3.0  # times what the gradient explains
_ROUNDING = 1e-9  # the same, of one motion reached by two runs
_BACK = (1e-8, 1e-7, 1e-6)  # of the bounds, off a boundary
_LOST = 1e-4  # units of the objective, that a step off a boundary loses at most
_PAIRS, _BOX, _APART = 256, 0.01, 1e-7  # neighbours, their distance from a place and each other
_LEAP = 1e-3  # units of the objective, between neighbours on different motions
_LONG, _STAYS = 2048, 1e-6  # excitation periods of a run, and how near to its motion it ends
_CLOSEST = 1e-8  # of the bounds, around an optimum at a border
_BESIDE = (1e-6, 1e-5, 1e-4, 1e-3)  # of the bounds, uphill, where a basin boundary is looked for


class Spot(NamedTuple):
    """Variables, the worst objective of the motions that count there, and a place near to it."""

    worst: float
    u: Vector
    near: Place

    def place(self, program: Program) -> Place | None:
        """The place with these motions."""
        if program.among == STABLE:
            return program.beside(self.near, self.u)
        return program.begin(self.u)


def worst_at(
    program: Program, points: Matrix, near: Sequence[Place] = (), longer: int = 1
) -> Vector:
    """The worst objective at points (n,), infinite where there is no motion.

    Beyond limits it is greater than any within them. Where all stable motions count, runs begin on
    those of places `near`, one for each of the points or for all of them.
    """
    states = None
    if program.among == STABLE:
        states = np.array([place.motions[0].at_phase_zero for place in near])
        states = np.repeat(states, len(points) // len(near), axis=0)
    found = overview(program, points, states, longer)
    beyond = found.beyond(program)
    worst = found.worst / program.unit
    worst = np.where(beyond > KEPT, _REFUSED + beyond, worst)
    return np.where(np.isfinite(worst), worst, np.inf)


def refined(
    program: Program,
    places: Sequence[Place],
    level: float,
    size: float,
    finest: float,
    longer: int = 1,
    known: Sequence[Place] = (),
) -> list[Spot]:
    """The best places near some, the best first; `size` and `finest` are steps, of the bounds.

    Searches end where they come near a better one or a known optimum, or will hardly reach the
    level or the best.
    """
    if core_of(program.system.scene) is None:
        return sorted((Spot(one.worst, one.u, one) for one in places), key=lambda one: one.worst)
    search = _Searches(program, places, size, longer)
    least, each = _GENERATIONS
    for generation in range(max(least, each * len(program.names))):
        check_time()
        if not search.left.any():
            break
        search.step()
        search.left &= search.reach > finest
        if generation % _LOOK == _LOOK - 1:
            search.drop(level, known)
    found = zip(search.worst.tolist(), search.u, places, strict=True)
    spots = [Spot(*one) for one in found]
    return sorted(spots, key=lambda one: one.worst)


class _Searches:
    """Searches by covariance matrix adaptation, side by side, each with its best place."""

    def __init__(self, program: Program, places: Sequence[Place], size: float, longer: int) -> None:
        self.program, self.places, self.longer = program, places, longer
        self.u = np.array([place.u for place in places])
        self.worst = worst_at(program, self.u, places, longer)
        self.before = self.worst + np.inf
        n, d = self.u.shape
        self.left = np.ones(n, bool)
        self.mean, self.size = self.u.copy(), np.full(n, size)
        self.shape = np.tile(np.eye(d), (n, 1, 1))
        self.path, self.path_of_size = np.zeros((n, d)), np.zeros((n, d))
        self.reach = np.full(n, size)
        """The longest half-axis of the places that are tried."""
        self.count, self.draw = 6 + 2 * d, np.random.default_rng(0)
        weights = np.log(self.count / 2 + 0.5) - np.log(np.arange(1, self.count // 2 + 1))
        self.weights = weights / weights.sum()

    def step(self) -> None:
        """One generation of all searches that are left."""
        some, d, count = np.flatnonzero(self.left), self.u.shape[1], self.count
        scales, axes = np.linalg.eigh(self.shape[some])
        scales = np.sqrt(np.maximum(scales, 1e-300))
        drawn = self.draw.normal(size=(len(some), count, d)) * scales[:, None]
        moves = np.einsum("nij,ncj->nci", axes, drawn) * self.size[some, None, None]
        tried = np.clip(self.mean[some, None] + moves, 0.0, 1.0)
        near = [self.places[i] for i in some.tolist()]
        values = worst_at(self.program, tried.reshape(-1, d), near, self.longer)
        values = values.reshape(len(some), count)
        order = np.argsort(values, axis=1, kind="stable")
        rows = np.arange(len(some))
        first = values[rows, order[:, 0]]
        better = first < self.worst[some]
        self.worst[some[better]] = first[better]
        self.u[some[better]] = tried[rows, order[:, 0]][better]
        alive = np.isfinite(first)
        plain = alive & (values == first[:, None]).all(axis=1)
        self.left[some[plain]] = False  # there is no way
        self.size[some[~alive]] /= 2
        taken = (tried - self.mean[some, None]) / self.size[some, None, None]
        taken = np.take_along_axis(taken, order[:, : len(self.weights), None], axis=1)
        usable = np.isfinite(np.take_along_axis(values, order[:, : len(self.weights)], axis=1))
        weights = self.weights * usable
        weights /= np.maximum(weights.sum(axis=1), 1e-300)[:, None]
        self._adapt(some[alive], weights[alive], taken[alive], scales[alive], axes[alive])
        self.reach[some] = self.size[some] * scales.max(axis=1)

    def _adapt(
        self, some: NDArray[np.intp], weights: Matrix, taken: Vector, scales: Matrix, axes: Vector
    ) -> None:
        """Means, shapes and sizes after a generation, with the constants of the paper's table 1."""
        d, mass = self.u.shape[1], 1 / (self.weights**2).sum()
        c_size = (mass + 2) / (d + mass + 5)
        damping = 1 + 2 * max(0.0, np.sqrt((mass - 1) / (d + 1)) - 1) + c_size
        c_path = (4 + mass / d) / (d + 4 + 2 * mass / d)
        c_one = 2 / ((d + 1.3) ** 2 + mass)
        c_most = min(1 - c_one, 2 * (mass - 2 + 1 / mass) / ((d + 2) ** 2 + mass))
        normal = np.sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d**2))
        move = np.einsum("nc,nci->ni", weights, taken)
        self.mean[some] += self.size[some, None] * move
        white = np.einsum("nij,nj->ni", axes, np.einsum("nji,nj->ni", axes, move) / scales)
        self.path_of_size[some] *= 1 - c_size
        self.path_of_size[some] += np.sqrt(c_size * (2 - c_size) * mass) * white
        far = np.linalg.norm(self.path_of_size[some], axis=1)
        self.path[some] *= 1 - c_path
        short = (far < (1.4 + 2 / (d + 1)) * normal)[:, None]
        self.path[some] += np.sqrt(c_path * (2 - c_path) * mass) * move * short
        path = self.path[some]
        self.shape[some] *= 1 - c_one - c_most
        self.shape[some] += c_one * path[:, :, None] * path[:, None, :]
        self.shape[some] += c_most * np.einsum("nc,nci,ncj->nij", weights, taken, taken)
        self.size[some] *= np.exp(np.minimum(1.0, (c_size / damping) * (far / normal - 1)))

    def drop(self, level: float, known: Sequence[Place]) -> None:
        """End searches that come near a better one, or will hardly reach the best."""
        for place in known:
            near = abs(self.u - place.u).max(axis=1) < _MERGED
            self.left &= ~(near & (self.worst > place.worst - _KNOWN))
        best = min(level, float(self.worst.min()))
        with np.errstate(invalid="ignore"):
            gain = self.before - self.worst
            self.left &= ~(self.worst - _PROMISED * gain > best)
        self.before = self.worst.copy()
        order = np.argsort(self.worst, kind="stable").tolist()
        for k, i in enumerate(order):
            near = abs(self.u[order[:k]] - self.u[i]).max(axis=1, initial=0.0)
            if k and near.min() < _MERGED:
                self.left[i] = False


def scattered(program: Program, place: Place) -> float:
    """Share of neighbours near to a place of which one start leads to another motion.

    Next to a smooth boundary it is nearly 0, as they are so close; where basins are riddled it is
    not.
    """
    draw, shape = np.random.default_rng(0), (_PAIRS, len(place.u))
    points = np.clip(place.u + _BOX * draw.uniform(-1, 1, shape), 0.0, 1.0)
    beside = np.clip(points + _APART * draw.choice((-1.0, 1.0), shape), 0.0, 1.0)
    values = worst_at(program, np.vstack([points, beside]), [place])
    one, other = np.where(np.isfinite(values), values, _REFUSED).reshape(2, -1)
    return float(np.mean(abs(one - other) > _LEAP))


def led_to(program: Program, place: Place) -> bool:
    """True if the starts lead to the motions of a place, or if that is not required."""
    if program.among == STABLE:
        return all(motion.multiplier < 1 for motion in place.motions)
    settled = program.settled(place.u)
    return settled is not None and all(map(agrees, place.motions, settled))


def ends_uphill(program: Program, place: Place, lost: bool = False) -> bool:
    """True if the motions beside a place are better and the starts do not lead to them.

    With `lost` also whether they are lost there, so that the objective jumps.
    """
    uphill = _uphill(program, place)
    if uphill is None:
        return False
    steep = float(np.linalg.norm(program.by_u(place.objective_by), axis=1).max())
    for far in _BESIDE:
        side = program.beside(place, np.clip(place.u + far * uphill, 0.0, 1.0))
        if side is None or side.worst > place.worst + _JUMP * steep * far + _ROUNDING:
            if lost:
                return True
        elif not side.beyond and side.worst < place.worst and not led_to(program, side):
            return True
    return False


def led_beside(program: Program, place: Place) -> bool:
    """True if the starts lead to the motions of a place from one of some places close around it.

    Exactly on a border between itineraries each period of a run may have a switch that takes long
    to be decided.
    """
    if program.among == STABLE or core_of(program.system.scene) is None:
        return led_to(program, place)
    found = overview(program, _close_around(place, _CLOSEST), longer=LONGER)
    same = np.ones(_AROUND, bool)
    for motion, one in zip(place.motions, found.motions, strict=True):
        same &= alike(motion, one.period_numbers, one.found)
    return bool(same.any())


def jumps_beside(program: Program, place: Place) -> bool:
    """True if the starts lead elsewhere from places close around one."""
    far, *_ = _BESIDE
    worst = worst_at(program, _close_around(place, far), [place], LONGER)
    steep = float(np.linalg.norm(program.by_u(place.objective_by), axis=1).max())
    most = place.worst + _JUMP * steep * far * np.sqrt(len(place.u)) + _ROUNDING
    return bool(np.any((worst > most) & (worst < _REFUSED)) or np.any(np.isinf(worst)))


def _close_around(place: Place, far: float) -> Matrix:
    """Random points around a place."""
    points = place.u + far * np.random.default_rng(0).uniform(-1, 1, (_AROUND, len(place.u)))
    return np.clip(points, 0.0, 1.0)


def _uphill(program: Program, place: Place) -> Vector | None:
    """The direction in which the worst objective gets better fastest, between the bounds."""
    slope = program.by_u(place.objective_by)[int(np.argmax(place.objective))]
    held = ((place.u <= 0) & (slope > 0)) | ((place.u >= 1) & (slope < 0))
    found: Vector = -np.where(held, 0.0, slope)
    size = np.linalg.norm(found)
    return found / size if size > 0 else None


def stepped_back(program: Program, place: Place) -> Place:
    """The place a little off a boundary uphill, at which a long run from each start stays."""
    if (uphill := _uphill(program, place)) is None:
        return place
    for far in _BACK:
        spot = Spot(place.worst, np.clip(place.u - far * uphill, 0.0, 1.0), place)
        back = spot.place(program)
        if back is not None and abs(back.worst - place.worst) < _LOST and _stays(program, back):
            return back
    return place


def _stays(program: Program, place: Place) -> bool:
    """True if long runs from the starts end on the motions of a place."""
    if program.among == STABLE:
        return True
    systems = program.systems_at(place.u)
    for scenario, system, motion in zip(program.scenarios, systems, place.motions, strict=True):
        own = dimensionless(system)
        row = np.array([[*own.to_dict().values()]])
        length = _LONG // motion.period_number * motion.period_number
        run = simulate_many(row, scenario.state, 0.0, length, scene=own.scene)
        off = abs(run.states[0] - motion.state).max() if run.success[0] else np.inf
        if not off < _STAYS * (1 + abs(motion.state).max()):
            return False
    return True
