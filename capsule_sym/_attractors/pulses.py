"""Switching between attractors by a pulse of the drive: the shortest, or that of least work.

The pulse begins at forcing angle 0, in one of the periods of the motion, and has whole periods of
the changed drive. Then the drive is restored, and the motion settles on the other attractor. Its
work is that of the drive during the pulse.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from capsule_sym._attractors.boundary import SHARE
from capsule_sym._attractors.destinations import known_orbits
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._attractors.pulse import Interval, Pulse, PulseWindow, pulsed, unit_of
from capsule_sym._attractors.pulse_search import AttractorLost, Case, carried, checked, intervals
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._native import Watch
from capsule_sym._orbits.metrics.work import drive_work
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import SceneDevice
from capsule_sym._systems import System, dimensionless, factors_of, real

_INSIDE = 100  # values within a window by which it is confirmed: a finer structure is found
_PRICED, _CLOSER = 300, 60  # pulses whose work is computed, a second: in all windows, and in one
_CONFIRMED = 8  # windows of least work that are confirmed
_WIDE = 1e-3  # least width, over the range, of the window of a pulse of least work


def switch_by_pulse(
    start: Orbit,
    end: Orbit,
    over: Mapping[str, Sequence[float]] | None = None,
    base: System | None = None,
    *,
    most_periods: int = 8,
    least: str = "periods",
    margin: float = 0.05,
    tolerances: Mapping[str, float] | None = None,
    values: int = 2000,
    max_seconds: float = 60.0,
    progress: Callable[[str], object] | None = None,
) -> Pulse:
    """Pulse of the drive that leads from one stable orbit to another.

    For at most `most_periods` periods, from forcing angle 0, one parameter of the drive has another
    value; then the drive is as before. For a motion of several periods the pulse begins in the best
    of them. A run leads to the end if it enters a neighbourhood that the map carries into itself,
    as in `attractors`.

    `values` are tried first for each number of periods, four times as many if none of them leads to
    the end. More are tried between those that lead to different attractors: much narrower intervals
    are found beside basin boundaries. After `max_seconds` the result has the shortest pulse so
    far, with the middle of its widest interval. A
    run that the core cannot decide has a tenth of the time left; beyond it its end is unknown.

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
    least : {"periods", "work"}, default "periods"
        "periods" gives the shortest pulse, with the middle of the widest interval of values that
        lead to the end. "work" gives the pulse of least work of the drive. Its interval has at
        least 0.1 % of the bounds if there is such a one.
    margin : float, default 0.05, 0 to 0.5
        Least distance of the value from the ends of its interval for "work", as a share of the
        interval.
    tolerances : mapping of str to float, optional, each above 0 and below 1
        Tolerances of parameters by name, as shares. The same pulse works at the nominal values and
        at all combinations of their ends, including those of the drive.
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
        system is a device, else dimensionless. `status` is "found", "no-pulse", "attractor-lost" if
        an attractor does not exist at an end of the tolerances, or "time-limit".

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
    if least not in ("periods", "work"):
        raise InvalidInput("least", least, "periods or work")
    if not (real(margin) and 0 <= margin <= 0.5):
        raise InvalidInput("margin", margin, "a share from 0 to 0.5")
    factors = factors_of(tolerances, system)
    watch = Watch(checked_seconds(max_seconds))
    start, end = whole_orbit(start), whole_orbit(end)
    search = _Search(start, end, system, name, bounds, margin, progress or (lambda said: None))
    with watch:
        search.run(factors, most_periods, least, values)
    return search.result()


@dataclass
class _Search:
    """Windows of pulses, and the best pulse so far."""

    start: Orbit
    end: Orbit
    system: System
    name: str
    bounds: Interval
    margin: float
    report: Callable[[str], object]
    cases: list[Case] = field(default_factory=list)
    windows: list[PulseWindow] = field(default_factory=list)
    found: dict[str, Any] = field(default_factory=dict)
    """Fields of the best pulse so far; at first that in the middle of the widest window."""
    status: Status = Status.TIME_LIMIT
    message: str = "time limit reached before the last pulse"

    def run(
        self, factors: Sequence[Mapping[str, float]], most: int, least: str, values: int
    ) -> None:
        """Find all windows, or those of the fewest periods, and the best pulse within them."""
        try:
            for number, one in enumerate(factors, 1):
                if len(factors) > 1:
                    self.report(f"attractors at end {number} of {len(factors)} of the tolerances")
                self.cases.append(self.case(one))
        except AttractorLost as lost:
            self.status, self.message = Status.ATTRACTOR_LOST, str(lost)
            return
        best: tuple[PulseWindow, float] | None = None
        for periods in range(1, most + 1):
            self.report(f"pulses of {periods} of {counted(most, 'period')}")
            found = self.of_periods(periods, values) or self.of_periods(periods, 4 * values)
            self.windows += found
            if found:  # computed now: no run starts after the time limit
                widest = max(self.windows, key=lambda one: one.width)
                self.found = self.measured(widest, (widest.low + widest.high) / 2)
            if least == "periods" and (whole := self.widest()) is not None:
                best = whole, (whole.low + whole.high) / 2
                break
        if least == "work":
            self.report("the least work")
            best = self.cheapest()
        self.found = self.measured(*best) if best else {}
        self.status, self.message = Status.FOUND, "the pulse leads to the other attractor"
        if best is None:
            over = "{} from {:.6g} to {:.6g}".format(self.name, *self.bounds)
            pulses = f"of at most {counted(most, 'period')} with {over}"
            self.status = Status.NO_PULSE
            self.message = f"no pulse {pulses} leads to the other attractor"

    def case(self, factors: Mapping[str, float]) -> Case:
        """Pulses at an end of the tolerances, with the attractors there."""
        changed = {name: getattr(self.system, name) * by for name, by in factors.items()}
        system = self.system.replace(**changed)
        there = dimensionless(system)
        known = known_orbits(
            [carried(one, there, factors) for one in (self.start, self.end)], share=SHARE
        )
        starts, marks = stroboscopic(self.start), known.cycles[0][0].states
        # The periods are numbered as those of the start.
        turns = [np.roll(marks, -i, axis=0) for i in range(len(starts))]
        marks = min(turns, key=lambda turned: float(abs(turned - starts).max()))
        tied, factor = self.name, 1.0
        if isinstance(system, SceneDevice):
            tied, factor = system.tie(tied)
        column = system.scene.facts.PARAMETERS.index(tied)
        return Case(known, marks, column, factor * factors.get(self.name, 1.0))

    def of_periods(self, periods: int, values: int) -> list[PulseWindow]:
        """Windows of pulses of so many periods, from each period of the start."""
        return [
            PulseWindow(periods, begins, *part)
            for begins in range(len(self.cases[0].starts))
            for part in intervals(self.cases, periods, begins, *self.bounds, values)
        ]

    def confirmed(self, window: PulseWindow) -> list[PulseWindow]:
        """Parts of a window by more values within it; they replace the window."""
        of = window.periods, window.begins
        parts = intervals(self.cases, *of, window.low, window.high, _INSIDE)
        at = self.windows.index(window)
        self.windows[at : at + 1] = (found := [PulseWindow(*of, *part) for part in parts])
        return found

    def widest(self) -> PulseWindow | None:
        """Widest window that is confirmed; None if there is none."""
        whole = set[PulseWindow]()
        while self.windows and (best := max(self.windows, key=lambda w: (w.width, w))) not in whole:
            whole.update(self.confirmed(best))
        return best if self.windows else None

    def cheapest(self) -> tuple[PulseWindow, float] | None:
        """Window with the pulse of least work, and its value; None if there is no window.

        Windows too narrow for use count only if there is no other.
        """
        least = _WIDE * (self.bounds[1] - self.bounds[0])
        wide = [one for one in self.windows if one.width >= least]
        total = sum(one.width for one in wide)
        wide.sort(key=lambda one: self.least(one, round(_PRICED * one.width / total))[0])
        parts = [part for one in wide[:_CONFIRMED] for part in self.confirmed(one)]
        parts = [one for one in parts if one.width >= least]
        parts = parts or [one for one in [self.widest()] if one is not None]
        polished = min(
            ((*self.least(one, _CLOSER, polish=True), one) for one in parts), default=None
        )
        return polished and (polished[2], polished[1])

    def least(self, window: PulseWindow, count: int, polish: bool = False) -> tuple[float, float]:
        """Least work of so many pulses of a window, or next to the best of them, and its value."""
        from scipy.optimize import minimize_scalar

        kept = self.margin * window.width
        low, high = window.low + kept, window.high - kept
        values = np.linspace(low, high, max(count, 3))
        work, value = min((self.work(window, value), value) for value in values.tolist())
        beside = max(low, value - values[1] + low), min(high, value + values[1] - low)
        if polish and beside[0] < beside[1]:
            best = minimize_scalar(partial(self.work, window), bounds=beside, method="bounded")
            work, value = min((work, value), (float(best.fun), float(best.x)))
        return work, value

    def pulse(self, window: PulseWindow, value: float) -> Trajectory:
        """Run during a pulse."""
        state = stroboscopic(self.start)[window.begins].tolist()
        return simulate(pulsed(self.system, self.name, value), state, periods=window.periods)

    def work(self, window: PulseWindow, value: float) -> float:
        """Work of the drive over a pulse, dimensionless."""
        return drive_work(self.pulse(window, float(value)))

    def result(self) -> Pulse:
        """Best pulse found, or the reason why there is none."""
        windows = tuple(self.windows)
        ends = self.start, self.end, self.system, self.name
        return Pulse(*ends, windows, self.status, self.message, **self.found)

    def measured(self, window: PulseWindow, value: float) -> dict[str, Any]:
        """Fields of the result that describe a pulse."""
        units = [unit_of(self.system, name) for name in ("x_r", "v_r", "v_c")]
        return {
            "value": value,
            "periods": window.periods,
            "begins": window.begins,
            "state": tuple((stroboscopic(self.start)[window.begins] * units).tolist()),
            "interval": (window.low, window.high),
            "work": self.work(window, value) * unit_of(self.system, "work"),
            "transient": self.transient(window, value),
        }

    def transient(self, window: PulseWindow, value: float) -> int:
        """Excitation periods after a pulse until the motion is within 0.1 % of the end."""
        marks, begin = stroboscopic(self.end), self.pulse(window, value).final[1]
        length, limit = 64, 1e-3 * (1 + abs(marks).max())
        while True:
            run = simulate(self.end.parameters, begin, periods=length, keep="stroboscopic")
            apart = abs(run.stroboscopic[:, None, :] - marks).max(axis=2).min(axis=1)
            last = len(apart) - int((apart <= limit)[::-1].cumprod().sum())
            if last + len(marks) < length or length >= 2**16:
                return last
            length *= 2
