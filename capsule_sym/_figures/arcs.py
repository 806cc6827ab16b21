"""A trajectory as curves to draw: one arc for each segment, from its closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from capsule_sym._arrays import Matrix as Array
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import CAPSULE, Scene

UNSETTLED = 16
"""Largest number of excitation periods drawn of a run without a steady motion."""
_PER_PERIOD = 240  # points; no corner is visible in a picture a page wide
_ROUNDED = 1e-9  # periods
_PER_RADIAN = 16  # points per radian of a segment's fastest rate

Motion = Trajectory | Orbit
"""A run, or a periodic orbit."""


@dataclass(frozen=True)
class Arc:
    """A segment, or its drawn part, as points of its closed form (dimensionless).

    All arrays have shape (n,); `time` is absolute, in excitation periods.
    """

    field: int
    time: Array
    x_r: Array
    v_r: Array
    v_c: Array
    x_c: Array
    scene: Scene = CAPSULE

    @property
    def states(self) -> tuple[Array, Array, Array]:
        """Coordinates (x_r, v_r, v_c) of the state space."""
        return self.x_r, self.v_r, self.v_c


def arcs(motion: Motion, periods: int) -> list[Arc]:
    """Arcs of the last excitation periods of a run, the first one cut at the start of its period.

    Of an orbit they are those of `cycle`. Raises InvalidInput if `periods` is not in [1, the run's
    whole periods], and if segments were not kept.
    """
    if not isinstance(motion, Trajectory):
        return cycle(motion)
    end, _ = motion.final
    if not 1 <= periods <= end.period:
        raise InvalidInput("periods", periods, f"from 1 to the run's {end.period}")
    period, (_, stop) = motion.parameters.period, motion.span
    return _between(motion, (end.period - periods) * period, stop, period / _PER_PERIOD)


def opening(trajectory: Trajectory, duration: float) -> list[Arc]:
    """Arcs of the start of a run, cut at `duration` (dimensionless)."""
    begin, stop = trajectory.span
    return _between(trajectory, begin, min(begin + duration, stop), duration / _PER_PERIOD)


def is_periodic(motion: Motion) -> bool:
    """True for an orbit, and for a run that ends in a steady motion."""
    return not isinstance(motion, Trajectory) or motion.steady() is not None


def cycle(motion: Motion) -> list[Arc]:
    """Arcs of one period of an orbit, or of the steady motion at the end of a run, from phase 0.

    Of a run without a steady motion, those of its last excitation periods, at most `UNSETTLED`.
    """
    if not isinstance(motion, Trajectory):
        run, period = motion.trajectory(), motion.parameters.period
        begin, end = run.span
        first = math.ceil(begin / period)
        late = _between(run, begin, first * period, period / _PER_PERIOD)
        turns, advance = motion.itinerary.period_number, run.position(end) - run.position(begin)
        return _between(run, first * period, end, period / _PER_PERIOD) + [
            replace(arc, time=arc.time + turns, x_c=arc.x_c + advance) for arc in late
        ]
    steady = motion.steady()
    shown = steady.period_number if steady else min(UNSETTLED, motion.final[0].period)
    return arcs(motion, shown)


def _between(trajectory: Trajectory, begin: float, end: float, step: float) -> list[Arc]:
    period, scene = trajectory.parameters.period, trajectory.parameters.scene
    numbers, found = NumpyBackend(scene), []
    for segment in trajectory.segments:
        start, stop = (at.period * period + float(at.phase) for at in (segment.start, segment.end))
        low, high = max(start, begin), min(stop, end)
        if low < high:
            # With a stiff stop a short arc bends as much as a long one.
            turned = numbers.constants(segment.field, trajectory.parameters).rate * (high - low)
            count = max((high - low) / step, min(_PER_RADIAN * turned, _PER_PERIOD))
            time = np.linspace(low, high, 2 + int(np.ceil(count)))
            x_r, v_r, v_c, x_c = trajectory(time, position=True).T
            found.append(Arc(segment.field, time / period, x_r, v_r, v_c, x_c, scene))
    return found


def phase_zero(drawn: Sequence[Arc]) -> int:
    """Number of the excitation period in which arcs begin, at whose phase 0 their axis begins."""
    return math.floor(float(drawn[0].time[0]) + _ROUNDED)
