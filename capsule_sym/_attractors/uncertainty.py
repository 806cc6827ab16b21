"""Uncertainty of a run's attractor if its start is known with limited precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import check_count
from capsule_sym._map.labelled import package

_SHARE = 8  # of a grid's shortest side, the largest distance


class BasinEntropy(NamedTuple):
    """Entropy of a basin in boxes of cells, dimensionless, in nats (Daza et al. 2016).

    `entropy` is the mean over all boxes: 0 for a basin of one attractor, at most the logarithm of
    their number. `boundary_entropy` is the mean over the boxes with cells of more than one
    attractor, nan if there is none; above ln 2 it indicates a fractal boundary.
    """

    entropy: float
    boundary_entropy: float
    boxes: int
    boundary_boxes: int


class UncertaintyExponent(NamedTuple):
    """Growth of the fraction of uncertain cells with the distance (Grebogi et al. 1983).

    It grows as distance^exponent: 1 for a smooth boundary, less for a fractal one. `dimension` is
    the estimate of the boundary's dimension, the grid's number of axes less the exponent; `error`
    is the standard error of the fit. `distances` are in cells, shape (k,); `fractions`, shape (k,),
    are those of cells with a neighbour of another number at this distance along an axis.
    Dimensionless.
    """

    exponent: float
    error: float
    dimension: float
    distances: NDArray[np.int64]
    fractions: NDArray[np.float64]


def basin_entropy(numbers: ArrayLike, side: int = 5) -> BasinEntropy:
    """Entropy of a basin, dimensionless, from the attractor number of each cell.

    `numbers`, shape (n, ...), are those of `run_basin`; cells without attractor count as one
    further attractor. The boxes have `side` cells along each axis; cells that fill no box are
    omitted. Raises InvalidInput for an array without axes, and for a side that does not fit.
    """
    cells = np.asarray(numbers)
    if cells.ndim == 0 or cells.size == 0:
        raise InvalidInput("numbers", cells.shape, "an array with cells")
    check_count("side", side, 2, min(cells.shape))
    cells = cells[tuple(slice(n // side * side) for n in cells.shape)]
    split = cells.reshape([part for n in cells.shape for part in (n // side, side)])
    within = tuple(range(1, split.ndim, 2))
    entropy = np.zeros(split.shape[::2])
    for one in np.unique(cells).tolist():
        share = (split == one).mean(axis=within)
        entropy -= share * np.log(np.where(share > 0, share, 1.0))
    entropy += 0.0  # not -0
    mixed = split.max(axis=within) != split.min(axis=within)
    boundary = float(entropy[mixed].mean()) if mixed.any() else math.nan
    return BasinEntropy(float(entropy.mean()), boundary, entropy.size, int(mixed.sum()))


def uncertainty_exponent(
    numbers: ArrayLike, distances: Sequence[int] | None = None
) -> UncertaintyExponent:
    """Uncertainty exponent of a basin's boundary, dimensionless, by linear regression.

    `numbers`, shape (n, ...), are the attractor numbers of the cells of a grid, as of `run_basin`.
    `distances` are in cells, by default 1, 2, 4, ... to an eighth of the grid. Raises InvalidInput
    for distances that do not fit, and if no cell is uncertain.
    """
    cells = np.asarray(numbers)
    if cells.ndim == 0 or min(cells.shape) < 2 * _SHARE:
        raise InvalidInput("numbers", cells.shape, f"a grid of {2 * _SHARE} cells an axis or more")
    if distances is None:
        most = min(cells.shape) // _SHARE
        distances = [2**k for k in range(most.bit_length())]
    chosen = np.array(sorted(set(distances)))
    if len(chosen) < 2:
        raise InvalidInput("distances", distances, "two or more")
    for one in chosen.tolist():
        check_count("distances", one, 1, (min(cells.shape) - 1) // 2)
    # The cells are the same at all distances: those with neighbours at the largest one.
    rim = int(chosen[-1])
    inner = tuple(slice(rim, n - rim) for n in cells.shape)
    fractions = []
    for one in chosen.tolist():
        uncertain = np.zeros(cells[inner].shape, bool)
        for axis, way in product(range(cells.ndim), (-one, one)):
            uncertain |= np.roll(cells, way, axis)[inner] != cells[inner]
        fractions.append(float(uncertain.mean()))
    if not fractions[0]:
        raise InvalidInput("numbers", cells.shape, "of a basin with a boundary within")
    fit = package("scipy.stats").linregress(np.log(chosen), np.log(fractions))
    slope = float(fit.slope)
    given = slope, float(fit.stderr), cells.ndim - slope
    return UncertaintyExponent(*given, chosen, np.array(fractions))
