"""Result of a fit: values with their uncertainties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.measured import Measured
from capsule_sym._design.quantities import System, values_of
from capsule_sym._errors import Status
from capsule_sym._map.result import Result, brief


@dataclass(frozen=True, eq=False)
class Fit(Result):
    """Result of a fit.

    Values are dimensionless, or in SI units if the fitted system is a device. Standard errors
    assume independent errors of the measurements, of equal size within a column, and a model that
    is nearly linear over them. `autocorrelation` tests the independence.
    """

    system: System
    """Parameters, with the fitted values."""
    state: tuple[float, float, float]
    """(x_r, v_r, v_c) at the first time."""
    phase: float
    """Phase of the forcing at the first time."""
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
    """Number of runs, with and without derivatives."""
    noise: float
    """Standard deviation of the residuals."""
    noise_by_column: dict[str, float]
    """The same of each column, in units of its own spread about its linear trend."""
    autocorrelation: float
    """Correlation of a residual with the next one of its column, weighted by the loss."""
    open_combinations: tuple[dict[str, float], ...]
    """Combinations of relative changes of the unknowns that are not identifiable."""
    data: Measured
    """Measured values, in the order of time."""
    residuals: Vector
    """Model minus measurement, in standard deviations of its column, shape (n,)."""
    _recorded = (
        "evaluations values standard_errors covariance state phase noise noise_by_column "
        "autocorrelation open_combinations"
    )

    def __repr__(self) -> str:
        told = ", ".join(
            f"{name} = {value:.6g} +/- {self.standard_errors[name]:.1g}"
            for name, value in self.values.items()
        )
        return brief(self, f"{told}, {self.status}")

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts."""
        return super().to_dict() | {"parameters": values_of(self.system)}

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The n measurements, shape (n,): time, column, value, and residual over noise."""
        return {
            "t": self.data.times,
            "column": np.array(self.data.names)[self.data.column],
            "value": self.data.values,
            "residual": self.residuals / (self.noise or 1.0),
        }
