"""Result of a fit: values with their uncertainties, and the fitted runs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.least_squares import Least, Profile
from capsule_sym._design.problem import Misfit
from capsule_sym._design.quantities import System, record, values_of
from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._map import checks
from capsule_sym._map.labelled import package
from capsule_sym._map.result import Result, brief, by_fields
from capsule_sym._native import Watch


@dataclass(frozen=True, eq=False)
class FittedRun:
    """One of the fitted runs; dimensionless, or in SI units for a device."""

    name: str
    """Name of the run; empty for the one run of `fit`."""
    system: System
    """Parameters of this run."""
    state: tuple[float, float, float]
    """(x_r, v_r, v_c) at the first time."""
    phase: float
    """Phase of the forcing at the first time."""
    slip: float
    """Relative error of the time base: true time is 1 + slip times the measured one."""
    series: dict[str, tuple[float, float, float]]
    """Scale, offset and drift of each series, by name."""
    __repr__ = by_fields


@dataclass(frozen=True, eq=False)
class Fit(Result):
    """Result of a fit.

    Values are dimensionless, or in SI units if the fitted system is a device. Standard errors and
    intervals assume independent errors of the measurements, of equal size within a series, and a
    model that is nearly linear over them. `autocorrelation` tests the independence.
    """

    runs: tuple[FittedRun, ...]
    """Fitted runs."""
    values: dict[str, float]
    """Fitted values, by name."""
    standard_errors: dict[str, float]
    """Standard errors of the values; infinite for values in `open_combinations`."""
    covariance: Matrix
    """Covariance of the values, shape (k, k)."""
    status: Status
    """Status of the fit."""
    message: str
    """Status as a sentence."""
    evaluations: int
    """Number of runs with derivatives."""
    noise: float
    """Standard deviation of the residuals, in units of each series' `scales`."""
    noise_by_column: dict[str, float]
    """The same of each column, in units of its own spread about its linear trend."""
    autocorrelation: float
    """Correlation of a residual with the next one of its series, weighted by the loss."""
    singular_values: Vector
    """Singular values of the Jacobian by relative changes of the unknowns, largest first."""
    open_combinations: tuple[dict[str, float], ...]
    """Combinations of relative changes of the unknowns that are not identifiable."""
    border: str
    """Value within whose standard error the itinerary changes; empty if there is none."""
    problem: Misfit
    """Residuals and Jacobian at other values of the unknowns."""
    limits: tuple[Vector, Vector]
    """Lower and upper bounds of the unknowns, each of shape (k,)."""
    found: Least
    """Final state of the least squares."""
    growth: Vector
    """Growth of the sum with one value off by a standard error, the others refitted, (k,)."""
    _recorded = "evaluations values standard_errors covariance"

    @property
    def system(self) -> System:
        """Parameters of the first run, with the fitted values."""
        return self.runs[0].system

    @property
    def state(self) -> tuple[float, float, float]:
        """(x_r, v_r, v_c) at the first time of the first run."""
        return self.runs[0].state

    @property
    def phase(self) -> float:
        """Phase of the forcing at the first time of the first run."""
        return self.runs[0].phase

    @property
    def residuals(self) -> Vector:
        """Model minus measurement, in standard deviations of its series, shape (n,).

        Run after run, each in the order of time.
        """
        return self.found.residuals

    @property
    def loss(self) -> str:
        """Name of the loss function."""
        return self.found.loss.name

    @property
    def least(self) -> float:
        """Least sum of the squared residuals, each transformed by the loss."""
        return 2.0 * self.found.cost

    def __repr__(self) -> str:
        told = ", ".join(
            f"{name} = {value:.6g} +/- {self.standard_errors[name]:.1g}"
            for name, value in self.values.items()
        )
        return brief(self, f"{told}, {self.status}")

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts."""
        found = super().to_dict() | {"parameters": values_of(self.system)}
        names = "noise noise_by_column autocorrelation singular_values open_combinations border"
        found |= record(self, f"state phase {names}")
        if self.runs[0].name:
            found["runs"] = [
                record(one, "name state phase slip series") | {"parameters": values_of(one.system)}
                for one in self.runs
            ]
        return found

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The n measurements, shape (n,): time, column, value, and residual over noise.

        Runs with names have the name of the run as first column.
        """
        every = [run.data for run in self.problem.recorded]
        found = {
            "run": np.repeat([run.name for run in self.runs], [len(one.values) for one in every]),
            "t": np.concatenate([one.times for one in every]),
            "column": np.concatenate([np.array(one.names)[one.column] for one in every]),
            "value": self.problem.values,
            "residual": self.residuals / (self.noise or 1.0),
        }
        return found if self.runs[0].name else {name: found[name] for name in [*found][1:]}

    @checked
    def deviations(self, level: float = 0.95) -> float:
        """Half-width in standard errors of an interval with this probability.

        It is Student's quantile, with the number of values minus unknowns as degrees of freedom.
        Raises InvalidInput for a level that is not between 0 and 1.
        """
        if not checks.is_real(level) or not 0 < level < 1:
            raise InvalidInput("level", level, "between 0 and 1")
        freedom = len(self.residuals) - len(self.values)
        return float(package("scipy.stats").t.ppf((1 + level) / 2, freedom))

    @checked
    def interval(
        self, name: str, level: float = 0.95, *, max_seconds: float = math.inf
    ) -> tuple[float, float]:
        """Profile interval of an unknown: values at which a refit of the others is acceptable.

        At its ends the sum of squares, transformed by the loss, has grown by `deviations(level)`
        squared times its growth at one standard error (`growth`). If it does not grow so much
        within the bounds of the fit, the bound is the end. An end that is not found within
        `max_seconds` is nan. Raises InvalidInput for another name or level.
        """
        check_one_of("name", name, self.values)
        deviations, ends = self.deviations(level), [math.nan, math.nan]
        k = list(self.values).index(name)
        with Watch(checks.checked_seconds(max_seconds)):
            for i, far in enumerate((-deviations, deviations)):
                profile = Profile(self.problem, self.found, self.limits, k, self.growth[k])
                ends[i] = profile.end(far, far * self.standard_errors[name])
        return ends[0], ends[1]
