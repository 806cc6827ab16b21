"""First guesses of a fit: linear unknowns solved, phases and starts scanned, random guesses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.problem import Misfit, about_trend
from capsule_sym._design.quantities import allowed, dimensionless
from capsule_sym._design.residuals import OF_START, PHASE, STATE, Recorded
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map import simulate
from capsule_sym._map.checks import checked_ends
from capsule_sym._map.labelled import package
from capsule_sym._native import TimeUp
from capsule_sym._parameters import SceneDevice
from capsule_sym._processes import sobol
from capsule_sym._systems import drives

_PHASES = 24  # of the forcing, tried for a run's start
_SETTLED = 100  # periods from rest, after which a motion counts as steady
_WEIGHINGS = 6  # of residuals, to reduce the effect of outliers on the linear unknowns
SLIPS = -0.5, 1.0  # range of a slip of the time base
_SCALE = 1e-12  # least scale
_AROUND = 4.0  # factor about a guess of the frequency within which the spectrum has its peak
_SAMPLES, _LEAST_SAMPLES, _FREQUENCIES, _OVERSAMPLED = 2000, 7, 20_000, 4.0


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
            low[k] = _SCALE
        elif own not in OF_START and not problem.linear[k]:
            low[k], high[k] = allowed(problem.recorded[0].system, own)
        if name in bounds:
            low[k], high[k] = checked_ends(f"bounds of {name}", bounds[name], low[k], high[k])
        if not low[k] <= (guess := float(problem.guess[k])) <= high[k]:
            raise InvalidInput(name, guess, f"from {low[k]:g} to {high[k]:g} as a guess")
    return low, high


def drawn(problem: Misfit, limits: tuple[Vector, Vector], count: int, seed: int) -> list[Vector]:
    """Guesses between the bounds, or without bounds between half and twice the guess."""
    if not count:
        return []
    low, high = limits
    guess, bounded, above = problem.guess, np.isfinite(high), np.isfinite(low)
    size = np.where(guess == 0.0, 1.0, np.abs(guess))
    first = np.select([bounded, above], [low, size / 2], guess - size)
    last = np.select([bounded, above], [high, 2 * size], guess + size)
    for run, places in zip(problem.recorded, problem.places, strict=True):
        for k, name in zip(places.tolist(), run.unknown, strict=True):
            if name == PHASE and not bounded[k]:
                first[k], last[k] = 0.0, _period(run, guess[places])
            elif (
                problem.linear[k] or name in run.sought or (name == "slip" and high[k] == SLIPS[1])
            ):
                first[k] = last[k] = guess[k]
    return list(first + sobol(len(first), count, seed) * (last - first))


def spectral(problem: Misfit, limits: tuple[Vector, Vector]) -> list[Vector]:
    """Guesses with the frequency of the drive at the spectrum's peak, its half and its double."""
    run, name = problem.recorded[0], [*drives(problem.recorded[0].system)][1]
    if name not in problem.unknown or len(problem.recorded) > 1:
        return []
    k = problem.unknown.index(name)
    guess, low, high = problem.guess, limits[0][k], limits[1][k]
    ends = max(low, guess[k] / _AROUND), min(high, guess[k] * _AROUND)
    total = np.ptp(run.data.times) * (ends[1] - ends[0])
    tried = np.linspace(*ends, int(min(_FREQUENCIES, _OVERSAMPLED * total + 2)))
    power = np.zeros(len(tried))
    for column in range(len(run.data.names)):
        own = np.flatnonzero(run.data.column == column)
        own = own[:: -(-len(own) // _SAMPLES)]
        times, values = run.data.times[own], run.data.values[own]
        if len(own) > _LEAST_SAMPLES:
            values = about_trend(times, values / (np.abs(values).max() or 1.0))
            power += package("scipy.signal").lombscargle(times, values, tried, normalize=True)
    peak = tried[power.argmax()]
    found = []
    for factor in (1.0, 0.5, 2.0):
        if low <= factor * peak <= high:
            found.append(guess.copy())
            found[-1][k] = factor * peak
    return found


def best_of(problem: Misfit, guesses: Sequence[Vector]) -> list[Vector]:
    """Guesses sorted by their cost, as many as the time limit allows."""
    if len(guesses) == 1 and not problem.partly:
        return list(guesses)
    found, costs = list[Vector](), list[float]()
    with suppress(TimeUp):
        for k, guess in enumerate(guesses, 1):
            problem.doing = f"guess {k} of {len(guesses)}"
            values, cost = begun(problem, guess)
            found.append(values)
            costs.append(cost)
    order = np.argsort(costs, kind="stable").tolist()
    return [found[i] for i in order] or [guesses[0]]


def begun(problem: Misfit, values: Vector) -> tuple[Vector, float]:
    """Guess completed from the measurements, and its cost.

    If the phase and start of a run are unknown, they are those at which the steady motion from rest
    is nearest to the series. Linear unknowns minimise the sum of absolute deviations.
    """
    if not problem.partly:
        return values, problem.cost(values)
    values = values.copy()
    for run, places in zip(problem.recorded, problem.places, strict=True):
        if run.sought:
            alone = Misfit([run], run.unknown)
            tried = [_solved(alone, one) for one in _starts(run, values[places])]
            values[places] = min(tried, key=lambda one: one[1])[0]
    return _solved(problem, values)


def _starts(run: Recorded, values: Vector) -> list[Vector]:
    """Values of a run's unknowns with the phases and starts to try."""
    now, period = run.now(values), _period(run, values)
    phases = np.array([now[PHASE]])
    if PHASE in run.sought:
        phases = np.arange(_PHASES) * (period / _PHASES)
    system = run.system_at(values)
    p = dimensionless(system)
    steady = simulate(p, (0.0, 0.0, 0.0), periods=_SETTLED + 1)
    states = np.zeros((len(phases), 3))
    if steady.success:
        states = steady(p.period * (_SETTLED + (phases / period) % 1.0))[:, :3]
    if isinstance(system, SceneDevice):
        states = states * [system.scale(name) for name in STATE]
    found = []
    for phase, state in zip(phases, states, strict=True):
        sought = dict(zip(STATE, state, strict=True)) | {PHASE: phase}
        pairs = zip(run.unknown, values, strict=True)
        found.append(np.array([sought[one] if one in run.sought else v for one, v in pairs]))
    return found


def _period(run: Recorded, values: Vector) -> float:
    """Period of the forcing, in the system's unit of time."""
    system = run.system_at(values)
    return math.tau / system.rate if isinstance(system, SceneDevice) else system.period


def _solved(problem: Misfit, values: Vector) -> tuple[Vector, float]:
    """Values with the linear unknowns at the least sum of absolute deviations, and that sum."""
    residuals, jacobian = problem.without_slopes(values)
    linear, held = np.flatnonzero(problem.linear), values.copy()
    if len(linear):
        scales = [problem.unknown[k].rpartition(".")[2].startswith("scale") for k in linear]
        columns, weights, start = jacobian[:, linear], np.ones(len(residuals)), residuals
        for _ in range(_WEIGHINGS):
            step = np.linalg.lstsq(columns * weights[:, None], -start * weights, rcond=None)[0]
            residuals = start + columns @ step
            size = np.abs(residuals)
            weights = 1.0 / np.sqrt(np.maximum(size, np.median(size) + 1e-300))
        held[linear] += step
        # A negative scale would be a mirror image, which has another phase.
        if np.any(held[linear][scales] <= _SCALE):
            return values, math.inf
    return held, float(np.sum(np.abs(residuals)))
