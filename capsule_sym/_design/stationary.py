"""Karush-Kuhn-Tucker conditions of an optimum, solved with a set of active constraints.

The problem minimises a level that is an upper bound of all scenarios' objectives. Each objective,
each slack and each bound of a variable is then a constraint with one multiplier. All are smooth
along the orbits of one itinerary, admissible or not; borders between itineraries are slacks like
any other. The unknowns of the equations are the free variables, the level and the multipliers.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.program import Place
from capsule_sym._errors import InvalidInput
from capsule_sym._map.labelled import package

Mask = NDArray[np.bool_]

_AT_BOUND = 1e-6  # of a variable's range: at a bound
_ACTIVE = (1e-8, 1e-5, 1e-2)  # slacks below which a constraint may be active, tried in turn
_CHANGES = 8  # largest number of changes of the active set
_STEPS = 10  # Newton steps with one active set: they converge in five, or not
_ENOUGH, _DIVERGED = 1e-14, 1e4  # residual, and over the least one, at which the steps end
_PARALLEL = 1e-12  # least ratio of singular values of the equations: constraints may be parallel
_REACH = 0.1  # of the bounds: largest step of a variable
_SHARES = (1.0, 0.999, 0.5, 0.1)  # shares of a step to try if an orbit is lost beyond
_SOLVED = 1e-9  # largest residual of an optimum, and size below which a number has no sign
_APART = 1e-5  # of the bounds, of differences of gradients, which have ten digits or more
_FLAT = 1e-6  # size below which a negative curvature counts as none: error of the differences


class Slopes(Protocol):
    """Model with derivatives by its variables."""

    def by_u(self, rows: Matrix) -> Matrix:
        """Derivatives by the variables, from those by all parameters."""


class SmoothModel(Slopes, Protocol):
    """Model to solve."""

    def at(self, u: Vector) -> Place | None:
        """Objectives and slacks at variables, in a fixed order; None if an orbit is lost."""


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


def stationary(model: SmoothModel, place: Place) -> Stationary | None:
    """Stationary place next to a place; None if an orbit is lost."""
    found: Stationary | None = None
    tried = set[bytes]()
    for near in _ACTIVE:
        with suppress(np.linalg.LinAlgError):  # at a fold, or where an orbit is lost
            own = _Conditions(model, place)
            active = own.forces(own.at(own.u), near)[0] > _SOLVED
            if active.tobytes() not in tried:
                tried.add(active.tobytes())
                found = own.solved(active)
                if found.minimal:
                    return found
    return found


def rough(model: Slopes, place: Place, near: float = _ACTIVE[-1]) -> Stationary:
    """Multipliers of the constraints near to 0 that balance the slopes best, and the residual.

    No equations are solved, so that several borders may coincide.
    """
    own = _Balance(model, place)
    forces, left = own.forces(place, near)
    weights, limits = np.split(forces, [own.count])
    residual = max(left, float(limits @ place.slacks), -float(place.slacks.min(initial=0.0)))
    return Stationary(place, weights, limits, own.pull(place, forces), residual, residual < _SOLVED)


class _Balance:
    """Gradient of the Lagrangian; the constraints are the objectives below the level, and slacks.

    `side` is -1 for a variable at its lower bound, 1 at its upper bound, 0 between.
    """

    def __init__(self, model: Slopes, place: Place) -> None:
        self.by_u, self.count = model.by_u, len(place.objective)
        self.u = np.where(place.u < _AT_BOUND, 0.0, np.where(place.u > 1 - _AT_BOUND, 1.0, place.u))
        self.side = (self.u == 1.0).astype(int) - (self.u == 0.0)

    def values(self, place: Place, level: float) -> Vector:
        """Values of the constraints (n,)."""
        return np.append(level - place.objective, place.slacks)

    def gradient(self, place: Place, forces: Vector) -> Vector:
        """Derivatives of the negative Lagrangian by the variables and the level."""
        by = self._rows(place)
        return np.asarray(forces @ by - np.append(np.zeros(len(self.u)), 1.0))

    def pull(self, place: Place, forces: Vector) -> Vector:
        """Multipliers of the bounds, (k,): negative if the objective decreases away from one."""
        found: Vector = self.side * self.gradient(place, forces)[:-1]
        return found

    def forces(self, place: Place, near: float) -> tuple[Vector, float]:
        """Multipliers >= 0 (n,) of constraints near 0 that balance the slopes, and the residual.

        Bounds of variables act as well; the multipliers of the objectives add up to 1.
        """
        chosen = np.flatnonzero(self.values(place, place.worst) < near)
        held = np.flatnonzero(self.side)
        bounds = np.zeros((len(held), len(self.u) + 1))
        bounds[range(len(held)), held] = -self.side[held]
        rows = np.vstack([self._rows(place)[chosen], bounds])
        goal = np.append(np.zeros(len(self.u)), 1.0)
        found, left = package("scipy.optimize").nnls(rows.T, goal)
        forces = np.zeros(self.count + len(place.slacks))
        forces[chosen] = found[: len(chosen)]
        return forces, float(left)

    def _rows(self, place: Place) -> Matrix:
        """Derivatives of the constraints by the variables and the level, (n, k + 1)."""
        by = np.vstack([-self.by_u(place.objective_by), self.by_u(place.slacks_by)])
        return np.column_stack([by, np.arange(len(by)) < self.count])


class _Conditions(_Balance):
    """Equations of a stationary place, solved by Newton's method."""

    def __init__(self, model: SmoothModel, place: Place) -> None:
        super().__init__(model, place)
        self.model, self.known = model, dict[bytes, Place]()

    def at(self, u: Vector) -> Place:
        """Place at variables; raises LinAlgError if an orbit is lost."""
        if u.tobytes() not in self.known:
            place = None
            with suppress(InvalidInput):  # beyond the bounds, of a parameter that is not allowed
                place = self.model.at(u)
            if place is None or not place.finite:  # LAPACK prints a message where it is given a nan
                raise np.linalg.LinAlgError("an orbit is lost")
            self.known[u.tobytes()] = place
        return self.known[u.tobytes()]

    def solved(self, active: Mask) -> Stationary:
        """Solution with the active constraints and bounds of a minimum."""
        for _ in range(_CHANGES):
            place, level, forces, residual = self._solution(active)
            pull = self.pull(place, forces)
            if np.any(pull < -_SOLVED):
                # At a bound peaks of a force may be equal, as without a second spring, and rounding
                # decides which of them has the gradient: it is that inside.
                inside = self.at(place.u - _AT_BOUND * self.side)
                pull = self.pull(inside, self._multipliers(inside, active))
            over = (self.side == 0) & ((place.u < 0) | (place.u > 1))
            loose = pull < -_SOLVED
            beyond = ~active & (self.values(place, level) < -_SOLVED)
            wrong = active & (forces < -_SOLVED) & (forces == forces.min())  # one by one
            changes = over.any() or loose.any() or beyond.any() or wrong.any()
            if not changes or residual > _SOLVED:
                break
            active = (active & ~wrong) | beyond
            self.side = np.where(over, np.where(place.u > 1, 1, -1), np.where(loose, 0, self.side))
            self.u = np.clip(place.u, 0.0, 1.0)
        minimal = not changes and residual < _SOLVED and self._curved(place, active, forces)
        weights, limits = np.split(forces, [self.count])
        return Stationary(place, weights, limits, pull, residual, minimal)

    def _solution(self, active: Mask) -> tuple[Place, float, Vector, float]:
        """Place, level, multipliers and residual by Newton's method with active constraints."""
        rows = np.append(self.side == 0, True)
        free, none = rows.sum() - 1, np.zeros((active.sum(), active.sum()))
        place = self.at(self.u)
        level, best = place.worst, None
        for _ in range(_STEPS):
            by, forces = self._rows(place)[active][:, rows], self._multipliers(place, active)
            slopes, values = self.gradient(place, forces)[rows], self.values(place, level)[active]
            residual = np.append(slopes, values)
            size = float(abs(residual).max())
            if best is None or size < best[-1]:
                best = place, level, forces, size
            if size < _ENOUGH or size > _DIVERGED * best[-1]:
                break
            second = self._second(place, forces)[np.ix_(rows, rows)]
            matrix = np.block([[second, by.T], [by, none]])
            step = np.linalg.lstsq(matrix, -residual, rcond=_PARALLEL)[0][: free + 1]
            step *= min(1.0, _REACH / max(abs(step[:-1]).max(initial=0.0), 1e-300))
            place, share = self._moved(place, step[:-1])
            level += share * step[-1]
        assert best is not None
        return best

    def _multipliers(self, place: Place, active: Mask) -> Vector:
        """Multipliers of the active constraints that balance the slopes best."""
        found, rows = np.zeros(len(active)), np.append(self.side == 0, True)
        by, goal = self._rows(place)[active][:, rows], np.eye(len(rows))[-1][rows]
        found[active] = np.linalg.lstsq(by.T, goal, rcond=None)[0]
        return found

    def _moved(self, place: Place, step: Vector) -> tuple[Place, float]:
        """Place after a step of the free variables, and the share of it where there is an orbit."""
        for share in _SHARES:
            u = place.u.copy()
            u[self.side == 0] += share * step
            with suppress(np.linalg.LinAlgError):
                return self.at(u), share
        raise np.linalg.LinAlgError("an orbit is lost")

    def _second(self, place: Place, forces: Vector) -> Matrix:
        """Second derivatives of the negative Lagrangian, (k + 1, k + 1); 0 of variables at bounds.

        They are differences of gradients.
        """
        found, here = np.zeros((len(self.side) + 1,) * 2), self.gradient(place, forces)
        for i in np.flatnonzero(self.side == 0):
            for step in (_APART, -_APART, _APART**2, -(_APART**2)):
                with suppress(np.linalg.LinAlgError):  # beyond a border
                    beside = self.at(place.u + step * (np.arange(len(place.u)) == i))
                    found[i] = (self.gradient(beside, forces) - here) / step
                    break
        return (found + found.T) / 2

    def _curved(self, place: Place, active: Mask, forces: Vector) -> bool:
        """True if the Lagrangian's curvature along the active constraints is not negative."""
        rows = np.append(self.side == 0, True)
        along = package("scipy.linalg").null_space(self._rows(place)[active][:, rows])
        second = along.T @ self._second(place, forces)[np.ix_(rows, rows)] @ along
        return not along.size or bool(np.linalg.eigvalsh(-second).min() > -_FLAT)
