"""First guesses of a fit: linear unknowns solved, phases and starts scanned, random guesses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.measured import about_trend
from capsule_sym._design.problem import Misfit
from capsule_sym._design.quantities import allowed, dimensionless
from capsule_sym._design.residuals import OF_START, PHASE, STATE, Recorded, period_of, units_of
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map import simulate
from capsule_sym._map.checks import checked_ends
from capsule_sym._native import TimeUp
from capsule_sym._processes import sobol
from capsule_sym._systems import drives

_PHASES = 24  # starts that are tried over a period of the forcing
_SETTLED = 100  # excitation periods from rest, after which a motion counts as steady
_AROUND = 4.0  # factor about a guess of the frequency within which the spectrum has its peak
SLIPS = -0.5, 1.0  # range of the relative error of a time base


def limits_of(problem: Misfit, bounds: Mapping[str, tuple[float, float]]) -> tuple[Vector, Vector]:
    """Lower and upper bounds of the unknowns, each (k,).

    Raises InvalidInput for bounds of another name, and for those that are not allowed.
    """
    for name in bounds:
        check_one_of("bounds", name, problem.unknown)
    low, high = np.full((2, len(problem.unknown)), np.inf) * [[-1], [1]]
    for k, name in enumerate(problem.unknown):
        own = name.rpartition(".")[2]
        if own == "slip":
            low[k], high[k] = SLIPS
        elif own.startswith("scale"):
            low[k] = np.finfo(float).tiny
        elif own not in OF_START and not problem.linear[k]:
            low[k], high[k] = allowed(problem.recorded[0].system, own)
        if name in bounds:
            low[k], high[k] = checked_ends(f"bounds of {name}", bounds[name], low[k], high[k])
        if not low[k] <= (guess := float(problem.guess[k])) <= high[k]:
            raise InvalidInput(name, guess, f"from {low[k]:g} to {high[k]:g} as a guess")
    return low, high


def drawn(problem: Misfit, limits: tuple[Vector, Vector], count: int, seed: int) -> list[Vector]:
    """Guesses between the bounds, or without bounds between half and twice the guess.

    Without a bound a phase is anywhere in its period, and a slip as given.
    """
    if not count:
        return []
    (low, high), guess = limits, problem.guess
    bounded, above = np.isfinite(high), np.isfinite(low)
    size = np.where(guess == 0.0, 1.0, np.abs(guess))
    first = np.select([bounded, above], [low, size / 2], guess - size)
    last = np.select([bounded, above], [high, 2 * size], guess + size)
    for run, places in zip(problem.recorded, problem.places, strict=True):
        for k, name in zip(places.tolist(), run.unknown, strict=True):
            if name == PHASE and not bounded[k]:
                first[k], last[k] = 0.0, period_of(run.system_at(guess[places]))
            if problem.linear[k] or name in run.sought or (name, high[k]) == ("slip", SLIPS[1]):
                first[k] = last[k] = guess[k]
    return list(first + sobol(len(first), count, seed) * (last - first))


def spectral(problem: Misfit, limits: tuple[Vector, Vector]) -> list[Vector]:
    """Guesses with the frequency of the drive at the spectrum's peak, its half and its double."""
    (run, *others), guess = problem.recorded, problem.guess
    name, data = [*drives(run.system)][1], run.data
    if name not in problem.unknown or others:
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


def best_of(problem: Misfit, guesses: Sequence[Vector]) -> list[Vector]:
    """Guesses sorted by their cost, as many as the time limit allows."""
    found = list[tuple[Vector, float]]()
    with suppress(TimeUp):
        for k, guess in enumerate(guesses, 1):
            problem.doing = f"guess {k} of {len(guesses)}"
            found.append(begun(problem, guess))
    return [values for values, _ in sorted(found, key=lambda one: one[1])] or [guesses[0]]


def begun(problem: Misfit, values: Vector) -> tuple[Vector, float]:
    """Guess completed from the measurements, and its cost.

    If the phase and start of a run are unknown, they are those at which the steady motion from rest
    is nearest to the series. Linear unknowns minimise the sum of squares.
    """
    values = values.copy()
    for run, places in zip(problem.recorded, problem.places, strict=True):
        if run.sought:
            alone = Misfit([run], run.unknown)
            tried = [_solved(alone, one) for one in _starts(run, values[places])]
            values[places] = min(tried, key=lambda one: one[1])[0]
    return _solved(problem, values)


def _starts(run: Recorded, values: Vector) -> Matrix:
    """Values of a run's unknowns with the phases and starts to try, a row for each."""
    system = run.system_at(values)
    period = period_of(system)
    phases = np.array([run.now(values)[PHASE]])
    if PHASE in run.sought:
        phases = np.arange(_PHASES) * (period / _PHASES)
    p, states = dimensionless(system), np.zeros((len(phases), len(STATE)))
    steady = simulate(p, (0.0, 0.0, 0.0), periods=_SETTLED + 1)
    if steady.success:
        states = steady(p.period * (_SETTLED + (phases / period) % 1.0))[:, : len(STATE)]
    starts = dict(zip(STATE, states.T * units_of(system)[: len(STATE), None], strict=True))
    found = np.tile(values, (len(phases), 1))
    for name in run.sought:
        found[:, run.unknown.index(name)] = starts.get(name, phases)
    return found


def _solved(problem: Misfit, values: Vector) -> tuple[Vector, float]:
    """Values with the linear unknowns solved for, and the sum of absolute deviations."""
    residuals, jacobian = problem.evaluated(values, slopes=False)
    held, columns = values.copy(), jacobian[:, problem.linear]
    step = np.linalg.lstsq(columns, -residuals, rcond=None)[0]
    held[problem.linear] += step
    scales = ["scale" in name.rpartition(".")[2] for name in problem.unknown]
    # A negative scale would be a mirror image, which has another phase.
    if np.any(held[problem.linear & scales] <= 0.0):
        return values, math.inf
    return held, float(np.sum(np.abs(residuals + columns @ step)))
