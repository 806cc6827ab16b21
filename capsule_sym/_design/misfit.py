"""Residuals of a run at measured times, with their exact Jacobian, and first guesses of a fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.functions import allowed
from capsule_sym._design.measured import OF_STATE, Measured, about_trend
from capsule_sym._errors import InvalidInput, check_one_of, counted
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.checks import checked_ends
from capsule_sym._map.sensitivities import START, columns_of, sensitivities
from capsule_sym._native.watch import silent
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.quantities import varied
from capsule_sym._parameters import SceneDevice, names_of
from capsule_sym._processes import sobol
from capsule_sym._systems import System, dimensionless, drives

OF_START = (*START, "x_c")
STATE, PHASE = START[:-1], START[-1]
LOST = 1e3
"""Residual, in standard deviations of its column, of a motion that ends too early."""


class _Continued(NamedTuple):
    """Motion at values of the unknowns, and the different times (m,) of data; dimensionless."""

    run: Trajectory
    times: Vector
    own: dict[str, Any]
    """Start and parameters, with derivatives by the unknowns."""
    units: dict[str, Slope]
    """Units of the start, with derivatives."""
    whole: float
    """Whole periods by which the phase is reduced, as a time over omega."""


class Misfit:
    """Residuals at values of the unknowns, in standard deviations of each column.

    They are model minus measurement, (n,).
    """

    def __init__(
        self,
        data: Measured,
        system: System,
        unknown: Sequence[str],
        given: Mapping[str, float],
        progress: Callable[[str], object] = silent,
    ) -> None:
        """`given` has state and phase at the first time; of unknowns these are guesses.

        Raises InvalidInput unless there are more values than unknowns.
        """
        self.data, self.system, self.unknown = data, system, tuple(unknown)
        self.progress, self.doing, self.evaluations = progress, "", 0
        own = {one: getattr(system, one) for one in names_of(system)}
        self.base: dict[str, float] = own | {"x_c": 0.0} | dict(given)
        self.guess = np.array([float(self.base[one]) for one in self.unknown])
        self.latest = self.guess
        """Values of the latest Jacobian: the best ones of a search that a time limit ends."""
        if len(self.unknown) >= len(data.values):
            told = counted(len(data.values), "value")
            raise InvalidInput("data", told, "more values than unknowns")
        self.rows = np.array([OF_STATE[one] for one in data.names])[data.column]
        self.speeds = np.array([one.startswith("v") for one in data.names])[data.column]
        spreads = [data.values[data.column == k].std() for k in range(len(data.names))]
        self.scales = np.array(spreads)[data.column]
        self.times, self.which = np.unique(data.times - data.begin, return_inverse=True)

    def now(self, values: Vector) -> dict[str, float]:
        """All values by name, with these values of the unknowns."""
        return self.base | self.named(values)

    def system_at(self, values: Vector) -> System:
        """System with these values of the unknowns."""
        now = self.now(values)
        return type(self.system)(**{name: now[name] for name in names_of(self.system)})

    def named(self, values: Vector) -> dict[str, float]:
        """Values by the names of the unknowns."""
        return dict(zip(self.unknown, values.tolist(), strict=True))

    def sizes(self, values: Vector) -> Vector:
        """Reference sizes for relative changes of the unknowns."""
        units = dict(zip(OF_START, start_units(self.system).tolist(), strict=True))
        least = [max(abs(self.base[one]), units.get(one, 0.0)) for one in self.unknown]
        found = np.maximum(np.abs(values), least)
        return np.where(found == 0.0, 1.0, found)

    def residuals(self, values: Vector) -> Vector:
        """Residuals (n,); all are LOST without a motion up to the last of the times."""
        motion = self._motion(values)
        if motion is None:
            return np.full(len(self.data.values), LOST)
        model = self._quantities(motion, motion.run(motion.times, position=True))
        return np.asarray((self._units(motion) * model - self.data.values) / self.scales)

    def jacobian(self, values: Vector) -> Matrix:
        """Derivatives of the n residuals by the k unknowns, shape (n, k).

        They are 0 for a lost motion. Behind a tangential switch the derivatives of the states do
        not exist and count as 0; those of the units and of the first x_c remain.
        """
        self.latest, motion = values.copy(), self._motion(values)
        if motion is None:
            return np.zeros((len(self.data.values), len(values)))
        own, none, columns = motion.own, np.zeros(len(values)), columns_of(self.system.scene)
        moved = sensitivities(motion.run, motion.times)
        chain = np.array([getattr(own[name], "slope", none) for name in columns])
        # The phase was reduced by whole periods, which depend on omega.
        chain[columns.index(PHASE)] += motion.whole * chain[columns.index("omega")]
        # Derivatives of the logarithms of the units of length and of time.
        by_length, by_time = (motion.units[n].slope / motion.units[n].value for n in ("x_c", PHASE))
        by = np.where(np.isfinite(moved.slopes), moved.slopes, 0.0) @ chain
        elapsed = self.times / motion.units[PHASE].value
        by -= moved.rates[..., None] * (elapsed[:, None, None] * by_time)
        by[:, OF_STATE["x_c"].index(1.0)] += own["x_c"].slope
        each = np.einsum("nk,nkj->nj", self.rows, by[self.which])
        model = self._quantities(motion, moved.states)
        each += model[:, None] * (by_length - self.speeds[:, None] * by_time)
        return np.asarray((self._units(motion) / self.scales)[:, None] * each)

    def _motion(self, values: Vector) -> _Continued | None:
        """Motion at these values; None if it does not reach the last of the times.

        Also None for values out of range; raises InvalidInput if they are the guess.
        """
        self.evaluations += 1
        self.progress(f"{self.doing}, {counted(self.evaluations, 'run')}")
        now = varied(self.system.scene, self.now(values), self.unknown)
        own, units = dict(vars(now)), dict.fromkeys(OF_START, Slope(1.0, np.zeros(len(values))))
        if isinstance(self.system, SceneDevice):
            own, units = own | now.ratios(), {name: now.scale(name) for name in OF_START}
        # The start is fixed in SI units, so that the dimensionless start varies with the units.
        own |= {name: own[name] / unit for name, unit in units.items()}
        try:
            p, phase = dimensionless(self.system_at(values)), own[PHASE].value
            reduced = phase % p.period
            reduced = 0.0 if reduced >= p.period else reduced
            times = reduced + self.times / units[PHASE].value
            periods = max(1, math.ceil(times[-1] / p.period + 1e-9))
            run = simulate(p, tuple(own[name].value for name in STATE), reduced, periods)
        except InvalidInput:  # of values that are out of range
            if np.array_equal(values, self.guess):
                raise
            return None
        if not run.success or times[-1] > run.span[1]:
            return None
        return _Continued(run, times, own, units, (phase - reduced) / p.omega)

    def _quantities(self, motion: _Continued, states: Matrix) -> Vector:
        """Measured quantities (n,) of the states at the different times; dimensionless."""
        origin = motion.own["x_c"].value * np.array(OF_STATE["x_c"])
        return np.asarray(np.sum(self.rows * (states + origin)[self.which], axis=1))

    def _units(self, motion: _Continued) -> Vector:
        """Unit of each value, (n,)."""
        speed, length = (motion.units[name].value for name in ("v_r", "x_c"))
        return np.asarray(np.where(self.speeds, speed, length))


def start_units(system: System) -> Vector:
    """Units of the start, in the order of OF_START."""
    if isinstance(system, SceneDevice):
        return np.array([system.scale(name) for name in OF_START])
    return np.ones(len(OF_START))


def period_of(system: System) -> float:
    """Excitation period, in the system's unit of time."""
    return float(dimensionless(system).period * start_units(system)[OF_START.index(PHASE)])


_AROUND = 4.0  # factor about a guess of the frequency within which the spectrum has its peak


def limits_of(problem: Misfit, bounds: Mapping[str, tuple[float, float]]) -> tuple[Vector, Vector]:
    """Lower and upper bounds of the unknowns, each (k,).

    They are infinite for a start without `bounds`. Raises InvalidInput for bounds of another name,
    for those that are not allowed, and for a guess outside of them.
    """
    for name in bounds:
        check_one_of("bounds", name, problem.unknown)
    low, high = np.full((2, len(problem.unknown)), np.inf) * [[-1], [1]]
    for k, name in enumerate(problem.unknown):
        if name not in OF_START:
            low[k], high[k] = allowed(problem.system, name)
        if name in bounds:
            low[k], high[k] = checked_ends(f"bounds of {name}", bounds[name], low[k], high[k])
        if not low[k] <= (guess := float(problem.guess[k])) <= high[k]:
            raise InvalidInput(name, guess, f"from {low[k]:g} to {high[k]:g} as a guess")
    return low, high


def guesses(problem: Misfit, limits: tuple[Vector, Vector], count: int, seed: int) -> list[Vector]:
    """The given guess, those by the spectrum, and random ones, so many."""
    return [problem.guess, *spectral(problem, limits), *drawn(problem, limits, count, seed)]


def drawn(problem: Misfit, limits: tuple[Vector, Vector], count: int, seed: int) -> list[Vector]:
    """Guesses between the bounds, or without an upper bound between half and twice the guess.

    Without any bound a phase is anywhere in its period, and another value differs from the guess by
    up to its size, or 1 if that is 0.
    """
    if not count:
        return []
    (low, high), guess = limits, problem.guess
    bounded, above = np.isfinite(high), np.isfinite(low)
    size = np.where(guess == 0.0, 1.0, np.abs(guess))
    first = np.select([bounded, above], [low, size / 2], guess - size)
    last = np.select([bounded, above], [high, 2 * size], guess + size)
    for k, name in enumerate(problem.unknown):
        if name == PHASE and not bounded[k]:
            first[k], last[k] = 0.0, period_of(problem.system)
    return list(first + sobol(len(first), count, seed) * (last - first))


def spectral(problem: Misfit, limits: tuple[Vector, Vector]) -> list[Vector]:
    """Guesses with the frequency of the drive at the spectrum's peak, its half and its double.

    Only those within the limits; none if the frequency is known.
    """
    name, data, guess = [*drives(problem.system)][1], problem.data, problem.guess
    if name not in problem.unknown:
        return []
    k = problem.unknown.index(name)
    times, step = np.linspace(data.times[0], data.times[-1], len(data.times), retstep=True)
    # Padded with zeros, the spectrum has a value at every quarter of its lines.
    frequencies = math.tau * np.fft.rfftfreq(4 * len(times), float(step))
    power = np.zeros(len(frequencies))
    for column in range(len(data.names)):
        own = data.column == column
        values = about_trend(data.times[own], data.values[own])
        even = np.interp(times, data.times[own], values / (np.abs(values).max() or 1.0))
        power += np.abs(np.fft.rfft(even, 4 * len(times))) ** 2
    low, high = limits[0][k], limits[1][k]
    ends = max(low, guess[k] / _AROUND), min(high, guess[k] * _AROUND)
    power[(frequencies < ends[0]) | (frequencies > ends[1])] = 0.0
    peaks = frequencies[power.argmax()] * np.array([1.0, 0.5, 2.0])
    found = np.tile(guess, (len(peaks), 1))
    found[:, k] = peaks
    return list(found[(low <= peaks) & (peaks <= high)])
