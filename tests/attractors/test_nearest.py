"""The nearest point of a boundary: corners by geometry, and slopes by differences of radii."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from capsule_sym import Parameters, search_orbits, solve_orbit
from capsule_sym._attractors.boundary import Basin
from capsule_sym._attractors.nearest import Place, Surface, nearest

BISTABLE = Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
Vector = NDArray[np.float64]


class Corner:
    """Motions are lost beyond all planes n x = c; c of each has a kink at the time 0.3."""

    basin = SimpleNamespace(period=1.0, length=1.0)

    def __init__(self, normals: Any, rates: Any) -> None:
        self.normals, self.rates = np.array(normals, dtype=float), np.array(rates, dtype=float)

    def _reached(self, times: Vector, directions: Vector) -> tuple[Vector, Vector, Vector]:
        """Number of the plane that a ray reaches last, and the plane's c and n d."""
        level = 1 + self.rates * abs(times[:, None] - 0.3)
        along = np.maximum(directions @ self.normals.T, 1e-3)
        last = (level / along).argmax(axis=1)
        rows = np.arange(len(times))
        return last, level[rows, last], along[rows, last]

    def radii(self, times: Vector, directions: Vector, guess: Vector) -> Vector:
        _, level, along = self._reached(times, directions)
        return level / along

    def slopes(self, times: Vector, directions: Vector, radii: Vector) -> Vector:
        last, level, along = self._reached(times, directions)
        by_time = self.rates[last] * np.sign(times - 0.3) / along
        steep = -(level / along**2)[:, None] * self.normals[last]
        steep -= np.sum(steep * directions, axis=1)[:, None] * directions
        return np.column_stack([by_time, steep])


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
    surface: Any = Corner(normals, rates)
    found = descended(surface, 0.34, np.array([0.5, 0.6, 0.7]))
    assert found.radius == pytest.approx(np.linalg.norm(corner), rel=1e-8)
    assert found.time == pytest.approx(0.3, abs=1e-8)
    np.testing.assert_allclose(found.radius * found.direction, corner, rtol=0, atol=1e-4)


# By BFGS steps alone eight of these end beside the nearest point, and by those that begin again
# along the slope where they stall four.
@pytest.mark.parametrize("seed", range(170, 200))
def test_the_nearest_point_beyond_random_planes_is_found(seed: int) -> None:
    random = np.random.default_rng(seed)
    normals = random.normal(size=(random.integers(2, 6), 3)) ** 2 + 0.02
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    surface: Any = Corner(normals, 10 ** random.uniform(-1, 2, len(normals)))
    direction = abs(random.normal(size=3))
    found = descended(surface, 0.3 + random.uniform(-0.05, 0.05), direction)
    # The least x with normals x >= 1, by Lawson's and Hanson's least distance programming.
    equations, last = np.vstack([normals.T, np.ones(len(normals))]), np.array([0, 0, 0, 1.0])
    rest = equations @ nnls(equations, last)[0] - last
    assert found.radius == pytest.approx(np.linalg.norm(rest[:3]) / abs(rest[3]), rel=1e-6)


def descended(surface: Any, time: float, direction: Vector) -> Place:
    """Nearest point from a time and a direction."""
    unit = direction / np.linalg.norm(direction)
    radius = float(surface.radii(np.array([time]), unit[None], np.ones(1))[0])
    return nearest(surface, Place(time, unit, radius), np.random.default_rng(0))


@pytest.mark.long
def test_slopes_of_the_boundary_are_differences_of_its_radii() -> None:
    orbit = solve_orbit(BISTABLE)
    (edge,) = (one for one in search_orbits(BISTABLE, 30) if abs(one.multipliers[0]) > 1)
    surface = Surface(Basin(orbit, (), None), edge, np.diag([1.0, 0.5, 2.0]))
    # On both sides of the worst time, beside the smallest knock.
    times = np.array([11.98, 12.58])
    directions = np.tile([0.9900, 0.0553, 0.0730], (2, 1))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    radii = surface.radii(times, directions, np.full(2, 0.279))
    slopes = surface.slopes(times, directions, radii)
    assert (abs(slopes[:, 0]) > 1).all()
    step = 1e-5

    def solved(moves: Vector) -> Vector:
        moved = directions + moves[1:]
        moved /= np.linalg.norm(moved, axis=1)[:, None]
        return surface.radii(times + moves[0] * BISTABLE.period, moved, radii)

    for axis, slope in zip(step * np.eye(4), slopes.T, strict=True):
        difference = (solved(axis) - solved(-axis)) / (2 * step)
        # Runs are compared some 1e-4 away from the edge state, where the map is nearly linear.
        np.testing.assert_allclose(difference, slope, rtol=1e-3, atol=1e-5)
