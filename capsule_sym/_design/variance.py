"""Spread of metrics over samples: moments, quantiles, and Sobol's indices of the variance.

The indices are SciPy's, by Saltelli's estimators of 2010, with bootstrap intervals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._map.labelled import package
from capsule_sym._map.result import by_fields

QUANTILES = 0.025, 0.25, 0.5, 0.75, 0.975
"""Shares of the samples below the listed quantiles."""
_RESAMPLED = range(200)  # for the intervals of the indices
_INTERVAL = 0.025, 0.975


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


def _indices(values: Sequence[Matrix], chosen: Any) -> tuple[Vector, Vector]:
    """Sobol's indices, of first order and total, from some of the samples."""
    # The output is given twice: for one output of one parameter SciPy returns no array.
    a, b, ab = (np.stack([part[..., chosen]] * 2, axis=-2) for part in values)
    stats = package("scipy.stats")
    found = stats.sobol_indices(func={"f_A": a, "f_B": b, "f_AB": ab}, n=a.shape[-1])
    return found.first_order.reshape(2, -1)[0], found.total_order.reshape(2, -1)[0]


def spreads(
    names: Sequence[str], nominal: Vector, values: tuple[Matrix, Matrix, Matrix], seed: int
) -> tuple[MetricSpread, ...]:
    """Spread of each metric, from both samples and their combinations, (k, n, metrics)."""
    rng, found = np.random.default_rng(seed), []
    for j, name in enumerate(names):
        one, other, mixed = (part[..., j] for part in values)
        numbers = one[np.isfinite(one)]
        share = float(np.mean([np.isfinite(part).mean() for part in (one, other, *mixed)]))
        mean = float(numbers.mean()) if len(numbers) else math.nan
        filled = [np.where(np.isfinite(part), part, mean) for part in (one, other, mixed)]
        first = total = np.full(len(mixed), math.nan)
        ends = [np.full((len(mixed), 2), math.nan)] * 2
        if len(numbers) and np.ptp(np.concatenate(filled[:2])) > 0:
            first, total = _indices(filled, slice(None))
            again = [_indices(filled, rng.integers(0, len(one), len(one))) for _ in _RESAMPLED]
            ends = list(np.quantile(again, _INTERVAL, axis=0).transpose(1, 2, 0))
        found.append(
            MetricSpread(
                name,
                float(nominal[j]),
                mean,
                float(numbers.std()) if len(numbers) else math.nan,
                tuple(np.quantile(numbers, QUANTILES).tolist()) if len(numbers) else (),
                first,
                ends[0],
                total,
                ends[1],
                share,
            )
        )
    return tuple(found)
