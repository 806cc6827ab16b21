"""Parameters, start and phase of a system from measured time series, by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.counts import FOLLOW, SEED, STARTS, STEPS
from capsule_sym._design.least_squares import LOSSES, Errors, Least, errors_of, least
from capsule_sym._design.measured import Measured, measured
from capsule_sym._design.misfit import OF_START, PHASE, STATE, Misfit, guesses, limits_of, period_of
from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._map import checks
from capsule_sym._map.result import Result, brief
from capsule_sym._native import TimeUp, Watch
from capsule_sym._native.watch import silent
from capsule_sym._orbits.quantities import units_in
from capsule_sym._systems import System, check_parameter, values_of

_POOR = 0.5  # noise of a column, over its spread: a quarter of its variance is unexplained
_AT_BOUND = 1e-6  # distance from a bound, over the size of the value, that counts as none


def fit(
    data: Mapping[str, ArrayLike],
    system: System,
    unknown: Sequence[str],
    *,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    loss: str = "linear",
    starts: int = 0,
    follow: int = 4,
    seed: int = 0,
    steps: int = 200,
    max_seconds: float = checks.SEARCH_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Fit:
    """Fit unknown values of a system to measured time series, by least squares.

    The motion starts in `state`, at `phase` of the forcing, at the first of the times, even if the
    first values are gaps. The given values of the unknowns are the first guess; all other values
    are known. If the frequency of the drive is unknown, frequencies from the spectrum of the data
    are guesses too. All is dimensionless, or in SI units if `system` is a device.

    Parameters
    ----------
    data : mapping of str to array_like of shape (n,)
        Columns by name: ascending times `t`, and one or more of x_r, v_r, v_c, x_c, x_m, v_m, as
        `read_measured` gives. A gap is nan, masked, or pandas' NA. There are more values than
        unknowns. Dimensionless, or in SI units if `system` is a device.
    system : Parameters, PhysicalParameters, or those of another scene
        Known parameters, and first guesses of the unknown ones, dimensionless or in SI units.
    unknown : sequence of str
        Names of the unknowns, at least one: parameters of `system`, and x_r, v_r, v_c, phase, x_c
        of the start (x_c: the capsule's position, 0 if it is known, and as first guess).
    state : sequence of float, default (0.0, 0.0, 0.0)
        State (x_r, v_r, v_c) at the first time, or a guess, of size at most 1e20. Dimensionless, or
        in SI units if `system` is a device.
    phase : float, default 0.0, from 0 to below the excitation period
        Time in the excitation period at the first of the times, or a guess. Dimensionless, or in
        seconds if `system` is a device.
    bounds : mapping of str to (float, float), default None
        Bounds (low, high) of unknowns, ascending, within the parameter's own range and around the
        guess. Dimensionless, or in SI units if `system` is a device.
    loss : {"linear", "cauchy"}, default "linear"
        Loss of the squared residuals. That of Cauchy gives outliers less weight.
    starts : int, default 0, 0 to 100,000
        Number of further random guesses: within `bounds`, else within the parameter's own range if
        that ends on both sides, else from half to twice the guess. A phase is drawn in its whole
        period. A guess of either sign changes by up to its size; 0 counts as 1.
    follow : int, default 4, 1 to 1,000
        Number of guesses that are continued: the best ones, of the given guess and all others.
    seed : int, default 0, 0 to 10**12
        Seed of the random guesses.
    steps : int, default 200, 1 to 100,000
        Largest number of evaluations of the residuals in each least-squares solution. The loss of
        Cauchy takes three of these for a guess.
    max_seconds : float, default 600.0, above 0
        Time limit, in seconds of wall time.
    progress : callable, default None
        Function that is called with a text during the fit.

    Returns
    -------
    Fit
        Fitted `values` by name and `standard_errors`, in SI units if `system` is a device, else
        dimensionless; `status` and `message`; and `noise`, in units of each column's standard
        deviation. `success` is True for the status "converged".
        After `max_seconds` it has the best values of the guesses that are finished, else the latest
        values from the first, and the status "time-limit".

    Raises
    ------
    InvalidInput
        For columns, names, bounds or values that are not allowed, and without a C core.

    Notes
    -----
    The residuals of a column are in units of its standard deviation. Their Jacobian is exact, since
    the closed forms are differentiated through all switches. The least squares are SciPy's.

    See Also
    --------
    plot_residuals : figure of the result.
    sensitivities : derivatives of a run.

    Examples
    --------
    >>> import numpy as np
    >>> import capsule_sym as cs
    >>> times = np.linspace(0.0, 15.0, 200)
    >>> run = cs.simulate(cs.Parameters(alpha=0.9), periods=2)
    >>> data = {"t": times, "x_r": run(times)[:, 0]}
    >>> found = cs.fit(data, cs.Parameters(alpha=0.85), ["alpha"])
    >>> print(found.status, round(found.values["alpha"], 6))
    converged 0.9
    """
    for name in unknown:
        check_parameter("unknown", name, system, *OF_START)
    if not unknown or len(set(unknown)) < len(unknown):
        raise InvalidInput("unknown", ", ".join(unknown), "one or more different names")
    checks.check_phase(phase, period_of(system))
    given = dict(zip(STATE, checks.checked_state(state), strict=True)) | {PHASE: phase}
    problem = Misfit(measured(data), system, unknown, given, progress or silent)
    limits = limits_of(problem, bounds or {})
    check_one_of("loss", loss, LOSSES)
    checks.check_count("starts", starts, *STARTS)
    checks.check_count("follow", follow, *FOLLOW)
    checks.check_count("seed", seed, *SEED)
    checks.check_count("steps", steps, *STEPS)
    found, status = list[Least](), Status.TIME_LIMIT
    message = "time limit reached: best values so far"
    with Watch(checks.checked_seconds(max_seconds)):
        best = _best(problem, guesses(problem, limits, starts, seed))[:follow]
        for k, guess in enumerate(best, 1):
            problem.doing = f"start {k} of {len(best)}"
            found.append(least(problem, guess, limits, loss, steps))
        status = Status.FINISHED
    problem.progress = silent
    least_squares = min(found, key=lambda one: one.cost) if found else Least(problem.latest)
    errors = errors_of(problem, least_squares)
    if status is Status.FINISHED:
        status, message = _status(problem, least_squares, errors, limits)
    now = problem.now(least_squares.x)
    x_r, v_r, v_c = (now[name] for name in STATE)
    return Fit(
        system=problem.system_at(least_squares.x),
        state=(x_r, v_r, v_c),
        phase=now[PHASE],
        values=problem.named(least_squares.x),
        standard_errors=problem.named(errors.standard),
        covariance=errors.covariance,
        status=status,
        message=message,
        evaluations=problem.evaluations,
        noise=errors.noise,
        noise_by_column=errors.noise_by_column,
        autocorrelation=errors.autocorrelation,
        open_combinations=errors.lost,
        data=problem.data,
        residuals=errors.residuals,
    )


def _best(problem: Misfit, guesses: Sequence[Vector]) -> list[Vector]:
    """Guesses sorted by the sum of absolute residuals, as many as the time limit allows."""
    found = list[tuple[float, int]]()
    with suppress(TimeUp):
        for k, guess in enumerate(guesses):
            problem.doing = f"guess {k + 1} of {len(guesses)}"
            found.append((float(abs(problem.residuals(guess)).sum()), k))
    return [guesses[k] for _, k in sorted(found)] or [guesses[0]]


def _status(
    problem: Misfit, found: Least, errors: Errors, limits: tuple[Vector, Vector]
) -> tuple[Status, str]:
    """Status of the best least squares, and the status as a sentence."""
    noise = errors.noise_by_column.items()
    poor = [f"{by:.2g} of the spread of {one}" for one, by in noise if not by < _POOR]
    apart = [name for name, by in problem.named(errors.standard).items() if math.isinf(by)]
    # The least squares stay a little within the bounds.
    room = np.minimum(found.x - limits[0], limits[1] - found.x) / problem.sizes(found.x)
    bound = [name for name, by in problem.named(room).items() if by <= _AT_BOUND]
    status, message = Status.NOT_CONVERGED, found.message
    if found.success:
        status, message = Status.CONVERGED, "the least squares converged"
    advice = "try the state and phase of the start, more starts, other guesses, and check units"
    for names, cause, text in (
        (poor, Status.UNEXPLAINED, f"the noise is {', '.join(poor)}: {advice}"),
        (apart, Status.NOT_IDENTIFIABLE, f"the data do not determine {', '.join(apart)}"),
        (bound, Status.AT_BOUND, f"{', '.join(bound)} at a bound: try wider bounds"),
    ):
        if names:
            return (cause if found.success else status), f"{message.rstrip('.')}; {text}"
    return status, message


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
    """Time in the forcing's period at the first time; a fitted one may be outside of it."""
    values: dict[str, float]
    """Fitted values, by name."""
    standard_errors: dict[str, float]
    """Standard errors of the values; infinite for those with a share above 0.1 in an entry of
    `open_combinations`."""
    covariance: Matrix
    """Covariance of the values, shape (k, k)."""
    status: Status
    """Status of the fit."""
    message: str
    """Status as a sentence."""
    evaluations: int
    """Number of runs, with and without derivatives."""
    noise: float
    """Standard deviation of `residuals`, in their unit; a robust one for the loss "cauchy"."""
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
        """Result by name, as JSON has it: None stands for a number that is not finite.

        `units` has the SI units of metrics, parameters and start of a device, and is empty without
        one.
        """
        more = {"parameters": values_of(self.system), "units": units_in(self.system)}
        return super().to_dict() | more

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The n measurements, shape (n,): time, column, value, and residual over noise."""
        return {
            "t": self.data.times,
            "column": np.array(self.data.names)[self.data.column],
            "value": self.data.values,
            "residual": self.residuals / (self.noise or 1.0),
        }
