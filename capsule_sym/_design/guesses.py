"""First guesses of a fit: random ones, and frequencies of the drive from the spectrum."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.measured import about_trend
from capsule_sym._design.misfit import OF_START, PHASE, Misfit, period_of
from capsule_sym._design.quantities import allowed
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map.checks import checked_ends
from capsule_sym._processes import sobol
from capsule_sym._systems import drives

_AROUND = 4.0  # factor about a guess of the frequency within which the spectrum has its peak


def limits_of(problem: Misfit, bounds: Mapping[str, tuple[float, float]]) -> tuple[Vector, Vector]:
    """Lower and upper bounds of the unknowns, each (k,).

    Raises InvalidInput for bounds of another name, and for those that are not allowed.
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


def drawn(problem: Misfit, limits: tuple[Vector, Vector], count: int, seed: int) -> list[Vector]:
    """Guesses between the bounds, or without bounds between half and twice the guess.

    Without a bound a phase is anywhere in its period.
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
    """Guesses with the frequency of the drive at the spectrum's peak, its half and its double."""
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
