"""Shares of 95 % intervals that hold the truth, by `python -m benchmarks intervals`.

Intervals by standard errors of four parameters, in fits with each loss to synthetic series with
errors of several kinds.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import t

from capsule_sym import Parameters, fit, simulate

TRUE = Parameters(alpha=0.83, delta=0.03, zeta=0.06, beta=1.7, gamma=3.3)
STATE, PHASE, NOISE = (0.1, 0.2, 0.3), 0.4, 2e-3
UNKNOWN = ("alpha", "delta", "zeta", "beta")
LOSSES = "linear", "cauchy"

Vector = NDArray[np.float64]

ERRORS: dict[str, Callable[[np.random.Generator, int], Any]] = {
    "normal": lambda draw, n: draw.normal(size=n),
    "outliers": lambda draw, n: draw.normal(size=n) * np.where(draw.random(n) < 0.1, 50, 1),
    "one-sided": lambda draw, n: draw.normal(size=n) + 100 * (draw.random(n) < 0.05),
    "unlike": lambda draw, n: draw.normal(size=n) * np.repeat([1, 5], n // 2),
    "correlated": lambda draw, n: lfilter([1.0], [1.0, -0.7], draw.normal(size=n)),
    "heavy": lambda draw, n: draw.standard_t(2.0, size=n),
}
"""Errors of n values, the first half those of x_m and the others of x_c, over the noise."""
COUNTS = {9: UNKNOWN[:2], 20: UNKNOWN, 150: UNKNOWN}
"""Unknowns, by the number of times."""


def data_of(errors: str, count: int, seed: int) -> dict[str, Vector]:
    """Measurements at `count` irregular times, with errors by name."""
    draw = np.random.default_rng([seed, count])
    times = np.concatenate([[PHASE], PHASE + np.sort(draw.uniform(0, 50, count - 1))])
    x_r, _, _, x_c = simulate(TRUE, STATE, PHASE, 9)(times, position=True).T
    of_x_m, of_x_c = NOISE * ERRORS[errors](draw, 2 * count).reshape(2, -1)
    return {"t": times, "x_m": x_r + x_c + of_x_m, "x_c": x_c + of_x_c}


def held(loss: str, errors: str, count: int, seeds: Iterable[int]) -> NDArray[np.bool_]:
    """Mask (sets, k) of intervals, by Student's quantile, that contain the true value."""
    found, unknown = [], COUNTS[count]
    for seed in seeds:
        data = data_of(errors, count, seed)
        one = fit(data, TRUE, unknown, state=STATE, phase=PHASE, loss=loss)
        wide = float(t.ppf(0.975, len(one.residuals) - len(unknown)))
        apart = [abs(one.values[name] - getattr(TRUE, name)) for name in unknown]
        found.append(
            [by < wide * one.standard_errors[name] for by, name in zip(apart, unknown, strict=True)]
        )
    return np.array(found)


def table(sets: int) -> None:
    """Print the table."""
    print("values  errors      " + "".join(f"{loss:>10}" for loss in LOSSES))
    for count in COUNTS:
        for errors in ERRORS:
            if errors != "correlated":
                _print(count, errors, sets)
    _print(max(COUNTS), "correlated", sets // 4)


def _print(count: int, errors: str, sets: int) -> None:
    """Print a row."""
    shares = [held(loss, errors, count, range(sets)).mean() for loss in LOSSES]
    numbers = "".join(f"{100 * share:8.1f} %" for share in shares)
    print(f"{2 * count:6}  {errors:12}{numbers}", flush=True)
