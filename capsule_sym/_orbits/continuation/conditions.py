"""Test functions, and orbits at which they vanish or segments have the duration 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.kinds import DURATIONS, cubic, degeneracy, quadratic
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath, PathAxis
from capsule_sym._orbits.shooting.admissibility import KINKS
from capsule_sym._orbits.shooting.equations import ROUNDINGS, Matrix, Vector, shooting, solve
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers, monodromy_matrix
from capsule_sym._orbits.shooting.taylor import monodromy_derivative

_UNIT = 2.0**-53
_ROUNDINGS = 64  # of a test function, in units of its largest terms
_COMPLEX = 1e-6  # least imaginary part of a complex multiplier
EXACT = (*kinds.SMOOTH, kinds.RESONANCE_1_1, kinds.RESONANCE_1_2)  # with an exact gradient


def evaluate_test_functions(orbit: Orbit) -> dict[str, float]:
    """Test functions of an orbit's monodromy matrix, which vanish at smooth bifurcations."""
    return of_matrix(monodromy_matrix(orbit))


def of_matrix(matrix: Matrix) -> dict[str, float]:
    """Test functions of a monodromy matrix M.

    det(M - I) at a fold, det(M + I) at a period doubling, and the product of all 1 - mu_i mu_j, i <
    j, at a Neimark-Sacker bifurcation. At a 1:1 resonance a fold has a second multiplier 1, at a
    1:2 resonance a period doubling has a second multiplier -1: the derivative of the characteristic
    polynomial vanishes.
    """
    first, second, third = _invariants(matrix)
    return {
        kinds.FOLD: float(third - second + first - 1),
        kinds.PERIOD_DOUBLING: float(1 + first + second + third),
        kinds.NEIMARK_SACKER: float(1 - second + first * third - third * third),
        kinds.RESONANCE_1_1: float(3 - 2 * first + second),
        kinds.RESONANCE_1_2: float(3 + 2 * first + second),
    }


def _invariants(matrix: Matrix) -> tuple[float, float, float]:
    """Sums of the multipliers, of products of two, and the product of all."""
    first = np.trace(matrix)
    return first, (first * first - np.trace(matrix @ matrix)) / 2, np.linalg.det(matrix)


def gradient_of_test_function(orbit: Orbit, name: str, directions: Matrix) -> Vector:
    """Gradient (n + 4 + m,) of a test function by z and along m directions of the parameters."""
    matrix = monodromy_matrix(orbit)
    first, _, third = _invariants(matrix)
    unit = np.eye(len(matrix))
    cofactors = np.cross(matrix[[1, 2, 0]], matrix[[2, 0, 1]])
    weights = {
        kinds.FOLD: (1, -1, 1),
        kinds.PERIOD_DOUBLING: (1, 1, 1),
        kinds.NEIMARK_SACKER: (third, -1, first - 2 * third),
        kinds.RESONANCE_1_1: (-2, 1, 0),
        kinds.RESONANCE_1_2: (2, 1, 0),
    }[name]
    of_invariants = unit, first * unit - matrix.T, cofactors
    by = sum(weight * one for weight, one in zip(weights, of_invariants, strict=True))
    changes = monodromy_derivative(orbit, directions)
    return np.einsum("ij,kij->k", by, changes)  # type: ignore[no-any-return]


def noise(orbit: Orbit) -> float:
    """Rounding error of the test functions at an orbit."""
    return _ROUNDINGS * _UNIT * (1 + float(np.max(abs(monodromy_matrix(orbit))))) ** 3


class Collapse(NamedTuple):
    """Itinerary without an inserted segment of duration 0, and its unknowns as a matrix times z.

    A rest of duration 0 within a drift sets the velocity to 0, where the drift alone would not:
    multipliers of the orbit on this side are those without it.
    """

    itinerary: Itinerary
    matrix: Matrix

    def orbit(self, orbit: Orbit) -> Orbit:
        """The same orbit without the segment."""
        return orbit_at(orbit.numbers, orbit.values, self.itinerary, self.matrix @ orbit.z)


class Condition(NamedTuple):
    """Test function as a condition: it has to vanish.

    A degenerate border collision needs its segment of duration 0; a cusp needs a direction `like`
    that of the fold. With `collapse` the function is that of the orbit without a segment.
    """

    name: str
    zero_segment: int | None = None
    like: Vector | None = None
    collapse: Collapse | None = None

    def at(self, orbit: Orbit) -> Orbit:
        """Orbit of which this is the test function."""
        return orbit if self.collapse is None else self.collapse.orbit(orbit)

    def value(self, orbit: Orbit) -> float:
        """Test function at an orbit."""
        orbit = self.at(orbit)
        if self.name == kinds.CUSP:
            return quadratic(orbit, self.like).term
        if self.name == kinds.GENERALIZED_DOUBLING:
            there = cubic(orbit)
            return there.term / there.by_multiplier
        if self.name == kinds.DEGENERATE and self.zero_segment is not None:
            return degeneracy(orbit, self.zero_segment)
        return evaluate_test_functions(orbit)[self.name]


def has_rotations(orbit: Orbit) -> bool:
    """True if an orbit has complex multipliers."""
    return any(abs(value.imag) > _COMPLEX for value in floquet_multipliers(orbit))


_MOST_STEPS = 20
_LARGEST_RESIDUAL = 1024  # units of rounding
_RANK = 1e-9  # singular values below this share of the largest count as zero
_DIFFERENCE = 1e-6  # of the unknowns, for the gradient of a condition


class EventSolution(NamedTuple):
    """Orbit with segments of duration 0 and conditions that hold, and the accuracy of both.

    There are as many free parameters as such segments and conditions. `residual` is the largest
    entry of the equations. `uncertainties` bound the errors of the free parameters to first order:
    the rounding of each equation times the inverse Jacobian.
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
) -> Orbit:
    """Orbit with these unknowns, which need not be a solution, in the numbers of a backend."""
    system = shooting(numbers, values, itinerary, z)
    return Orbit(tuple(values), itinerary, z, system, numbers.name)


class Evaluation(NamedTuple):
    """Equations at some unknowns: residual (m,), derivative (m, many), and the orbit there."""

    residual: Vector
    by: Matrix
    orbit: Orbit


@lru_cache(maxsize=64)
def _without(size: int, segments: tuple[int, ...]) -> NDArray[np.intp]:
    """Indices of z, of so many entries, without the durations of some segments."""
    return np.delete(np.arange(size), [DURATIONS + segment for segment in segments])


class OrbitEquations:
    """Equations of an orbit with segments of duration 0 and conditions.

    The unknowns are the other entries of z, and the coordinate of each `free` parameter: a path's
    value, or the share of an axis' range. The other parameters are those of `values`.
    """

    def __init__(
        self,
        numbers: Backend,
        values: Sequence[Number],
        free: Sequence[ParameterPath | PathAxis],
        itinerary: Itinerary,
        segments: tuple[int, ...] = (),
        conditions: Sequence[Condition] = (),
    ) -> None:
        self.numbers, self.values, self.free = numbers, values, free
        self.itinerary, self.segments, self.conditions = itinerary, segments, conditions

    @property
    def rest(self) -> NDArray[np.intp]:
        """Indices of z that are unknown."""
        return _without(DURATIONS + len(self.itinerary), self.segments)

    def unknowns(self, orbit: Orbit) -> Vector:
        """Unknowns of an orbit."""
        return np.array([*orbit.z[self.rest], *(one.share(orbit.values) for one in self.free)])

    def orbit(self, u: Vector) -> Orbit:
        """Orbit with these unknowns, which need not be a solution."""
        many, values = len(u) - len(self.free), list(self.values)
        z = u[:many]
        if self.segments:
            z = np.full(DURATIONS + len(self.itinerary), self.numbers.number(0))
            z[self.rest] = u[:many]
        for one, share in zip(self.free, u[many:], strict=True):
            values = one.placed(values, share)
        return orbit_at(self.numbers, values, self.itinerary, z)

    def evaluate(self, u: Vector) -> Evaluation:
        """Equations at u; a condition without an exact gradient has gradient 0."""
        orbit = self.orbit(u)
        system = orbit.system
        by_free = [one.by(system.by_p, orbit.values) for one in self.free]
        by = np.column_stack([system.by_z[:, self.rest], *by_free])
        residual, itself = system.residual, self._identities
        if itself:
            residual, by = np.delete(residual, itself), np.delete(by, itself, axis=0)
        if not self.conditions:
            return Evaluation(residual, by, orbit)
        values = [one.value(orbit) for one in self.conditions]
        rows = np.array([self.row(orbit, one) for one in self.conditions])
        return Evaluation(np.append(residual, values), np.vstack([by, rows]), orbit)

    @property
    def _identities(self) -> list[int]:
        """Equations that always hold: a slip of two segments of zero duration ends at rest."""
        segments = self.itinerary.segments
        return [
            k
            for k in self.segments
            if segments[k].guard is Guard.DRIFT
            and (k - 1) % len(segments) in self.segments
            and segments[k - 1].guard in KINKS
            and drift(segments[k - 1].field, self.itinerary.scene)
        ]

    def row(self, orbit: Orbit, condition: Condition) -> Vector:
        """Gradient of a test function by the unknowns; zeros if it has no exact gradient."""
        count = len(self.free)
        if condition.name not in EXACT:
            return np.zeros(len(self.rest) + count)
        unit = np.eye(len(orbit.values))
        along = np.array([one.by(unit, orbit.values) for one in self.free])
        row = gradient_of_test_function(condition.at(orbit), condition.name, along)
        by_z, by_free = np.split(row, [len(row) - count])
        if condition.collapse is not None:
            by_z = by_z @ condition.collapse.matrix
        return np.append(by_z[self.rest], by_free)


class ExtendedSystem(OrbitEquations):
    """Equations with as many free paths as segments of duration 0 and conditions.

    Conditions need double precision; there may be one too many if it follows from the others.
    """

    # Rows of conditions without an exact gradient: first differences, then Broyden's updates. Their
    # errors cost only further Newton steps.
    _rows: Matrix | None = None
    _last = _step = np.zeros(0)

    def solve(self, z: Vector) -> EventSolution | None:
        """Solution by Newton's method from z and `values`; None if there is none."""
        numbers, known = self.numbers, np.array(list(z))[self.rest]
        many = len(known)
        unknowns = np.array([*known, *(one.share(self.values) for one in self.free)])
        # Near a segment of duration 0 the derivative has an error of about unit^(1/3), by which
        # each step reduces the error. If the equations are nearly dependent, rounding moves the
        # unknowns by more: the last step is accepted if its square is rounding.
        root = numbers.sqrt(numbers.unit)
        small = root * numbers.sqrt(root)
        with np.errstate(all="ignore"):
            for iterations in range(1, _MOST_STEPS + 1):
                found = self._evaluate(unknowns)
                if not all(abs(value) < float("inf") for value in found.residual):
                    return None
                try:
                    step = _newton_step(numbers, found.by, found.residual)
                except np.linalg.LinAlgError:
                    return None
                unknowns, self._step = unknowns - step, -step
                least = small if iterations < _MOST_STEPS else root
                if max(abs(step)) <= least * (1 + max(abs(unknowns[:many]))):
                    self._rows = None
                    return self._solution(self._evaluate(unknowns), unknowns, iterations)
        return None

    def _evaluate(self, unknowns: Vector) -> Evaluation:
        found = self.evaluate(unknowns)
        inexact = [k for k, one in enumerate(self.conditions) if one.name not in EXACT]
        if inexact:
            which = [len(found.residual) - len(self.conditions) + k for k in inexact]
            conditions = [self.conditions[k] for k in inexact]
            found.by[which] = self._secants(unknowns, conditions, found.residual[which])
        return found

    def _secants(self, unknowns: Vector, conditions: list[Condition], now: Vector) -> Matrix:
        """Gradients (many, size) of conditions with the values `now`."""
        step = self._step
        if self._rows is None:
            columns = []
            for change in _DIFFERENCE * np.eye(len(unknowns)):
                ahead, behind = self.orbit(unknowns + change), self.orbit(unknowns - change)
                both = [(one.value(ahead), one.value(behind)) for one in conditions]
                columns.append([after - before for after, before in both])
            self._rows = np.array(columns).T / (2 * _DIFFERENCE)
        else:
            missed = now - self._last - self._rows @ step
            self._rows = self._rows + np.outer(missed, step) / (step @ step)
        self._last = now
        return self._rows

    def _solution(
        self, found: Evaluation, unknowns: Vector, iterations: int
    ) -> EventSolution | None:
        """Solution and its uncertainties; None if the residual is larger than rounding."""
        numbers, free, (residual, matrix, orbit) = self.numbers, len(self.free), found
        closed, off = np.split(residual, [len(residual) - len(self.conditions)])
        # Stiff stops magnify the unknowns' rounding: each equation has its own.
        rounding = ROUNDINGS * numbers.unit * (abs(matrix) @ abs(unknowns))
        least = _LARGEST_RESIDUAL * numbers.unit * (1 + max(abs(unknowns)))
        if not all(abs(closed) <= least + rounding[: len(closed)]):
            return None
        if len(off):
            rounding[len(closed) :] = [noise(one.at(orbit)) for one in self.conditions]
            if not all(abs(off) <= rounding[len(closed) :]):
                return None
        if len(residual) > len(unknowns):
            rows = np.linalg.pinv(matrix)[-free:]
        else:
            # The rows of the inverse that belong to the parameters.
            unit = np.full((len(unknowns), free), numbers.number(0))
            unit[-free:] = unit[-free:] + np.eye(free, dtype=int)
            rows = solve(numbers, matrix.T, unit).T
        uncertainties = tuple((abs(rows) @ (rounding + abs(residual))).tolist())
        orbit = replace(orbit, iterations=iterations)
        return EventSolution(orbit, self.segments, max(abs(residual)), uncertainties)


def _newton_step(numbers: Backend, matrix: Matrix, residual: Vector) -> Vector:
    """Newton step; if there are more equations than unknowns, some follow from the others."""
    if len(residual) == matrix.shape[1]:
        return solve(numbers, matrix, residual)
    step, _, rank, _ = np.linalg.lstsq(matrix, residual, rcond=_RANK)
    if rank < matrix.shape[1]:
        raise np.linalg.LinAlgError("dependent unknowns")
    return step
