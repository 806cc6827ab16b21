"""Parameters, start and phase of a device from measured time series, by least squares.

The residuals' Jacobian is exact: it is that of the closed forms, carried through every switch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._design.counts import FOLLOW, SEED, STARTS, STEPS
from capsule_sym._design.measured import OF_STATE, Measured, measured
from capsule_sym._design.quantities import System, dimensionless, real, values_of
from capsule_sym._design.sensitivities import SLOPES, START, sensitivities
from capsule_sym._design.units import DEVICE, slopes_of
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._map.labelled import package
from capsule_sym._native import Watch
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._parameters import POSITIVE, Parameters, PhysicalParameters, names_of

LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
_OF_START = (*START, "x_c")
_BLOCK = 2**15  # times whose derivatives, all 48 of each, are in memory at once
_LOST = 1e-8  # a combination whose scaled singular value is below this share of the largest
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
    success: bool
    """Whether the fit converged and the measurements determine every unknown."""
    status: FitStatus
    """How it ended."""
    message: str
    """The same as a sentence."""
    evaluations: int
    """Runs with derivatives that it took."""
    noise: float
    """Standard deviation of the residuals, in units of each column's `scales`."""
    residuals: Vector
    """Model less measurement over `scales`, shape (n,), in the order of time."""
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
    loss: str
    """How residuals counted."""
    loss_scale: float
    """The residual from which a robust loss lets them count less, in units of `residuals`."""
    least: float
    """Sum of the residuals' squares, as the loss counts them."""

    def __repr__(self) -> str:
        told = ", ".join(
            f"{name} = {value:.6g} +/- {self.standard_errors[name]:.1g}"
            for name, value in self.values.items()
        )
        return f"<Fit: {told}, {self.status}>"

    def to_dict(self) -> dict[str, Any]:
        """The results by name, of numbers, texts and lists."""
        return {
            "success": self.success,
            "status": str(self.status),
            "message": self.message,
            "evaluations": self.evaluations,
            "values": self.values,
            "standard_errors": self.standard_errors,
            "covariance": self.covariance.tolist(),
            "parameters": values_of(self.system),
            "state": list(self.state),
            "phase": self.phase,
            "noise": self.noise,
            "singular_values": self.singular_values.tolist(),
            "open_combinations": list(self.open_combinations),
            "border": self.border,
        }

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
        self.problem.watch = Watch(checked_seconds(max_seconds))
        with suppress(_Over):
            for i, sign in enumerate((-1, 1)):
                ends[i] = _edge(self, name, sign * deviations)
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
    watch = Watch(checked_seconds(max_seconds))
    problem = Problem(measured(data), system, tuple(unknown), tuple(state), phase, watch, progress)
    low, high = _limits(problem, bounds or {})
    guesses = [problem.guess, *_drawn(problem, low, high, starts, seed)]
    if starts:
        guesses = _best(problem, guesses)[:follow]
    found = list[_Least]()
    for k, guess in enumerate(guesses, 1):
        if k == 1 or not watch.over:
            problem.doing = f"start {k} of {len(guesses)}"
            found.append(_least(problem, guess, low, high, loss, steps))
    best = min(found, key=lambda one: one.cost)
    return _result(problem, best, low, high, loss)


def _best(problem: Problem, guesses: Sequence[Vector]) -> list[Vector]:
    """The guesses by their cost, as far as there is time to look at them, the best first."""
    costs = list[float]()
    with suppress(_Over):
        for k, guess in enumerate(guesses, 1):
            problem.doing = f"guess {k} of {len(guesses)}"
            costs.append(problem.cost(guess))
    order = np.argsort(costs, kind="stable").tolist() or [0]
    return [guesses[i] for i in order]


class _Over(Exception):
    """The time is over."""


class _Run(NamedTuple):
    """A motion at values of the unknown, its times (n,), and its start in units of the model."""

    trajectory: Trajectory | None
    """None where it does not reach the last of the times."""
    times: Vector
    start: Vector
    phase: float
    whole: float
    """Derivative by omega of the whole periods that the phase is reduced by."""
    units: Vector
    """Of length and of speed, twice."""

    @property
    def itinerary(self) -> str:
        """The fields that were passed."""
        if self.trajectory is None:
            return "open"
        return " ".join(f"F{field}" for field in self.trajectory.records["field"].tolist())


@dataclass
class Problem:
    """Residuals and their Jacobian at values of the unknown."""

    data: Measured
    system: System
    unknown: tuple[str, ...]
    state: tuple[float, ...]
    phase: float
    watch: Watch = field(default_factory=Watch)
    progress: Callable[[str], object] | None = None
    doing: str = ""
    """What is done, in words."""

    def __post_init__(self) -> None:
        own = names_of(self.system)
        for name in self.unknown:
            if name not in own and name not in _OF_START:
                raise InvalidInput("unknown", name, f"one of {', '.join((*own, *_OF_START))}")
        if not self.unknown or len(set(self.unknown)) < len(self.unknown):
            raise InvalidInput("unknown", ", ".join(self.unknown), "one or more different names")
        if len(self.state) != 3 or not all(map(real, self.state)):
            raise InvalidInput("state", self.state, "three finite numbers")
        if not real(self.phase):
            raise InvalidInput("phase", self.phase, "a finite number")
        if len(self.unknown) >= len(self.data.values):
            raise InvalidInput("data", f"{len(self.data.values)} values", "more than are unknown")
        known = dict(zip(_OF_START, (*self.state, self.phase, 0.0), strict=True))
        self.base = {name: getattr(self.system, name) for name in own} | known
        self.guess = np.array([float(self.base[name]) for name in self.unknown])
        self.scales = np.array(
            [self.data.values[self.data.column == k].std() for k in range(len(self.data.names))]
        )[self.data.column]
        self.rows = np.array([OF_STATE[name] for name in self.data.names])[self.data.column]
        self.speeds = np.array([name.startswith("v") for name in self.data.names])[self.data.column]
        self.elapsed = self.data.times - self.data.begin
        self.different, self.which = np.unique(self.elapsed, return_inverse=True)
        self.evaluations = 0
        self._last: tuple[bytes, Vector, Matrix, str] | None = None

    def residuals(self, values: Vector) -> Vector:
        """Residuals (n,)."""
        return self.at(values)[0]

    def jacobian(self, values: Vector) -> Matrix:
        """Their Jacobian (n, k)."""
        return self.at(values)[1]

    def cost(self, values: Vector) -> float:
        """Half the sum of the residuals' squares."""
        return float(np.sum(self._at(values, slopes=False)[0] ** 2) / 2)

    def itinerary(self, values: Vector) -> str:
        """The run's itinerary."""
        return self._run(values).itinerary

    def at(self, values: Vector) -> tuple[Vector, Matrix, str]:
        """Residuals (n,), their Jacobian (n, k), and the run's itinerary."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self._at(values))
        return self._last[1:]

    def now(self, values: Vector) -> dict[str, float]:
        """All values by name, with these of the unknown."""
        return self.base | dict(zip(self.unknown, values.tolist(), strict=True))

    def system_at(self, values: Vector) -> System:
        """The system with these values of the unknown."""
        now = self.now(values)
        return type(self.system)(**{name: now[name] for name in names_of(self.system)})

    def _run(self, values: Vector) -> _Run:
        """The motion at these values; raises _Over where there is no time for it."""
        self.evaluations += 1
        if self.progress is not None:
            self.progress(f"{self.doing}, {self.evaluations} runs")
        now, system = self.now(values), self.system_at(values)
        device = system if isinstance(system, PhysicalParameters) else None
        p = dimensionless(system)
        length, rate = (
            (1.0, 1.0) if device is None else (device.length_scale, device.natural_frequency)
        )
        units = np.array([length, length * rate, length * rate])
        start = np.array([now["x_r"], now["v_r"], now["v_c"]]) / units
        phase = now["phase"] * rate
        reduced = phase % p.period
        reduced = 0.0 if reduced >= p.period else reduced
        times = reduced + self.different * rate
        periods = max(1, math.ceil(times[-1] / p.period + 1e-9))
        run = simulate(p, tuple(start.tolist()), reduced, periods, max_seconds=self.watch.left)
        if self.watch.over:
            raise _Over
        lost = not run.success or times[-1] > run.span[1]
        return _Run(None if lost else run, times, start, phase, (phase - reduced) / p.omega, units)

    def _at(self, values: Vector, slopes: bool = True) -> tuple[Vector, Matrix, str]:
        at = self._run(values)
        count = len(self.elapsed)
        residuals, jacobian = np.full(count, 1e3), np.zeros((slopes * count, len(values)))
        if at.trajectory is not None:
            for first in range(0, len(self.different), _BLOCK):
                if self.watch.over:
                    raise _Over
                block = slice(first, first + _BLOCK)
                rows = slice(*np.searchsorted(self.which, (first, first + _BLOCK)))
                states, moved = self._states(values, at, block, slopes)
                which, unit = (
                    self.which[rows] - first,
                    np.where(self.speeds[rows], *at.units[1::-1]),
                )
                model = np.sum(self.rows[rows] * states[which], axis=1)
                residuals[rows] = (unit * model - self.data.values[rows]) / self.scales[rows]
                if moved is not None:
                    by = np.einsum("nk,nkj->nj", self.rows[rows], moved[0][which])
                    by += model[:, None] * (moved[1] + self.speeds[rows, None] * moved[2])
                    jacobian[rows] = by * (unit / self.scales[rows])[:, None]
        return residuals, jacobian, at.itinerary

    def _states(
        self, values: Vector, at: _Run, block: slice, differentiated: bool
    ) -> tuple[Matrix, tuple[NDArray[np.float64], Vector, Vector] | None]:
        """States (n, 4) at some of the times, and their derivatives (n, 4, k) by the unknown.

        With these come the derivatives (k,) of the logarithms of the units of length and rate.
        """
        assert at.trajectory is not None
        here = self.now(values)["x_c"] / at.units[0]
        if not differentiated:
            states = at.trajectory(at.times[block], position=True)
            states[:, 3] += here
            return states, None
        system = self.system_at(values)
        device = system if isinstance(system, PhysicalParameters) else None
        found = sensitivities(at.trajectory, at.times[block])
        # After a tangential switch there are none.
        slopes = np.where(np.isfinite(found.slopes), found.slopes, 0.0)
        # The phase was taken less whole periods, which depend on omega.
        slopes[..., SLOPES.index("omega")] += slopes[..., 3] * at.whole
        chain, by_length, by_rate = self._chain(device, at.units, at.start, at.phase)
        states = found.states
        states[:, 3] += here
        moved = slopes @ chain
        elapsed = self.different[block] * (at.units[1] / at.units[0])
        moved += found.rates[..., None] * (elapsed[:, None, None] * by_rate)
        if "x_c" in self.unknown:
            moved[:, 3, self.unknown.index("x_c")] += 1.0 / at.units[0]
        moved[:, 3] -= here * by_length
        return states, (moved, by_length, by_rate)

    def _chain(
        self, device: PhysicalParameters | None, units: Vector, start: Vector, phase: float
    ) -> tuple[Matrix, Vector, Vector]:
        """Derivatives of SLOPES by the unknown (11, k), and of the logarithms of the units (k,)."""
        chain, by_length, by_rate = (
            np.zeros((11, len(self.unknown))),
            *np.zeros((2, len(self.unknown))),
        )
        by_device = None if device is None else slopes_of(device)
        rate = 1.0 if device is None else device.natural_frequency
        for k, name in enumerate(self.unknown):
            if by_device is not None and name in DEVICE:
                column = DEVICE.index(name)
                chain[4:, k] = by_device.parameters[:, column]
                by_length[k], by_rate[k] = by_device.length[column], by_device.rate[column]
            elif name in PARAMETERS:
                chain[SLOPES.index(name), k] = 1.0
            elif name in START:
                chain[START.index(name), k] = (
                    rate if name == "phase" else 1.0 / units[START.index(name)]
                )
        # The start is held in SI units: in those of the device it moves as they do.
        chain[0] -= start[0] * by_length
        chain[1:3] -= start[1:, None] * (by_length + by_rate)
        chain[3] += phase * by_rate
        return chain, by_length, by_rate


def _limits(problem: Problem, bounds: Mapping[str, tuple[float, float]]) -> tuple[Vector, Vector]:
    """Lowest and highest values of the unknown."""
    for name in bounds:
        if name not in problem.unknown:
            raise InvalidInput("bounds", name, f"one of {', '.join(problem.unknown)}")
    low, high = np.full((2, len(problem.unknown)), np.inf) * [[-1], [1]]
    for k, name in enumerate(problem.unknown):
        if name not in _OF_START:
            low[k] = 1e-12 if name in POSITIVE else 0.0
        if name in bounds:
            first, last = bounds[name]
            if not low[k] <= first < last:
                allowed = f"two numbers that ascend, from {low[k]:g} on"
                raise InvalidInput(f"bounds of {name}", (first, last), allowed)
            low[k], high[k] = first, last
        if not low[k] <= problem.guess[k] <= high[k]:
            raise InvalidInput(name, problem.guess[k], f"from {low[k]:g} to {high[k]:g} at first")
    return low, high


def _drawn(problem: Problem, low: Vector, high: Vector, count: int, seed: int) -> list[Vector]:
    """Guesses between the bounds, or where there are none between half and twice the guess."""
    if not count:
        return []
    Sobol = package("scipy.stats.qmc", "design").Sobol
    size = np.where(problem.guess == 0.0, 1.0, np.abs(problem.guess))
    first = np.where(
        np.isfinite(high), low, np.where(np.isfinite(low), size / 2, problem.guess - size)
    )
    last = np.where(
        np.isfinite(high), high, np.where(np.isfinite(low), 2 * size, problem.guess + size)
    )
    if "phase" in problem.unknown and not np.isfinite(high[problem.unknown.index("phase")]):
        k, system = problem.unknown.index("phase"), problem.system
        first[k] = 0.0
        last[k] = system.period if isinstance(system, Parameters) else 2 * math.pi / system.Omega
    draws = Sobol(len(first), seed=seed).random_base2(max(0, int(count - 1).bit_length()))[:count]
    return list(first + draws * (last - first))


class _Least(NamedTuple):
    """End of the least squares, with the loss's weights in the Jacobian where it is a minimum."""

    x: Vector
    cost: float
    residuals: Vector
    jac: Matrix
    success: bool
    message: str
    scale: float
    """Of a robust loss: from the residuals that are left at last."""


def _least(
    problem: Problem, guess: Vector, low: Vector, high: Vector, loss: str, steps: int
) -> _Least:
    """The least squares from a guess, as far as there is time."""
    least_squares = package("scipy.optimize", "design").least_squares

    def solve(start: Vector, loss: str, scale: float) -> _Least:
        best = _Least(
            start,
            math.inf,
            np.full(len(problem.elapsed), np.nan),
            np.zeros((len(problem.elapsed), len(start))),
            False,
            "",
            scale,
        )

        def residuals(values: Vector) -> Vector:
            nonlocal best
            found, jacobian, _ = problem.at(values)
            cost = _counted(found, loss, scale) / 2
            if cost < best.cost:
                best = _Least(values.copy(), cost, found, jacobian, False, "", scale)
            return found

        try:
            found = least_squares(
                residuals,
                start,
                problem.jacobian,
                bounds=(low, high),
                x_scale="jac",
                loss=loss,
                f_scale=scale,
                ftol=1e-14,
                xtol=1e-12,
                gtol=1e-14,
                max_nfev=steps,
            )
        except _Over:
            return best
        success = bool(found.success) and problem.at(found.x)[2] != "open"
        rest = found.fun, found.jac, success, str(found.message), scale
        return _Least(found.x, float(found.cost), *rest)

    if loss == "linear":
        return solve(np.clip(guess, low, high), loss, 1.0)
    found = solve(np.clip(guess, low, high), "soft_l1", 0.1)
    for _ in range(2):
        if problem.watch.over:
            break
        again = solve(found.x, loss, 2.0 * _spread(found.residuals, loss) + 1e-300)
        found = again if math.isfinite(again.cost) else found
    return found


def _spread(residuals: Vector, loss: str, unknown: int = 0) -> float:
    """Standard deviation of the residuals; by their median where some may be far off."""
    if loss != "linear":
        return float(1.4826 * np.median(np.abs(residuals)))
    return math.sqrt(float(residuals @ residuals) / max(1, len(residuals) - unknown))


def _result(problem: Problem, found: _Least, low: Vector, high: Vector, loss: str) -> Fit:
    """Result of the least squares that fit best."""
    values, k = found.x, len(found.x)
    noise = _spread(found.residuals, loss, k)
    size = np.where(values == 0.0, 1.0, np.abs(values))
    _, singular, directions = np.linalg.svd(found.jac * size, full_matrices=False)
    kept = singular > _LOST * singular[0]
    inverse = directions[kept].T / singular[kept]
    covariance = noise**2 * (inverse @ inverse.T) * np.outer(size, size)
    errors = np.sqrt(np.diag(covariance))
    lost = [dict(zip(problem.unknown, row.tolist(), strict=True)) for row in directions[~kept]]
    for row in lost:
        for i, name in enumerate(problem.unknown):
            if abs(row[name]) > 0.1:
                errors[i] = math.inf
    border = ""
    with suppress(_Over):
        border = _border(problem, values, errors, low, high)
    status = FitStatus.CONVERGED if found.success else FitStatus.NOT_CONVERGED
    message = "the least squares came to rest" if found.success else found.message
    at_bound = [
        n for n, v, a, b in zip(problem.unknown, values, low, high, strict=True) if v <= a or v >= b
    ]
    if problem.watch.over:
        status, message = FitStatus.TIME_LIMIT, "the time is over: these are the best values so far"
    elif lost:
        status, message = FitStatus.NOT_IDENTIFIABLE, "the measurements leave a combination open"
    elif at_bound:
        message += f", with {', '.join(at_bound)} at a bound"
    problem.watch, problem.progress = Watch(), None
    system = problem.system_at(values)
    named, now = dict(zip(problem.unknown, values.tolist(), strict=True)), problem.now(values)
    return Fit(
        system=system,
        state=(now["x_r"], now["v_r"], now["v_c"]),
        phase=now["phase"],
        values=named,
        standard_errors=dict(zip(problem.unknown, errors.tolist(), strict=True)),
        covariance=covariance,
        success=status is FitStatus.CONVERGED,
        status=status,
        message=message,
        evaluations=problem.evaluations,
        noise=noise,
        residuals=found.residuals,
        singular_values=singular,
        open_combinations=tuple(lost),
        border=border,
        problem=problem,
        limits=(low, high),
        loss=loss,
        loss_scale=found.scale,
        least=2.0 * found.cost,
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


def _shape(loss: str, z: Vector) -> tuple[Vector, Vector, Vector]:
    """SciPy's loss of squared residuals z over its scale, and its first two derivatives."""
    one = np.ones_like(z)
    if loss == "soft_l1":
        root = np.sqrt(1 + z)
        return 2 * (root - 1), 1 / root, -0.5 / root**3
    if loss == "huber":
        root = np.sqrt(np.maximum(z, 1.0))
        return np.where(z <= 1, z, 2 * root - 1), 1 / root, np.where(z <= 1, 0.0, -0.5 / root**3)
    if loss == "cauchy":
        return np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2
    if loss == "arctan":
        return np.arctan(z), 1 / (1 + z**2), -2 * z / (1 + z**2) ** 2
    return z, one, 0 * z


def _counted(residuals: Vector, loss: str, scale: float) -> float:
    """The sum of residuals' squares as the loss counts them."""
    return float(scale**2 * _shape(loss, (residuals / scale) ** 2)[0].sum())


def _variance(fitted: Fit) -> float:
    """By how much the sum grows where a value is a standard error off.

    That of an M-estimator: the mean square of the influence over its mean slope (Huber, Robust
    Statistics, 1981, section 6.3).
    """
    if fitted.loss == "linear":
        return fitted.noise**2
    z = (fitted.residuals / fitted.loss_scale) ** 2
    _, first, second = _shape(fitted.loss, z)
    influence, slope = fitted.residuals * first, first + 2 * z * second
    return float(np.mean(influence**2) / np.mean(slope))


def _edge(fitted: Fit, name: str, deviations: float) -> float:
    """Where the sum of squares has grown so far on one side of an unknown."""
    optimize = package("scipy.optimize", "design")
    problem, k = fitted.problem, list(fitted.values).index(name)
    values = np.array(list(fitted.values.values()))
    others = [i for i in range(len(values)) if i != k]
    low, high = fitted.limits
    robust: Any = {"loss": fitted.loss, "f_scale": fitted.loss_scale}
    variance = _variance(fitted)
    guess = values[others]

    def grown(at: float) -> float:
        nonlocal guess
        if not others:
            total = _counted(problem.residuals(np.array([at])), fitted.loss, fitted.loss_scale)
        else:

            def whole(part: Vector) -> Vector:
                full = np.empty(len(values))
                full[k], full[others] = at, part
                return full

            def residuals(part: Vector) -> Vector:
                found: Vector = problem.residuals(whole(part))
                return found

            def jacobian(part: Vector) -> Matrix:
                found: Matrix = problem.jacobian(whole(part))[:, others]
                return found

            found = optimize.least_squares(
                residuals,
                guess,
                jacobian,
                bounds=(low[others], high[others]),
                x_scale="jac",
                **robust,
            )
            guess, total = found.x, 2 * found.cost
        return float((total - fitted.least) / variance - deviations**2)

    step = deviations * fitted.standard_errors[name]
    if math.isinf(step):  # the measurements leave it open
        return float(high[k] if step > 0 else low[k])
    far = values[k] + step
    for _ in range(20):
        far = float(np.clip(far, low[k], high[k]))
        if far == values[k]:
            return far
        if grown(far) >= 0:
            edge: float = optimize.brentq(grown, values[k], far, xtol=1e-6 * abs(step))
            return edge
        if far in (low[k], high[k]):
            return far
        step *= 1.5
        far = values[k] + step
    return math.copysign(math.inf, deviations)
