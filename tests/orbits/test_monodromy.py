"""Derivatives of test functions by an orbit's unknowns and parameters, against differences."""

import numpy as np
import pytest

from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation.conditions import (
    evaluate_test_functions,
    gradient_of_test_function,
)
from capsule_sym._orbits.shooting.equations import shooting
from capsule_sym.results import Orbit
from tests.orbits.branches import settled

# Landings that stick; that turn the drift round; with contact; short slips beside them.
MOTIONS = ({"alpha": 0.37, "zeta": 0.0478}, {"alpha": 1.9}, {"alpha": 1.2, "beta": 10.0})
STEP = 1e-5


@pytest.mark.parametrize("motion", MOTIONS, ids=str)
def test_gradients_of_test_functions_are_their_slopes(motion: dict[str, float]) -> None:
    orbit = settled(**motion)
    n = len(orbit.z)

    def moved(k: int, by: float) -> dict[str, float]:
        z, values = orbit.z.copy(), [*orbit.values]
        if k < n:
            z[k] += by
        else:
            values[k - n] += by
        system = shooting(numbers, values, orbit.itinerary, z)
        return evaluate_test_functions(Orbit(tuple(values), orbit.itinerary, z, system, "numpy"))

    with backend("numpy") as numbers:
        ends = [(moved(k, STEP), moved(k, -STEP)) for k in range(n + 7)]
        for name in ends[0][0]:
            slopes = [(ahead[name] - behind[name]) / (2 * STEP) for ahead, behind in ends]
            found = gradient_of_test_function(orbit, name, np.eye(7))
            assert found == pytest.approx(slopes, abs=3e-7 * max(map(abs, slopes))), name
