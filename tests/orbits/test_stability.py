"""Monodromy, multipliers and exponents, against finite differences that know nothing of them."""

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from numpy.typing import NDArray

import capsule_sym as cs
from capsule_sym._orbits.shooting import stability
from capsule_sym._orbits.shooting.stability import field
from tests.orbits.branches import settled

# All three directions alive, drift reversed at once, stick once and twice, at phase 0 and not.
ALPHAS = (1.9, 1.5, 1.2, 0.7, 0.45)
MOST_LONG = [*ALPHAS[:2], *(pytest.param(a, marks=pytest.mark.long) for a in ALPHAS[2:])]


def at_phase_0(orbit: cs.results.Orbit) -> tuple[list[float], int]:
    """State of the orbit at phase 0, and how many directions it can be moved in: 2 in stick."""
    run = cs.simulate(orbit.parameters, list(orbit.z[:3]), orbit.z[3] / orbit.parameters.omega, 1)
    state = [float(value) for value in run.final[1]]
    assert cs.simulate(orbit.parameters, state, 0.0, 1).final[1] == pytest.approx(state, abs=1e-13)
    return state, 2 if state[2] == 0.0 else 3


def differences(
    final: Callable[[list[Any]], Any], state: list[Any], size: int, step: Any
) -> NDArray[Any]:
    """Central differences of a map of states, in its own number system, shape (3, size)."""
    columns = []
    for j in range(size):
        ends = []
        for side in (1, -1):
            start = list(state)
            start[j] = start[j] + side * step
            ends.append((start[j], np.array(final(start)[:3])))
        columns.append((ends[0][1] - ends[1][1]) / (ends[0][0] - ends[1][0]))
    return np.array(columns).T


@pytest.mark.long
@pytest.mark.parametrize("alpha", MOST_LONG)
def test_monodromy_is_the_derivative_of_the_50_digit_map(alpha: float) -> None:
    orbit = settled(alpha=alpha)
    state, size = at_phase_0(orbit)

    def final(start: list[float]) -> list[Any]:
        return list(cs.simulate(orbit.parameters, start, periods=1, backend="mpmath").final[1])

    # The starts are doubles, used exactly; a central difference is off by the step squared.
    with mp.workdps(60):
        slopes = differences(final, state, size, 2.0**-24).astype(float)
    exact = cs.orbits.jacobian(cs.simulate(orbit.parameters, state, periods=1))
    assert np.max(abs(slopes - exact[:, :size])) < 1e-12 * np.max(abs(exact))
    found = np.linalg.eigvals(exact[:size, :size])
    found = found[np.argsort(-abs(found), kind="stable")]
    assert np.sort_complex(cs.orbits.floquet_multipliers(orbit)[:size]) == pytest.approx(
        np.sort_complex(found), abs=1e-13
    )


@pytest.mark.parametrize("alpha", ALPHAS)
def test_monodromy_agrees_with_the_orbit_equations(alpha: float) -> None:
    """The durations are eliminated from the equations by their own guards."""
    orbit = settled(alpha=alpha)
    system, n = orbit.system, len(orbit.itinerary)
    # A deviation of the start moves every switch so that its guard still vanishes ...
    by_start, by_h = system.by_z[:n, :3], system.by_z[:n, 4:]
    h_by = -np.linalg.solve(by_h, by_start)
    end_by = system.flows[-1].end_by
    end = end_by[:, :3] + end_by[:, 4 : n + 4] @ h_by
    # ... and the end is reached at another time: the next segment makes up for it.
    first = system.flows[0]
    speed = field(first.c, first.start, math.cos(first.angle))
    expected = end - np.outer(speed, h_by.sum(axis=0))
    assert np.max(abs(cs.orbits.monodromy_matrix(orbit) - expected)) < 1e-11 * np.max(abs(expected))


@pytest.mark.parametrize("alpha", ALPHAS)
def test_stick_takes_one_multiplier_away(alpha: float) -> None:
    values = cs.orbits.floquet_multipliers(settled(alpha=alpha))
    assert (values[2] == 0) == (alpha < 1.7)
    assert abs(values[0]) < 1


def test_multipliers_of_stick_are_those_of_the_oscillator() -> None:
    """exp((-zeta +- i sqrt(1 - zeta^2)) T) for the inner mass on its spring."""
    orbit = settled(alpha=0.005)
    parameters = orbit.parameters
    root = complex(-parameters.zeta, math.sqrt(1 - parameters.zeta**2))
    expected = [
        cmath.exp(root * parameters.period),
        cmath.exp(root.conjugate() * parameters.period),
    ]
    assert np.sort_complex(cs.orbits.floquet_multipliers(orbit)[:2]) == pytest.approx(
        np.sort_complex(expected)
    )
    assert cs.orbits.floquet_multipliers(orbit)[2] == 0


@pytest.mark.long
@pytest.mark.parametrize("alpha", MOST_LONG)
def test_exponents_along_an_orbit_are_those_of_its_multipliers(alpha: float) -> None:
    orbit = settled(alpha=alpha)
    state, _ = at_phase_0(orbit)
    run = cs.simulate(orbit.parameters, state, periods=400)
    with np.errstate(divide="ignore"):
        expected = np.log(abs(cs.orbits.floquet_multipliers(orbit))) / orbit.parameters.period
    # The contribution of the first periods decays as one over the run's length.
    assert cs.orbits.lyapunov_exponents(run) == pytest.approx(expected, abs=2e-3)
    assert cs.orbits.lyapunov_exponents(run, transient=100) == pytest.approx(expected, abs=2e-3)


def test_largest_exponent_of_chaos_is_the_rate_at_which_neighbours_part() -> None:
    parameters = cs.Parameters(alpha=2.5, omega=3.0, delta=0.2, zeta=0.01, beta=50.0, gamma=3.0)
    state = np.array(cs.simulate(parameters, periods=100).final[1])
    periods, distance, parted = 150, 1e-8, 0.0
    run = cs.simulate(parameters, state.tolist(), periods=periods)
    along = np.array([1.0, 0.0, 0.0])
    for mark in run.stroboscopic[1:]:
        ends = [
            np.array(cs.simulate(parameters, (state + side * along).tolist(), periods=1).final[1])
            for side in (distance / 2, -distance / 2)
        ]
        apart = ends[0] - ends[1]
        parted += math.log(np.linalg.norm(apart) / distance)
        state, along = np.array(mark), apart / np.linalg.norm(apart)
    largest = cs.orbits.lyapunov_exponents(run)[0] * periods * parameters.period
    assert largest > 10
    # The first vector of a frame that starts with the same direction grows alike.
    assert largest == pytest.approx(parted, abs=0.01)


def test_exponents_of_a_long_rest_do_not_underflow() -> None:
    run = cs.simulate(cs.Parameters(alpha=0.005), periods=3000)
    assert cs.orbits.lyapunov_exponents(run)[:2] == pytest.approx([-0.05, -0.05], abs=1e-5)


@pytest.mark.parametrize("zeta", [0.3, 1.0, 2.5, 10.0, 1e4])
def test_exponents_of_a_strongly_damped_rest_sum_to_its_contraction(zeta: float) -> None:
    run = cs.simulate(cs.Parameters(0.5, delta=1e6, zeta=zeta, f_b=1e6), periods=300)
    largest = -1 / (zeta + math.sqrt(zeta**2 - 1)) if zeta > 1 else -zeta
    for transient in (0, 20):  # within the only segment
        values = cs.orbits.lyapunov_exponents(run, transient)
        assert values[:2].sum() == pytest.approx(-2 * zeta, rel=1e-13)
        assert values[0] == pytest.approx(largest, abs=6e-3)
        assert values[2] == -math.inf


def test_exponents_of_a_strongly_damped_drift_are_its_rates() -> None:
    parameters = cs.Parameters(0.5, delta=1e6, zeta=8.0, gamma=0.1, f_b=1e-3)
    run = cs.simulate(parameters, (0.0, 0.0, 1e3), periods=40)
    assert len(run.segments) == 1
    sigma, root = 88.0, math.sqrt(88.0**2 - 11)
    expected = [0.0, -11 / (sigma + root), -sigma - root]
    values = cs.orbits.lyapunov_exponents(run)
    assert values.sum() == pytest.approx(-2 * sigma, rel=1e-13)
    assert values == pytest.approx(expected, rel=3e-4, abs=1e-3)  # one over the run's length


def test_sum_of_exponents_without_stick_is_the_contraction() -> None:
    """Liouville: the flow contracts at the trace -2 zeta (gamma + 1)/gamma, rest apart."""
    orbit = settled(alpha=1.9)
    contraction = 1.0
    flows = orbit.system.flows
    for flow, following in zip(flows, flows[1:] + flows[:1], strict=True):
        contraction *= math.exp(-2 * flow.c.sigma * flow.h)
        if flow.c.drift != following.c.drift:
            cosine = math.cos(flow.angle + flow.c.omega * flow.h)
            before = field(flow.c, flow.end, cosine)[2]
            contraction *= field(following.c, flow.end, cosine)[2] / before
    assert np.linalg.det(cs.orbits.monodromy_matrix(orbit)) == pytest.approx(contraction, rel=1e-12)


def test_without_saltation_the_monodromy_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    orbit = settled(alpha=1.9).refined()
    right = cs.orbits.monodromy_matrix(orbit)
    monkeypatch.setattr(stability, "saltation_matrix", lambda *_: np.eye(3))
    assert np.max(abs(cs.orbits.monodromy_matrix(orbit) - right)) > 0.01


def test_transient_longer_than_the_run_is_refused() -> None:
    for transient in (3, 10):
        with pytest.raises(cs.InvalidInput, match="transient"):
            cs.orbits.lyapunov_exponents(cs.simulate(cs.Parameters(), periods=3), transient)
