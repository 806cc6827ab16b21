"""Proofs about all motions, against motions of the map."""

from __future__ import annotations

import numpy as np
import pytest

from capsule_sym import Parameters, simulate
from paper.claims import every_motion
from paper.claims.every_motion import ENERGY, tends_to_one_orbit

STARTS = [(0.0, 0.0, 0.0), (1.5, -0.7, 2.0), (-3.0, 2.0, -1.0)]


def energies(parameters: Parameters, one, other, periods: int) -> np.ndarray:
    times = np.linspace(0.0, periods * parameters.period, 40 * periods)
    x, v, c = (
        simulate(parameters, one, periods=periods)(times)
        - simulate(parameters, other, periods=periods)(times)
    ).T
    return (x**2 + (v + c) ** 2 + parameters.gamma * c**2) / 2


@pytest.mark.parametrize("start", STARTS[1:])
@pytest.mark.parametrize("alpha", [0.3, 1.6])
def test_without_the_second_spring_motions_approach_each_other(alpha: float, start) -> None:
    found = energies(Parameters(alpha=alpha, beta=0.0), STARTS[0], start, 150)
    assert np.all(np.diff(found) < 1e-12)
    assert found[-1] < 1e-10 * found[0]


def test_with_it_they_do_not_at_every_instant() -> None:
    found = energies(Parameters(alpha=1.6), STARTS[0], (0.01, 0.0, 0.0), 5)
    assert np.any(np.diff(found) > 1e-6)


@pytest.mark.parametrize("beta", [0.0, 1.5])
def test_a_motion_from_far_away_comes_into_the_bounded_set(beta: float) -> None:
    """The bound with the springs' energy at most that on the ellipse on which it may still grow."""
    p = Parameters(alpha=1.2, beta=beta)
    m, push = 1 + 1 / p.gamma, p.alpha + p.f_b / p.gamma
    run = simulate(p, (40.0, -20.0, 15.0), periods=400)
    times = np.linspace(300.0, 400.0, 4000) * p.period
    x, v, c = run(times).T

    def bound(x, v):
        springs = x**2 / 2 + p.beta / 2 * np.maximum(x - p.delta, 0) ** 2
        return v**2 / 2 + (v + 2 * m * p.zeta * x) ** 2 / 2 + 2 * m * springs

    # On the ellipse |v| and |x| are at most their middle and the root of what is left over.
    left = push**2 / (2 * m * p.zeta) + push**2 * p.zeta / 2
    speed = push / (2 * m * p.zeta) + (left / (2 * m * p.zeta)) ** 0.5
    reach = push / (2 * m) + (left / (2 * m**2 * p.zeta)) ** 0.5
    assert np.all(bound(x, v) <= bound(reach, speed))
    assert np.max(np.abs(c)) < 15.0


@pytest.mark.long
def test_the_argument_needs_each_of_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    assert tends_to_one_orbit(ENERGY)
    for step in ("_rigid", "_momentum", "_brakes"):
        with monkeypatch.context() as patch:
            patch.setattr(every_motion, step, lambda *_: False)
            assert not tends_to_one_orbit(ENERGY)


@pytest.mark.parametrize("start", [(0.1, 0.2, 1.5), (-0.3, 0.4, -0.7)])
def test_the_capsule_comes_to_rest_as_told(start) -> None:
    """The rate of W along motions with and without contact and drift, by differences."""
    p = Parameters(alpha=0.3)
    run = simulate(p, start, periods=2)
    times = np.linspace(0.01, 2 * p.period - 0.01, 400)

    def bound(time: np.ndarray) -> np.ndarray:
        x, v, c = run(time).T
        springs = x**2 / 2 + p.beta / 2 * np.maximum(x - p.delta, 0) ** 2
        u = v + c
        return u**2 / 2 + p.gamma * c**2 / 2 + springs + p.zeta * x * u + (p.zeta * x) ** 2

    x, v, c = run(times).T
    spring = x + p.beta * np.maximum(x - p.delta, 0)
    told = p.alpha * np.cos(p.omega * times) * (v + c + p.zeta * x) - p.zeta * v**2
    told += p.zeta * v * c - p.zeta * x * spring - p.f_b * abs(c)
    step = 1e-5
    found = (bound(times + step) - bound(times - step)) / (2 * step)
    assert np.any(c > 0.1) or np.any(c < -0.1)
    assert np.median(abs(found - told)) < 1e-9
    assert np.max(abs(found - told)) < 1e-4  # a switch within a difference
