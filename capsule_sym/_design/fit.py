"""Parameters, start and phase of a device from measured time series, by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._design.bootstrap import Bootstrap, bootstrapped, correlation
from capsule_sym._design.counts import BOOTSTRAP, FOLLOW, SEED, STARTS, STEPS
from capsule_sym._design.covariance import Errors, errors_of
from capsule_sym._design.guesses import best_of, drawn, limits_of
from capsule_sym._design.least_squares import LOSSES, Least, Profile, least
from capsule_sym._design.measured import measured
from capsule_sym._design.problem import Problem
from capsule_sym._design.quantities import System, real, record, values_of
from capsule_sym._design.residuals import OF_START, PHASE, STATE, Recorded
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map.checks import check_count, checked_seconds, is_real
from capsule_sym._map.labelled import package
from capsule_sym._map.result import Result
from capsule_sym._native import Watch, check_time
from capsule_sym._parameters import names_of

Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]


class FitStatus(StrEnum):
    """Ways in which a fit can end."""

    #: The least squares reached a minimum.
    CONVERGED = "converged"
    #: They did not reach one.
    NOT_CONVERGED = "not-converged"
    #: The measurements do not determine some combination of the unknowns.
    NOT_IDENTIFIABLE = "not-identifiable"
    #: The time was over: the values are the best that were tried.
    TIME_LIMIT = "time-limit"


@dataclass(frozen=True, eq=False)
class FittedRun:
    """One of the runs that were fitted; dimensionless, or in SI units where it is a device's."""

    name: str
    """Its name; empty for the one run of `fit`."""
    system: System
    """The parameters of this run."""
    state: tuple[float, float, float]
    """(x_r, v_r, v_c) at the first time."""
    phase: float
    """Phase of the forcing there."""
    slip: float
    """True time passes 1 + slip times as fast as the measured one."""
    series: dict[str, tuple[float, float, float]]
    """Scale, offset and drift of each series, by name."""


@dataclass(frozen=True, eq=False)
class Fit(Result):
    """Result of a fit.

    Values are dimensionless, or in SI units where the system that was fitted is a device. Standard
    errors and intervals hold for independent errors of the measurements, alike within a series,
    where the model is nearly linear over them; `autocorrelation` tells if errors are independent,
    and `bootstrap` has the uncertainty where they are not.
    """

    runs: tuple[FittedRun, ...]
    """The runs."""
    values: dict[str, float]
    """The fitted values, by name."""
    standard_errors: dict[str, float]
    """Their standard errors; infinite where `open_combinations` tells of it."""
    covariance: Matrix
    """Their covariance, shape (k, k)."""
    status: FitStatus
    """How it ended."""
    message: str
    """The same as a sentence."""
    evaluations: int
    """Runs with derivatives that it took."""
    noise: float
    """Standard deviation of the residuals, in units of each series' `scales`."""
    autocorrelation: float
    """Correlation of a residual with the next of its series, as the loss counts both."""
    singular_values: Vector
    """Of the Jacobian by the relative changes of what was unknown, largest first."""
    open_combinations: tuple[dict[str, float], ...]
    """Relative changes of what was unknown that the measurements cannot tell from none."""
    border: str
    """Where the itinerary changes within a standard error: which value; else empty."""
    problem: Problem
    """Residuals and Jacobian at other values of what was unknown."""
    limits: tuple[Vector, Vector]
    """Lowest and highest values allowed for what was unknown, each of shape (k,)."""
    found: Least
    """End of the least squares."""
    growth: Vector
    """The sum's growth where a value is a standard error off, the others fitted anew, (k,)."""
    bootstrap: Bootstrap | None
    """Fits anew to resampled residuals, if they were asked for."""
    _good = (FitStatus.CONVERGED,)
    _recorded = "evaluations values standard_errors covariance"

    @property
    def system(self) -> System:
        """The parameters of the first run, those that were known among them."""
        return self.runs[0].system

    @property
    def state(self) -> tuple[float, float, float]:
        """(x_r, v_r, v_c) at the first time of the first run."""
        return self.runs[0].state

    @property
    def phase(self) -> float:
        """Phase of the forcing there."""
        return self.runs[0].phase

    @property
    def residuals(self) -> Vector:
        """Model less measurement over `scales`, shape (n,), of each run in the order of time."""
        return self.found.residuals

    @property
    def loss(self) -> str:
        """How residuals counted."""
        return self.found.loss.name

    @property
    def loss_scale(self) -> float:
        """The residual from which a robust loss lets them count less, in their units."""
        return self.found.loss.scale

    @property
    def least(self) -> float:
        """Sum of the residuals' squares, as the loss counts them."""
        return 2.0 * self.found.cost

    def __repr__(self) -> str:
        told = ", ".join(
            f"{name} = {value:.6g} +/- {self.standard_errors[name]:.1g}"
            for name, value in self.values.items()
        )
        return f"<Fit: {told}, {self.status}>"

    def to_dict(self) -> dict[str, Any]:
        """The result by name, of numbers, texts, lists and dicts."""
        found = super().to_dict() | {"parameters": values_of(self.system)}
        names = "noise autocorrelation singular_values open_combinations border"
        found |= record(self, f"state phase {names}")
        if self.runs[0].name:
            found["runs"] = [
                record(one, "name state phase slip series") | {"parameters": values_of(one.system)}
                for one in self.runs
            ]
        return found | ({"bootstrap": self.bootstrap.to_dict()} if self.bootstrap else {})

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The n measurements, shape (n,): time, column, value, and residual over noise.

        With the name of the run before these where runs have names.
        """
        every = [one.data for one in self.problem.recorded]
        named = [np.array(one.names, np.str_)[one.column] for one in every]
        runs = [
            np.full(len(one.values), run.name) for one, run in zip(every, self.runs, strict=True)
        ]
        return ({"run": np.concatenate(runs)} if self.runs[0].name else {}) | {
            "t": np.concatenate([one.times for one in every]),
            "column": np.concatenate(named),
            "value": self.problem.values,
            "residual": self.residuals / (self.noise or 1.0),
        }

    def deviations(self, level: float = 0.95) -> float:
        """Standard errors between a value and the end of its interval of this probability.

        Student's quantile for as many values as there are more than unknown. Raises InvalidInput
        for a level that is not between 0 and 1.
        """
        if not is_real(level) or not 0 < level < 1:
            raise InvalidInput("level", level, "between 0 and 1")
        freedom = len(self.residuals) - len(self.values)
        return float(package("scipy.stats", "design").t.ppf((1 + level) / 2, freedom))

    def interval(
        self, name: str, level: float = 0.95, *, max_seconds: float = math.inf
    ) -> tuple[float, float]:
        """Profile interval of an unknown: where the others, fitted anew, still fit.

        The sum of squares, as the loss counts them, grows there by `deviations(level)` squared
        times what it grows by where the value is a standard error off (`growth`). Where it does
        not grow so far within the bounds of the fit, the bound is the end. An end that is not found
        within `max_seconds` is nan. Raises InvalidInput for another name or level.
        """
        check_one_of("name", name, self.values)
        deviations, ends = self.deviations(level), [math.nan, math.nan]
        k = list(self.values).index(name)
        with Watch(checked_seconds(max_seconds)):
            for i, sign in enumerate((-1, 1)):
                profile = Profile(self.problem, self.found, self.limits, k, self.growth[k])
                far = sign * deviations
                ends[i] = profile.end(far, far * self.standard_errors[name])
        return ends[0], ends[1]


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
    bootstrap: int = 0,
    max_seconds: float = math.inf,
    progress: Callable[[str], object] | None = None,
) -> Fit:
    """Values of what is unknown of a system, from measured time series, by least squares.

    `data` has columns (n,): times `t`, ascending, and one or more of x_r, v_r, v_c, x_c, x_m, v_m;
    a gap is nan, masked, or pandas' NA. The motion starts in `state` (x_r, v_r, v_c), at `phase` of
    the forcing, at the first of the times, gap or not. `unknown` names parameters of `system`, and
    of x_r, v_r, v_c, phase, x_c of the start (x_c: where the capsule's position was zero); the
    others are known, and what is given for the unknown is the first guess. All is dimensionless, or
    in SI units where `system` is PhysicalParameters. Each column's residuals count in units of its
    standard deviation; `loss` is one of SciPy's. `starts` draws so many other guesses, within
    `bounds` or else between half and twice the guess, and the best `follow` are followed; `seed`
    makes them others. `steps` is how many runs with derivatives each may take. `bootstrap` is how
    many fits to resampled residuals follow, for `Fit.bootstrap`. After `max_seconds` the result has
    the best values that were tried. `progress` is called with what is done, in
    words.

    Raises InvalidInput for columns, names, bounds or values that are not allowed.
    """
    own = names_of(system)
    for name in unknown:
        if name not in own and name not in OF_START:
            raise InvalidInput("unknown", name, f"one of {', '.join((*own, *OF_START))}")
    if not unknown or len(set(unknown)) < len(unknown):
        raise InvalidInput("unknown", ", ".join(unknown), "one or more different names")
    given = dict(zip(STATE, checked_state(state), strict=True)) | {PHASE: phase}
    run = Recorded(measured(data), system, tuple(unknown), given)
    problem = Problem([run], unknown, progress)
    limits = limits_of(problem, bounds or {})
    return fitted(problem, limits, loss, starts, follow, seed, steps, bootstrap, max_seconds)


def checked_state(state: Sequence[float]) -> tuple[float, ...]:
    """A start's state; raises InvalidInput unless it is three finite numbers."""
    if not isinstance(state, Sequence | np.ndarray) or len(state) != 3 or not all(map(real, state)):
        raise InvalidInput("state", state, "three finite numbers")
    return tuple(state)


def fitted(
    problem: Problem,
    limits: tuple[Vector, Vector],
    loss: str,
    starts: int,
    follow: int,
    seed: int,
    steps: int,
    bootstrap: int,
    max_seconds: float,
) -> Fit:
    """The fit of a problem; arguments are those of `fit`, checked here."""
    check_one_of("loss", loss, LOSSES)
    check_count("starts", starts, *STARTS)
    check_count("follow", follow, *FOLLOW)
    check_count("seed", seed, *SEED)
    check_count("steps", steps, *STEPS)
    check_count("bootstrap", bootstrap, *BOOTSTRAP)
    found, errors, border, again = list[Least](), None, None, None
    guesses = [problem.guess]
    with Watch(checked_seconds(max_seconds)):
        guesses += drawn(problem, limits, starts, seed)
        guesses = best_of(problem, guesses)[:follow]
        for k, guess in enumerate(guesses, 1):
            problem.doing = f"start {k} of {len(guesses)}"
            found.append(least(problem, guess, limits, loss, steps))
            check_time()
        best = min(found, key=lambda one: one.cost)
        errors = errors_of(problem, best)
        border = _border(problem, best.x, errors.standard, *limits)
        if bootstrap:
            again = bootstrapped(problem, best, limits, bootstrap, seed, steps)
    best = min(found, key=lambda one: one.cost)
    errors = errors or errors_of(problem, best)
    return _result(problem, best, errors, limits, border, again)


def _result(
    problem: Problem,
    found: Least,
    errors: Errors,
    limits: tuple[Vector, Vector],
    border: str | None,
    bootstrap: Bootstrap | None,
) -> Fit:
    """Result of the least squares that fit best; without a border the time was over."""
    values = found.x
    status = FitStatus.CONVERGED if found.success else FitStatus.NOT_CONVERGED
    message = "the least squares came to rest" if found.success else found.message
    bound = (values <= limits[0]) | (values >= limits[1])
    if border is None:
        status, message = FitStatus.TIME_LIMIT, "the time is over: these are the best values so far"
    elif errors.lost:
        apart = [
            name
            for name, error in zip(problem.unknown, errors.standard, strict=True)
            if math.isinf(error)
        ]
        status = FitStatus.NOT_IDENTIFIABLE
        message = f"the measurements cannot tell apart or do not show {', '.join(apart)}"
    elif bootstrap and not bootstrap.success:
        status, message = FitStatus.TIME_LIMIT, "the time is over: the bootstrap has fewer fits"
    elif bound.any():
        names = [name for name, at in zip(problem.unknown, bound, strict=True) if at]
        message += f", with {', '.join(names)} at a bound"
    problem.progress = None
    pairs = zip(problem.recorded, problem.places, strict=True)
    return Fit(
        runs=tuple(_run(run, values[places]) for run, places in pairs),
        values=dict(zip(problem.unknown, values.tolist(), strict=True)),
        standard_errors=dict(zip(problem.unknown, errors.standard.tolist(), strict=True)),
        covariance=errors.covariance,
        status=status,
        message=message,
        evaluations=problem.evaluations,
        noise=errors.noise,
        autocorrelation=correlation(found.loss.influence(found.residuals)[0], problem.groups),
        singular_values=errors.singular,
        open_combinations=errors.lost,
        border=border or "",
        problem=problem,
        limits=limits,
        found=found,
        growth=errors.growth,
        bootstrap=bootstrap,
    )


def _run(run: Recorded, values: Vector) -> FittedRun:
    """What was found of a run."""
    now = run.now(values)
    series = {
        one: (now[run.scale_of(one)], now[f"offset_{one}"], now[f"drift_{one}"])
        for one in run.data.names
    }
    x_r, v_r, v_c = (now[one] for one in STATE)
    return FittedRun(
        run.name, run.system_at(values), (x_r, v_r, v_c), now[PHASE], now["slip"], series
    )


def _border(problem: Problem, values: Vector, errors: Vector, low: Vector, high: Vector) -> str:
    """Which value, a standard error off, has another itinerary."""
    problem.doing = "itineraries beside it"
    for i, name in enumerate(problem.unknown):
        if problem.linear[i]:
            continue
        itinerary = problem.itinerary(values, i)
        for sign in (-1.0, 1.0):
            moved = values.copy()
            moved[i] += sign * errors[i] if math.isfinite(errors[i]) else 0.0
            if low[i] <= moved[i] <= high[i] and problem.itinerary(moved, i) != itinerary:
                return name
    return ""
