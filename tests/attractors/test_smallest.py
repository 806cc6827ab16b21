"""The smallest knock near one that loses a motion: corners by geometry; bisection of lines."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from capsule_sym._attractors.smallest import ACCURACY, WIDTH, KnockSearch
from capsule_sym.results import Status

Vector = NDArray[np.float64]


class Corner(KnockSearch):
    """Motions are lost beyond all planes n x = c; c of each has a kink at the time 0.3."""

    def __init__(self, normals: Any, rates: Any, start: Vector) -> None:
        self.normals, self.rates = np.array(normals, dtype=float), np.array(rates, dtype=float)
        self.random, self.tried, self.best = np.random.default_rng(0), 0, None
        self._polish(start[None], WIDTH)

    def stays_lost(self, points: Vector) -> bool:
        return bool(self.lost(points).all())

    def lost(self, points: Vector) -> NDArray[np.bool_]:
        levels = 1 + self.rates * abs(points[:, :1] - 0.3)
        return (points[:, 1:] @ self.normals.T >= levels).all(axis=1)


@pytest.mark.parametrize(
    ("normals", "rates", "corner"),
    [
        # A plane, an edge and a corner, in a time that matters for one plane or for all.
        ([[0, 0, 1]], [5], [0, 0, 1]),
        ([[1, 0, 0], [0, 1, 0]], [30, 0.1], [1, 1, 0]),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [30, 30, 30], [1, 1, 1]),
    ],
)
def test_the_smallest_knock_at_a_corner_is_found(normals: Any, rates: Any, corner: Any) -> None:
    found = Corner(normals, rates, np.array([0.34, 3.0, 3.3, 3.6]))
    assert found.radius == pytest.approx(np.linalg.norm(corner), rel=ACCURACY)
    assert found.best[0] == pytest.approx(0.3, abs=1e-3)
    np.testing.assert_allclose(found.best[1:], corner, rtol=0, atol=2e-2)


@pytest.mark.parametrize("seed", range(170, 180))
def test_the_smallest_knock_beyond_random_planes_is_found(seed: int) -> None:
    random = np.random.default_rng(seed)
    normals = random.normal(size=(random.integers(2, 6), 3)) ** 2 + 0.02
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    start = np.append(0.3 + random.uniform(-0.05, 0.05), abs(random.normal(size=3)))
    start[1:] *= 1e4
    found = Corner(normals, 10 ** random.uniform(-1, 2, len(normals)), start)
    assert found.lost(found.best[None])[0]
    # The least x with normals x >= 1, by Lawson's and Hanson's least distance programming.
    equations, last = np.vstack([normals.T, np.ones(len(normals))]), np.array([0, 0, 0, 1.0])
    rest = equations @ nnls(equations, last)[0] - last
    least = np.linalg.norm(rest[:3]) / abs(rest[3])
    assert found.radius == pytest.approx(least, rel=ACCURACY)
    assert found.radius > least * (1 - 1e-12)


class Wall(Corner):
    """Motions are lost beyond the plane v_r = 0.01 at all times; notes what is tried inside."""

    def __init__(self, largest: float) -> None:
        self.normals, self.rates, self.units = np.array([[0.0, 100, 0]]), np.zeros(1), np.eye(3)
        self.random, self.tried, self.best = np.random.default_rng(0), 0, None
        self.turns, self.largest, self.radius = 1, largest, 1e-5
        self.status, self.inside = Status.TIME_LIMIT, list[int]()

    def _smallest(self, points: Vector, radii: Any, width: float = WIDTH) -> Any:
        if np.ndim(radii) and (radii < self.radius * (1 - ACCURACY / 2)).all():
            self.inside.append(len(points))
        return super()._smallest(points, radii, width)


def test_a_search_ends_after_as_many_smaller_knocks_as_are_asked_for() -> None:
    search, told = Wall(1.0), list[str]()
    search.run(1000, told.append)
    assert search.status is Status.FOUND
    assert search.radius == pytest.approx(0.01, rel=ACCURACY)
    np.testing.assert_allclose(search.best[1:], [0.0, 0.01, 0.0], rtol=0, atol=2e-4)
    assert sum(search.inside) == 1000
    assert told[-1].startswith("a knock of 0.01")


def test_a_search_ends_at_the_largest_size() -> None:
    search = Wall(0.009)
    search.run(1000, lambda said: None)
    assert (search.status, search.radius, search.best) == (Status.NOT_LOST, 0.009, None)


def test_bisection_takes_the_first_boundary_of_a_line() -> None:
    """Of lines from 0, runs are lost beyond a point, except in a gap farther on."""
    search = Corner([[1, 0, 0]], [0], np.array([0.3, 3.0, 0.0, 0.0]))
    for length, end in ((1.0, 0.3), (2.0, 0.05), (4.0, 0.9)):

        def lost(points: Vector, length: float = length, end: float = end) -> NDArray[np.bool_]:
            share = points[:, 1] / length
            return (share >= end) & ~((share > end + 0.2) & (share < end + 0.3))

        search.lost = lost
        outside = search._bisected(np.array([0.2, length, 0.0, 0.0]), 1e-9)
        assert outside == pytest.approx([0.2, end * length, 0.0, 0.0], abs=1e-8)
        assert end * length <= outside[1]


def test_knocks_beside_the_end_of_the_period_are_near_to_those_at_its_begin() -> None:
    search = KnockSearch.__new__(KnockSearch)
    search.turns = 2
    points = np.array([[1.99, 1.0, 0.0], [0.1, 2.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    apart = search._apart(points, [np.array([0.01, 1.0, 0.0])])
    assert apart.tolist() == [[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
