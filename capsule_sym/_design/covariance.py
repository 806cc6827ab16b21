"""Covariance of a fit's values, and combinations that are not identifiable."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.least_squares import Least
from capsule_sym._design.problem import Misfit

_PART = 0.1  # share of a combination above which an unknown is not identifiable
_LEAST_SLOPE = 0.05  # least slope of a series' influence, over the mean of all series


class Errors(NamedTuple):
    """Uncertainties of a fit."""

    noise: float
    covariance: Matrix
    """(k, k)."""
    standard: Vector
    """Standard errors (k,), infinite for unknowns that are not identifiable."""
    growth: Vector
    """Growth of the sum with one unknown off by a standard error, the others refitted, (k,)."""
    singular: Vector
    """Singular values of the Jacobian by relative changes, (k,)."""
    lost: tuple[dict[str, float], ...]
    """Combinations of relative changes that are not identifiable."""


@np.errstate(all="ignore")  # of residuals whose squares overflow
def errors_of(problem: Misfit, found: Least) -> Errors:
    """Errors of the fitted values to first order, those of an M-estimator.

    They are H^-1 B H^-1, with H the sum of J^T J over the series, each times its mean slope of
    influence, and B the same with the mean square of influence. The errors within a series are
    independent and equally distributed. Both means use n - k of n values; the correction for k
    unknowns is Huber's (Robust Statistics, 1981, section 7.6). For a linear loss and one series
    this is the classical covariance. The velocity of a capsule at rest at the first time is 0
    without an error.
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
    # Squares of smaller ones, which the covariance has, are lost in those of the largest.
    kept = singular > math.sqrt(np.finfo(float).eps) * singular[0]
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


def correlation(residuals: Vector, groups: NDArray[np.int64]) -> float:
    """Lag-one correlation of residuals within their series, given by `groups`."""
    order = np.argsort(groups, kind="stable")
    along = np.diff(groups[order]) == 0
    ordered = residuals[order]
    return float((ordered[1:] * ordered[:-1])[along].sum() / (residuals @ residuals or 1.0))
