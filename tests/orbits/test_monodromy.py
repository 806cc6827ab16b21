"""Derivative of the monodromy matrix by an orbit's unknowns and parameters, in fifty digits."""

import numpy as np
import pytest

from capsule_sym._map.backend import backend
from capsule_sym._orbits.shooting.orbit import evaluated
from capsule_sym._orbits.shooting.stability import monodromy_matrix
from capsule_sym._orbits.shooting.taylor import monodromy_derivative
from tests.orbits.branches import settled

# Landings that stick; that turn the drift round; with contact; short slips beside them.
MOTIONS = (
    {"alpha": 0.37, "zeta": 0.0478},
    {"alpha": 1.9},
    {"alpha": 1.2, "beta": 10.0},
    {"alpha": 1.2, "beta": 900.0},
)


@pytest.mark.parametrize("motion", MOTIONS, ids=str)
def test_a_derivative_is_that_of_differences_in_fifty_digits(motion: dict[str, float]) -> None:
    orbit = settled(**motion)
    n, found = len(orbit.z), monodromy_derivative(orbit, np.eye(7))
    with backend("mpmath") as numbers:
        step = numbers.number("1e-15")
        given = np.array([numbers.number(value) for value in (*orbit.z, *orbit.values)])

        def at(moved: np.ndarray) -> np.ndarray:
            return monodromy_matrix(evaluated(numbers, moved[n:], orbit.itinerary, moved[:n]))

        for k, unit in enumerate(np.eye(len(given), dtype=int)):
            exact = (at(given + step * unit) - at(given - step * unit)) / (2 * step)
            assert abs(found[k] - exact.astype(float)).max() < 1e-7 * (1 + abs(found[k]).max()), k
