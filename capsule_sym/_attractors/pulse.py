"""A pulse of the drive that leads from one attractor to another: the result of a search."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, record
from capsule_sym._orbits.metrics.work import drive_force
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import Scene, SceneDevice, SceneParameters
from capsule_sym._systems import System, dimensionless

_SHOWN, _BEFORE, _AFTER = 100, 2, 4  # times a period, and periods beside pulse and transient
Vector = NDArray[np.float64]
Interval = tuple[float, float]


class PulseStatus(StrEnum):
    """Outcome of the search for a pulse."""

    #: A pulse leads from one attractor to the other.
    FOUND = "found"
    #: No pulse of so many periods within the bounds leads there.
    NO_PULSE = "no-pulse"
    #: One of the attractors does not exist at an end of the tolerances.
    ATTRACTOR_LOST = "attractor-lost"
    #: The time is over: the result is the best so far, if there is one.
    TIME_LIMIT = "time-limit"


class PulseWindow(NamedTuple):
    """Pulses that lead to the end: periods, period of the start at which they begin, and values.

    In SI units where the system is a device, else dimensionless.
    """

    periods: int
    begins: int
    low: float
    high: float

    @property
    def width(self) -> float:
        """How far the values are apart."""
        return self.high - self.low


@dataclass(frozen=True, eq=False)
class Pulse(Result, Labelled):
    """A change of the drive for some periods that leads from one attractor to another.

    In SI units where the system is a device, else dimensionless. Without a pulse `value`, `work`
    and `interval` are nan, `periods` and `transient` 0.
    """

    start: Orbit
    end: Orbit
    system: System
    parameter: str
    """What the pulse changes."""
    windows: tuple[PulseWindow, ...]
    """All pulses that were found to lead to the end."""
    status: PulseStatus
    """How it ended."""
    message: str
    """The same as a sentence."""
    value: float = math.nan
    """What it is while the pulse lasts."""
    periods: int = 0
    """Periods of the changed drive."""
    begins: int = 0
    """Period of the start, from 0 on, at which the pulse begins: in the state `state`."""
    state: tuple[float, ...] = (math.nan,) * 3
    """(x_r, v_r, v_c) at forcing angle 0, where the pulse begins."""
    interval: Interval = math.nan, math.nan
    """Values around this one that lead to the end as well, with all else as it is."""
    work: float = math.nan
    """Work of the drive while the pulse lasts."""
    transient: int = 0
    """Excitation periods after the pulse until the motion is within 0.1 % of its end."""
    dimension = "time"
    _good = (PulseStatus.FOUND,)
    _recorded = "parameter value periods begins state interval work duration transient"

    def __repr__(self) -> str:
        if not self.periods:
            return f"<Pulse: {self.status}>"
        drive = f"{self.parameter} = {self.value:.6g}"
        return f"<Pulse of {drive} over {self.periods} periods, {self.status}>"

    @property
    def scene(self) -> Scene:
        """The scene of the system."""
        return self.system.scene

    @property
    def duration(self) -> float:
        """How long the pulse lasts."""
        return self.times[1] - self.times[0] if self.periods else 0.0

    @property
    def drives(self) -> tuple[SceneParameters, SceneParameters]:
        """The dimensionless parameters as they are else, and while the pulse lasts."""
        return dimensionless(self.system), pulsed(self.system, self.parameter, self.value)

    @cached_property
    def runs(self) -> tuple[Trajectory, Trajectory, Trajectory]:
        """The run before the pulse, while it lasts, and after it; dimensionless."""
        assert self.periods
        usual, changed = self.drives
        marks = stroboscopic(self.start)
        state = marks[(self.begins - _BEFORE) % len(marks)].tolist()
        before = simulate(usual, state, periods=_BEFORE)
        pulse = simulate(changed, marks[self.begins].tolist(), periods=self.periods)
        after = simulate(usual, pulse.final[1], periods=self.transient + _AFTER)
        return before, pulse, after

    @property
    def times(self) -> tuple[float, float, float]:
        """Times at which the pulse begins and ends, and at which the transient is over."""
        if not self.periods:
            return 0.0, 0.0, 0.0
        usual, changed = self.drives
        end = self.periods * changed.period
        second = unit_of(self.system, "duration")
        return 0.0, end * second, (end + self.transient * usual.period) * second

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Time, what the pulse changes, force of the drive, x_r and x_c, 100 a period, (n,).

        The pulse begins at time 0; two periods are before it, four after its transient.
        """
        names = ("time", self.parameter, "drive", "x_r", "x_c")
        if not self.periods:
            return {name: np.zeros(0) for name in names}
        rows, begin, place = list[Vector](), 0.0, 0.0
        values = (getattr(self.system, self.parameter), self.value)
        for run, value in zip(self.runs, (values[0], values[1], values[0]), strict=True):
            count = run.final[0].period * _SHOWN
            times = np.arange(count) / count * run.span[1]
            x_r, *_, x_c = run(times, position=True).T
            force = drive_force(run, times)
            rows.append(np.array([times + begin, np.full(count, value), force, x_r, x_c + place]))
            begin, place = begin + run.span[1], place + float(run.advance)
        found = np.hstack(rows)
        # Time and place are 0 where the pulse begins.
        found[0] -= self.runs[0].span[1]
        found[4] -= float(self.runs[0].advance)
        units = ("duration", "", "peak_force", "x_r", "x_c")
        scales = [unit_of(self.system, unit) if unit else 1.0 for unit in units]
        return {name: row * scale for name, row, scale in zip(names, found, scales, strict=True)}

    def to_dict(self) -> dict[str, Any]:
        """The result by name, of numbers, texts, lists and dicts."""
        orbits = {"start": str(self.start.itinerary), "end": str(self.end.itinerary)}
        return super().to_dict() | orbits | record(self, "windows")


def pulsed(system: System, name: str, value: float) -> SceneParameters:
    """The dimensionless parameters while the pulse lasts."""
    return dimensionless(system.replace(**{name: value}))


def unit_of(system: System, quantity: str) -> float:
    """The SI unit of a quantity where the system is a device, else 1."""
    return system.scale(quantity) if isinstance(system, SceneDevice) else 1.0
