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
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, brief, by_fields, record
from capsule_sym._orbits.metrics.performance import drive_force, drive_work
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneDevice, SceneParameters
from capsule_sym._systems import System, dimensionless

_BEFORE, _AFTER = 2, 4  # excitation periods shown before the pulse, and after its transient
_LONGEST = 2**16  # excitation periods within which the end of a transient is looked for


class PulseWindow(NamedTuple):
    """Pulses that lead to the end: periods, starting period of the motion, and range of values.

    `low` and `high` are in SI units if the system is a device, else dimensionless.
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

    In SI units if the system is a device, else dimensionless. `windows` are those of the fewest
    periods; only the widest, `interval`, is confirmed. Without a pulse `value`, `work`,
    `interval` and `state` are nan, `periods`, `begins`, `transient` and `duration` 0, and `columns`
    empty; `runs` and `drives` raise InvalidInput.
    """

    _of_system = True
    start: Orbit
    end: Orbit
    system: System
    parameter: str
    """Name of the parameter that the pulse changes."""
    windows: tuple[PulseWindow, ...]
    """Windows of the fewest periods: named tuples of `periods`, `begins`, `low`, `high`.

    All values that were tried within a window lead to the end. Only the widest one is confirmed.
    """
    status: Status
    """Status of the search."""
    message: str
    """Status as a sentence."""
    value: float = math.nan
    """Value of the parameter during the pulse."""
    interval: tuple[float, float] = math.nan, math.nan
    """Range of values around `value`; all that were tried in it lead to the end, all else equal."""
    periods: int = 0
    """Number of periods of the changed drive."""
    begins: int = 0
    """Period of the start motion, from 0, at whose phase 0 the pulse begins, in `state`."""
    _recorded = "parameter value periods begins state interval work duration transient"

    def __repr__(self) -> str:
        if not self.periods:
            return brief(self, str(self.status))
        drive = f"of {self.parameter} = {self.value:.6g}"
        return brief(self, f"{counted(self.periods, 'period')}, {self.status}", drive)

    @property
    def drives(self) -> tuple[SceneParameters, SceneParameters]:
        """Dimensionless parameters without and with the pulse."""
        return dimensionless(self.system), pulsed(self.system, self.parameter, self.value)

    @property
    def state(self) -> tuple[float, ...]:
        """(x_r, v_r, v_c) at forcing angle 0, at the start of the pulse."""
        units = [unit_of(self.system, name) for name in ("x_r", "v_r", "v_c")]
        begin = stroboscopic(self.start)[self.begins] if self.periods else np.full(3, math.nan)
        return tuple((begin * units).tolist())

    @cached_property
    def runs(self) -> tuple[Trajectory, Trajectory, Trajectory]:
        """Runs of two periods before the pulse, during it, and after it; dimensionless.

        The last one ends four periods after the transient. Raises InvalidInput if no pulse was
        found.
        """
        if not self.periods:
            raise InvalidInput("pulse", self, "a result with a pulse")
        usual, changed = self.drives
        marks = stroboscopic(self.start)
        state = marks[(self.begins - _BEFORE) % len(marks)].tolist()
        before = simulate(usual, state, periods=_BEFORE)
        pulse = simulate(changed, marks[self.begins].tolist(), periods=self.periods)
        return before, pulse, simulate(usual, pulse.final[1], periods=self.transient + _AFTER)

    @property
    def work(self) -> float:
        """Work of the drive during the pulse."""
        return drive_work(self.runs[1]) * unit_of(self.system, "work") if self.periods else math.nan

    @cached_property
    def transient(self) -> int:
        """Excitation periods after the pulse until states at phase 0 stay near to those of `end`.

        That is within 0.001 times (1 + the largest absolute entry of these), dimensionless. 65,537
        if they are not near after 65,536 periods, and 0 without a pulse.
        """
        if not self.periods:
            return 0
        usual, changed = self.drives
        begin, marks = stroboscopic(self.start)[self.begins].tolist(), stroboscopic(self.end)
        state = simulate(changed, begin, periods=self.periods, keep="final").final[1]
        length, late = 32, 32
        while late + len(marks) >= length < _LONGEST:
            length *= 2
            run = simulate(usual, state, periods=length, keep="stroboscopic")
            apart = abs(run.stroboscopic[:, None] - marks).max(axis=2).min(axis=1)
            near = apart <= 1e-3 * (1 + abs(marks).max())
            late = len(near) - int(near[::-1].cumprod().sum())
        return late

    @property
    def duration(self) -> float:
        """Duration of the pulse."""
        return self.times[1]

    @property
    def times(self) -> tuple[float, float, float]:
        """Times of the start of the pulse, 0, of its end, and of the end of the transient."""
        if not self.periods:
            return 0.0, 0.0, 0.0
        usual, changed = self.drives
        end, second = self.periods * changed.period, unit_of(self.system, "duration")
        return 0.0, end * second, (end + self.transient * usual.period) * second

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Time, changed parameter, force of the drive, x_r and x_c, 100 times a period, (n,).

        The pulse begins at time 0 and x_c = 0; two periods are before it, four after its transient.
        The names are "time", that of the parameter, "drive", "x_r" and "x_c".
        """
        names = ("time", self.parameter, "drive", "x_r", "x_c")
        if not self.periods:
            return {name: np.zeros(0) for name in names}
        own = getattr(self.system, self.parameter)
        values, lengths = (own, self.value, own), (_BEFORE, self.periods, self.transient + _AFTER)
        # Time and place are 0 at the start of the pulse.
        rows, before = list[Vector](), self.runs[0]
        begin, place = -before.span[1], -float(before.advance)
        for run, value, length in zip(self.runs, values, lengths, strict=True):
            times = np.arange(0, length, 0.01) * run.parameters.period
            x_r, *_, x_c = run(times, position=True).T
            force, changed = drive_force(run, times), np.full(len(times), value)
            rows.append(np.array([times + begin, changed, force, x_r, x_c + place]))
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


def longest(end: Orbit) -> int:
    """Excitation periods after a pulse within which it has to lead to an orbit.

    They are 512, and those in which the orbit attracts by e^14, to 1e-6.
    """
    rate = -math.log(max(abs(end.multipliers[0]), 1e-3))
    return 512 + math.ceil(14 * end.itinerary.period_number / rate)


def unit_of(system: System, quantity: str) -> float:
    """SI unit of a quantity, as a factor, if the system is a device, else 1."""
    return system.scale(quantity) if isinstance(system, SceneDevice) else 1.0
