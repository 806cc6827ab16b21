"""Block bootstrap: fits to resampled residuals, starting from the fit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.least_squares import Least, solved
from capsule_sym._design.problem import Problem
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map.checks import is_real
from capsule_sym._native import TimeUp, check_time

_MOST = 0.75  # largest share of the variance that blocks may lose
Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bootstrap:
    """Values of fits to resampled residuals, in the units of the fit's values.

    Residuals are drawn in blocks of successive times, all series of a run together, and added to
    the fitted model. Errors may be correlated over times shorter than a block, and between series.
    They are assumed to have the same distribution along a run.
    """

    names: tuple[str, ...]
    """Names of the fitted values."""
    values: Matrix
    """Values of the fits that converged, shape (m, k)."""
    asked: int
    """Number of fits requested."""
    failed: int
    """Number of fits that did not converge."""
    block: int
    """Length of a block, for the run with the longest blocks."""

    @property
    def success(self) -> bool:
        """True if all fits were made within the time limit."""
        return len(self.values) + self.failed == self.asked

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard deviations of the values by name; nan for fewer than two fits."""
        few = len(self.values) < 2
        found = np.full(len(self.names), np.nan) if few else np.std(self.values, axis=0, ddof=1)
        return dict(zip(self.names, found.tolist(), strict=True))

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Percentile interval of a value with this probability; nan without fits.

        Raises InvalidInput for another name, and for a level that is not between 0 and 1.
        """
        check_one_of("name", name, self.names)
        if not is_real(level) or not 0 < level < 1:
            raise InvalidInput("level", level, "between 0 and 1")
        column = self.values[:, self.names.index(name)]
        if not len(column):
            return math.nan, math.nan
        low, high = np.quantile(column, [(1 - level) / 2, (1 + level) / 2]).tolist()
        return low, high

    def to_dict(self) -> dict[str, Any]:
        """Counts, standard errors and 95 % intervals by name."""
        return {
            "fits": len(self.values),
            "failed": self.failed,
            "block": self.block,
            "standard_errors": self.standard_errors,
            "intervals": {name: list(self.interval(name)) for name in self.names},
        }


def bootstrapped(
    problem: Problem,
    found: Least,
    limits: tuple[Vector, Vector],
    count: int,
    seed: int,
    steps: int,
) -> Bootstrap:
    """Fits to `count` resamples of the residuals, or as many as the time limit allows."""
    draw = np.random.default_rng(seed)
    blocks = list(_blocks(problem, found))
    # Residuals are smaller than errors, due to the fitted unknowns.
    larger = math.sqrt(len(found.residuals) / (len(found.residuals) - len(found.x)))
    model = problem.values + found.residuals * problem.scales
    values, failed = list[Vector](), 0
    with suppress(TimeUp):
        for k in range(1, count + 1):
            check_time()
            problem.doing = f"bootstrap {k} of {count}"
            errors = np.concatenate([one.drawn(draw) for one in blocks])
            again = problem.measuring(model - larger * errors * problem.scales)
            fit = solved(again, found.x, limits, found.loss, steps)
            problem.evaluations = again.evaluations
            check_time()
            if fit.success:
                values.append(fit.x)
            else:
                failed += 1
    longest = max(one.length for one in blocks)
    table = np.reshape(values, (-1, len(found.x)))
    return Bootstrap(problem.unknown, table, count, failed, longest)


class _Blocks:
    """Residuals of a run as a table of times and series, drawn in blocks of times."""

    def __init__(
        self,
        residuals: Vector,
        which: NDArray[np.int64],
        column: NDArray[np.int64],
        r: float,
    ) -> None:
        self.which, self.column = which, column
        times, series = which.max() + 1, column.max() + 1
        self.table = np.full((times, series), np.nan)
        self.table[which, column] = residuals
        for one in self.table.T:  # a gap gets the residual of the nearest time
            there = np.flatnonzero(np.isfinite(one))
            middle = 0.5 * (there[1:] + there[:-1])
            one[:] = one[there[np.searchsorted(middle, np.arange(times))]]
        # For autoregressive errors: blocks of least mean square error (Carlstein, Ann. Stat. 14,
        # 1171,
        # 1986), and the share of the variance that is lost at their ends.
        reach = 2 * max(r, 0.0) / (1 - min(abs(r), 0.99) ** 2)
        length = reach ** (2 / 3) * times ** (1 / 3)
        self.length = int(np.clip(math.ceil(length), 1, max(1, times // 4)))
        self.table /= math.sqrt(1 - min(reach / self.length, _MOST))

    def drawn(self, draw: np.random.Generator) -> Vector:
        """Resampled residuals (n,)."""
        times = len(self.table)
        begins = draw.integers(times, size=math.ceil(times / self.length))
        rows = (begins[:, None] + np.arange(self.length)).ravel()[:times] % times
        found: Vector = self.table[rows][self.which, self.column]
        return found


def _blocks(problem: Problem, found: Least) -> Iterator[_Blocks]:
    """Blocks of each run's residuals, centred by the loss."""
    influence, _ = found.loss.influence(found.residuals)
    nothing = found.residuals == 0.0
    weights = np.where(nothing, 1.0, influence / np.where(nothing, 1.0, found.residuals))
    total = np.bincount(problem.groups, weights * found.residuals)
    centred = found.residuals - (total / np.bincount(problem.groups, weights))[problem.groups]
    for run, rows in zip(problem.recorded, problem.rows, strict=True):
        r = correlation(influence[rows], run.data.column)
        yield _Blocks(centred[rows], run.which, run.data.column, r)


def correlation(residuals: Vector, groups: NDArray[np.int64]) -> float:
    """Lag-one correlation of residuals within their series, given by `groups`."""
    order = np.argsort(groups, kind="stable")
    along = np.diff(groups[order]) == 0
    ordered = residuals[order]
    return float((ordered[1:] * ordered[:-1])[along].sum() / (residuals @ residuals or 1.0))
