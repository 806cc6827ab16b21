"""Karush-Kuhn-Tucker conditions of an optimum, solved on a set of active constraints.

The problem minimises a level that is an upper bound of all scenarios' objectives. Each objective,
each slack and each bound of a variable is then a constraint with one multiplier. All are smooth
along the orbits of one itinerary, admissible or not; borders between itineraries are slacks like
any other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.program import Place
from capsule_sym._map.labelled import package

_STEP = 1e-4  # of a variable's range: step of the differences of gradients
_SHARE = 0.03  # of the distance on which derivatives change little
_LEAST_STEP = 1e-8
_SHARES = (1.0, 0.999, 0.5, 0.1)  # shares of a step to try if an orbit is lost beyond
_SHRINK = 0.01
_CHANGES = 8  # largest number of changes of the active set
_PARALLEL = 1e-6  # least ratio of singular values of the active constraints
_STEPS = 12  # Newton steps on one active set
_AT_BOUND = 1e-6  # of a variable's range
_ACTIVE = (1e-8, 1e-5, 1e-2)  # of a constraint, below which it may be active
_NEAR = 1e-6  # the same without Newton's method
_KEPT = 1e-10  # violation above which a constraint becomes active
_ENOUGH = 1e-13
_PATIENCE = 2  # Newton steps in a row without a smaller residual
_SLOW = 0.1  # residual, over the one before, above which curvatures are computed again
_REACH = 0.1  # of the bounds: largest step of a variable
_SOLVED = 1e-9  # largest residual of an optimum
_ROUNDING = 1e-9  # size below which a multiplier has no sign
_FLAT = 1e-6  # size below which a negative curvature counts as none


class Slopes(Protocol):
    """Model with derivatives by its variables."""

    def by_u(self, rows: Matrix) -> Matrix:
        """Derivatives by the variables, from those by all parameters."""


class Model(Slopes, Protocol):
    """Model to solve: the place at variables u, with derivatives by these; None if lost."""

    def at(self, u: Vector) -> Place | None:
        """Objectives and slacks at variables, in a fixed order."""

    def smooth(self, place: Place) -> float:
        """Distance from a place within which derivatives change little."""


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


class _Point(NamedTuple):
    """Place with its constraints at level 0, and their derivatives by variables and level."""

    place: Place
    values: Vector
    by: Matrix


def stationary(model: Model, place: Place) -> Stationary | None:
    """Stationary place next to a place; None if an orbit is lost."""
    found: Stationary | None = None
    tried = set[bytes]()
    with suppress(np.linalg.LinAlgError):  # at a fold
        for near in _ACTIVE:
            own = _Conditions(model, place)
            point = own.at(own.start)
            own.begin(point, near)
            if own.active.tobytes() not in tried:
                tried.add(own.active.tobytes())
                found = own.solved(point)
                if found.minimal:
                    return found
    return found


def adjusted(model: Model, place: Place, near: Stationary) -> Stationary | None:
    """Stationary place with the active constraints of a near one; None if an orbit is lost.

    Both have the same constraints. Others that are exceeded become active, and those with a
    negative multiplier inactive.
    """
    with suppress(np.linalg.LinAlgError):
        own = _Conditions(model, place)
        own.active = np.append(near.weights, near.multipliers) > _ROUNDING
        return own.solved(own.at(own.start))
    return None


def balanced(model: Slopes, place: Place) -> Stationary:
    """Multipliers at a place with which near constraints balance the objectives' slopes.

    The residual is that of the balance, and the gain of the objective until the constraints are
    reached. No derivatives of gradients are needed, so that several borders may coincide.
    """
    own = _Balance(model, place)
    point = own.point(place)
    forces, left = own.balance(point, _NEAR)
    weights, limits = np.split(forces, [own.count])
    own.active = forces > 0
    exceeded = -float(place.slacks.min(initial=0.0))
    residual = max(left, float(limits @ place.slacks), exceeded)
    return Stationary(place, weights, limits, own.pull(point), residual, residual < _SOLVED)


def rough(model: Slopes, place: Place) -> Stationary:
    """Multipliers that fit a place best, and their residual."""
    own = _Balance(model, place)
    point = own.point(place)
    own.begin(point, _ACTIVE[-1])
    return own.told(point, minimal=False)


class _Balance:
    """Conditions of a stationary place, with its active constraints.

    Constraints are the objectives below the level, and the slacks. `side` is -1 for a variable at
    its lower bound, 1 at its upper bound, 0 between.
    """

    def __init__(self, model: Slopes, place: Place) -> None:
        self.by_u = model.by_u
        self.start = np.where(place.u < _AT_BOUND, 0.0, place.u)
        self.start[self.start > 1 - _AT_BOUND] = 1.0
        self.side = np.where(self.start == 0.0, -1, np.where(self.start == 1.0, 1, 0))
        self.count = len(place.objective)
        self.active = np.zeros(self.count + len(place.slacks), bool)

    @property
    def rows(self) -> NDArray[np.bool_]:
        """Rows in which the Lagrangian's gradient has to vanish: free variables, and the level."""
        return np.append(self.side == 0, True)

    def point(self, place: Place) -> _Point:
        """Constraints of a place."""
        by = np.vstack([-self.by_u(place.objective_by), self.by_u(place.slacks_by)])
        levels = np.arange(len(by)) < self.count
        return _Point(
            place, np.append(-place.objective, place.slacks), np.column_stack([by, levels])
        )

    def held(self, point: _Point) -> Vector:
        """Constraints at the level of the active objectives."""
        values = point.values.copy()
        objectives = values[: self.count]
        chosen = objectives[self.active[: self.count]]
        objectives -= chosen.mean() if len(chosen) else objectives.min()
        return values

    def begin(self, point: _Point, near: float) -> None:
        """Activate the constraints near 0 that balance the gradients with positive forces."""
        forces, _ = self.balance(point, near)
        self.active = forces > _ROUNDING
        objectives = point.values[: self.count]
        self.active[np.argmin(objectives)] |= not self.active[: self.count].any()

    def balance(self, point: _Point, near: float) -> tuple[Vector, float]:
        """Positive forces (n,) of constraints near 0 that balance the slopes, and the residual.

        Bounds of variables act as well; the forces of the objectives add up to 1.
        """
        values, goal = point.values.copy(), np.append(np.zeros(len(self.side)), 1.0)
        values[: self.count] += point.place.worst
        chosen, held = np.flatnonzero(values < near), np.flatnonzero(self.side)
        bounds = np.zeros((len(held), len(goal)))
        bounds[range(len(held)), held] = -self.side[held]
        rows = np.vstack([point.by[chosen], bounds])
        found, left = package("scipy.optimize").nnls(rows.T, goal)
        forces = np.zeros(len(values))
        forces[chosen] = found[: len(chosen)]
        return forces, float(left)

    def multipliers(self, point: _Point) -> Vector:
        """Multipliers of the active constraints that balance the gradients best."""
        found, goal = np.zeros(len(self.active)), np.append(np.zeros(len(self.side)), 1.0)
        by = point.by[self.active][:, self.rows]
        found[self.active] = np.linalg.lstsq(by.T, goal[self.rows], rcond=None)[0]
        return found

    def residual(self, point: _Point) -> Vector:
        """Residual of the equations: the Lagrangian's gradient, and the active constraints."""
        gradient = self.multipliers(point) @ point.by
        gradient[-1] -= 1.0
        return np.concatenate([gradient[self.rows], self.held(point)[self.active]])

    def pull(self, point: _Point) -> Vector:
        """Multipliers of the bounds, (k,): negative if the objective decreases away from one."""
        found: Vector = self.side * (self.multipliers(point) @ point.by)[:-1]
        return found

    def told(self, point: _Point, minimal: bool) -> Stationary:
        """Result, with its residual."""
        weights, limits = np.split(self.multipliers(point), [self.count])
        largest = float(abs(self.residual(point)).max())
        return Stationary(point.place, weights, limits, self.pull(point), largest, minimal)


class _Conditions(_Balance):
    """Equations of a stationary place, solved."""

    def __init__(self, model: Model, place: Place) -> None:
        super().__init__(model, place)
        self.model: Model = model

    def at(self, u: Vector) -> _Point:
        """Constraints at variables, on the orbits' itineraries."""
        place = self.model.at(u)
        # LAPACK prints a message if a value is not finite.
        if place is None or not place.finite:
            raise np.linalg.LinAlgError("an orbit is lost")
        return self.point(place)

    def solved(self, point: _Point) -> Stationary:
        """Solution with the active constraints and bounds of a minimum."""
        for _ in range(_CHANGES):
            point = self.newton(point)
            pull, multipliers = self.pull(point), self.multipliers(point)
            if np.any(pull < -_ROUNDING):
                pull = self.pull_inside(point)
            beyond = ~self.active & (self.held(point) < -_KEPT)
            wrong = self.active & (multipliers < -_ROUNDING)
            wrong &= multipliers == multipliers[wrong].min(initial=0.0)  # one by one
            loose = pull < -_ROUNDING
            if not (np.any(wrong | beyond) or np.any(loose)):
                minimal = abs(self.residual(point)).max() < _SOLVED and self.curved(point)
                return self.told(point, minimal)
            self.active = (self.active & ~wrong) | beyond
            self.side = np.where(loose, 0, self.side)
        return self.told(point, minimal=False)

    def pull_inside(self, point: _Point) -> Vector:
        """Multipliers of the bounds slightly within the bounds.

        At a bound two peaks of a force may be equal, as all are without a second spring: rounding
        decides which of them has the gradient there.
        """
        with suppress(np.linalg.LinAlgError):
            return self.pull(self.at(point.place.u - _AT_BOUND * self.side))
        return self.pull(point)

    def newton(self, point: _Point) -> _Point:
        """Newton's method for the active constraints, and for a zero slope along them.

        Curvatures are computed again if the residual decreases slowly.
        """
        best, reached, worse = point, math.inf, 0
        base, second = np.empty(0), np.empty(0)
        with suppress(np.linalg.LinAlgError):  # where an orbit is lost
            for _ in range(_STEPS):
                size = abs(self.residual(point)).max()
                along = self.along(point)
                if fresh := size > _SLOW * reached or not base.size:
                    base, second = along, self.curvature(point, along)
                # A step onto the constraints may change the slopes along them.
                worse = 0 if size < reached else worse + fresh
                if size < reached:
                    best, reached = point, size
                if reached < _ENOUGH or worse > _PATIENCE:
                    break
                turn = base.T @ along
                point = self.stepped(point, along, turn.T @ second @ turn)
        return best

    def along(self, point: _Point) -> Matrix:
        """Directions (rows, n) along the active constraints."""
        by = point.by[self.active][:, self.rows]
        found: Matrix = package("scipy.linalg").null_space(by)
        return found

    def stepped(self, point: _Point, along: Matrix, second: Matrix) -> _Point:
        """Point after a step onto the active constraints, and to zero slope along them."""
        by = point.by[self.active][:, self.rows]
        step = -np.linalg.lstsq(by, self.held(point)[self.active], rcond=_PARALLEL)[0]
        if along.size:  # along these only the level has a slope
            step = step + along @ np.linalg.lstsq(second, along[-1], rcond=1e-13)[0]
        u, free = point.place.u, np.flatnonzero(self.side == 0)
        most = min(1.0, _REACH / max(abs(step[:-1]).max(initial=0.0), 1e-300))
        for share in _SHARES:
            moved = u.copy()
            moved[free] = np.clip(u[free] + share * most * step[:-1], 0.0, 1.0)
            with suppress(np.linalg.LinAlgError):  # a border beyond which there is no orbit
                return self.at(moved)
        raise np.linalg.LinAlgError("an orbit is lost")

    def curvature(self, point: _Point, along: Matrix) -> Matrix:
        """Second derivatives of the Lagrangian along directions, as differences of gradients."""
        multipliers = self.multipliers(point)
        step = min(_STEP, _SHARE * self.model.smooth(point.place))
        here = multipliers @ point.by
        while True:
            try:
                columns = [self._second(point, multipliers, here, way, step) for way in along.T]
                break
            except np.linalg.LinAlgError:
                step *= _SHRINK
                if step < _LEAST_STEP:
                    raise
        found = along.T @ np.array(columns).reshape(along.shape[::-1]).T
        return (found + found.T) / 2

    def _second(
        self, point: _Point, multipliers: Vector, here: Vector, way: Vector, step: float
    ) -> Vector:
        """Derivative of the Lagrangian's gradient along one direction."""
        u, direction = point.place.u, np.zeros(len(self.side))
        direction[self.side == 0] = way[:-1]
        size = abs(direction).max()
        if not size > 0:
            return np.zeros(len(way))
        step /= size
        pairs: Sequence[tuple[int, int]] = ((-1, 1), (1, 2), (-1, -2))
        for first, last in pairs:
            ends = [u + many * step * direction for many in (first, last)]
            if any(np.any((end < 0) | (end > 1)) for end in ends):
                continue
            try:
                one, two = (multipliers @ self.at(end).by - here for end in ends)
            except np.linalg.LinAlgError:
                continue
            # Derivative of the parabola through three points, at the first.
            slope = (last**2 * one - first**2 * two) / (first * last * (last - first) * step)
            return np.asarray(slope[self.rows], dtype=float)
        raise np.linalg.LinAlgError("an orbit beside this one is lost")

    def curved(self, point: _Point) -> bool:
        """True if the Lagrangian's curvature along the active constraints is not negative.

        Raises LinAlgError if a neighbouring orbit is lost.
        """
        along = self.along(point)
        if not along.size:
            return True
        second = self.curvature(point, along)
        return bool(np.linalg.eigvalsh(-second).min() > -_FLAT)
