"""Intervals of a drive's value in which a pulse of some periods leads to an attractor.

Values on a grid are tried. Where neighbours lead to different attractors a value between them is
tried, down to a least spacing: this bisects the ends of intervals, and finds narrower intervals
beside the boundaries of basins.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.boundary import SHARE
from capsule_sym._attractors.destinations import NEUTRAL, Arrivals, KnownOrbits
from capsule_sym._attractors.neighbourhoods import run_rows
from capsule_sym._attractors.pulse import Interval, pulsed
from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import check_start, checked_ends
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import same, whole_orbit
from capsule_sym._systems import System, check_parameter, dimensionless, drives

_FINEST = 1e-9  # least spacing of values, over the range: the accuracy of an interval's ends
_END = 1  # number of the end attractor among the known ones


class PulseRuns(NamedTuple):
    """Runs of pulses, and the attractors to which they lead."""

    known: KnownOrbits
    """Attractors: that of the start, that of the end, and those that runs have reached."""
    starts: Vector
    """States at phase 0 of the attractor at the start, (period number, 3)."""
    column: int
    """Index of the dimensionless parameter that the pulse changes."""
    factor: float
    """Ratio of this parameter to the value."""

    def reached(self, values: Vector, periods: int, begins: int) -> NDArray[np.int16]:
        """Number of the attractor to which each pulse of these values leads, (n,)."""
        rows = self.known.rows.repeat(len(values), axis=0)
        rows[:, self.column] = values * self.factor
        starts = self.starts[[begins]].repeat(len(values), axis=0)
        after = run_rows(rows, starts, 0.0, periods, self.known.scene, share=SHARE)
        # The end attracts by e^14, to 1e-6, in the time beyond 512 excitation periods.
        end = self.known.cycles[0][_END]
        longest = 512 + math.ceil(14 * len(end.states) / -math.log(max(end.multiplier, 1e-3)))
        row = np.zeros(len(values), np.intp)
        found = self.known.destination(row, Arrivals.begun(after.states), 0.0, longest).numbers
        return np.where(after.success, found, -1)


def intervals(
    runs: PulseRuns, periods: int, begins: int, low: float, high: float, count: int
) -> list[Interval]:
    """Intervals in a range in which the pulse leads to the end, in ascending order.

    The grid has `count` values.
    """
    values = np.linspace(low, high, count)
    reached = runs.reached(values, periods, begins)
    most = 10 * count  # beside a fractal boundary values differ down to the least spacing
    while len(values) < most:
        gaps = np.diff(values)
        differ = (np.diff(reached) != 0) & (gaps > _FINEST * (high - low))
        # The widest gaps first, if there is no room for all.
        chosen = np.flatnonzero(differ)[np.argsort(-gaps[differ], kind="stable")]
        if not chosen.size:
            break
        between = values[chosen[: most - len(values)]]
        between = between + gaps[chosen[: len(between)]] / 2
        order = np.argsort(joined := np.append(values, between), kind="stable")
        more = runs.reached(between, periods, begins)
        values, reached = joined[order], np.concatenate([reached, more])[order]
    leads = np.concatenate([[False], reached == _END, [False]])
    ends = np.flatnonzero(np.diff(leads.astype(int)))
    return [*zip(values[ends[::2]].tolist(), values[ends[1::2] - 1].tolist(), strict=True)]


def checked(
    start: Orbit, end: Orbit, over: Mapping[str, Sequence[float]] | None, system: System
) -> tuple[str, Interval]:
    """Parameter that the pulse changes, and its bounds; raises InvalidInput for all arguments."""
    for field_, orbit in (("start", start), ("end", end)):
        if not orbit.success or not stable(orbit.multipliers):
            raise InvalidInput(field_, orbit, "a stable periodic orbit")
    if end.parameters != start.parameters:
        raise InvalidInput("end", end.parameters, "an orbit at the parameters of the start")
    if dimensionless(system) != start.parameters:
        raise InvalidInput(
            "base", system, "the parameters of the orbits, or a device that has them"
        )
    if same(whole_orbit(start), whole_orbit(end)):
        raise InvalidInput("end", str(end.itinerary), "another orbit than the start")
    allowed = drives(system)
    if over is None:
        name = next(iter(allowed))
        over = {name: (0.0, 2 * getattr(system, name))}
    for name in over:
        check_parameter("over", name, system)
    if len(over) != 1 or next(iter(over)) not in allowed:
        raise InvalidInput("over", over, f"bounds of one of {', '.join(allowed)}")
    ((name, given),) = over.items()
    ends = checked_ends(f"bounds of {name}", given)
    for one in ends:
        try:
            check_start(pulsed(system, name, one), (0.0, 0.0, 0.0), 0.0, 1)
        except InvalidInput as error:
            allowed_ends = f"such that {error.field} is {error.allowed}"
            raise InvalidInput(f"bounds of {name}", given, allowed_ends) from None
    return name, ends


def stable(multipliers: Iterable[complex]) -> bool:
    """True if an orbit with these multipliers is stable beyond rounding."""
    return max(map(abs, multipliers), default=0.0) < 1 - NEUTRAL
