"""Local search by SQP, and Karush-Kuhn-Tucker conditions with a set of active constraints.

The slacks are smooth along the orbits of one itinerary, admissible or not; borders between
itineraries are slacks like any other. The unknowns of the equations are the variables at no bound
and the multipliers of the active slacks.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.pieces import Piece
from capsule_sym._design.program import CLOSE, Place, Program
from capsule_sym._map.labelled import package
from capsule_sym._native import TimeUp, check_time

SOLVED = 1e-9
"""Largest residual of an optimum, and size below which a multiplier has no sign, in units of the
objective and of the slacks: ten times above the rounding of gradients by an orbit's equations."""
_ACTIVE = CLOSE, 1e-2  # slacks, in their units, below which constraints may be active, in turn
_ENOUGH = 1e-12  # residual at which no further step is taken: most gradients round to more
_STEPS = 10  # steps of Newton's method, which doubles the digits: five suffice, or it diverges
_DIFFERENCE = 1e-5  # share of the range: square root of the rounding of gradients, for differences

MOST = 100
"""Evaluations of a search, as SciPy's iterations: beside a border a line search has no end."""
_PRECISE = 1e-11  # units of the objective: accuracy required of SLSQP
_LOST = 10.0  # units of the objective, above the start, without a motion: about all variation
_MAX_LOST = 8  # places without a motion: beside a bifurcation each line search meets some

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class LocalOptimum:
    """Place with the multipliers of its slacks and of the variables' bounds, and what holds it."""

    model: Program | Piece
    """The problem, with its margin of stability, or a piece of it."""
    place: Place
    multipliers: Vector
    """Those of the slacks, (n,): of the limits, the stability, and borders between itineraries."""
    bounds: Vector
    """Those of the bounds of variables, (k,)."""
    residual: float
    """Largest of the Lagrangian's derivatives by the scaled variables at no bound, of the slacks
    with multipliers, and of violations of the others."""
    kkt_satisfied: bool
    """True if the conditions of a minimum hold, and no piece beyond a border is better; also of a
    place that is taken as the best without conditions."""
    border: tuple[str, ...] = ()
    """Itineraries of the pieces beside the place, its own first; empty if no border holds it, or if
    it is taken without conditions."""
    bifurcation: str = ""
    """Bound of the best: loss of stability, lost motion beyond a border, basin boundary or kink."""
    limit: float = np.nan
    """Limit of the objective there."""

    @property
    def program(self) -> Program:
        """The problem."""
        return self.model.program if isinstance(self.model, Piece) else self.model

    @property
    def active_borders(self) -> list[int]:
        """Indices of slacks that are borders and hold the place, the largest multiplier first."""
        forces, limits = self.multipliers, len(self.program.texts)
        some = range(limits, len(forces))
        return sorted((i for i in some if forces[i] > SOLVED), key=lambda i: -forces[i])

    @property
    def at_margin(self) -> bool:
        """True if the margin of stability is active."""
        last = len(self.program.texts) - 1
        return self.program.margin is not None and bool(self.multipliers[last] > SOLVED)


def stationary(model: Piece, place: Place) -> LocalOptimum | None:
    """Place of solved conditions next to one, by the slacks active near to it; None if none."""
    balances = (balanced(model, place, near).multipliers > SOLVED for near in _ACTIVE)
    for active in dict.fromkeys(tuple(each.tolist()) for each in balances):
        with suppress(np.linalg.LinAlgError):  # where an orbit is lost
            found = _solved(model, place, np.array(active, bool))
            if found.kkt_satisfied:
                return found
    return None


def balanced(model: Program | Piece, place: Place, near: float = _ACTIVE[-1]) -> LocalOptimum:
    """Place with the multipliers >= 0 of the slacks near to 0 that balance the slopes best.

    Bounds of variables act as well. No equations are solved.
    """
    rows, sides = model.by_u(place.slacks_by), _sides(place.u)
    chosen = np.flatnonzero(place.slacks < near)
    pushes = np.vstack([rows[chosen], -np.diag(sides)[sides != 0]])
    slopes, multipliers = model.by_u(place.objective_by), np.zeros(len(rows))
    if len(pushes):  # SciPy's method has no answer without any
        multipliers[chosen] = package("scipy.optimize").nnls(pushes.T, slopes)[0][: len(chosen)]
    return _with(model, place, multipliers, sides)


def _solved(model: Piece, place: Place, active: Mask) -> LocalOptimum:
    """Best place of Newton's method with active slacks, and variables fixed at bounds nearby.

    It is the one of the least residual, solved or not. Raises LinAlgError if an orbit is lost.
    """
    sides, best = _sides(place.u), None
    free = sides == 0
    place = _at(model, np.where(free, place.u, sides > 0))
    for _ in range(_STEPS):
        rows, multipliers = model.by_u(place.slacks_by)[active][:, free], np.zeros(len(active))
        slopes = model.by_u(place.objective_by)[free]
        multipliers[active] = np.linalg.lstsq(rows.T, slopes, rcond=None)[0]
        found = _with(model, place, multipliers, sides)
        if best is not None and found.residual >= best.residual:
            break
        best = found
        if found.residual < _ENOUGH:
            break
        second, none = _second(model, found, free), np.zeros((len(rows), len(rows)))
        left = np.append(_lagrangian_by(model, place, multipliers)[free], place.slacks[active])
        matrix, u = np.block([[second, -rows.T], [rows, none]]), place.u.copy()
        u[free] -= np.linalg.lstsq(matrix, left, rcond=None)[0][: len(slopes)]
        place = _at(model, u)
    assert best is not None
    return best


def _second(model: Piece, found: LocalOptimum, free: Mask) -> Matrix:
    """Second derivatives of the Lagrangian by the free variables, by differences."""
    here, rows = _lagrangian_by(model, found.place, found.multipliers), []
    for along in _DIFFERENCE * np.eye(len(free))[free]:
        try:
            beside, step = _at(model, found.place.u + along), _DIFFERENCE
        except np.linalg.LinAlgError:  # beyond a fold
            beside, step = _at(model, found.place.u - along), -_DIFFERENCE
        rows.append((_lagrangian_by(model, beside, found.multipliers) - here)[free] / step)
    second = np.array(rows).reshape(free.sum(), free.sum())
    return np.asarray((second + second.T) / 2)


def _at(model: Piece, u: Vector) -> Place:
    """Place at variables; raises LinAlgError if the orbit is lost."""
    place = model.at(u)
    if place is None:
        raise np.linalg.LinAlgError("an orbit is lost")
    return place


def _sides(u: Vector) -> Vector:
    """-1 for a variable at its lower bound, 1 at its upper bound, 0 between."""
    return np.asarray(1.0 * (u > 1 - CLOSE) - (u < CLOSE), np.float64)


def _lagrangian_by(model: Program | Piece, place: Place, multipliers: Vector) -> Vector:
    """Derivatives by the variables of the Lagrangian of the slacks, without bounds of variables."""
    held = multipliers @ model.by_u(place.slacks_by)
    return np.asarray(model.by_u(place.objective_by) - held)


def _with(model: Program | Piece, place: Place, multipliers: Vector, sides: Vector) -> LocalOptimum:
    """Place with the multipliers of its slacks, those of bounds, and the test of its conditions."""
    left = _lagrangian_by(model, place, multipliers)
    bounds, slacks = -sides * left, np.where(multipliers > 0, abs(place.slacks), -place.slacks)
    residual = np.concatenate([abs(left[sides == 0]), slacks]).max(initial=0.0)
    least = min(multipliers.min(initial=0.0), bounds.min())
    minimal = residual < SOLVED and least > -SOLVED and bool(np.all(abs(place.u - 0.5) <= 0.5))
    return LocalOptimum(model, place, multipliers, bounds, float(residual), bool(minimal))


class _Enough(Exception):
    """Raised in place of an evaluation beyond those that a search may make."""


def local_search(model: Program | Piece, first: Place, most: int = MOST) -> list[Place]:
    """Places that SciPy's SLSQP passes from a place, of a program or on a piece, the best first.

    The first place is one of them. At most so many are evaluated, each continued from the nearest
    one, and at most 8 without a motion, which are left out. At the time limit they are those passed
    so far, and TimeUp is not raised. Metrics are continuous across changes of itinerary: where
    their gradients jump the method stops beside the border.
    """
    none, no_slack = 0 * first.objective_by, np.full(len(first.slacks), -_LOST)
    lost = Place(first.u, first.motion, first.objective + _LOST, none, no_slack, first.slacks_by)
    known = {first.u.tobytes(): first}

    def at(x: Vector) -> Place:
        """Place at variables, its motion continued from the nearest known place."""
        u = np.clip(x, 0.0, 1.0)
        if (key := u.tobytes()) not in known:
            check_time()
            passed = [one for one in known.values() if one is not lost]
            if len(known) == most or len(known) - len(passed) == _MAX_LOST:
                raise _Enough
            near = min(passed, key=lambda one: float(abs(one.u - u).max()))
            known[key] = model.beside(near, u) or lost
        return known[key]

    held = {"fun": lambda x: at(x).slacks, "jac": lambda x: model.by_u(at(x).slacks_by)}
    with np.errstate(all="ignore"), suppress(_Enough, TimeUp):
        package("scipy.optimize").minimize(
            lambda x: (at(x).objective, model.by_u(at(x).objective_by)),
            first.u,
            jac=True,
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(first.u),
            constraints=[{"type": "ineq", **held}] if len(no_slack) else (),
            options={"ftol": _PRECISE},
        )
    return sorted((one for one in known.values() if one is not lost), key=lambda one: one.rank)
