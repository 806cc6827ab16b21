"""Newton's method on a problem whose constraint is curved, beside SciPy's solver."""

import numpy as np
import pytest
from scipy.optimize import minimize

from capsule_sym._design.program import Place
from capsule_sym._design.stationary import stationary

CENTRE, RADIUS, TARGET = np.array([0.5, 0.3, 0.4]), 0.25, np.array([0.9, 0.5, 0.8])


def objective(u):
    return float(np.exp(u[2] - u[0]) * (u - TARGET) @ (u - TARGET))


def slack(u):
    return RADIUS**2 - float((u - CENTRE) @ (u - CENTRE))


class Sphere:
    """The objective within a sphere; it counts its calls."""

    def __init__(self) -> None:
        self.calls = 0

    def by_u(self, rows):
        return rows

    def at(self, u):
        self.calls += 1
        weight = np.exp(u[2] - u[0])
        by = 2 * weight * (u - TARGET) + objective(u) * np.array([-1.0, 0.0, 1.0])
        slacks = np.array([slack(u)])
        return Place(u, None, objective(u), by, slacks, -2 * (u - CENTRE)[None])


@pytest.fixture(scope="module")
def expected():
    limit = {"type": "ineq", "fun": slack}
    return minimize(objective, CENTRE, constraints=limit, tol=1e-15, method="SLSQP")


def test_newton_converges_along_a_curved_constraint(expected) -> None:
    model = Sphere()
    found = stationary(model, model.at(np.array([0.72, 0.4, 0.6])))
    assert found.kkt_satisfied
    assert found.residual < 5e-13
    assert model.calls <= 40
    np.testing.assert_allclose(found.place.u, expected.x, atol=1e-7)
    assert found.multipliers[0] > 0.1


class Bowl:
    """The squared distance from a place beyond the upper bound of the first variable."""

    def by_u(self, rows):
        return rows

    def at(self, u):
        apart = u - np.array([2.0, 0.3])
        return Place(u, None, float(apart @ apart), 2 * apart, np.empty(0), np.empty((0, 2)))


def test_a_minimum_at_an_upper_bound_has_the_slope_there_as_its_multiplier() -> None:
    model = Bowl()
    found = stationary(model, model.at(np.array([1 - 1e-7, 0.25])))
    assert found.kkt_satisfied
    assert found.place.u == pytest.approx([1.0, 0.3], abs=1e-9)
    assert found.bounds == pytest.approx([2.0, 0.0], abs=1e-9)
