"""Switching between attractors by a pulse of the drive, the shortest one.

The pulse begins at forcing angle 0, in one of the periods of the motion, and has whole periods of
the changed drive. Then the drive is restored, and the motion settles on the other attractor.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from capsule_sym._attractors.boundary import SHARE
from capsule_sym._attractors.destinations import known_orbits
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._attractors.pulse import Interval, Pulse, PulseWindow, pulsed, unit_of
from capsule_sym._attractors.pulse_search import PulseRuns, checked, intervals
from capsule_sym._errors import Status, counted
from capsule_sym._map import simulate
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._native import Watch
from capsule_sym._orbits.metrics.performance import drive_work
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import SceneDevice
from capsule_sym._systems import System

_INSIDE = 100  # values within a window by which it is confirmed: a finer structure is found
_LONGEST = 2**16  # excitation periods within which a transient is looked for


def switch_by_pulse(
    start: Orbit,
    end: Orbit,
    over: Mapping[str, Sequence[float]] | None = None,
    base: System | None = None,
    *,
    most_periods: int = 8,
    values: int = 2000,
    max_seconds: float = 60.0,
    progress: Callable[[str], object] | None = None,
) -> Pulse:
    """Shortest pulse of the drive that leads from one stable orbit to another.

    For at most `most_periods` periods, from forcing angle 0, one parameter of the drive has another
    value; then the drive is as before. For a motion of several periods the pulse begins in the best
    of them. A run leads to the end if it enters a neighbourhood that the map carries into itself,
    as in `attractors`.

    `values` are tried first for each number of periods, four times as many if none of them leads to
    the end. More are tried between those that lead to different attractors: much narrower intervals
    are found beside basin boundaries. The value is the middle of the widest interval. A run that
    the core cannot decide has a tenth of the time left; beyond it its end is unknown.

    Parameters
    ----------
    start : Orbit
        Stable periodic orbit before the pulse.
    end : Orbit
        Another stable periodic orbit, at the same parameters.
    over : mapping of str to (low, high), optional
        Bounds of the value of one parameter of the drive: of alpha or omega, of alpha_low or D if
        the drive is pulsed, dimensionless. For a device they are bounds of P_d or Omega in SI
        units. By default the amplitude varies from 0 to twice its own.
    base : PhysicalParameters, Parameters or SceneParameters, optional
        Device whose dimensionless parameters are those of the orbits. The default is the parameters
        of the orbits.
    most_periods : int, default 8, 1 to 1,000
        Largest number of periods of the changed drive.
    values : int, default 2000, 9 to 1,000,000
        Number of values that are tried first for each number of periods.
    max_seconds : float, default 60, above 0
        Time limit, in seconds of wall time.
    progress : callable, optional
        Function that is called with a text.

    Returns
    -------
    Pulse
        `value` and `periods` of the pulse, its `work`, and the `transient` after it in excitation
        periods.
        `interval` is the range around the value that leads to the end too. In SI units if the
        system is a device, else dimensionless. `status` is "found", "no-pulse" or "time-limit".

    Raises
    ------
    InvalidInput
        For orbits that are equal, not stable or at different parameters. Also for an unknown
        parameter of the drive, and for a value outside its range.

    See Also
    --------
    attractors : orbits to choose from.
    plot_pulse : figure of the result.

    Examples
    --------
    Two weak periods turn a capsule that moves forward into one that moves backward:

    >>> import capsule_sym as cs
    >>> system = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> found = cs.attractors(system, {"x_r": (-2, 2), "v_r": (-2, 2)}, count=20)
    >>> forward, backward = (one.orbit for one in found.attractors)
    >>> pulse = cs.switch_by_pulse(forward, backward, values=50)
    >>> print(f"alpha = {pulse.value:.4f} for {pulse.periods} periods, then {pulse.transient}")
    alpha = 0.8877 for 2 periods, then 18
    >>> back = cs.switch_by_pulse(backward, forward, {"omega": (0.3, 0.5)}, values=50)
    >>> print(f"omega = {back.value:.4f} for {back.periods} period")
    omega = 0.4676 for 1 period
    """
    system = start.parameters if base is None else base
    name, bounds = checked(start, end, over, system)
    check_count("most_periods", most_periods, 1, 1000)
    check_count("values", values, 9, 10**6)
    start, end = whole_orbit(start), whole_orbit(end)
    search = _Search(start, end, system, name, bounds, progress or (lambda said: None))
    with Watch(checked_seconds(max_seconds)):
        search.run(most_periods, values)
    ends = start, end, system, name
    return Pulse(*ends, tuple(search.windows), search.status, search.message, **search.found)


@dataclass
class _Search:
    """Windows of pulses, and the best pulse so far."""

    start: Orbit
    end: Orbit
    system: System
    name: str
    bounds: Interval
    report: Callable[[str], object]
    windows: list[PulseWindow] = field(default_factory=list)
    found: dict[str, Any] = field(default_factory=dict)
    """Fields of the best pulse so far, that in the middle of the widest window."""
    status: Status = Status.TIME_LIMIT
    message: str = "time limit reached before the last pulse"

    def run(self, most: int, values: int) -> None:
        """Find the windows of the fewest periods, and confirm the widest one."""
        known = known_orbits([self.start, self.end], share=SHARE)
        tied, factor = self.name, 1.0
        if isinstance(self.system, SceneDevice):
            tied, factor = self.system.tie(tied)
        column = self.system.scene.facts.PARAMETERS.index(tied)
        runs = PulseRuns(known, known.cycles[0][0].states, column, factor)
        for periods in range(1, most + 1):
            self.report(f"pulses of {periods} of {counted(most, 'period')}")
            found = self.of_periods(runs, periods, values)
            self.windows += found or self.of_periods(runs, periods, 4 * values)
            whole = set[PulseWindow]()
            while self.windows:
                best = max(self.windows, key=lambda one: (one.width, one))
                if best in whole:
                    self.status = Status.FOUND
                    self.message = "the pulse leads to the other attractor"
                    return
                self.found = self.measured(best)  # now: no run starts after the time limit
                whole.update(self.confirmed(runs, best))
        over = "{} from {:.6g} to {:.6g}".format(self.name, *self.bounds)
        pulses = f"of at most {counted(most, 'period')} with {over}"
        self.status, self.found = Status.NO_PULSE, {}
        self.message = f"no pulse {pulses} leads to the other attractor"

    def of_periods(self, runs: PulseRuns, periods: int, values: int) -> list[PulseWindow]:
        """Windows of pulses of so many periods, from each period of the start."""
        return [
            PulseWindow(periods, begins, *part)
            for begins in range(len(runs.starts))
            for part in intervals(runs, periods, begins, *self.bounds, values)
        ]

    def confirmed(self, runs: PulseRuns, window: PulseWindow) -> list[PulseWindow]:
        """Parts of a window by more values within it; they replace the window."""
        of = window.periods, window.begins
        parts = intervals(runs, *of, window.low, window.high, _INSIDE)
        at = self.windows.index(window)
        self.windows[at : at + 1] = (found := [PulseWindow(*of, *part) for part in parts])
        return found

    def measured(self, window: PulseWindow) -> dict[str, Any]:
        """Fields of the result that describe the pulse in the middle of a window."""
        value, begin = (window.low + window.high) / 2, stroboscopic(self.start)[window.begins]
        drive = pulsed(self.system, self.name, value)
        pulse = simulate(drive, begin.tolist(), periods=window.periods)
        units = [unit_of(self.system, name) for name in ("x_r", "v_r", "v_c")]
        return {
            "value": value,
            "periods": window.periods,
            "begins": window.begins,
            "state": tuple((begin * units).tolist()),
            "interval": (window.low, window.high),
            "work": drive_work(pulse) * unit_of(self.system, "work"),
            "transient": self.transient(pulse.final[1]),
        }

    def transient(self, begin: Any) -> int:
        """Excitation periods after a pulse until the motion is within 0.1 % of the end."""
        marks, length = stroboscopic(self.end), 64
        limit = 1e-3 * (1 + abs(marks).max())
        while True:
            run = simulate(self.end.parameters, begin, periods=length, keep="stroboscopic")
            apart = abs(run.stroboscopic[:, None, :] - marks).max(axis=2).min(axis=1)
            last = len(apart) - int((apart <= limit)[::-1].cumprod().sum())
            if last + len(marks) < length or length >= _LONGEST:
                return last
            length *= 2
