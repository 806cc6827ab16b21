"""The best places that the scenarios' starts lead to, near others, where no gradient shows the way.

Beyond a basin boundary a start leads to another motion, and the objective jumps: there a search by
simplices (Nelder and Mead 1965) replaces conditions.
"""

from __future__ import annotations

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import agrees, alike
from capsule_sym._design.overview import overview
from capsule_sym._design.program import KEPT, STABLE, Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._map.labelled import package
from capsule_sym._map.many import simulate_many
from capsule_sym._native import check_time, core_of

_TRIALS = 120  # evaluations of a simplex, for each variable
_SECOND = 0.01  # of the first simplex's size: the second one, which begins where that ends
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


def _beside(program: Program, u: Vector, near: Place) -> Place | None:
    """The place at `u`, on the motions near to those of another one where all stable ones count."""
    return program.beside(near, u) if program.among == STABLE else program.begin(u)


def worst_at(
    program: Program, points: Matrix, near: Place | None = None, longer: int = 1
) -> Vector:
    """The worst objective at points (n,), infinite where there is no motion.

    Beyond limits it is greater than any within them. Where all stable motions count, runs begin on
    that of the place `near`.
    """
    states = None
    if program.among == STABLE and near is not None:
        states = np.tile(near.motions[0].at_phase_zero, (len(points), 1))
    found = overview(program, points, states, longer)
    beyond = found.beyond(program)
    worst = found.worst / program.unit
    worst = np.where(beyond > KEPT, _REFUSED + beyond, worst)
    return np.where(np.isfinite(worst), worst, np.inf)


def refined(program: Program, place: Place, size: float, finest: float, longer: int = 1) -> Place:
    """The best place near to one, by the simplices of Nelder and Mead; steps are of the bounds."""
    if core_of(program.system.scene) is None:
        return place

    def worst(u: Vector) -> float:
        check_time()
        return min(float(worst_at(program, u[None], place, longer)[0]), 10 * _REFUSED)

    for step in (size, _SECOND * size):
        inwards = np.where(place.u > 0.5, -step, step)
        found = package("scipy.optimize").minimize(
            worst,
            place.u,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(place.u),
            options={
                "initial_simplex": np.vstack([place.u, place.u + np.diag(inwards)]),
                "xatol": finest,
                "fatol": np.inf,
                "maxfev": _TRIALS * len(place.u),
            },
        )
        better = _beside(program, found.x, place)
        place = better if better is not None and better.rank < place.rank else place
    return place


def scattered(program: Program, place: Place) -> float:
    """Share of neighbours near to a place of which one start leads to another motion.

    Next to a smooth boundary it is nearly 0, as they are so close; where basins are riddled it is
    not.
    """
    draw, shape = np.random.default_rng(0), (_PAIRS, len(place.u))
    points = np.clip(place.u + _BOX * draw.uniform(-1, 1, shape), 0.0, 1.0)
    beside = np.clip(points + _APART * draw.choice((-1.0, 1.0), shape), 0.0, 1.0)
    values = worst_at(program, np.vstack([points, beside]), place)
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
    worst = worst_at(program, _close_around(place, far), place, LONGER)
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
        back = _beside(program, np.clip(place.u - far * uphill, 0.0, 1.0), place)
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
