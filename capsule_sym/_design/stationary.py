"""The conditions of Karush, Kuhn and Tucker at an optimum, solved on a set of active constraints.

What is least is a level that no scenario's objective is above. Each scenario, each limit and each
bound of a variable is then a constraint with one multiplier. Objective and limits are followed on
the orbits' itineraries, on which they are smooth, whether the map realises these or not. Where the
optimum is on a border between itineraries, that border is one more constraint: it is held at zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.evaluation import Motion
from capsule_sym._design.program import FINE, KEPT, Place, Program
from capsule_sym._map.labelled import package

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Border = Callable[[Place], tuple[float, Vector]]
"""A function of a place that vanishes on a border, with derivatives by all parameters."""
_STEP = 1e-4  # of a variable's range, in the differences of gradients
_CHANGES = 8  # of the active set
_STEPS = 12  # of Newton's method on one active set
_AT_BOUND = 1e-6  # of a variable's range
_ACTIVE = 1e-5  # of a constraint, below which it may hold the optimum
_ENOUGH = 1e-12
_SLOW = 0.1  # of the residual before: slopes that make it no smaller are taken anew
_REACH = 0.1  # of the bounds, that a step moves a variable at most
_HOPELESS = 0.5  # a residual from which Newton's method is not tried
_SOLVED = 1e-9  # largest residual of what counts as an optimum
_ROUNDING = 1e-9  # below which a multiplier's sign is not looked at
_FLAT = 1e-6  # below which a negative curvature counts as none


@dataclass(frozen=True, eq=False)
class Stationary:
    """A place with multipliers, and the largest residual of the conditions there.

    The residual is that of the Lagrangian's derivatives by the scaled variables and of the active
    constraints. `weights` (m,) are the multipliers of the scenarios' objectives, `multipliers` (n,)
    those of the slacks, `bounds` (k,) those of the variables' bounds, `border` that of the border.
    """

    place: Place
    weights: Vector
    multipliers: Vector
    bounds: Vector
    border: float
    residual: float
    minimal: bool
    """Whether the residual is that of an optimum, the multipliers have the signs of a minimum, and
    the curvature along the active constraints is not negative."""


class _Point(NamedTuple):
    """A place with its constraints at level 0, and their derivatives by variables and level."""

    place: Place
    values: Vector
    by: Matrix


class _State(NamedTuple):
    """What the equations are solved for: a place, the level, and the constraints' multipliers."""

    point: _Point
    level: float
    multipliers: Vector

    @property
    def held(self) -> Vector:
        """The constraints at the level."""
        return self.point.values + self.level * self.point.by[:, -1]


def stationary(
    program: Program,
    place: Place,
    border: Border | None = None,
    orbits: tuple[Motion, ...] | None = None,
) -> Stationary | None:
    """The stationary place next to a place; None where an orbit is lost."""
    try:
        return _Conditions(program, place, border, orbits or place.motions).solved()
    except np.linalg.LinAlgError:  # at a fold, or where the border is left behind
        return None


def rough(program: Program, place: Place) -> Stationary:
    """The multipliers that suit a place best, and the residual that they leave."""
    own = _Conditions(program, place, None, place.motions)
    state = own.begun(own.point(place))
    return own.told(state, own.pull(state), minimal=False)


class _Conditions:
    """The equations of a stationary place, with the constraints that are active in them.

    Constraints are the scenarios' objectives below the level, the limits, and the border. Bounds
    of variables hold these at `side`: -1 at the lower one, 1 at the upper one, 0 between.
    """

    def __init__(
        self, program: Program, place: Place, border: Border | None, orbits: tuple[Motion, ...]
    ) -> None:
        self.program, self.border, self.orbits = program, border, orbits
        self.begin = np.where(place.u < _AT_BOUND, 0.0, place.u)
        self.begin[self.begin > 1 - _AT_BOUND] = 1.0
        self.side = np.where(self.begin == 0.0, -1, np.where(self.begin == 1.0, 1, 0))
        self.parts = np.cumsum([len(place.objective), len(place.slacks)])
        # Of a border the multiplier may have either sign.
        self.signed = np.arange(self.parts[-1] + (border is not None)) < self.parts[-1]
        self.active = np.zeros(len(self.signed), bool)

    @property
    def rows(self) -> NDArray[np.bool_]:
        """By which the Lagrangian's gradient is to vanish: the free variables, and the level."""
        return np.append(self.side == 0, True)

    def at(self, u: Vector) -> _Point:
        """Constraints at variables, on the orbits' itineraries."""
        orbits = self.program.extended(self.orbits, u)
        place = None if orbits is None else self.program.at(u, orbits, FINE)
        # LAPACK prints where it is given what is not finite.
        if place is None or not place.finite:
            raise np.linalg.LinAlgError("an orbit is lost")
        return self.point(place)

    def point(self, place: Place) -> _Point:
        """The constraints of a place."""
        by_u = self.program.by_u
        values = [-place.objective, place.slacks]
        by = [-by_u(place.objective_by), by_u(place.slacks_by)]
        if self.border is not None:
            value, row = self.border(place)
            values, by = [*values, np.array([value])], [*by, by_u(row[None])]
        levels = np.arange(len(self.signed)) < self.parts[0]
        found = _Point(place, np.concatenate(values), np.column_stack([np.vstack(by), levels]))
        if not (np.all(np.isfinite(found.values)) and np.all(np.isfinite(found.by))):
            raise np.linalg.LinAlgError("a constraint has no derivatives")
        return found

    def begun(self, point: _Point) -> _State:
        """The state at a place, with all active that is near to 0."""
        near = point.values + point.place.worst * point.by[:, -1] < _ACTIVE
        self.active = near | ~self.signed
        return _State(point, point.place.worst, self.multipliers(point))

    def multipliers(self, point: _Point) -> Vector:
        """Those of the active constraints that balance the gradients best."""
        found, goal = np.zeros(len(self.active)), np.append(np.zeros(len(point.place.u)), 1.0)
        by = point.by[self.active][:, self.rows]
        found[self.active] = np.linalg.lstsq(by.T, goal[self.rows], rcond=None)[0]
        return found

    def residual(self, state: _State) -> Vector:
        """Residual of the equations: of the Lagrangian's gradient, and of what is active."""
        gradient = state.multipliers @ state.point.by
        gradient[-1] -= 1.0
        return np.concatenate([gradient[self.rows], state.held[self.active]])

    def pull(self, state: _State) -> Vector:
        """The multipliers of the bounds, (k,): negative where the objective falls away from one."""
        found: Vector = self.side * (state.multipliers @ state.point.by)[:-1]
        return found

    def solved(self) -> Stationary:
        """The solution with those constraints and bounds active that a minimum has active."""
        state = self.begun(self.at(self.begin))
        for _ in range(_CHANGES):
            state = self.newton(state)
            pull = self.pull(state)
            if np.any(pull < -_ROUNDING):
                pull = self.pull_inside(state)
            beyond = ~self.active & (state.held < -KEPT)
            wrong = self.signed & self.active & (state.multipliers < -_ROUNDING)
            wrong &= state.multipliers == state.multipliers[wrong].min(initial=0.0)  # one by one
            loose = pull < -_ROUNDING
            if not (np.any(wrong | beyond) or np.any(loose)):
                minimal = abs(self.residual(state)).max() < _SOLVED and self.curved(state)
                return self.told(state, pull, minimal)
            self.active = (self.active & ~wrong) | beyond
            self.side = np.where(loose, 0, self.side)
            state = state._replace(multipliers=self.multipliers(state.point))
        return self.told(state, pull, minimal=False)

    def pull_inside(self, state: _State) -> Vector:
        """The same a little within the bounds.

        At a bound two peaks of a force may be equal, as all are without a second spring: which of
        them has the gradient there is by rounding.
        """
        with suppress(np.linalg.LinAlgError):
            inside = self.at(state.point.place.u - _AT_BOUND * self.side)
            return self.pull(state._replace(point=inside))
        return self.pull(state)

    def newton(self, state: _State) -> _State:
        """Newton's method, its slopes taken anew where they make the residual little smaller."""
        best, reached, slopes, fresh = state, math.inf, np.empty(0), False
        with suppress(np.linalg.LinAlgError):  # where an orbit is lost
            for _ in range(_STEPS):
                size = abs(self.residual(state)).max()
                slow = size > _SLOW * reached
                if size < reached:
                    best, reached = state, size
                elif fresh:
                    break
                if reached < _ENOUGH or reached > _HOPELESS:
                    break
                if fresh := slow or not slopes.size:
                    slopes = self.slopes(best)
                step = np.linalg.lstsq(slopes, -self.residual(best), rcond=1e-13)[0]
                state = self.stepped(best, np.asarray(step, dtype=float))
        return best

    def stepped(self, state: _State, step: Vector) -> _State:
        """The state after a step of free variables, level and active multipliers."""
        u, free = state.point.place.u.copy(), self.side == 0
        count = int(free.sum())
        share = min(1.0, _REACH / max(abs(step[:count]).max(initial=0.0), 1e-300))
        u[free] = np.clip(u[free] + share * step[:count], 0.0, 1.0)
        multipliers = state.multipliers.copy()
        multipliers[self.active] += step[count + 1 :]
        return _State(self.at(u), state.level + step[count], multipliers)

    def slopes(self, state: _State) -> Matrix:
        """Derivatives of the equations by free variables, level and active multipliers."""
        by = state.point.by[self.active][:, self.rows]
        count = by.shape[1]
        found = np.zeros((count + len(by),) * 2)
        found[: count - 1, : count - 1] = self.curvature(state)
        found[:count, count:], found[count:, :count] = by.T, by
        return found

    def curvature(self, state: _State) -> Matrix:
        """Second derivatives of the constraints' sum by the free variables, as differences."""
        u, free = state.point.place.u, np.flatnonzero(self.side == 0)
        here, columns = state.multipliers @ state.point.by, []
        for i in free:
            # Beside a bound both steps are away from it.
            inside = _STEP <= u[i] <= 1 - _STEP
            first, last = (-1, 1) if inside else (1, 2) if u[i] < 0.5 else (-1, -2)
            step = _STEP * np.eye(len(u))[i]
            one, two = (
                state.multipliers @ self.at(u + many * step).by - here for many in (first, last)
            )
            # The parabola through three points, differentiated at the first.
            slope = (last**2 * one - first**2 * two) / (first * last * (last - first) * _STEP)
            columns.append(slope[free])
        return np.array(columns).reshape(len(free), len(free)).T

    def curved(self, state: _State) -> bool:
        """Whether the Lagrangian's curvature along the active constraints is not negative.

        Raises LinAlgError where an orbit beside this one is lost.
        """
        by, second = state.point.by[self.active][:, self.rows], self.curvature(state)
        along = package("scipy.linalg", "design").null_space(by)[:-1]
        if not along.size:
            return True
        projected = -along.T @ (second + second.T) @ along / 2
        return bool(np.linalg.eigvalsh(projected).min() > -_FLAT)

    def told(self, state: _State, pull: Vector, minimal: bool) -> Stationary:
        """What was found, with the residual that is left."""
        weights, limits, border = np.split(state.multipliers, self.parts)
        largest = float(abs(self.residual(state)).max())
        return Stationary(
            state.point.place, weights, limits, pull, float(border.sum()), largest, minimal
        )
