"""Spread of metrics over samples: moments, quantiles, and Sobol's indices of the variance.

The indices are SciPy's, by Saltelli's estimators of 2010.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._map.labelled import package
from capsule_sym._map.result import by_fields

QUANTILES = 0.025, 0.25, 0.5, 0.75, 0.975
"""Shares of the samples below the listed quantiles."""


class MetricSpread(NamedTuple):
    """Spread of one metric over the samples, in SI units if the system is a device.

    `deviation` is the standard deviation; `quantiles` are those at `QUANTILES`. `first` and
    `total`, (k,), are Sobol's indices of the k parameters.
    `mean`, `deviation` and `quantiles` (() without values) are those of the first of two sets of
    samples. `numbers` is the share of all samples with a finite value; samples without a periodic
    motion have none, and count as the mean in the indices. Indices of a constant metric are nan.
    """

    metric: str
    nominal: float
    mean: float
    deviation: float
    quantiles: tuple[float, ...]
    first: Vector
    total: Vector
    numbers: float

    def __repr__(self) -> str:
        return by_fields(self)


def spread(name: str, nominal: float, values: Matrix) -> MetricSpread:
    """Spread of one metric, from two samples (n,) and their combinations, (2 + k, n).

    `values` are both samples, and for each parameter the first with that parameter of the second.
    """
    known = values[0][np.isfinite(values[0])]
    mean, deviation, quantiles = math.nan, math.nan, tuple[float, ...]()
    if len(known):
        mean, deviation = float(known.mean()), float(known.std())
        quantiles = tuple(np.quantile(known, QUANTILES).tolist())
    a, b, *ab = np.where(np.isfinite(values), values, mean)
    first, total = np.full((2, len(ab)), math.nan)
    if np.ptp([a, b]) > 0:
        # The output is given twice: for one output of one parameter SciPy returns no array.
        given = {"f_A": [a, a], "f_B": [b, b], "f_AB": np.stack([ab, ab], axis=1)}
        sobol_indices: Any = package("scipy.stats").sobol_indices
        found = sobol_indices(func={key: np.array(of) for key, of in given.items()}, n=len(a))
        first, total = found.first_order[0], found.total_order[0]
    share = float(np.isfinite(values).mean())
    return MetricSpread(name, nominal, mean, deviation, quantiles, first, total, share)
