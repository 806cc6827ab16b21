"""Switching between attractors by a pulse of the drive, the shortest one.

The pulse begins at forcing angle 0, in one of the periods of the motion, and has whole periods of
the changed drive. Then the drive is restored, and the motion settles on the other attractor.

Values on a grid are tried. Where neighbours lead to different attractors a value between them is
tried, down to a least spacing: this bisects the ends of windows, and finds narrower windows beside
the boundaries of basins.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Arrivals, known_orbits
from capsule_sym._attractors.neighbourhoods import NONE, SHARE
from capsule_sym._attractors.pulse import Pulse, PulseWindow, longest, pulsed
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.checks import check_count, check_start, checked_ends, checked_seconds
from capsule_sym._native import Watch
from capsule_sym._native.watch import silent
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import same, whole_orbit
from capsule_sym._parameters import SceneDevice
from capsule_sym._systems import System, check_parameter, dimensionless, drives

_INSIDE = 100  # values within a window by which it is confirmed: a finer structure is found
_FINEST = 1e-9  # least spacing of values, over the range: the best accuracy of a window's ends
_END = 1  # number of the end attractor among the known ones


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
    are found beside basin boundaries. The value is the middle of the widest interval.

    A run is computed in parts of growing length. Its end is unknown, and the pulse not taken, if
    the core cannot decide more than 100 segments of a part, or if a part is not over within a tenth
    of the time left. It counts as leading elsewhere if it takes more than 512 periods beyond those
    in which the end orbit attracts by a factor of 1e6.

    Parameters
    ----------
    start : Orbit
        Stable periodic orbit before the pulse.
    end : Orbit
        Another stable periodic orbit, at the same parameters.
    over : mapping of str to (low, high), optional
        Bounds of the value of one parameter of the drive: of alpha or omega, of alpha_low or D if
        the drive is pulsed, dimensionless. For a device they are bounds of P_d or Omega, or
        of P_low or duty, in SI units. By default the amplitude varies from 0 to twice its own.
    base : PhysicalParameters, Parameters or SceneParameters, optional
        Device whose dimensionless parameters are those of the orbits. The default is the parameters
        of the orbits.
    most_periods : int, default 8, 1 to 1,000
        Largest number of periods of the changed drive.
    values : int, default 2000, 9 to 1,000,000
        Number of values that are tried first for each number of periods and each period of the
        motion in which the pulse may begin.
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
        system is a device, else dimensionless. `status` is "found", "no-pulse" or "time-limit"; at
        a time limit a value is the middle of the widest window so far, which is not confirmed.

    Raises
    ------
    InvalidInput
        For orbits that are equal, not stable or at different parameters, and for a `base` of other
        parameters. Also for an unknown parameter of the drive, and for a value outside its range.

    See Also
    --------
    attractors : orbits to choose from.
    plot : figure of the result.

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
    if dimensionless(system) != start.parameters:
        allowed = "the parameters of the orbits, or a device that has them"
        raise InvalidInput("base", system, allowed)
    name, ends = _bounds(over, system)
    check_count("most_periods", most_periods, 1, 1000)
    check_count("values", values, 9, 10**6)
    search = PulseSearch(start, end, system, name)
    with Watch(checked_seconds(max_seconds)):
        search.run(ends, most_periods, values, progress or silent)
    found: dict[str, Any] = {}
    if (best := search.best) is not None:
        found = {"value": (best.low + best.high) / 2, "interval": (best.low, best.high)}
        found |= {"periods": best.periods, "begins": best.begins}
    windows = tuple(search.windows)
    return Pulse(*search.ends, system, name, windows, search.status, search.message, **found)


class PulseSearch:
    """Windows of pulses of the fewest periods, and the widest one, `best`, None for none.

    Raises InvalidInput for orbits that are equal, not stable or at different parameters.
    """

    def __init__(self, start: Orbit, end: Orbit, system: System, name: str) -> None:
        self.ends = whole_orbit(start), whole_orbit(end)
        self.known = known_orbits(self.ends, share=SHARE)
        if same(*self.ends):
            raise InvalidInput("end", str(end.itinerary), "another orbit than the start")
        self.name, self.factor = name, 1.0
        if isinstance(system, SceneDevice):
            name, self.factor = system.tie(name)
        self.column = system.scene.facts.PARAMETERS.index(name)
        self.windows = list[PulseWindow]()
        self.best: PulseWindow | None = None
        self.status, self.message = Status.TIME_LIMIT, "time limit reached before the last pulse"

    def run(
        self, ends: tuple[float, float], most: int, values: int, report: Callable[[str], object]
    ) -> None:
        """Find the windows of the fewest periods, and confirm the widest one.

        `ends` are the bounds of the value, `most` is the largest number of periods, `values` the
        number of values. Sets status and message. Raises TimeUp if the present watch is over.
        """
        for periods in range(1, most + 1):
            report(f"pulses of {periods} of {counted(most, 'period')}")
            begins = range(len(self.known.cycles[0][0].states))
            every = [PulseWindow(periods, begin, *ends) for begin in begins]
            for count in (values, 4 * values):
                if not self.windows:
                    self.windows = [part for one in every for part in self.parts(one, count)]
            while self.windows:
                self.best = best = max(self.windows, key=lambda one: (one.width, one))
                parts = self.parts(best, _INSIDE)
                if parts == [best]:
                    self.status = Status.FOUND
                    self.message = "the pulse leads to the other attractor"
                    return
                at = self.windows.index(best)
                self.windows[at : at + 1] = parts
        pulse = "pulse of at most {} with {} from {:.6g} to {:.6g}"
        pulse = pulse.format(counted(most, "period"), self.name, *ends)
        self.status, self.best = Status.NO_PULSE, None
        self.message = f"no {pulse} leads to the other attractor"

    def parts(self, window: PulseWindow, count: int) -> list[PulseWindow]:
        """Parts of a range in which pulses lead to the end, ascending.

        `count` values are tried first, and up to ten times as many in all.
        """
        values = np.linspace(window.low, window.high, count)
        reached = self.reached(window, values)
        most = 10 * count  # beside a fractal boundary values differ down to the least spacing
        while len(values) < most:
            gaps = np.diff(values)
            differ = (np.diff(reached) != 0) & (gaps > _FINEST * (window.high - window.low))
            # The widest gaps first, if there is no room for all.
            chosen = np.flatnonzero(differ)[np.argsort(-gaps[differ], kind="stable")]
            if not chosen.size:
                break
            chosen = chosen[: most - len(values)]
            between = values[chosen] + gaps[chosen] / 2
            order = np.argsort(joined := np.append(values, between), kind="stable")
            reached = np.append(reached, self.reached(window, between))[order]
            values = joined[order]
        leads = np.concatenate([[False], reached == _END, [False]])
        ends = np.flatnonzero(np.diff(leads.astype(int)))
        found = zip(values[ends[::2]].tolist(), values[ends[1::2] - 1].tolist(), strict=True)
        return [window._replace(low=low, high=high) for low, high in found]

    def reached(self, window: PulseWindow, values: Vector) -> NDArray[np.int16]:
        """Number of the attractor to which each pulse of these values leads, (n,).

        NONE if it is unknown, or not reached in time.
        """
        rows = self.known.rows.repeat(len(values), axis=0)
        rows[:, self.column] = values * self.factor
        begin = self.known.cycles[0][0].states[[window.begins]].repeat(len(values), axis=0)
        after = self.known.run(rows, begin, 0.0, window.periods)
        runs, row = Arrivals.begun(after.states), np.zeros(len(values), np.intp)
        self.known.destination(row, runs, 0.0, longest(self.ends[1]))
        return np.where(after.success, runs.numbers, NONE)


def _bounds(
    over: Mapping[str, Sequence[float]] | None, system: System
) -> tuple[str, tuple[float, float]]:
    """Parameter that the pulse changes, and its bounds; by default the amplitude to twice its own.

    Raises InvalidInput for others.
    """
    allowed = drives(system)
    name = next(iter(allowed))
    over = {name: (0.0, 2 * getattr(system, name))} if over is None else over
    for name in over:
        check_parameter("over", name, system)
    if len(over) != 1 or not {*over} <= {*allowed}:
        raise InvalidInput("over", over, f"bounds of one of {', '.join(allowed)}")
    ((name, given),) = over.items()
    ends = checked_ends(f"bounds of {name}", given)
    for one in ends:
        check_start(pulsed(system, name, one), (0.0, 0.0, 0.0), 0.0, 1)
    return name, ends
