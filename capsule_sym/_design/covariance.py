"""Covariance of what a fit found, and what the measurements cannot tell."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.least_squares import Least
from capsule_sym._design.problem import Problem

_LOST = 1e-8  # a combination whose scaled singular value is below this share of the largest
_PART = 0.1  # of a combination, from which an unknown is open with it
_LEAST_SLOPE = 0.05  # of a series' mean slope of influence, of that of all
Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]


class Errors(NamedTuple):
    """What a fit leaves uncertain."""

    noise: float
    covariance: Matrix
    """(k, k)."""
    standard: Vector
    """Standard errors (k,), infinite for what is open."""
    growth: Vector
    """The sum's growth where one of the unknown is a standard error off, the others fitted, (k,)"""
    singular: Vector
    """Singular values of the Jacobian by relative changes, (k,)."""
    lost: tuple[dict[str, float], ...]
    """Relative changes that the measurements cannot tell from none."""


def errors_of(problem: Problem, found: Least) -> Errors:
    """Errors of the values that fit best, to first order: those of an M-estimator.

    H^-1 B H^-1 with H the sum of J^T J over the series, each times its mean slope of influence, and
    B with its mean square of influence in place of that; the errors of a series are alike and
    independent. Both means count n - k values of n, and the correction for k unknown is Huber's
    (Robust Statistics, 1981, section 7.6). With a linear loss and one series it is the classical
    covariance. The velocity of a capsule that rests at the first time is 0 without an error.
    """
    count, unknown = found.jac.shape
    free = np.flatnonzero(~problem.resting(found.x))
    noise = found.loss.spread(found.residuals, unknown)
    influence, slope = found.loss.influence(found.residuals)
    mean, share = slope.mean(), unknown / count
    factor = 1.0 + share * np.var(slope) / mean**2 if mean > 0 else 1.0
    sizes = np.bincount(problem.groups)
    slopes = np.bincount(problem.groups, slope) / sizes
    squares = np.bincount(problem.groups, influence**2) / (sizes * (1.0 - share))
    least = np.fmax(_LEAST_SLOPE * mean, 1e-300)
    slopes = np.fmax(slopes, least)[problem.groups]
    size = problem.sizes(found.x)[free]
    scaled = found.jac[:, free] * np.sqrt(slopes)[:, None] * size
    left, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    kept = singular > _LOST * singular[0]
    inverse = directions[kept].T / singular[kept]
    ratios = squares[problem.groups] / slopes
    middle = left[:, kept].T @ (ratios[:, None] * left[:, kept])
    own = factor**2 * (inverse @ middle @ inverse.T) * np.outer(size, size)
    covariance, growth = np.zeros((unknown, unknown)), np.ones(unknown)
    covariance[np.ix_(free, free)] = own
    standard = np.sqrt(np.diag(covariance))
    flat = np.sum(inverse**2, axis=1) * size**2
    growth[free] = np.divide(np.diag(own), flat, out=np.ones(len(free)), where=flat > 0)
    standard[free[np.any(np.abs(directions[~kept]) > _PART, axis=0)]] = math.inf
    names = [problem.unknown[k] for k in free]
    lost = [dict(zip(names, row.tolist(), strict=True)) for row in directions[~kept]]
    return Errors(noise, covariance, standard, growth, singular, tuple(lost))
