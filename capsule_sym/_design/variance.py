"""Spread of metrics over samples: moments, quantiles, and Sobol's indices of the variance.

The indices are SciPy's, by Saltelli's estimators of 2010, with bootstrap intervals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._map.labelled import package
from capsule_sym._map.result import by_fields

QUANTILES = 0.025, 0.25, 0.5, 0.75, 0.975
"""Shares of the samples below the listed quantiles."""
_RESAMPLED = range(200)  # samples for intervals of the indices, whose ends are five of them


class MetricSpread(NamedTuple):
    """Spread of one metric over the samples, in SI units if the system is a device.

    `deviation` is the standard deviation; `quantiles` are those at `QUANTILES`. `first` and
    `total`, (k,), are Sobol's indices of the k parameters, with their 95 % intervals (k, 2).
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
    first_interval: Matrix
    total: Vector
    total_interval: Matrix
    numbers: float

    def __repr__(self) -> str:
        return by_fields(self)


def spreads(
    names: Sequence[str], nominal: Vector, values: NDArray[np.float64], seed: int
) -> tuple[MetricSpread, ...]:
    """Spread of each metric, from two samples (n, metrics) and their combinations.

    `values` are both samples, and for each parameter the first with that parameter of the second.
    """
    rng, known = np.random.default_rng(seed), [part[np.isfinite(part)] for part in values[0].T]
    means = np.array([part.mean() if len(part) else math.nan for part in known])
    filled = np.where(np.isfinite(values), values, means).swapaxes(1, 2)
    varies, count = np.ptp(filled[:2], axis=(0, 2)) > 0, filled.shape[2]
    # The first output is given twice: for one output of one parameter SciPy returns no array.
    twice = np.insert(filled, 0, filled[:, 0], axis=1)
    drawn = (np.take(twice, rng.integers(0, count, count), axis=2) for _ in _RESAMPLED)
    found = np.array([_indices(some) for some in chain([twice], drawn)])[:, :, 1:]
    found = np.where(varies[:, None], found, math.nan)
    low, *_, high = QUANTILES
    indices, ends = found[0], np.moveaxis(np.quantile(found[1:], (low, high), axis=0), 0, -1)
    shares = np.isfinite(values).mean(axis=(0, 1))
    return tuple(
        MetricSpread(
            metric=name,
            nominal=float(nominal[j]),
            mean=float(means[j]),
            deviation=float(known[j].std()) if len(known[j]) else math.nan,
            quantiles=tuple(np.quantile(known[j], QUANTILES).tolist()) if len(known[j]) else (),
            first=indices[0, j],
            first_interval=ends[0, j],
            total=indices[1, j],
            total_interval=ends[1, j],
            numbers=float(shares[j]),
        )
        for j, name in enumerate(names)
    )


def _indices(values: NDArray[np.float64]) -> Matrix:
    """Sobol's indices, of first order and total, (2, metrics, k), from values (2 + k, metrics, n).

    The metrics are two or more.
    """
    a, b, *ab = values
    sobol_indices: Any = package("scipy.stats").sobol_indices
    found = sobol_indices(func={"f_A": a, "f_B": b, "f_AB": np.array(ab)}, n=a.shape[1])
    return np.array([found.first_order, found.total_order]).reshape(2, len(a), len(ab))
