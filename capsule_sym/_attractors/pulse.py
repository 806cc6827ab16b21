"""Result of the search for a pulse of the drive that switches between two attractors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._errors import Status, counted
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, brief, by_fields, record
from capsule_sym._orbits.metrics.performance import drive_force
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import Scene, SceneDevice, SceneParameters
from capsule_sym._systems import System, dimensionless

_BEFORE = 2  # excitation periods shown before the pulse
Interval = tuple[float, float]


class PulseWindow(NamedTuple):
    """Pulses that lead to the end: periods, starting period of the motion, and range of values.

    In SI units if the system is a device, else dimensionless.
    """

    periods: int
    begins: int
    low: float
    high: float

    def __repr__(self) -> str:
        return by_fields(self)

    @property
    def width(self) -> float:
        """Width of the range of values."""
        return self.high - self.low


@dataclass(frozen=True, eq=False)
class Pulse(Result, Labelled):
    """A change of the drive for some periods that leads from one attractor to another.

    In SI units if the system is a device, else dimensionless. Without a pulse `value`, `work` and
    `interval` are nan, `periods` and `transient` 0.
    """

    start: Orbit
    end: Orbit
    system: System
    parameter: str
    """Name of the parameter that the pulse changes."""
    windows: tuple[PulseWindow, ...]
    """All pulses found that lead to the end, each with its `periods`, the period of the motion in
    which it `begins`, and its range of values, `low` to `high`."""
    status: Status
    """Status of the search."""
    message: str
    """Status as a sentence."""
    value: float = math.nan
    """Value of the parameter during the pulse."""
    periods: int = 0
    """Number of periods of the changed drive."""
    begins: int = 0
    """Period of the start motion, from 0, in which the pulse begins, in the state `state`."""
    state: tuple[float, ...] = (math.nan,) * 3
    """(x_r, v_r, v_c) at forcing angle 0, at the start of the pulse."""
    interval: Interval = math.nan, math.nan
    """Range of values around `value` that also lead to the end, all else being equal."""
    work: float = math.nan
    """Work of the drive during the pulse."""
    transient: int = 0
    """Excitation periods after the pulse until the motion is within 0.1 % of its end."""
    _recorded = "parameter value periods begins state interval work duration transient"

    def __repr__(self) -> str:
        if not self.periods:
            return brief(self, str(self.status))
        drive = f"of {self.parameter} = {self.value:.6g}"
        return brief(self, f"{counted(self.periods, 'period')}, {self.status}", drive)

    @property
    def scene(self) -> Scene:
        """Scene of the system."""
        return self.system.scene

    @property
    def duration(self) -> float:
        """Duration of the pulse."""
        return self.times[1] - self.times[0] if self.periods else 0.0

    @property
    def drives(self) -> tuple[SceneParameters, SceneParameters]:
        """Dimensionless parameters without and with the pulse."""
        return dimensionless(self.system), pulsed(self.system, self.parameter, self.value)

    @cached_property
    def runs(self) -> tuple[Trajectory, Trajectory, Trajectory]:
        """Runs of two periods before the pulse, during it, and until it settles; dimensionless."""
        assert self.periods
        usual, changed = self.drives
        marks = stroboscopic(self.start)
        state = marks[(self.begins - _BEFORE) % len(marks)].tolist()
        before = simulate(usual, state, periods=_BEFORE)
        pulse = simulate(changed, marks[self.begins].tolist(), periods=self.periods)
        after = simulate(usual, pulse.final[1], periods=self.transient + 4)
        return before, pulse, after

    @property
    def times(self) -> tuple[float, float, float]:
        """Times of the start and end of the pulse, and of the end of the transient."""
        if not self.periods:
            return 0.0, 0.0, 0.0
        usual, changed = self.drives
        end = self.periods * changed.period
        second = unit_of(self.system, "duration")
        return 0.0, end * second, (end + self.transient * usual.period) * second

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Time, changed parameter, force of the drive, x_r and x_c, 100 times a period, (n,).

        The pulse begins at time 0; two periods are before it, four after its transient.
        """
        names = ("time", self.parameter, "drive", "x_r", "x_c")
        if not self.periods:
            return {name: np.zeros(0) for name in names}
        own = getattr(self.system, self.parameter)
        # Time and place are 0 at the start of the pulse.
        rows, before = list[Vector](), self.runs[0]
        begin, place = -before.span[1], -float(before.advance)
        for run, value in zip(self.runs, (own, self.value, own), strict=True):
            times = np.arange(0, run.final[0].period, 0.01) * run.parameters.period
            x_r, *_, x_c = run(times, position=True).T
            force = drive_force(run, times)
            rows.append(
                np.array([times + begin, np.full(len(times), value), force, x_r, x_c + place])
            )
            begin, place = begin + run.span[1], place + float(run.advance)
        units = ("duration", "", "peak_force", "x_r", "x_c")
        scales = [unit_of(self.system, unit) if unit else 1.0 for unit in units]
        found = zip(names, np.hstack(rows), scales, strict=True)
        return {name: row * scale for name, row, scale in found}

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts."""
        orbits = {"start": str(self.start.itinerary), "end": str(self.end.itinerary)}
        return super().to_dict() | orbits | record(self, "windows")


def pulsed(system: System, name: str, value: float) -> SceneParameters:
    """Dimensionless parameters during the pulse."""
    return dimensionless(system.replace(**{name: value}))


def unit_of(system: System, quantity: str) -> float:
    """SI unit of a quantity if the system is a device, else 1."""
    return system.scale(quantity) if isinstance(system, SceneDevice) else 1.0
