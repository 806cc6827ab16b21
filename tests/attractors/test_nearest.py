"""The nearest point of a boundary: corners by geometry, gradients by bisected runs."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from capsule_sym import Parameters, simulate, simulate_many, solve_orbit
from capsule_sym._attractors.boundary import Basin, bisect
from capsule_sym._attractors.nearest import Knocks, nearest

BISTABLE = Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
Vector = NDArray[np.float64]


class Corner(Knocks):
    """Motions are lost beyond all planes n x = c; c of each has a kink at the time 0.3."""

    def __init__(self, normals: Any, rates: Any) -> None:
        self.normals, self.rates = np.array(normals, dtype=float), np.array(rates, dtype=float)

    def _above(self, points: Vector) -> Vector:
        levels = 1 + self.rates * abs(points[:, :1] - 0.3)
        return points[:, 1:] @ self.normals.T - levels

    def lost(self, points: Vector) -> NDArray[np.bool_]:
        return (self._above(points) >= 0).all(axis=1)

    def gradients(self, inside: Vector, outside: Vector) -> Vector:
        assert self.lost(outside).all()
        assert not self.lost(inside).any()
        crossed = self._above(inside).argmin(axis=1)
        rates = -self.rates[crossed] * np.sign(inside[:, 0] - 0.3)
        return np.column_stack([rates, self.normals[crossed]])


@pytest.mark.parametrize(
    ("normals", "rates", "corner"),
    [
        # A plane, an edge and a corner, in a time that matters for one plane or for all.
        ([[0, 0, 1]], [5], [0, 0, 1]),
        ([[1, 0, 0], [0, 1, 0]], [30, 0.1], [1, 1, 0]),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [30, 30, 30], [1, 1, 1]),
    ],
)
def test_the_nearest_point_of_a_corner_is_found(normals: Any, rates: Any, corner: Any) -> None:
    found = nearest(Corner(normals, rates), np.array([0.34, 3.0, 3.3, 3.6]))
    assert np.linalg.norm(found[1:]) == pytest.approx(np.linalg.norm(corner), rel=1e-5)
    assert found[0] == pytest.approx(0.3, abs=1e-4)
    np.testing.assert_allclose(found[1:], corner, rtol=0, atol=5e-3)


@pytest.mark.parametrize("seed", range(170, 180))
def test_the_nearest_point_beyond_random_planes_is_found(seed: int) -> None:
    random = np.random.default_rng(seed)
    normals = random.normal(size=(random.integers(2, 6), 3)) ** 2 + 0.02
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    knocks = Corner(normals, 10 ** random.uniform(-1, 2, len(normals)))
    start = np.append(0.3 + random.uniform(-0.05, 0.05), abs(random.normal(size=3)))
    while not knocks.lost(start[None])[0]:
        start[1:] *= 2
    found = nearest(knocks, start)
    assert knocks.lost(found[None])[0]
    # The least x with normals x >= 1, by Lawson's and Hanson's least distance programming.
    equations, last = np.vstack([normals.T, np.ones(len(normals))]), np.array([0, 0, 0, 1.0])
    rest = equations @ nnls(equations, last)[0] - last
    assert np.linalg.norm(found[1:]) == pytest.approx(
        np.linalg.norm(rest[:3]) / abs(rest[3]), rel=1e-5
    )


def test_bisection_takes_the_first_boundary_of_each_line_or_the_least_of_all() -> None:
    # On the lines from 0 to 1 runs are lost beyond these points, except in a gap of the first.
    lengths, ends = np.array([1.0, 2.0, 4.0]), np.array([0.3, 0.05, 0.9])

    def lost(points: Vector) -> NDArray[np.bool_]:
        number = points[:, 1].astype(int)
        share = points[:, 0] / lengths[number]
        return (share >= ends[number]) & ~((number == 0) & (share > 0.45) & (share < 0.55))

    starts = np.column_stack([np.zeros(3), np.arange(3)])
    finish = np.column_stack([lengths, np.arange(3)])
    inside, outside = bisect(lost, starts, finish, np.full(3, 1e-9))
    assert outside[:, 0] == pytest.approx(ends * lengths, abs=1e-8)
    assert (inside[:, 0] < ends * lengths).all()
    assert (outside[:, 0] >= ends * lengths).all()
    least = bisect(lost, starts, finish, np.full(3, 1e-9), every=False)[1]
    assert least[1, 0] == pytest.approx(0.1, abs=1e-8)
    assert least[:, 0].argmin() == 1


def test_gradients_of_the_boundary_are_those_of_bisected_runs() -> None:
    """Radii of the boundary by runs of the map: on both sides of a kink, just before phase 0."""
    orbit, units = solve_orbit(BISTABLE), np.diag([1.0, 0.5, 2.0])
    knocks, period = Knocks(Basin(orbit, (), None), units), BISTABLE.period
    way = np.array([0.9900, 0.0553, 0.0730]) / np.linalg.norm([0.9900, 0.0553, 0.0730])
    times = np.array([11.98 / period, 12.58 / period, 1 - 4e-8])
    points = np.column_stack([times, np.outer([0.279, 0.279, 0.5907], way)])
    pairs = knocks.neighbours(points, points[0] * [1, 2, 2, 2])
    gradients = knocks.gradients(*pairs)
    settled = simulate(BISTABLE, periods=400).final[1]
    run = simulate(BISTABLE, settled, periods=1)

    def radius(time: float, direction: Vector) -> float:
        low, high, phase = 0.9 * size, 1.1 * size, math.fmod(time, period)
        while high - low > 1e-8:
            radii = np.linspace(low, high, 64)
            states = run(phase) + radii[:, None] * (units @ direction)
            final = simulate_many([BISTABLE] * 64, states, phase, 80).states
            first = int((abs(final - settled).max(axis=1) > 1e-3).argmax())
            low, high = radii[first - 1], radii[first]
        return high

    step = 1e-4
    for point, slope in zip(pairs[1], gradients, strict=True):
        size = np.linalg.norm(point[1:])
        time, direction = point[0] * period, point[1:] / size
        assert radius(time, direction) == pytest.approx(size, rel=2e-6)
        assert slope[1:] @ direction > 0  # to the side on which the motion is lost
        ahead, back = (radius(time + way * step * period, direction) for way in (1, -1))
        expected = -slope[0] / (slope[1:] @ direction)
        assert abs(expected) > 1
        assert (ahead - back) / (2 * step) == pytest.approx(expected, rel=5e-3)
        for axis in np.eye(3):
            radii = []
            for sign in (1, -1):
                turned = direction + sign * step * axis
                radii.append(radius(time, turned / np.linalg.norm(turned)))
            aside = axis - (axis @ direction) * direction
            expected = -size * (slope[1:] @ aside) / (slope[1:] @ direction)
            assert (radii[0] - radii[1]) / (2 * step) == pytest.approx(expected, abs=2e-3)
