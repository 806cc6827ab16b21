"""The conditions of Karush, Kuhn and Tucker at an optimum, and Newton's method on them.

Objective and limits are followed on the orbits' itineraries, on which they are smooth, whether the
map realises these or not. Where the optimum is on a border between itineraries, that border is one
more limit: it is held at zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.evaluation import Motion
from capsule_sym._design.program import FINE, Place, Program

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Border = Callable[[Place], tuple[float, Vector]]
"""A function of a place that vanishes on a border, with derivatives by all parameters."""
_STEP = 1e-4  # of a variable's range, in the differences of gradients
_MOST = 12  # Newton's steps
_AT_BOUND = 1e-6  # of a variable's range
_ACTIVE = 1e-5  # of a slack, below which a limit may hold the optimum
_ENOUGH = 1e-12
_HOPELESS = 0.5  # a residual from which Newton's method is not tried
_REACH = 0.1  # of the bounds, that a step moves a variable at most
SOLVED = 1e-9
"""Largest residual of what counts as an optimum."""
_ROUNDING = 1e-9  # below which a multiplier's sign is not looked at


@dataclass(frozen=True, eq=False)
class Stationary:
    """A place with multipliers, and the largest residual of the conditions there.

    The residual is that of the Lagrangian's derivatives by the scaled variables and of the active
    limits. `weights` (m,) are those of the scenarios' objectives,
    `multipliers` (n,) of the slacks, `bounds` (k,) of the variables' bounds, positive where the
    objective would fall beyond an upper one, negative at a lower one; `border` that of the border.
    """

    place: Place
    weights: Vector
    multipliers: Vector
    bounds: Vector
    border: float
    residual: float
    minimal: bool
    """Whether, where the residual is that of an optimum, multipliers have the signs of a minimum
    and the curvature is not negative."""


def stationary(
    program: Program,
    place: Place,
    border: Border | None = None,
    orbits: tuple[Motion, ...] | None = None,
) -> Stationary | None:
    """The stationary place next to a place, by Newton's method; None where an orbit is lost."""
    try:
        return _Own(program, place, border, orbits or place.motions).solve()
    except np.linalg.LinAlgError:  # at a fold, or where the border is left behind
        return None


def rough(program: Program, place: Place) -> Stationary:
    """The multipliers that suit a place best, and the residual that they leave."""
    own = _Own(program, place, None, place.motions)
    unknowns = own.multipliers(place)
    worst = float(abs(own.residual(place, unknowns)).max(initial=0.0))
    return replace(own.ended(worst, place, unknowns), minimal=False)


class _Own:
    def __init__(
        self, program: Program, place: Place, border: Border | None, orbits: tuple[Motion, ...]
    ) -> None:
        self.program, self.border, self.orbits = program, border, orbits
        self.borders: dict[Place, tuple[float, Vector]] = {}
        self.scale = program.high - program.low
        self.columns = program.columns
        u = place.u.copy()
        u[u < _AT_BOUND], u[u > 1 - _AT_BOUND] = 0.0, 1.0
        self.start = u
        self.scenarios = np.flatnonzero(place.objective > place.objective.max() - _ACTIVE)
        self.free = np.flatnonzero((u > 0.0) & (u < 1.0))
        self.limits = np.flatnonzero(place.slacks < _ACTIVE)

    def at(self, u: Vector) -> Place | None:
        orbits = self.program.extended(self.orbits, u)
        place = None if orbits is None else self.program.at(u, orbits, FINE)
        # LAPACK prints where it is given what is not finite.
        return place if place is not None and place.finite else None

    def held(self, place: Place) -> tuple[Vector, Matrix]:
        """What is held at zero, with derivatives by the scaled variables: limits, and border."""
        values, by = place.slacks[self.limits], place.slacks_by[self.limits]
        if self.border is not None:
            if place not in self.borders:
                self.borders[place] = self.border(place)
            value, row = self.borders[place]
            values, by = np.append(values, value), np.vstack([by, row])
        if not (np.all(np.isfinite(values)) and np.all(np.isfinite(by))):
            raise np.linalg.LinAlgError("what is held has no derivatives")
        return values, by[:, self.columns] * self.scale

    def solve(self) -> Stationary | None:
        """Drop what pulls the wrong way, until all that is left holds."""
        for _ in range(4):
            found = self._solve()
            if found is None or self.dropped(found):
                if found is None:
                    return None
                continue
            return found
        return found

    def pulling(self, found: Stationary) -> tuple[list[int], list[int], list[int]]:
        """Limits, bounds and scenarios that are active, whose multipliers have the wrong sign."""
        wrong = [i for i in self.limits.tolist() if found.multipliers[i] < -_ROUNDING]
        loose = [
            i
            for i in range(len(self.start))
            if i not in self.free
            and found.bounds[i] * (1 if self.start[i] == 1.0 else -1) < -_ROUNDING
        ]
        light = [
            k
            for k, s in enumerate(self.scenarios)
            if len(self.scenarios) > 1 and found.weights[s] < -_ROUNDING
        ]
        return wrong, loose, light

    def dropped(self, found: Stationary) -> bool:
        """Whether something active is let go because its multiplier has the wrong sign."""
        wrong, loose, light = self.pulling(found)
        if not (wrong or loose or light):
            return False
        self.limits = np.array([i for i in self.limits if i not in wrong], dtype=int)
        self.free = np.sort(np.append(self.free, np.array(loose, dtype=int)))
        self.scenarios = np.delete(self.scenarios, light[:1])
        self.start = found.place.u
        return True

    def _solve(self) -> Stationary | None:
        place = self.at(self.start)
        if place is None:
            return None
        best: tuple[float, Place, Vector] | None = None
        unknowns = self.multipliers(place)
        slopes, fresh = None, False
        for _ in range(_MOST):
            residual = self.residual(place, unknowns)
            worst = float(abs(residual).max(initial=0.0))
            slow = best is not None and not worst < 0.1 * best[0]
            if best is None or worst < best[0]:
                best = worst, place, unknowns
            elif fresh:
                break  # a step by the slopes here makes it no better
            else:
                _, place, unknowns = best
                residual = self.residual(place, unknowns)
            if worst < _ENOUGH or worst > _HOPELESS:
                break
            fresh = slopes is None or slow
            if fresh:
                slopes = self.slopes(place, unknowns)
            if slopes is None:
                break
            try:
                step = np.linalg.lstsq(slopes, -residual, rcond=1e-13)[0]
            except np.linalg.LinAlgError:
                break
            count = len(self.free)
            longest = max(abs(step[:count]).max(initial=0.0), 1e-300)
            moved = place.u.copy()
            moved[self.free] += step[:count] * min(1.0, _REACH / longest)
            after = self.at(np.clip(moved, 0.0, 1.0))
            if after is None:
                break
            place, unknowns = after, unknowns + step[count:]
        assert best is not None
        return self.ended(*best)

    def multipliers(self, place: Place) -> Vector:
        """First guess of the multipliers, by least squares: level, weights, those held."""
        m = len(self.scenarios)
        _, by = self.held(place)
        by_u = place.objective_by[self.scenarios][:, self.columns] * self.scale
        rows = np.vstack([np.column_stack([by_u.T, -by.T])[self.free], [1.0] * m + [0.0] * len(by)])
        right = np.append(np.zeros(len(self.free)), 1.0)
        guess = np.linalg.lstsq(rows, right, rcond=None)[0]
        return np.concatenate([[place.objective[self.scenarios].max()], guess])

    def residual(self, place: Place, unknowns: Vector) -> Vector:
        """Residual of the equations."""
        m = len(self.scenarios)
        level, weights, others = unknowns[0], unknowns[1 : 1 + m], unknowns[1 + m :]
        values, by = self.held(place)
        by_u = place.objective_by[self.scenarios][:, self.columns] * self.scale
        lagrangian = weights @ by_u - others @ by
        return np.concatenate(
            [
                lagrangian[self.free],
                place.objective[self.scenarios] - level,
                [weights.sum() - 1.0],
                values,
            ]
        )

    def slopes(self, place: Place, unknowns: Vector) -> Matrix | None:
        """Derivatives of the equations: by the variables as differences, by the others exactly."""
        columns = []
        for i in self.free:
            # Beside a bound both steps are away from it.
            first, last = (
                (-1, 1)
                if _STEP <= place.u[i] <= 1 - _STEP
                else (1, 2)
                if place.u[i] < 0.5
                else (-1, -2)
            )
            step = np.zeros(len(place.u))
            step[i] = _STEP
            ends = [self.at(place.u + many * step) for many in (first, last)]
            if any(end is None for end in ends):
                return None
            one, two = (self.residual(end, unknowns) for end in ends if end is not None)
            here = self.residual(place, unknowns)
            # The parabola through three points, differentiated at the first.
            columns.append(
                (last**2 * (one - here) - first**2 * (two - here))
                / (first * last * (last - first) * _STEP)
            )
        for k in range(len(unknowns)):
            moved = unknowns.copy()
            moved[k] += 1.0
            columns.append(self.residual(place, moved) - self.residual(place, unknowns))
        return np.array(columns).T

    def ended(self, worst: float, place: Place, unknowns: Vector) -> Stationary:
        m = len(self.scenarios)
        weights, others = unknowns[1 : 1 + m], unknowns[1 + m :]
        _, by = self.held(place)
        by_u = place.objective_by[self.scenarios][:, self.columns] * self.scale
        lagrangian = weights @ by_u - others @ by
        every, multipliers = np.zeros(len(place.objective)), np.zeros(len(place.slacks))
        every[self.scenarios] = weights
        multipliers[self.limits] = others[: len(self.limits)]
        bounds = -lagrangian
        bounds[self.free] = 0.0
        found = Stationary(
            place=place,
            weights=every,
            multipliers=multipliers,
            bounds=bounds,
            border=float(others[-1]) if self.border is not None else 0.0,
            residual=worst,
            minimal=False,
        )
        if not worst < SOLVED or any(self.pulling(found)):
            return found
        return replace(found, minimal=self.curved(place, unknowns, by))

    def curved(self, place: Place, unknowns: Vector, by: Matrix) -> bool:
        """Whether the Lagrangian's curvature along what is held is not negative."""
        count = len(self.free)
        slopes = self.slopes(place, unknowns)
        if slopes is None:
            return False
        m = len(self.scenarios)
        by_u = place.objective_by[self.scenarios][:, self.columns] * self.scale
        fixed = np.vstack([by, by_u[1:] - by_u[:1] if m > 1 else by_u[:0]])[:, self.free]
        if count == 0:
            return True
        _, values, directions = (
            np.linalg.svd(fixed, full_matrices=True)
            if len(fixed)
            else (
                None,
                np.zeros(0),
                np.eye(count),
            )
        )
        rank = int(np.sum(values > 1e-12))
        basis = directions[rank:].T
        hessian = slopes[:count, :count]
        projected = basis.T @ (hessian + hessian.T) @ basis / 2
        least = np.linalg.eigvalsh(projected).min(initial=0.0) if projected.size else 0.0
        return bool(least > -1e-6)
