"""A 1:2 resonance of the system: where rotations, period doublings and brute force agree."""

from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

import capsule_sym as cs
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.shooting.admissibility import rerun
from tests.orbits.branches import settled

pytestmark = pytest.mark.long

MOTION = {"alpha": 5.8, "zeta": 0.0033, "beta": 81.0, "gamma": 0.135}
RANGES = ((0.1, 0.7), (2.1, 3.0))


@lru_cache
def rotations() -> cs.results.Curve:
    """The curve of Neimark-Sacker bifurcations in delta and omega."""
    branch = cs.continue_orbit(settled(omega=2.7, delta=0.4, **MOTION), "delta", 0.3, points=4)
    (one,) = (one for one in branch.bifurcations if one.type == kinds.NEIMARK_SACKER)
    return cs.continue_bifurcation(one, "omega", RANGES, points=8)


def resonance(curve: cs.results.Curve) -> cs.results.CodimensionTwoPoint:
    (point,) = (one for one in curve.codimension_two if kinds.RESONANCE_1_2 in one.types)
    return point


def test_rotations_end_in_a_resonance() -> None:
    curve = rotations()
    point = resonance(curve)
    assert point.types == (kinds.NEIMARK_SACKER, kinds.RESONANCE_1_2)
    assert point.status == "converged"
    assert max(point.uncertainties) < 1e-12
    assert sorted(ending for ending, _ in curve.endings) == [
        cs.results.Status.CODIMENSION_TWO,
        cs.results.Status.REACHED,
    ]
    for one in curve.points:
        first, second, _ = one.multipliers
        assert first == pytest.approx(second.conjugate(), abs=1e-12)
        assert abs(first) == pytest.approx(1, abs=1e-10)
        assert first.imag != 0


def test_two_multipliers_of_the_map_are_minus_one_there() -> None:
    """By differences of runs of the map over a period, from forcing angle 0."""
    orbit = resonance(rotations()).orbit
    parameters, start = orbit.parameters, np.array(rerun(orbit).stroboscopic[1], dtype=float)

    def after(state: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array(
            cs.simulate(parameters, state.tolist(), 0.0, 1).stroboscopic[-1], dtype=float
        )

    assert after(start) == pytest.approx(start, abs=1e-9)
    sides = [[after(start + side * row) for row in 1e-6 * np.eye(3)] for side in (1, -1)]
    matrix = (np.array(sides[0]) - sides[1]).T / 2e-6
    # The capsule comes to rest: one multiplier is 0.
    assert np.poly(matrix) == pytest.approx([1, 2, 1, 0], abs=1e-5)


def test_period_doublings_pass_the_resonance() -> None:
    """Their curve meets it where a second multiplier is -1, which are other equations."""
    ranges = ((0.16, 0.3), (2.2, 2.27))
    branch = cs.continue_orbit(settled(omega=2.2, delta=0.3, **MOTION), "delta", 0.19, points=4)
    (one,) = (one for one in branch.bifurcations if one.type == kinds.PERIOD_DOUBLING)
    curve = cs.continue_bifurcation(one, "omega", ranges, points=4)
    point, there = resonance(curve), resonance(rotations())
    assert point.types == (kinds.PERIOD_DOUBLING, kinds.RESONANCE_1_2)
    errors = np.add(point.uncertainties, there.uncertainties)
    assert np.all(abs(np.subtract(point.values, there.values)) <= errors)
    # Of the two multipliers, one -1, the other is beyond -1 on one side.
    for there in curve.points:
        inside = abs(there.multipliers[0] * there.multipliers[1]) < 1
        assert inside == (there.values[1] < point.values[1])
