"""Least squares with robust losses by SciPy, and profile intervals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.problem import Misfit
from capsule_sym._map.labelled import package
from capsule_sym._native import TimeUp

_FIRST = 0.1  # scale of the first robust loss, in standard deviations of a series
_BULK = 2.0  # scale of a robust loss, in standard deviations of the noise
_PRECISE = {"ftol": 1e-14, "xtol": 1e-12, "gtol": 1e-14}  # some roundings of doubles, 1e-16

LOSSES: dict[str, Callable[[Vector], tuple[Vector, Vector, Vector]]] = {
    "linear": lambda z: (z, np.ones_like(z), np.zeros_like(z)),
    "soft_l1": lambda z: (2 * (np.sqrt(1 + z) - 1), (1 + z) ** -0.5, -0.5 * (1 + z) ** -1.5),
    "huber": lambda z: (
        np.where(z <= 1, z, 2 * np.sqrt(z) - 1),
        np.maximum(z, 1) ** -0.5,
        np.where(z <= 1, 0.0, -0.5 * np.maximum(z, 1) ** -1.5),
    ),
    "cauchy": lambda z: (np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2),
    "arctan": lambda z: (np.arctan(z), 1 / (1 + z**2), -2 * z / (1 + z**2) ** 2),
}
"""SciPy's losses of squared residuals z over their scale squared, and two derivatives."""


@dataclass(frozen=True)
class Loss:
    """Loss function: a name of SciPy, and the residual above which it reduces the weight."""

    name: str
    scale: float = 1.0

    def sum(self, residuals: Vector) -> float:
        """Sum of the residuals' squares, transformed by the loss."""
        return float(self.scale**2 * LOSSES[self.name]((residuals / self.scale) ** 2)[0].sum())

    def spread(self, residuals: Vector, unknown: int = 0) -> float:
        """Standard deviation of the bulk of the residuals, after a fit of so many unknowns.

        For robust losses it is computed from the median of the largest residuals, since as many as
        there are unknowns could be 0 (Street, Carroll and Ruppert, Am. Stat. 42, 152, 1988).
        """
        if self.name == "linear":
            return math.sqrt(float(residuals @ residuals) / max(1, len(residuals) - unknown))
        largest = np.sort(np.abs(residuals))[max(0, unknown - 1) :]
        return float(1.4826 * np.median(largest))

    def influence(self, residuals: Vector) -> tuple[Vector, Vector]:
        """Half the derivative of each term of `sum` by its residual, and the derivative of that."""
        z = (residuals / self.scale) ** 2
        _, first, second = LOSSES[self.name](z)
        return residuals * first, first + 2 * z * second


class Least(NamedTuple):
    """Result of the least squares."""

    x: Vector
    cost: float
    residuals: Vector
    jac: Matrix
    success: bool
    message: str
    loss: Loss
    """The loss; the scale of a robust one is that of the final residuals."""


def least(
    problem: Misfit, guess: Vector, limits: tuple[Vector, Vector], loss: str, steps: int
) -> Least:
    """Least squares from a guess, as far as the time limit allows.

    A robust loss begins as soft_l1, whose minimum is easier to reach; then its scale is that of the
    residuals, and after it once more.
    """
    guess = np.clip(guess, *limits)
    if loss == "linear":
        return solved(problem, guess, limits, Loss(loss), steps)
    found = solved(problem, guess, limits, Loss("soft_l1", _FIRST), steps)
    for _ in range(2):
        noise = max(found.loss.spread(found.residuals, len(guess)), np.finfo(float).eps)
        again = solved(problem, found.x, limits, Loss(loss, _BULK * noise), steps)
        found = again if math.isfinite(again.cost) else found
    return found


def solved(
    problem: Misfit, start: Vector, limits: tuple[Vector, Vector], loss: Loss, steps: int
) -> Least:
    """Least squares with one loss; at the time limit the best of the values tried."""
    count = len(problem.values)
    none = np.full(count, np.nan), np.zeros((count, len(start)))
    best = Least(start, math.inf, *none, False, "", loss)

    def residuals(values: Vector) -> Vector:
        nonlocal best
        found, jacobian = problem.at(values)
        if (cost := loss.sum(found) / 2) < best.cost:
            best = Least(values.copy(), cost, found, jacobian, False, "", loss)
        return found

    try:
        found = _least_squares(residuals, start, problem.jacobian, limits, loss, steps, **_PRECISE)
    except TimeUp:
        return best
    success = bool(found.success) and problem.complete(best.residuals)
    return best._replace(success=success, message=str(found.message))


@np.errstate(all="ignore")
def _least_squares(
    residuals: Callable[[Vector], Vector],
    start: Vector,
    jacobian: Callable[[Vector], Matrix],
    limits: tuple[Vector, Vector],
    loss: Loss,
    steps: int | None = None,
    **precise: float,
) -> Any:
    """SciPy's result, with unknowns scaled by the Jacobian."""
    how = {"bounds": limits, "x_scale": "jac", "loss": loss.name, "f_scale": loss.scale}
    how |= {"max_nfev": steps, **precise}
    return package("scipy.optimize").least_squares(residuals, start, jacobian, **how)


class Profile:
    """Least squares with one unknown fixed: growth of the sum, and ends of the interval."""

    def __init__(
        self, problem: Misfit, found: Least, limits: tuple[Vector, Vector], k: int, variance: float
    ) -> None:
        """`variance` is the sum's growth with the unknown off by a standard error."""
        self.problem, self.found, self.limits, self.k = problem, found, limits, k
        self.variance, self.others = variance, np.arange(len(found.x)) != k
        self.guess = found.x[self.others]

    def end(self, deviations: float, step: float) -> float:
        """Value at which the sum has grown by `deviations` squared; at most the bound."""
        value, (low, high) = self.found.x[self.k], (ends[self.k] for ends in self.limits)
        bound, brentq = high if step > 0 else low, package("scipy.optimize").brentq
        while math.isfinite(step):  # of an unknown that is not identifiable it is infinite
            far = float(np.clip(value + step, low, high))
            if far != value and self.growth(far) >= deviations**2:
                return float(brentq(lambda at: self.growth(at) - deviations**2, value, far))
            if far in (value, bound):
                return far
            step *= 2.0
        return float(bound)

    def growth(self, at: float) -> float:
        """Growth of the sum, in variances, with the unknown fixed at a value."""
        loss, others = self.found.loss, self.others

        def whole(part: Vector) -> Vector:
            return np.insert(part, self.k, at)

        if others.any():
            found = _least_squares(
                lambda part: self.problem.residuals(whole(part)),
                self.guess,
                lambda part: self.problem.jacobian(whole(part))[:, others],
                (self.limits[0][others], self.limits[1][others]),
                loss,
            )
            self.guess = found.x
        total = loss.sum(self.problem.residuals(whole(self.guess)))
        return float((total - 2 * self.found.cost) / self.variance)
