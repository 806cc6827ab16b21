"""Entropy and uncertainty exponent of basins with known theoretical values."""

import math

import numpy as np
import pytest

from capsule_sym import InvalidInput, basin_entropy, uncertainty_exponent


def cantor(levels: int) -> np.ndarray:
    """Middle thirds on a line, numbered by the parity of the level at which they are removed."""
    numbers = np.zeros(3**levels, int)
    for level in range(levels):
        middle = np.arange(3**levels) // 3 ** (levels - 1 - level) % 3 == 1
        numbers = np.where(middle & (numbers == 0), 1 + level % 2, numbers)
    # The remainder is as uncertain as the finer levels would be.
    return np.where(numbers == 0, np.random.default_rng(0).integers(1, 3, 3**levels), numbers)


def test_a_smooth_boundary_has_the_exponent_1():
    plane = np.zeros((200, 160), int)
    plane[:, 80:] = 1
    found = uncertainty_exponent(plane)
    assert found.exponent == pytest.approx(1.0, abs=1e-12)
    assert found.dimension == pytest.approx(1.0, abs=1e-12)
    # The border stands in every row; of the inner cells two lie within a distance of 1.
    np.testing.assert_allclose(found.fractions, 2 * found.distances / (160 - 2 * 16))


def test_a_disc_has_a_smooth_boundary():
    x, y = np.meshgrid(*2 * [np.linspace(-1, 1, 400)])
    assert uncertainty_exponent(x**2 + y**2 < 0.3).exponent == pytest.approx(1.0, abs=0.02)


def test_the_exponent_of_a_cantor_set_is_that_of_its_dimension():
    found = uncertainty_exponent(cantor(12), distances=[3**k for k in range(2, 8)])
    assert found.exponent == pytest.approx(1 - math.log(2) / math.log(3), abs=0.005)
    assert found.dimension == pytest.approx(math.log(2) / math.log(3), abs=0.005)
    assert found.error < 0.005


def test_cells_of_chance_stay_uncertain_at_all_distances():
    plane = np.random.default_rng(1).integers(0, 3, (300, 300))
    assert uncertainty_exponent(plane).exponent == pytest.approx(0.0, abs=0.01)


def test_the_entropy_of_two_half_planes_is_that_of_the_boxes_between():
    plane = np.zeros((255, 255), int)
    plane[:, 127:] = 7
    found = basin_entropy(plane)
    one = -(0.4 * math.log(0.4) + 0.6 * math.log(0.6))
    assert found.boundary_entropy == pytest.approx(one)
    assert found.entropy == pytest.approx(one / 51)
    assert (found.boxes, found.boundary_boxes) == (51 * 51, 51)


def test_the_entropy_of_one_attractor_is_0_and_of_a_chessboard_ln_2():
    alone = basin_entropy(np.full((12, 12, 12), -1), 3)
    assert alone.entropy == 0
    assert math.isnan(alone.boundary_entropy)
    board = np.indices((20, 20)).sum(axis=0) % 2
    assert basin_entropy(board, 2).entropy == pytest.approx(math.log(2))
    # Of k attractors at random, in boxes large enough, it comes to ln k.
    random = basin_entropy(np.random.default_rng(0).integers(0, 4, (400, 400)), 100)
    assert random.entropy == pytest.approx(math.log(4), abs=1e-3)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: basin_entropy(np.zeros((4, 4)), 5), "side"),
        (lambda: basin_entropy(3), "numbers"),
        (lambda: basin_entropy(np.zeros((4, 4)), 1), "side"),
        (lambda: uncertainty_exponent(np.zeros((40, 40))), "boundary"),
        (lambda: uncertainty_exponent(np.zeros((4, 4))), "numbers"),
        (lambda: uncertainty_exponent(np.eye(40), [1]), "distances"),
        (lambda: uncertainty_exponent(np.eye(40), [1, 30]), "distances"),
    ],
)
def test_bad_input_is_refused(call, named):
    with pytest.raises(InvalidInput, match=named):
        call()
