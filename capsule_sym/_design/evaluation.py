"""Steady motions and their metrics for the optimiser: one from a start, one next to another, many.

What computes the metrics is named here and nowhere else in the package.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map import simulate
from capsule_sym._map.many import simulate_many
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.performance import performance
from capsule_sym._orbits.shooting.admissibility import is_admissible
from capsule_sym._orbits.shooting.identity import same
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary
from capsule_sym._orbits.shooting.search import solve_orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._parameters import Parameters

METRICS = (
    "velocity",
    "progression",
    "work",
    "damper_loss",
    "friction_loss",
    "peak_force",
    "peak_contact",
)
_SETTLED = 100  # excitation periods before a cell of a survey is looked at
_SEEN = 4  # and over which it is
_SAMPLES = 48  # times a period
_PERIODS = 512  # excitation periods within which a motion is to settle
Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """A steady motion, closed: its orbit and dimensionless metrics with derivatives (7,)."""

    orbit: Orbit

    @cached_property
    def metrics(self) -> dict[str, Slope]:
        """The metrics in `METRICS`; raises numpy.linalg.LinAlgError at a fold."""
        found = performance(self.orbit)
        metrics = {name: getattr(found, name) for name in METRICS}
        return {
            name: Slope(float(one.value), np.array([float(v) for v in one.gradient.values()]))
            for name, one in metrics.items()
        }

    @cached_property
    def multiplier(self) -> float:
        """Largest modulus of the Floquet multipliers."""
        return float(abs(floquet_multipliers(self.orbit)[0]))

    @cached_property
    def realised(self) -> bool:
        """Whether the map follows this orbit, and stays near it."""
        return (
            bool(min(self.orbit.durations) > 0)
            and self.multiplier < 1
            and is_admissible(self.orbit)
        )

    @property
    def itinerary(self) -> str:
        """Its itinerary in words."""
        return str(self.orbit.itinerary)


def settle(parameters: Parameters, state: Sequence[float], phase: float = 0.0) -> Motion | None:
    """The motion that is reached from a state; None where none is reached."""
    orbit = solve_orbit(parameters, state, phase, _PERIODS)
    return Motion(orbit) if orbit.success else None


def beside(motion: Motion, parameters: Parameters) -> Motion | None:
    """The orbit of the same itinerary at other parameters, realised or not; None if none."""
    values = np.array(list(parameters.to_dict().values()))
    orbit = motion.orbit
    try:
        moved = orbit.by_parameter @ (values - np.array(orbit.values, dtype=float))
        guess = np.array(orbit.z, dtype=float) + moved
        found = solve_itinerary(parameters, orbit.itinerary, guess.tolist())
        if not found.success:
            found = solve_itinerary(parameters, orbit.itinerary, list(orbit.z))
    except np.linalg.LinAlgError:
        return None
    return Motion(found) if found.success else None


def follow(motion: Motion, parameters: Parameters) -> Motion | None:
    """The motion that a motion becomes where the parameters change to others; None if none."""
    found = beside(motion, parameters)
    if found is not None and found.realised:
        return found
    x_r, v_r, v_c, angle = (float(value) for value in motion.orbit.z[:4])
    phase = (angle % math.tau) / parameters.omega
    return settle(parameters, (x_r, v_r, v_c), min(phase, math.nextafter(parameters.period, 0.0)))


def agrees(one: Motion, other: Motion | None) -> bool:
    """Whether two motions are the same orbit."""
    return other is not None and same(one.orbit, other.orbit)


def survey(systems: Sequence[Parameters], state: Sequence[float]) -> list[dict[str, Slope]]:
    """About what the metrics are of n parameter sets from the same start, without derivatives.

    By sums over samples of the last of some periods, whether the motion has settled or not; empty
    for a run that does not finish. Only a choice of starts rests on them.
    """
    ended = simulate_many(systems, state, periods=_SETTLED)
    return [
        _sampled(p, end) if done else {}
        for p, end, done in zip(systems, ended.states, ended.success, strict=True)
    ]


def _sampled(p: Parameters, state: Vector) -> dict[str, Slope]:
    """About what the metrics are from a state at phase 0 on, by sums over samples."""
    run = simulate(p, tuple(state.tolist()), periods=_SEEN)
    if not run.success:
        return {}
    times = (np.arange(_SEEN * _SAMPLES) + 0.5) / _SAMPLES * p.period
    x_r, v_r, v_c, _ = run(times, position=True).T
    contact = p.beta * np.maximum(x_r - p.delta, 0.0)
    force = x_r + 2 * p.zeta * v_r + contact
    progression = float(run.advance) / _SEEN
    mean = {
        "work": p.alpha * np.cos(p.omega * times) * (v_r + v_c),
        "damper_loss": 2 * p.zeta * v_r**2,
        "friction_loss": p.f_b * abs(v_c),
    }
    found = {
        "velocity": progression * p.omega / (2 * math.pi),
        "progression": progression,
        **{name: float(values.mean() * p.period) for name, values in mean.items()},
        "peak_force": float(abs(force).max()),
        "peak_contact": float(contact.max()),
    }
    return {name: Slope(value, np.zeros(7)) for name, value in found.items()}
