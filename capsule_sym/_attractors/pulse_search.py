"""Intervals of a drive's value in which a pulse of some periods leads to an attractor.

As a function of the value, the run after the pulse is a continuous curve, which the boundaries of
basins cut. It is sampled until neighbours stay close for a while after the pulse. Beside a boundary
runs separate, so that samples next to it find intervals narrower than the first spacing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.neighbourhoods import run_rows, stroboscopic
from capsule_sym._attractors.pulse import Interval
from capsule_sym._attractors.settling import Arrivals, Cycle, Settling
from capsule_sym._orbits.shooting.orbit import Orbit

_FOLLOWED = (4, 16)  # excitation periods after the pulse at which neighbours are compared
_APART = 0.02  # distance of neighbours, over the size of all, above which a sample is inserted
_FINEST = 1e-7  # least spacing of inserted values, over the range
_MOST_VALUES = 10  # factor of values for pulses of one number of periods, over the first ones
_LEAST_VALUES = 9  # least number of values in a part of the range
_REFINED = 4  # intervals of a part whose ends are refined, the widest ones
_EDGE = 1e-11  # accuracy of these ends, over the range
_END = 1  # number of the end attractor among the known ones
_NEAR = 1e-6  # remaining share of a deviation at which a run counts as settled
_SETTLING = 512, 8192  # least and largest number of excitation periods in which a run arrives


@dataclass(frozen=True, eq=False)
class Case:
    """Parameters at one end of their tolerances, and pulses there.

    `orbits` are the attractors at the start and at the end, `starts` the states of the first at
    phase 0, (period number, 3).
    """

    orbits: tuple[Orbit, Orbit]
    starts: Vector
    column: int
    """Index of the dimensionless parameter that the pulse changes."""
    factor: float
    """Ratio of this parameter to the value."""

    @cached_property
    def known(self) -> Settling:
        """Attractors at these parameters: both orbits, and those that runs have reached so far.

        A run to any of them ends on arrival.
        """
        found = Settling(self.usual(1), self.orbits[0].scene)
        for orbit in self.orbits:
            found.add([(0, Cycle(stroboscopic(orbit), float(abs(orbit.multipliers[0]))))])
        return found

    @cached_property
    def settling(self) -> int:
        """Excitation periods within which a run to the end attractor arrives."""
        end = self.orbits[1]
        largest = min(max(float(abs(end.multipliers[0])), 1e-3), 1 - 1e-9)
        wanted = math.ceil(math.log(_NEAR) / math.log(largest)) * end.itinerary.period_number
        return min(max(wanted, _SETTLING[0]), _SETTLING[1])

    def on(self, states: Vector, rows: Vector, periods: int) -> Vector:
        """States after so many excitation periods at rows of parameters, (n, 3)."""
        return run_rows(rows, states, 0.0, periods, self.orbits[0].scene).states

    def usual(self, count: int) -> Vector:
        """Rows of the parameters without a pulse, (count, k)."""
        return np.tile([*self.orbits[0].parameters.to_dict().values()], (count, 1))

    def after(self, values: Vector, periods: int, begins: int) -> Vector:
        """States at phase 0 after pulses of these values, (n, 3)."""
        rows = self.usual(len(values))
        rows[:, self.column] = values * self.factor
        return self.on(np.tile(self.starts[begins], (len(values), 1)), rows, periods)

    def leads(self, values: Vector, periods: int, begins: int) -> NDArray[np.bool_]:
        """True for pulses of these values that lead to the end attractor, (n,)."""
        return self.at_end(self.after(values, periods, begins))

    def at_end(self, states: Vector) -> NDArray[np.bool_]:
        """True for states at phase 0 that lead to the end attractor, (n,)."""
        row, runs = np.zeros(len(states), np.intp), Arrivals.begun(states)
        found: NDArray[np.bool_] = self.known.follow(row, runs, 0.0, self.settling).numbers == _END
        return found

    def samples(self, values: Vector, periods: int, begins: int) -> _Samples:
        """Pulses of these values, and the states after them."""
        states, traces, passed = self.after(values, periods, begins), list[Vector](), 0
        rows = self.usual(len(values))
        for after in _FOLLOWED:
            states = self.on(states, rows, after - passed)
            traces.append(states)
            passed = after
        return _Samples(values, self.at_end(states), np.hstack(traces))


class _Samples(NamedTuple):
    """Values in ascending order (n,), True if a value leads to the end, and states on the way."""

    values: Vector
    leads: NDArray[np.bool_]
    traces: Vector


def intervals(
    case: Case,
    periods: int,
    begins: int,
    parts: Sequence[Interval],
    count: int,
    thorough: bool = False,
) -> list[Interval]:
    """Intervals within parts of a range in which the pulse leads to the end, in ascending order.

    `count` values are tried; a thorough search adds more where neighbours separate. Only the ends
    of the widest intervals are refined.
    """
    if not parts:
        return []
    found = list[Interval]()
    width, total = parts[-1][1] - parts[0][0], sum(high - low for low, high in parts)
    for low, high in parts:
        own = max(_LEAST_VALUES, round(count * (high - low) / total)) if total else 1
        values = np.linspace(low, high, own)
        if thorough:
            samples = _with_more(case, periods, begins, values, width)
            values, leads = samples.values, samples.leads
        else:
            leads = case.leads(values, periods, begins)
        found += _refined(case, periods, begins, values, leads, width)
    return found


def _with_more(case: Case, periods: int, begins: int, values: Vector, width: float) -> _Samples:
    """Samples at values, with more between neighbours that separate."""
    found, most = case.samples(values, periods, begins), _MOST_VALUES * len(values)
    size = np.ptp(found.traces, axis=0).max(initial=0.0)
    while len(found.values) < most:
        gaps = np.diff(found.values)
        apart = abs(np.diff(found.traces, axis=0)).max(axis=1, initial=0.0) > _APART * size
        chosen = np.flatnonzero((apart | np.diff(found.leads)) & (gaps > _FINEST * width))
        if not chosen.size:
            break
        # The widest gaps first, if there is no room for all.
        chosen = chosen[np.argsort(-gaps[chosen], kind="stable")]
        chosen = chosen[: most - len(found.values)]
        middle = found.values[chosen] + gaps[chosen] / 2
        more = case.samples(middle, periods, begins)
        order = np.argsort(np.append(found.values, middle), kind="stable")
        joined = (np.concatenate(pair)[order] for pair in zip(found, more, strict=True))
        found = _Samples(*joined)
    return found


def _refined(
    case: Case,
    periods: int,
    begins: int,
    values: Vector,
    leads: NDArray[np.bool_],
    width: float,
) -> list[Interval]:
    """Intervals of values that lead to the end; the ends of the widest are bisected."""
    padded = np.concatenate([[False], leads, [False]])
    firsts, lasts = np.flatnonzero(leads & ~padded[:-2]), np.flatnonzero(leads & ~padded[2:])
    widest = np.argsort(values[firsts] - values[lasts], kind="stable")[:_REFINED]
    ends = np.concatenate([firsts[widest], lasts[widest]])
    beside = np.repeat((-1, 1), len(widest)) + ends
    inside, beside = values[ends], np.clip(beside, 0, len(values) - 1)
    # The part has no values beyond its ends.
    outside = np.where(leads[beside], inside, values[beside])
    while (wide := np.flatnonzero(abs(outside - inside) > _EDGE * width)).size:
        middle = (inside[wide] + outside[wide]) / 2
        within = case.leads(middle, periods, begins)
        inside[wide[within]] = middle[within]
        outside[wide[~within]] = middle[~within]
    found = np.stack([values[firsts], values[lasts]], axis=1)
    found[widest] = inside.reshape(2, -1).T
    return [(low, high) for low, high in found.tolist()]
