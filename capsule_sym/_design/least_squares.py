"""Least squares by SciPy, with a robust loss if there are outliers, and errors of the values."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.measured import about_trend
from capsule_sym._design.misfit import LOST, Misfit
from capsule_sym._map.labelled import package

LOSSES = "linear", "cauchy"
_FIRST = 0.1  # scale of the first robust loss, in standard deviations of a column
_BULK = 2.0  # scale of the robust loss, in standard deviations of the noise
_PRECISE = {"ftol": 1e-14, "xtol": 1e-12, "gtol": 1e-14}  # some roundings of doubles, 1e-16
_PART = 0.1  # share of a combination above which an unknown is not identifiable
_LEAST_SLOPE = 0.05  # least slope of a column's influence, over the mean of all columns


class Least(NamedTuple):
    """Values of the least squares; `scale` is that of Cauchy's loss, infinite without it."""

    x: Vector
    cost: float = math.inf
    success: bool = False
    message: str = ""
    scale: float = math.inf


class Errors(NamedTuple):
    """Uncertainties of a fit."""

    noise: float
    covariance: Matrix
    """(k, k)."""
    standard: Vector
    """Standard errors (k,), infinite for unknowns that are not identifiable."""
    lost: tuple[dict[str, float], ...]
    """Combinations of relative changes that are not identifiable."""
    residuals: Vector
    noise_by_column: dict[str, float]
    """Spread of each column's residuals, over that of the column about its trend."""
    autocorrelation: float
    """Lag-one correlation of the residuals within their columns, weighted by the loss."""


@np.errstate(all="ignore")
def least(
    problem: Misfit, guess: Vector, limits: tuple[Vector, Vector], loss: str, steps: int
) -> Least:
    """Least squares from a guess, by SciPy, with unknowns scaled by the Jacobian.

    The robust loss begins as soft_l1, whose minimum is easier to reach; then its scale is that of
    the residuals, and after it once more. Each time the residuals are evaluated at most `steps`
    times. `success` is False without a motion up to the last of the times.
    """
    robust, x, scale = loss == "cauchy", np.clip(guess, *limits), _FIRST
    how: dict[str, Any] = {"bounds": limits, "x_scale": "jac", "max_nfev": steps} | _PRECISE
    for stage in ("soft_l1", loss, loss) if robust else (loss,):
        found = package("scipy.optimize").least_squares(
            problem.residuals, x, problem.jacobian, loss=stage, f_scale=scale, **how
        )
        x, used = found.x, scale if robust else math.inf
        scale = _BULK * max(spread(problem.residuals(x), len(x), robust), np.finfo(float).eps)
    success = bool(found.success) and not np.any(found.fun == LOST)
    return Least(x, float(found.cost), success, str(found.message), used)


def spread(residuals: Vector, unknown: int, robust: bool) -> float:
    """Standard deviation of the residuals, after a fit of so many unknowns.

    A robust one is computed from the median of all but the smallest `unknown` - 1 residuals, since
    as many as there are unknowns could be 0 (Street, Carroll and Ruppert, Am. Stat. 42, 152, 1988).
    """
    if not robust:
        return math.sqrt(float(residuals @ residuals) / max(1, len(residuals) - unknown))
    return float(1.4826 * np.median(np.sort(np.abs(residuals))[max(0, unknown - 1) :]))


@np.errstate(all="ignore")  # of residuals whose squares overflow
def errors_of(problem: Misfit, found: Least) -> Errors:
    """Errors of the fitted values to first order, those of an M-estimator.

    They are H^-1 B H^-1, with H the sum of J^T J over the columns, each times its mean slope of
    influence, and B the same with the mean square of influence. The errors within a column are
    independent and equally distributed. The mean square uses n - k of n values; the correction for
    k unknowns is Huber's (Robust Statistics, 1981, section 7.6). For a linear loss and one column
    this is the classical covariance.
    """
    residuals, jacobian, data = problem.residuals(found.x), problem.jacobian(found.x), problem.data
    robust, column = math.isfinite(found.scale), data.column
    count, unknown = jacobian.shape
    z = (residuals / found.scale) ** 2
    influence, slope = residuals / (1 + z), (1 - z) / (1 + z) ** 2  # of Cauchy's loss
    mean, share, sizes = slope.mean(), unknown / count, np.bincount(column)
    factor = 1.0 + share * np.var(slope) / mean**2 if mean > 0 else 1.0
    slopes = np.bincount(column, slope) / sizes
    squares = np.bincount(column, influence**2) / (sizes * (1.0 - share))
    slopes = np.fmax(slopes, np.fmax(_LEAST_SLOPE * mean, 1e-300))[column]
    size = problem.sizes(found.x)
    scaled = jacobian * np.sqrt(slopes)[:, None] * size
    left, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    # Squares of smaller ones, which the covariance has, are lost in those of the largest.
    kept = singular > math.sqrt(np.finfo(float).eps) * singular[0]
    inverse = directions[kept].T / singular[kept]
    ratios = squares[column] / slopes
    middle = left[:, kept].T @ (ratios[:, None] * left[:, kept])
    covariance = factor**2 * (inverse @ middle @ inverse.T) * np.outer(size, size)
    standard = np.sqrt(np.diag(covariance))
    standard[np.any(np.abs(directions[~kept]) > _PART, axis=0)] = math.inf
    lost = tuple(dict(zip(problem.unknown, row.tolist(), strict=True)) for row in directions[~kept])
    by_column = dict[str, float]()
    for k, name in enumerate(data.names):
        own = column == k
        whole = about_trend(data.times[own], data.values[own]).std() or math.nan
        by_column[name] = spread((residuals * problem.scales)[own], 0, robust) / float(whole)
    ordered = influence[order := np.argsort(column, kind="stable")]
    along = np.diff(column[order]) == 0
    correlation = float((ordered[1:] * ordered[:-1])[along].sum() / (influence @ influence or 1.0))
    noise = spread(residuals, unknown, robust)
    return Errors(noise, covariance, standard, lost, residuals, by_column, correlation)
