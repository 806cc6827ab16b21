"""Spread of the metrics of a steady motion due to tolerances of parameters, and Sobol's indices.

Monte Carlo on a scrambled Sobol sequence, and Sobol's indices of the variance (Saltelli 2010), both
by SciPy. The motion of a sample is the one on which the start settles there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix
from capsule_sym._attractors.attractor import interval
from capsule_sym._design.cells import Grid
from capsule_sym._design.counts import SEED
from capsule_sym._design.evaluation import settle_many
from capsule_sym._design.functions import Function, allowed, function_of, named, valued
from capsule_sym._design.optimise import system_of
from capsule_sym._design.variance import MetricSpread, spread
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map import checks
from capsule_sym._map.labelled import Labelled, package
from capsule_sym._map.result import Result, brief, by_fields
from capsule_sym._native import Watch, check_time
from capsule_sym._native.watch import silent
from capsule_sym._processes import sobol
from capsule_sym._systems import System, check_parameter, real

_BLOCK = 4096  # runs between two tests of the time limit, of some 10 microseconds a period


class Probability(NamedTuple):
    """Share of samples, dimensionless, and its 95 % interval by Clopper and Pearson."""

    value: float
    low: float
    high: float

    def __repr__(self) -> str:
        return by_fields(self)


_NONE = Probability(math.nan, math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class Tolerances(Result, Labelled):
    """Spread of metrics under tolerances of the parameters, and probabilities of other motions.

    In SI units if the system is a device, else dimensionless.
    """

    system: System
    """Nominal parameters."""
    names: tuple[str, ...]
    """Names of the k varied parameters."""
    parameters: Matrix
    """Values of the parameters in each sample, shape (n, k)."""
    values: Matrix
    """Metrics of each sample, shape (n, metrics); nan if not finite."""
    metrics: tuple[MetricSpread, ...] = ()
    """Spread of each metric: `nominal` value, `mean`, standard `deviation` and `quantiles` (2.5,
    25, 50, 75 and 97.5 %), Sobol's indices `first` and `total`, shape (k,), and `numbers`, the
    share of samples with a finite value."""
    samples: int = 0
    """Number n of samples of the Monte Carlo; the indices take k + 2 runs for each."""
    itinerary: tuple[str, ...] = ()
    """Fields of the nominal motion."""
    periodic: Probability = _NONE
    """Probability that the start leads to a periodic motion: `value`, `low`, `high` (95 %)."""
    changed: Probability = _NONE
    """Probability of another itinerary or period number, or of no periodic motion."""
    status: Status = Status.TIME_LIMIT
    """Status of the sampling."""
    message: str = "time limit reached"
    """Status as a sentence."""
    _recorded = "names samples itinerary periodic changed metrics"

    def __repr__(self) -> str:
        told = ", ".join(
            f"{one.metric} {one.mean:.4g} +- {one.deviation:.2g}" for one in self.metrics
        )
        return brief(self, told, f"of {', '.join(self.names)}")

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Sobol's indices as columns, shape (m k,) for m metrics and k parameters."""
        return {
            "metric": np.repeat([one.metric for one in self.metrics], len(self.names)),
            "parameter": np.tile(self.names, len(self.metrics)),
            "first_order": np.ravel([one.first for one in self.metrics]),
            "total": np.ravel([one.total for one in self.metrics]),
        }


def tolerances(
    metrics: str | Function | Sequence[str | Function],
    over: Mapping[str, Any],
    base: System | None = None,
    *,
    start: Sequence[float] = (0.0, 0.0, 0.0),
    samples: int = 4096,
    seed: int = 0,
    max_seconds: float = checks.SEARCH_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Tolerances:
    """Spread of metrics of the steady motion under tolerances of parameters.

    The result has mean, deviation, quantiles, and Sobol's indices of first order and total. A
    sample without a finite value, such as one without a periodic motion, counts as the mean in the
    indices, and not at all in the others. The result also has the probabilities of a periodic
    motion and of another itinerary. A motion is periodic if it settles within 1,984 excitation
    periods on one of at most 16, in a run that the core decides.

    Parameters
    ----------
    metrics : str, callable, or sequence of these
        One metric or several, as in `optimise`.
    over : mapping of str to float or distribution
        Tolerance of each varied parameter: a share between 0 and 1, dimensionless, or a frozen
        distribution of SciPy. The share 0.1 is a uniform distribution within 10 % of the nominal
        value. Values of a distribution are dimensionless, or in SI units if `base` is a device.
    base : Parameters, PhysicalParameters, or those of another scene, default None
        Nominal values, dimensionless or in SI units. None: those of the case study, Parameters().
    start : sequence of float, default (0.0, 0.0, 0.0)
        State (x_r, v_r, v_c) at phase 0, dimensionless, of size at most 1e20. The motion of a
        sample is the one on which it settles.
    samples : int, default 4096, 64 to 1,048,576
        Number of samples, a power of two. The indices of k parameters take k + 2 runs for each.
    seed : int, default 0, 0 to 10**12
        Seed of the samples.
    max_seconds : float, default 600.0, above 0
        Time limit, in seconds of wall time.
    progress : callable, default None
        Function that is called with a text during the runs.

    Returns
    -------
    Tolerances
        Spread of each metric in `metrics`, probabilities, and the samples. In SI units if `base` is
        a device, else dimensionless; indices and probabilities are dimensionless. After
        `max_seconds` it has only its status.

    Raises
    ------
    InvalidInput
        For names, values and distributions that are not allowed, and if a sample exceeds the range
        of a parameter. Also if the start leads to no periodic motion at the nominal values, and
        without a C core.

    Notes
    -----
    The samples are a scrambled Sobol sequence. The indices are by the estimators of Saltelli
    (2010), as in SciPy; intervals of probabilities are those of Clopper and Pearson.

    See Also
    --------
    optimise : best parameters for a metric.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> base = cs.Parameters(alpha=0.9)
    >>> spread = cs.tolerances("velocity", {"alpha": 0.05, "zeta": 0.1}, base, samples=64)
    >>> one = spread.metrics[0]
    >>> print(spread.message, f"{one.mean:.3f} +- {one.deviation:.3f}", one.total.round(1))
    64 samples 0.102 +- 0.007 [1. 0.]
    """
    system = system_of(base)
    given = [metrics] if isinstance(metrics, str) or callable(metrics) else metrics
    if not isinstance(given, Sequence) or not given:
        raise InvalidInput("metrics", metrics, "a metric or several")
    functions = [function_of("metrics", one, system) for one in given]
    chosen = _distributions(over, system)
    checks.check_count("samples", samples, 64, 2**20)
    if samples & (samples - 1):
        raise InvalidInput("samples", samples, "a power of two")
    checks.check_count("seed", seed, *SEED)
    # The two halves of the columns are two samples, which the indices combine.
    cubes = sobol(2 * len(chosen), samples, seed).clip(2.0**-53, 1 - 2.0**-53)
    one, other = (
        np.stack([by.ppf(part) for by, part in zip(chosen.values(), half.T, strict=True)], axis=1)
        for half in np.split(cubes, 2, axis=1)
    )
    nominal = [float(getattr(system, name)) for name in chosen]
    mixed = [np.where(np.arange(len(chosen)) == k, other, one) for k in range(len(chosen))]
    every = np.vstack([nominal, one, other, *mixed])
    for name, values in zip(chosen, every.T.tolist(), strict=True):
        ends = min(values), max(values)
        checks.checked_ends(f"tolerance of {name}", ends, *allowed(system, name))
    found = Tolerances(system, tuple(chosen), every[:0], np.empty((0, len(functions))))
    with Watch(checks.checked_seconds(max_seconds)):
        state = checks.checked_state(start, "start")
        found = _sampled(found, functions, every, samples, state, progress or silent)
    return found


def _distributions(over: Mapping[str, Any], system: System) -> dict[str, Any]:
    """Frozen distribution of each varied parameter; raises InvalidInput."""
    if not over:
        raise InvalidInput("over", over, "one parameter or more, each with its tolerance")
    found, stats = {}, package("scipy.stats")
    for name, by in over.items():
        check_parameter("over", name, system)
        nominal = float(getattr(system, name))
        if real(by) and 0 < by < 1:
            if not nominal:
                raise InvalidInput(f"tolerance of {name}", by, "a distribution, as its value is 0")
            found[name] = stats.uniform(nominal - by * abs(nominal), 2 * by * abs(nominal))
        elif callable(getattr(by, "ppf", None)):
            found[name] = by
        else:
            told = "a share between 0 and 1, or a frozen distribution of SciPy"
            raise InvalidInput(f"tolerance of {name}", by, told)
    return found


def _sampled(
    empty: Tolerances,
    functions: Sequence[Function],
    every: Matrix,
    n: int,
    state: tuple[float, float, float],
    progress: Callable[[str], object],
) -> Tolerances:
    """Result of the samples: the nominal values, both samples (n, k), and their combinations."""
    system, parts, branches = empty.system, list[Matrix](), list[tuple[int, ...]]()
    for first in range(0, len(every), _BLOCK):
        progress(f"{first:,} of {counted(len(every), 'run')}")
        grid = Grid(system, empty.names, every[first : first + _BLOCK])
        motions = settle_many(grid.rows, state, scene=system.scene)
        check_time()
        count, known = len(grid.rows), grid.metrics(motions.found)
        branches += map(motions.branch, range(count))
        if not branches[0]:
            told = "a state that leads to a periodic motion at the nominal parameters"
            raise InvalidInput("start", state, told)
        values = [valued("metrics", one, known).value for one in functions]
        parts.append(np.array([np.broadcast_to(one, count) for one in values]))
    metrics = np.concatenate(parts, axis=1)
    metrics[:, [not branch for branch in branches]] = np.nan
    own, *others = branches[: n + 1]
    return replace(
        empty,
        metrics=tuple(
            spread(named(function), float(values[0]), values[1:].reshape(-1, n))
            for function, values in zip(functions, metrics, strict=True)
        ),
        samples=n,
        itinerary=tuple(f"F{field}" for field in own[1:]),
        periodic=_probability(others),
        changed=_probability([each != own for each in others]),
        parameters=every[1 : n + 1],
        values=metrics[:, 1 : n + 1].T,
        status=Status.FINISHED,
        message=counted(n, "sample"),
    )


def _probability(chosen: Sequence[object]) -> Probability:
    count, total = sum(map(bool, chosen)), len(chosen)
    return Probability(count / total, *interval(count, total))
