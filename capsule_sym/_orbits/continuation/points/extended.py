"""Extended systems: an orbit's equations with segments of duration 0 and test functions of 0."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.continuation.points.conditions import Vanishing
from capsule_sym._orbits.continuation.points.kinds import DURATIONS
from capsule_sym._orbits.shooting.equations import (
    ROUNDINGS,
    Matrix,
    ShootingSystem,
    Vector,
    shooting,
    solve,
)
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit

_MOST_STEPS = 20
_LARGEST_RESIDUAL = 1024  # units of rounding
_RANK = 1e-9  # singular values below this share of the largest are taken for zero
_DIFFERENCE = 1e-6  # of the unknowns, for the gradient of a condition

#: What vanishes where no segment has the duration 0.
Condition = Callable[[Orbit], Vanishing]


class EventSolution(NamedTuple):
    """An orbit on which certain segments have the duration 0 and conditions hold, and how well.

    As many parameters as there are such segments and conditions were free. The `residual` is the
    largest entry of the equations'; `uncertainties` bound the errors of the free parameters to
    first order: the rounding of every equation carried through the inverse Jacobian.
    """

    orbit: Orbit
    segments: tuple[int, ...]
    residual: Number
    uncertainties: tuple[Number, ...]


def orbit_at(
    numbers: Backend,
    values: Sequence[Number],
    itinerary: Itinerary,
    z: Vector,
    iterations: int = 0,
    kept: ShootingSystem | None = None,
) -> Orbit:
    """The orbit of these unknowns, or what is to become one, in the number system of a backend."""
    system = shooting(numbers, values, itinerary, z, kept)
    return Orbit(tuple(values), itinerary, z, system, numbers.name, iterations)


@dataclass
class ExtendedSystem:
    """The equations of an orbit on which some segments have the duration 0 and conditions hold.

    Unknowns are the other entries of z and as many parameters as there are such segments and
    `conditions`, those that vary on the paths `free`; `z` and `values` hold the guess. Conditions,
    which vanish too, are for double precision; there may be one too many if it follows from others.
    """

    numbers: Backend
    values: Sequence[Number]
    free: tuple[ParameterPath, ...]
    itinerary: Itinerary
    z: Vector
    segments: tuple[int, ...] = ()
    conditions: Sequence[Condition] = ()

    def __post_init__(self) -> None:
        gone = [DURATIONS + segment for segment in self.segments]
        self.rest = [i for i in range(len(self.z)) if i not in gone]
        self._kept: ShootingSystem | None = None
        # Of conditions without an exact gradient: differences at first, then Broyden's updates. An
        # error of them costs steps of Newton's method only.
        self._rows: Matrix | None = None
        self._last = self._step = np.zeros(0)

    def solve(self) -> EventSolution | None:
        """The solution by Newton's method; None if there is none.

        In 50 digits the derivatives are computed at the guess alone: a step then leaves as much of
        the error as the guess was off, which is far less than a half.
        """
        numbers, many = self.numbers, len(self.rest)
        at = [path.value(self.values) for path in self.free]
        unknowns = np.array([*np.array(list(self.z))[self.rest], *at])
        # Near a segment of duration 0 the derivative has an error of some unit^(1/3), steps shrink
        # by that. Where equations are nearly dependent, rounding alone moves the unknowns by more:
        # the last step may be one whose square is rounding.
        root = numbers.sqrt(numbers.unit)
        small = root * numbers.sqrt(root)
        with np.errstate(all="ignore"):
            for iterations in range(1, _MOST_STEPS + 1):
                found = self._evaluate(unknowns)
                if not all(abs(value) < float("inf") for value in found.residual):
                    return None
                try:
                    step = _newton_step(numbers, found.matrix, found.residual)
                except np.linalg.LinAlgError:
                    return None
                unknowns, self._step = unknowns - step, -step
                least = small if iterations < _MOST_STEPS else root
                if max(abs(step)) <= least * (1 + max(abs(unknowns[:many]))):
                    self._rows = None
                    solution = self._solution(self._evaluate(unknowns), unknowns, iterations)
                    # Derivatives that are kept let the error fall by a factor, not by its square.
                    if solution is not None or numbers.name != "mpmath":
                        return solution
        return None

    def _orbit(self, unknowns: Vector) -> Orbit:
        z, values = np.full(len(self.z), self.numbers.number(0)), list(self.values)
        z[self.rest] = unknowns[: len(self.rest)]
        for path, value in zip(self.free, unknowns[len(self.rest) :], strict=True):
            values = path.placed(values, value)
        return orbit_at(self.numbers, values, self.itinerary, z, kept=self._kept)

    def _evaluate(self, unknowns: Vector) -> _Evaluation:
        orbit = self._orbit(unknowns)
        system = orbit.system
        if self._kept is None and self.numbers.name == "mpmath":
            self._kept = system
        by = [path.along(system.by_p, path.value(orbit.values)) for path in self.free]
        matrix = np.column_stack([system.by_z[:, self.rest], *by])
        if not self.conditions:
            return _Evaluation(orbit, system.residual, [], matrix)
        found = [condition(orbit) for condition in self.conditions]
        rows = np.zeros((len(found), matrix.shape[1]))
        unknown = [k for k, one in enumerate(found) if one.gradient is None]
        for row, one in zip(rows, found, strict=True):
            if one.gradient is not None:
                row[:] = [*one.gradient[self.rest], *one.gradient[len(self.z) :]]
        if unknown:
            rows[unknown] = self._secants(unknowns, unknown, [found[k].value for k in unknown])
        residual = np.append(system.residual, [one.value for one in found])
        roundings = [one.rounding for one in found]
        return _Evaluation(orbit, residual, roundings, np.vstack([matrix, rows]))

    def _secants(self, unknowns: Vector, which: list[int], values: list[float]) -> Matrix:
        """The gradients (many, size) of some conditions, which have these values."""
        now, step = np.array(values), self._step
        if self._rows is None:
            conditions, columns = [self.conditions[k] for k in which], []
            for change in _DIFFERENCE * np.eye(len(unknowns)):
                ahead, behind = self._orbit(unknowns + change), self._orbit(unknowns - change)
                columns.append([one(ahead).value - one(behind).value for one in conditions])
            self._rows = np.array(columns).T / (2 * _DIFFERENCE)
        else:
            missed = now - self._last - self._rows @ step
            self._rows = self._rows + np.outer(missed, step) / (step @ step)
        self._last = now
        return self._rows

    def _solution(
        self, found: _Evaluation, unknowns: Vector, iterations: int
    ) -> EventSolution | None:
        """The solution and its uncertainties; None where the residual is not that of rounding."""
        numbers, free, (orbit, residual, roundings, matrix) = self.numbers, len(self.free), found
        closed, off = np.split(residual, [len(orbit.system.residual)])
        if not max(abs(closed)) <= _LARGEST_RESIDUAL * numbers.unit * (1 + max(abs(unknowns))):
            return None
        if not all(abs(value) <= limit for value, limit in zip(off, roundings, strict=True)):
            return None
        rounding = ROUNDINGS * numbers.unit * (abs(matrix) @ abs(unknowns))
        if roundings:
            rounding[len(closed) :] = roundings
        if len(residual) > len(unknowns):
            rows = np.linalg.pinv(matrix)[-free:]
        else:
            # The rows of the inverse that give the parameters.
            unit = np.full((len(unknowns), free), numbers.number(0))
            unit[-free:] = unit[-free:] + np.eye(free, dtype=int)
            rows = solve(numbers, matrix.T, unit).T
        uncertainties = tuple((abs(rows) @ (rounding + abs(residual))).tolist())
        if self._kept is not None:  # the orbit has derivatives of its own
            orbit = orbit_at(numbers, orbit.values, orbit.itinerary, orbit.z)
        orbit = replace(orbit, iterations=iterations)
        return EventSolution(orbit, self.segments, max(abs(residual)), uncertainties)


class _Evaluation(NamedTuple):
    """The orbit at some unknowns, all equations there, roundings of conditions, derivatives."""

    orbit: Orbit
    residual: Vector
    roundings: list[float]
    matrix: Matrix


def _newton_step(numbers: Backend, matrix: Matrix, residual: Vector) -> Vector:
    """The step of Newton's method; of more equations than unknowns some follow from the others."""
    if len(residual) == matrix.shape[1]:
        return solve(numbers, matrix, residual)
    step, _, rank, _ = np.linalg.lstsq(matrix, residual, rcond=_RANK)
    if rank < matrix.shape[1]:
        raise np.linalg.LinAlgError("dependent unknowns")
    return step
