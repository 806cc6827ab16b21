"""Parameters, start and phase of a device from measured time series, by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._design.counts import FOLLOW, SEED, STARTS, STEPS
from capsule_sym._design.least_squares import LOSSES, Least, Profile, least
from capsule_sym._design.measured import measured
from capsule_sym._design.quantities import System, allowed, record, values_of
from capsule_sym._design.residuals import OF_START, Problem
from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._map.labelled import package
from capsule_sym._native import TimeUp, Watch, check_time
from capsule_sym._parameters import SceneParameters

_LOST = 1e-8  # a combination whose scaled singular value is below this share of the largest
_PART = 0.1  # of a combination, from which an unknown is open with it
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
class Fit:
    """Result of a fit.

    Values are dimensionless, or in SI units where the system that was fitted is a device. Standard
    errors and intervals hold for independent errors of the measurements, where the model is nearly
    linear over them.
    """

    system: System
    """The parameters, those that were known among them."""
    state: tuple[float, float, float]
    """(x_r, v_r, v_c) at the first time."""
    phase: float
    """Phase of the forcing there."""
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
    """Standard deviation of the residuals, in units of each column's `scales`."""
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

    @property
    def success(self) -> bool:
        """Whether the fit converged and the measurements determine every unknown."""
        return self.status is FitStatus.CONVERGED

    @property
    def residuals(self) -> Vector:
        """Model less measurement over `scales`, shape (n,), in the order of time."""
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
        """The results by name, of numbers, texts and lists."""
        return (
            record(self, "success status message evaluations values standard_errors covariance")
            | {"parameters": values_of(self.system)}
            | record(self, "state phase noise singular_values open_combinations border")
        )

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The n measurements in time, shape (n,): time, column, value, and residual over noise."""
        data = self.problem.data
        return {
            "t": data.times,
            "column": np.array([data.names[place] for place in data.column.tolist()], np.str_),
            "value": data.values,
            "residual": self.residuals / (self.noise or 1.0),
        }

    def interval(
        self, name: str, deviations: float = 1.96, *, max_seconds: float = math.inf
    ) -> tuple[float, float]:
        """Profile interval of an unknown: where the others, fitted anew, still fit.

        The sum of squares, as the loss counts them, grows there by `deviations` squared times the
        noise's variance; of a robust loss that is the variance of its influence over its mean
        slope, which outliers hardly change. Where it does not grow so far within the bounds of the
        fit, the bound is the end. An end that is not found within `max_seconds` is nan. Raises
        InvalidInput for another name.
        """
        if name not in self.values:
            raise InvalidInput("name", name, f"one of {', '.join(self.values)}")
        ends = [math.nan, math.nan]
        k = list(self.values).index(name)
        with Watch(checked_seconds(max_seconds)):
            for i, sign in enumerate((-1, 1)):
                profile = Profile(self.problem, self.found, self.limits, k, self.noise)
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
    makes them others. `steps` is how many runs with derivatives each may take. After `max_seconds`
    the result has the best values that were tried. `progress` is called with what is done, in
    words.

    Raises InvalidInput for columns, names, bounds or values that are not allowed.
    """
    if loss not in LOSSES:
        raise InvalidInput("loss", loss, f"one of {', '.join(LOSSES)}")
    check_count("starts", starts, *STARTS)
    check_count("follow", follow, *FOLLOW)
    check_count("seed", seed, *SEED)
    check_count("steps", steps, *STEPS)
    problem = Problem(measured(data), system, tuple(unknown), tuple(state), phase, progress)
    limits = _limits(problem, bounds or {})
    found, errors, border = list[Least](), None, None
    with Watch(checked_seconds(max_seconds)):
        guesses = [problem.guess, *_drawn(problem, *limits, starts, seed)]
        if starts:
            guesses = _best(problem, guesses)[:follow]
        for k, guess in enumerate(guesses, 1):
            problem.doing = f"start {k} of {len(guesses)}"
            found.append(least(problem, guess, limits, loss, steps))
            check_time()
        best = min(found, key=lambda one: one.cost)
        errors = _errors(problem, best)
        border = _border(problem, best.x, errors.standard, *limits)
    best = min(found, key=lambda one: one.cost)
    return _result(problem, best, errors or _errors(problem, best), limits, border)


def _best(problem: Problem, guesses: Sequence[Vector]) -> list[Vector]:
    """The guesses by their cost, as far as there is time to look at them, the best first."""
    costs = list[float]()
    with suppress(TimeUp):
        for k, guess in enumerate(guesses, 1):
            problem.doing = f"guess {k} of {len(guesses)}"
            costs.append(problem.cost(guess))
    order = np.argsort(costs, kind="stable").tolist() or [0]
    return [guesses[i] for i in order]


def _limits(problem: Problem, bounds: Mapping[str, tuple[float, float]]) -> tuple[Vector, Vector]:
    """Lowest and highest values of the unknown."""
    for name in bounds:
        if name not in problem.unknown:
            raise InvalidInput("bounds", name, f"one of {', '.join(problem.unknown)}")
    low, high = np.full((2, len(problem.unknown)), np.inf) * [[-1], [1]]
    for k, name in enumerate(problem.unknown):
        if name not in OF_START:
            low[k], high[k] = allowed(problem.system, name)
        if name in bounds:
            first, last = bounds[name]
            if not low[k] <= first < last <= high[k]:
                told = f"two numbers that ascend, from {low[k]:g} "
                told += "on" if high[k] == np.inf else f"to {high[k]:g}"
                raise InvalidInput(f"bounds of {name}", (first, last), told)
            low[k], high[k] = first, last
        if not low[k] <= problem.guess[k] <= high[k]:
            raise InvalidInput(name, problem.guess[k], f"from {low[k]:g} to {high[k]:g} at first")
    return low, high


def _drawn(problem: Problem, low: Vector, high: Vector, count: int, seed: int) -> list[Vector]:
    """Guesses between the bounds, or where there are none between half and twice the guess."""
    if not count:
        return []
    Sobol = package("scipy.stats.qmc", "design").Sobol
    guess, bounded, above = problem.guess, np.isfinite(high), np.isfinite(low)
    size = np.where(guess == 0.0, 1.0, np.abs(guess))
    first = np.select([bounded, above], [low, size / 2], guess - size)
    last = np.select([bounded, above], [high, 2 * size], guess + size)
    if "phase" in problem.unknown and not np.isfinite(high[problem.unknown.index("phase")]):
        k, system = problem.unknown.index("phase"), problem.system
        first[k] = 0.0
        last[k] = system.period if isinstance(system, SceneParameters) else math.tau / system.rate
    draws = Sobol(len(first), seed=seed).random_base2(max(0, int(count - 1).bit_length()))[:count]
    return list(first + draws * (last - first))


class _Errors(NamedTuple):
    """What a fit leaves uncertain: noise, covariance (k, k), standard errors (k,)."""

    noise: float
    covariance: Matrix
    standard: Vector
    singular: Vector
    """Singular values of the Jacobian by relative changes, (k,)."""
    lost: tuple[dict[str, float], ...]
    """Relative changes that the measurements cannot tell from none."""


def _errors(problem: Problem, found: Least) -> _Errors:
    """Errors of the values that fit best, to first order."""
    noise = found.loss.spread(found.residuals, len(found.x))
    size = np.where(found.x == 0.0, 1.0, np.abs(found.x))
    _, singular, directions = np.linalg.svd(found.jac * size, full_matrices=False)
    kept = singular > _LOST * singular[0]
    inverse = directions[kept].T / singular[kept]
    covariance = noise**2 * (inverse @ inverse.T) * np.outer(size, size)
    standard = np.sqrt(np.diag(covariance))
    standard[np.any(np.abs(directions[~kept]) > _PART, axis=0)] = math.inf
    lost = [dict(zip(problem.unknown, row.tolist(), strict=True)) for row in directions[~kept]]
    return _Errors(noise, covariance, standard, singular, tuple(lost))


def _result(
    problem: Problem,
    found: Least,
    errors: _Errors,
    limits: tuple[Vector, Vector],
    border: str | None,
) -> Fit:
    """Result of the least squares that fit best; without a border the time was over."""
    values = found.x
    status = FitStatus.CONVERGED if found.success else FitStatus.NOT_CONVERGED
    message = "the least squares came to rest" if found.success else found.message
    bound = (values <= limits[0]) | (values >= limits[1])
    if border is None:
        status, message = FitStatus.TIME_LIMIT, "the time is over: these are the best values so far"
    elif errors.lost:
        status, message = FitStatus.NOT_IDENTIFIABLE, "the measurements leave a combination open"
    elif bound.any():
        names = [name for name, at in zip(problem.unknown, bound, strict=True) if at]
        message += f", with {', '.join(names)} at a bound"
    problem.progress = None
    now = problem.now(values)
    return Fit(
        system=problem.system_at(values),
        state=(now["x_r"], now["v_r"], now["v_c"]),
        phase=now["phase"],
        values=dict(zip(problem.unknown, values.tolist(), strict=True)),
        standard_errors=dict(zip(problem.unknown, errors.standard.tolist(), strict=True)),
        covariance=errors.covariance,
        status=status,
        message=message,
        evaluations=problem.evaluations,
        noise=errors.noise,
        singular_values=errors.singular,
        open_combinations=errors.lost,
        border=border or "",
        problem=problem,
        limits=limits,
        found=found,
    )


def _border(problem: Problem, values: Vector, errors: Vector, low: Vector, high: Vector) -> str:
    """Which value, a standard error off, has another itinerary."""
    problem.doing = "itineraries beside it"
    itinerary = problem.itinerary(values)
    for i, name in enumerate(problem.unknown):
        for sign in (-1.0, 1.0):
            moved = values.copy()
            moved[i] += sign * errors[i] if math.isfinite(errors[i]) else 0.0
            if low[i] <= moved[i] <= high[i] and problem.itinerary(moved) != itinerary:
                return name
    return ""
