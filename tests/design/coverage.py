"""Shares of 95 % intervals that hold the truth, by `python -m tests.design.coverage [SETS]`.

Intervals by standard errors and profiles, of four parameters, in fits with each loss
to synthetic series with errors of several kinds.
"""

import sys

import numpy as np
from scipy.signal import lfilter

from capsule_sym import Parameters, fit, simulate
from capsule_sym._design.least_squares import LOSSES, Profile

TRUE = Parameters(alpha=0.83, delta=0.03, zeta=0.06, beta=1.7, gamma=3.3)
STATE, PHASE, NOISE = (0.1, 0.2, 0.3), 0.4, 2e-3
UNKNOWN = ("alpha", "delta", "zeta", "beta")

ERRORS = {
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


def data_of(errors, count, seed):
    """Measurements at `count` irregular times, with errors by name."""
    draw = np.random.default_rng([seed, count])
    times = np.concatenate([[PHASE], PHASE + np.sort(draw.uniform(0, 50, count - 1))])
    x_r, _, _, x_c = simulate(TRUE, STATE, PHASE, 9)(times, position=True).T
    of_x_m, of_x_c = NOISE * ERRORS[errors](draw, 2 * count).reshape(2, -1)
    return {"t": times, "x_m": x_r + x_c + of_x_m, "x_c": x_c + of_x_c}


def held(loss, errors, count, seeds, kind="errors"):
    """Mask (sets, k) of intervals of a kind that contain the true value."""
    found, unknown = [], COUNTS[count]
    how = {"state": STATE, "phase": PHASE, "loss": loss}
    for seed in seeds:
        one = fit(data_of(errors, count, seed), TRUE, unknown, **how)
        found.append([_holds(one, k, kind) for k in range(len(unknown))])
    return np.array(found)


def _holds(one, k, kind):
    """True if an interval of the k-th value contains the true one."""
    name = list(one.values)[k]
    truth = getattr(TRUE, name)
    if kind == "profile":
        profile = Profile(one.problem, one.found, one.limits, k, one.growth[k])
        return profile.growth(truth) < one.deviations() ** 2
    return abs(one.values[name] - truth) < one.deviations() * one.standard_errors[name]


def main(sets):
    """Print the table."""
    print("values  errors      intervals" + "".join(f"{loss:>10}" for loss in LOSSES))
    for count in COUNTS:
        for errors in ERRORS:
            if errors != "correlated":
                _print(count, errors, "errors", sets)
                _print(count, errors, "profile", sets)
    _print(max(COUNTS), "correlated", "errors", sets // 4)


def _print(count, errors, kind, sets):
    """Print a row."""
    shares = [held(loss, errors, count, range(sets), kind).mean() for loss in LOSSES]
    numbers = "".join(f"{100 * share:8.1f} %" for share in shares)
    print(f"{2 * count:6}  {errors:11} {kind:9}{numbers}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
