"""Pareto front of two metrics: points of which none is better in one and as good in the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from capsule_sym._design.counts import MAX_SECONDS, POINTS
from capsule_sym._design.front_search import Front, FrontSearch
from capsule_sym._design.functions import Function, function_of
from capsule_sym._design.optimise import check_survey, program_of
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._native import Watch
from capsule_sym._systems import System


def pareto(
    metric: str | Function,
    against: str | Function,
    over: Mapping[str, Sequence[float]],
    base: System | None = None,
    *,
    points: int = 50,
    maximise: bool = True,
    subject_to: Sequence[object] = (),
    margin: float | None = None,
    start: Sequence[float] = (0.0, 0.0, 0.0),
    samples: int = 256,
    seed: int = 0,
    max_seconds: float = MAX_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Front:
    """Pareto front of a metric to maximise, or minimise, against one to minimise.

    At most `points` points are spread along it, between its two ends, the optima of either
    metric. Each of the others is the optimum of the first metric with a bound on the second.
    `parts` are connected: parameters between those of two parts are worse. Otherwise the search is
    as in `optimise`.

    Parameters
    ----------
    metric : str or callable
        First metric, to maximise or minimise, as in `optimise`. Dimensionless, or in SI units if
        `base` is a device.
    against : str or callable
        Second metric, to minimise, as in `optimise`.
    over : mapping of str to (float, float)
        Bounds (low, high) of each varied parameter: ascending finite numbers within its own range.
        Dimensionless, or in SI units if `base` is a device.
    base : Parameters, PhysicalParameters, or those of another scene, default None
        Values of the other parameters, dimensionless or in SI units. None: those of the case study,
        Parameters().
    points : int, default 50, 2 to 10,000
        Largest number of points of the front.
    maximise : bool, default True
        True for the greatest first metric, False for the least.
    subject_to : sequence of str or tuple, default ()
        Constraints, each a text such as "peak_force <= 2" or a tuple (metric, "<=" or ">=",
        number). The number has the unit of the metric.
    margin : float, default None, from 0 to below 1
        Least distance of the Floquet multipliers from the unit circle, dimensionless: the modulus
        of each is at most 1 - `margin`. None: as in `optimise`.
    start : sequence of float, default (0.0, 0.0, 0.0)
        State (x_r, v_r, v_c) at phase 0, dimensionless, of size at most 1e20. The motion is the one
        on which it settles.
    samples : int, default 256, 1 to 1,000,000
        Number of points of the survey of each metric; that of both metrics, between the ends,
        begins with four times as many.
    seed : int, default 0, 0 to 10**12
        Seed of the surveys.
    max_seconds : float, default 60.0, above 0
        Time limit, in seconds of wall time.
    progress : callable, default None
        Function that is called with a text during the search.

    Returns
    -------
    Front
        Points by increasing second metric, each an `Optimum`, with `values`, `costs`, `parts`,
        `status` and `message`. In SI units if `base` is a device, else dimensionless. It has one
        point if one is the best in both metrics. After `max_seconds` it has the points found so
        far.

    Raises
    ------
    InvalidInput
        As in `optimise`, and if one metric is not finite where the other is best.

    See Also
    --------
    optimise : optimum of one metric.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> front = cs.pareto("speed", "work", {"alpha": (0.6, 1.2)}, points=2, samples=1)
    >>> for speed, work, point in zip(front.values, front.costs, front.points):
    ...     print(f"speed {speed:.4f}, work {work:.4f} at alpha = {point.over['alpha']:.4f}")
    speed 0.0304, work 0.3860 at alpha = 0.6000
    speed 0.1705, work 2.0065 at alpha = 1.2000
    """
    check_count("points", points, *POINTS)
    check_survey(samples, seed)
    program = program_of(metric, over, base, maximise, subject_to, margin, start, progress)
    cost = function_of("against", against, program.system)
    search = FrontSearch(program, cost, points)
    with Watch(checked_seconds(max_seconds)):
        search.run(samples, seed)
    return search.result
