"""Steady motions and their metrics for the optimiser: one from a start, one next to another, many.

The C core closes a motion and differentiates its metrics. Where it is missing or leaves a motion
open, and where an itinerary is followed beyond the place at which the map leaves it, the orbit's
equations do. What computes the metrics is named here and nowhere else in the package.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map import simulate
from capsule_sym._map.drift import drifts
from capsule_sym._map.itinerary import begun
from capsule_sym._map.many import simulate_many
from capsule_sym._map.segments import MODES
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import Watch, core
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.many import METRICS, Performances, performance_many
from capsule_sym._orbits.metrics.performance import performance
from capsule_sym._orbits.shooting.admissibility import is_admissible
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary
from capsule_sym._orbits.shooting.search import orbit_at, solve_orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._parameters import Parameters

_BLOCK = 64  # excitation periods after which it is first looked whether a motion has settled
_PERIODS = 1024  # excitation periods within which it is to settle
_REPEATED = 1e-2  # change over its periods, in units of the motion's size, at which it is closed
_NEAR = 1e-2  # distance of the closed motion from the run that led to it
_ARRIVED = 1e-7  # distance at which a run is on its motion
_SAME = 1e-6  # distance of two that are one
_SURVEYED = 100  # excitation periods before a cell of a survey is closed
_CONTACT = [field for field, mode in enumerate(MODES, 1) if mode.startswith("C")]
Vector = NDArray[np.float64]


class Motion:
    """A steady motion, closed, and its dimensionless metrics with derivatives (7,).

    `state` is (x_r, v_r, v_c) at forcing angle 0, `itinerary` has the fields' names.
    """

    def __init__(
        self,
        parameters: Parameters,
        found: Performances | None,
        period_number: int = 1,
        orbit: Orbit | None = None,
    ) -> None:
        self.parameters, self.found, self._orbit = parameters, found, orbit
        self.period_number = period_number
        if found is not None:
            self.state: Vector = found.states[0]
            self.itinerary: tuple[str, ...] = found.itinerary(0)
        elif orbit is not None:
            self.period_number = orbit.itinerary.period_number
            self.itinerary = tuple(f"F{field}" for field in begun(orbit.itinerary.fields))

    @property
    def orbit(self) -> Orbit | None:
        """The orbit as its equations have it; None where they have none."""
        if self._orbit is None:
            self._orbit = orbit_at(self.parameters, self.state.tolist(), self.period_number)
        return self._orbit

    @cached_property
    def metrics(self) -> dict[str, Slope]:
        """The metrics in `METRICS`; raises numpy.linalg.LinAlgError at a fold."""
        if self.found is not None:
            pairs = zip(self.found.values[0].tolist(), self.found.gradients[0], strict=True)
            found = {name: Slope(*pair) for name, pair in zip(METRICS, pairs, strict=True)}
        else:
            assert self._orbit is not None
            whole = performance(self._orbit)
            metrics = {name: getattr(whole, name) for name in METRICS}
            found = {
                name: Slope(float(one.value), np.array([float(v) for v in one.gradient.values()]))
                for name, one in metrics.items()
            }
        fields = np.array([[int(name[1:]) for name in self.itinerary]])
        values = np.array([[found[name].value for name in METRICS]])
        if not _drifting(_values(self.parameters)[None], fields, values)[0]:
            found |= dict.fromkeys(("velocity", "progression"), Slope(0.0, np.zeros(7)))
        return found

    @cached_property
    def multiplier(self) -> float:
        """Largest modulus of the Floquet multipliers."""
        if self.found is not None:
            return float(abs(self.found.multipliers[0, 0]))
        assert self._orbit is not None
        return float(abs(floquet_multipliers(self._orbit)[0]))

    @cached_property
    def admissible(self) -> bool:
        """Whether the map follows this orbit, and stays near it."""
        if self.found is not None:
            return self.multiplier < 1  # it is the map that the core has closed
        assert self._orbit is not None
        inside = bool(min(self._orbit.durations) > 0)
        return inside and self.multiplier < 1 and is_admissible(self._orbit)


def _drifting(rows: Vector, fields: NDArray[Any], values: Vector) -> NDArray[np.bool_]:
    """Whether motions of parameters (n, 7), with their fields (n, m) and METRICS (n, 7), drift."""
    metrics = dict(zip(METRICS, values.T, strict=True))
    return drifts(
        rows,
        contact=np.isin(fields, _CONTACT).any(axis=1),
        progression=metrics["progression"],
        way=metrics["friction_loss"] / rows[:, PARAMETERS.index("f_b")],
        segments=np.count_nonzero(fields, axis=1),
    )


def _values(parameters: Parameters) -> Vector:
    return np.array(list(parameters.to_dict().values()))


def _closed(
    parameters: Parameters, state: Vector, period_number: int, watch: Watch | None = None
) -> Motion | None:
    """The motion of the map near a state at forcing angle 0, by the core; None if none."""
    if core is None:
        return None
    row = _values(parameters)
    found = performance_many(row, state, period_number, gradients=True, watch=watch)
    whole = found.closed[0] and bool(np.all(np.isfinite(found.gradients[0])))
    return Motion(parameters, found, period_number) if whole else None


def settle(
    parameters: Parameters,
    state: Sequence[float],
    phase: float = 0.0,
    watch: Watch | None = None,
) -> Motion | None:
    """The motion that is reached from a state; None where none is reached, or in time."""
    watch = watch or Watch()
    if core is None:
        orbit = solve_orbit(parameters, state, phase, _PERIODS)
        return Motion(parameters, None, orbit=orbit) if orbit.success else None
    length, begin, at = _BLOCK, tuple(state), phase
    while length <= _PERIODS:
        run = simulate(parameters, begin, at, length, keep="stroboscopic", max_seconds=watch.left)
        if not run.success:
            return None
        marks = np.array(run.stroboscopic, dtype=float)
        if (found := _arrived(parameters, marks, watch)) is not None:
            return found
        length, begin, at = 2 * length, tuple(marks[-1].tolist()), 0.0
    return None


def _arrived(parameters: Parameters, marks: Vector, watch: Watch) -> Motion | None:
    """The motion that the end of a run is on, by its stroboscopic states; None if it is on none."""
    size, least = 1 + abs(marks[-LONGEST:]).max(), math.inf
    for period_number in range(1, LONGEST + 1):
        if len(marks) <= 2 * period_number:
            return None
        change = abs(marks[-1] - marks[-1 - period_number]).max()
        if change > _REPEATED * size or change >= least:
            continue  # another number of periods repeats better
        least = change
        found = _closed(parameters, marks[-1], period_number, watch)
        if found is None or not found.multiplier < 1:
            continue
        far = abs(marks[-1] - found.state).max()
        before = abs(marks[-1 - period_number] - found.state).max()
        # The run is on it, or comes closer to it period by period.
        if far <= _ARRIVED * size or (far <= _NEAR * size and far < before):
            return found
    return None


def same_itinerary_at(motion: Motion, parameters: Parameters, quick: bool = False) -> Motion | None:
    """The orbit of the same itinerary at other parameters, admissible or not; None if none.

    A quick answer is None as well where the map of a motion of the core does not pass through it.
    """
    moved = _values(parameters) - _values(motion.parameters)
    if motion.found is not None:
        state = motion.state + motion.found.by_parameter[0] @ moved
        found = _closed(parameters, state, motion.period_number)
        if found is not None and found.itinerary == motion.itinerary:
            return found
        if quick:
            return None
    orbit = motion.orbit
    if orbit is None:
        return None
    try:
        guess = np.array(orbit.z, dtype=float) + orbit.by_parameter @ moved
        solved = solve_itinerary(parameters, orbit.itinerary, guess.tolist())
        if not solved.success:
            solved = solve_itinerary(parameters, orbit.itinerary, list(orbit.z))
    except np.linalg.LinAlgError:
        return None
    return Motion(parameters, None, orbit=solved) if solved.success else None


def continue_motion(
    motion: Motion, parameters: Parameters, watch: Watch | None = None
) -> Motion | None:
    """The motion that a motion becomes where the parameters change to others; None if none."""
    if motion.found is not None:
        moved = _values(parameters) - _values(motion.parameters)
        state = motion.state + motion.found.by_parameter[0] @ moved
        found = _closed(parameters, state, motion.period_number, watch)
        if found is not None and found.admissible:
            return found
        return settle(parameters, tuple(motion.state.tolist()), watch=watch)
    found = same_itinerary_at(motion, parameters)
    if found is not None and found.admissible:
        return found
    assert motion.orbit is not None
    x_r, v_r, v_c, angle = (float(value) for value in motion.orbit.z[:4])
    phase = (angle % math.tau) / parameters.omega
    phase = min(phase, math.nextafter(parameters.period, 0.0))
    return settle(parameters, (x_r, v_r, v_c), phase, watch)


def agrees(one: Motion, other: Motion | None) -> bool:
    """Whether two motions at about the same parameters are one."""
    if other is None or one.period_number != other.period_number:
        return False
    names = ("progression", "work", "peak_force")
    return all(
        abs(one.metrics[name].value - other.metrics[name].value)
        <= _SAME * (1 + abs(one.metrics[name].value))
        for name in names
    )


def survey(
    systems: Sequence[Parameters], state: Sequence[float], watch: Watch | None = None
) -> list[dict[str, Slope]]:
    """The metrics of n parameter sets from the same start, without derivatives.

    Empty for a motion that does not settle within some periods on one of a period or two, or in
    time.
    """
    watch = watch or Watch()
    rows = np.array([_values(p) for p in systems])
    if core is None:
        orbits = [None if watch.over else settle(p, state, watch=watch) for p in systems]
        return [{} if one is None else _plain(one.metrics) for one in orbits]
    ended = simulate_many(rows, state, periods=_SURVEYED, max_seconds=watch.left)
    metrics: list[dict[str, Slope]] = [{} for _ in systems]
    for period_number in (1, 2):
        left = np.array([i for i, one in enumerate(metrics) if not one and ended.success[i]], int)
        if not len(left):
            break
        found = performance_many(rows[left], ended.states[left], period_number, watch=watch)
        values, still = found.values, ~_drifting(rows[left], found.fields, found.values)
        values[still, METRICS.index("progression")] = values[still, METRICS.index("velocity")] = 0
        stable = found.closed & (abs(found.multipliers[:, 0]) < 1)
        for i, row, good in zip(left.tolist(), values.tolist(), stable, strict=True):
            if good and np.all(np.isfinite(row)):
                metrics[i] = {
                    name: Slope(value, np.zeros(7))
                    for name, value in zip(METRICS, row, strict=True)
                }
    return metrics


def _plain(metrics: dict[str, Slope]) -> dict[str, Slope]:
    return {name: Slope(one.value, np.zeros(7)) for name, one in metrics.items()}
