"""Karush-Kuhn-Tucker conditions of an optimum, solved with a set of active constraints.

The problem minimises a level that is an upper bound of all scenarios' objectives. Each objective,
each slack and each bound of a variable is then a constraint with one multiplier. All are smooth
along the orbits of one itinerary, admissible or not; borders between itineraries are slacks like
any other. The unknowns of the equations are the free variables, the level and the multipliers.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.pieces import Piece
from capsule_sym._design.program import CLOSE, Place, Program
from capsule_sym._errors import InvalidInput
from capsule_sym._map.labelled import package

Mask = NDArray[np.bool_]

SOLVED = 1e-9
"""Largest residual of an optimum, and size below which a multiplier has no sign; a share of the
objective's unit, ten times above the rounding of gradients by an orbit's equations."""
_ACTIVE = 1e-8, 1e-5, 1e-2  # slacks, in their units, below which constraints may be active, in turn
_STEPS = 10  # steps of Newton's method, which doubles the digits: five suffice, or it diverges
_ENOUGH = 1e-13  # residual that rounding leaves
_DIFFERENCE = 1e-5  # share of the range: square root of the rounding of gradients, for differences


@dataclass(frozen=True, eq=False)
class Stationary:
    """Place with multipliers, and the largest residual of the conditions there.

    The residual is that of the Lagrangian's derivatives by the scaled variables and of the active
    constraints. `weights` (m,) are the multipliers of the objectives, `multipliers` (n,) those of
    the slacks, `bounds` (k,) those of the variables' bounds.
    """

    place: Place
    weights: Vector
    multipliers: Vector
    bounds: Vector
    residual: float
    minimal: bool
    """True if the conditions of a minimum hold. The residual is small, the multipliers have the
    signs of a minimum, and the curvature along the active constraints is not negative."""


def stationary(model: Piece, place: Place) -> Stationary | None:
    """Stationary place next to a place; None if no active set has one."""
    for near in _ACTIVE:
        with suppress(np.linalg.LinAlgError):  # at a fold, or where an orbit is lost
            found = _Conditions(model, place).solved(near)
            if found.minimal:
                return found
    return None


def balanced(model: Program | Piece, place: Place, near: float = _ACTIVE[-1]) -> Stationary:
    """Multipliers of the constraints near to 0 that balance the slopes best, and the residual.

    No equations are solved, so that several borders may coincide.
    """
    own = _Balance(model, place)
    forces, left = own.forces(place, near)
    limits = forces[own.count :]
    residual = max(left, float(limits @ place.slacks), -float(place.slacks.min(initial=0.0)))
    return own.result(place, forces, residual, residual < SOLVED)


class _Balance:
    """Gradient of the Lagrangian; the constraints are the objectives below the level, and slacks.

    `side` is -1 for a variable at its lower bound, 1 at its upper bound, 0 between.
    """

    def __init__(self, model: Program | Piece, place: Place) -> None:
        self.by_u, self.count = model.by_u, len(place.objective)
        low, high = place.u < CLOSE, place.u > 1 - CLOSE
        self.u, self.side = np.where(low, 0.0, np.where(high, 1.0, place.u)), 1 * high - low

    def values(self, place: Place, level: float) -> Vector:
        """Values of the constraints (n,)."""
        return np.append(level - place.objective, place.slacks)

    def rows(self, place: Place) -> Matrix:
        """Derivatives of the constraints by the variables and the level, (n, k + 1)."""
        by = np.vstack([-self.by_u(place.objective_by), self.by_u(place.slacks_by)])
        return np.column_stack([by, np.arange(len(by)) < self.count])

    def gradient(self, place: Place, forces: Vector) -> Vector:
        """Derivatives of the negative Lagrangian by the variables and the level."""
        goal = np.append(np.zeros(len(self.u)), 1.0)
        return np.asarray(forces @ self.rows(place) - goal)

    def forces(self, place: Place, near: float) -> tuple[Vector, float]:
        """Multipliers >= 0 (n,) of constraints near 0 that balance the slopes, and the residual.

        Bounds of variables act as well; the multipliers of the objectives add up to 1.
        """
        rows, goal = self.rows(place), np.append(np.zeros(len(self.u)), 1.0)
        chosen = np.flatnonzero(self.values(place, place.worst) < near)
        bounds = -np.diag(np.append(self.side, 0))[self.side.nonzero()]
        found, left = package("scipy.optimize").nnls(np.vstack([rows[chosen], bounds]).T, goal)
        forces = np.zeros(len(rows))
        forces[chosen] = found[: len(chosen)]
        return forces, float(left)

    def result(self, place: Place, forces: Vector, residual: float, minimal: bool) -> Stationary:
        """Place with its multipliers."""
        weights, limits = np.split(forces, [self.count])
        bounds = self.side * self.gradient(place, forces)[:-1]
        return Stationary(place, weights, limits, bounds, residual, minimal)


class _Conditions(_Balance):
    """Equations of a stationary place, solved by Newton's method."""

    def __init__(self, model: Piece, place: Place) -> None:
        super().__init__(model, place)
        self.model = model
        self.free = np.append(self.side == 0, True)
        """Mask of the variables at no bound, and of the level."""

    def at(self, u: Vector) -> Place:
        """Place at variables; raises LinAlgError if an orbit is lost."""
        place = None
        with suppress(InvalidInput):  # beyond the bounds, of a parameter that is not allowed
            place = self.model.at(u)
        if place is None:
            raise np.linalg.LinAlgError("an orbit is lost")
        return place

    def solved(self, near: float) -> Stationary:
        """Solution with the constraints that act near a place."""
        place = self.at(self.u)
        active = self.forces(place, near)[0] > SOLVED
        place, level, forces, residual = self._newton(place, active)
        found = self.result(place, forces, residual, False)
        inside = bool(np.all(abs(place.u - 0.5) <= 0.5))
        held = self.values(place, level).min() > -SOLVED
        least = min(forces.min(), found.bounds.min())
        if not (inside and held and least > -SOLVED and residual < SOLVED):
            return found
        return self.result(place, forces, residual, self._curved(place, active, forces))

    def _newton(self, place: Place, active: Mask) -> tuple[Place, float, Vector, float]:
        """Place, level, multipliers and residual of the best of the steps."""
        level, best, none = place.worst, None, np.zeros((active.sum(), active.sum()))
        for _ in range(_STEPS):
            by, forces = self.rows(place)[active][:, self.free], np.zeros(len(active))
            goal = np.eye(len(self.free))[-1][self.free]
            forces[active] = np.linalg.lstsq(by.T, goal, rcond=None)[0]
            slopes, values = self.gradient(place, forces), self.values(place, level)
            residual = np.append(slopes[self.free], values[active])
            size = float(abs(residual).max())
            if best is not None and size >= best[-1]:
                break
            best = place, level, forces, size
            if size < _ENOUGH:
                break
            second = self._second(place, forces)
            step = np.linalg.lstsq(np.block([[second, by.T], [by, none]]), -residual, rcond=None)[0]
            u, level = place.u.copy(), level + step[self.free.sum() - 1]
            u[self.side == 0] += step[: self.free.sum() - 1]
            place = self.at(u)
        assert best is not None
        return best

    def _second(self, place: Place, forces: Vector) -> Matrix:
        """Second derivatives of the negative Lagrangian by the free unknowns, by differences."""
        found, here = np.zeros((len(self.free),) * 2), self.gradient(place, forces)
        for i in np.flatnonzero(self.side == 0):
            along = _DIFFERENCE * np.eye(len(place.u))[i]
            try:
                beside = self.at(place.u + along)
            except np.linalg.LinAlgError:  # beyond a fold
                beside, along = self.at(place.u - along), -along
            found[i] = (self.gradient(beside, forces) - here) / along[i]
        symmetric: Matrix = ((found + found.T) / 2)[np.ix_(self.free, self.free)]
        return symmetric

    def _curved(self, place: Place, active: Mask, forces: Vector) -> bool:
        """True if the Lagrangian's curvature along the active constraints is not negative."""
        along = package("scipy.linalg").null_space(self.rows(place)[active][:, self.free])
        second = -along.T @ self._second(place, forces) @ along
        # The error of the differences may make a curvature of 0 slightly negative.
        return not along.size or bool(np.linalg.eigvalsh(second).min() > -CLOSE)
