"""Test functions of orbits: each vanishes at a bifurcation, or at a degenerate one, of its type."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.continuation.points.normal_forms import cubic, degeneracy, quadratic
from capsule_sym._orbits.shooting.equations import Matrix, Vector
from capsule_sym._orbits.shooting.monodromy import monodromy_derivative
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers, monodromy_matrix

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


def gradient_of_test_function(
    numbers: Backend, orbit: Orbit, name: str, directions: Matrix
) -> Vector:
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
    changes = monodromy_derivative(numbers, orbit, directions)
    return np.einsum("ij,kij->k", by, changes)  # type: ignore[no-any-return]


def noise(orbit: Orbit) -> float:
    """Rounding error of the test functions at an orbit."""
    return _ROUNDINGS * _UNIT * (1 + float(np.max(abs(monodromy_matrix(orbit))))) ** 3


class Condition(NamedTuple):
    """Test function as a condition: it has to vanish.

    A degenerate border collision needs its segment of duration 0; a cusp needs a direction `like`
    that of the fold.
    """

    name: str
    zero_segment: int | None = None
    like: Vector | None = None

    def value(self, numbers: Backend, orbit: Orbit) -> float:
        """Test function at an orbit."""
        if self.name == kinds.CUSP:
            return quadratic(numbers, orbit, self.like).term
        if self.name == kinds.GENERALIZED_DOUBLING:
            there = cubic(numbers, orbit)
            return there.term / there.by_multiplier
        if self.name == kinds.DEGENERATE and self.zero_segment is not None:
            return degeneracy(numbers, orbit, self.zero_segment)
        return evaluate_test_functions(orbit)[self.name]


def has_rotations(orbit: Orbit) -> bool:
    """True if an orbit has complex multipliers."""
    return any(abs(value.imag) > _COMPLEX for value in floquet_multipliers(orbit))
