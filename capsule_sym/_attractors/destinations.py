"""Destinations of starts: runs of many starts at many parameter sets, until each has settled.

A run has arrived at an orbit once it is within a neighbourhood that the map carries into itself, or
repeats itself there. Unknown orbits are solved by Newton's method from ends of runs that nearly
repeat.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.neighbourhoods import NEUTRAL, NONE, Runs, spectral_radii, stroboscopic
from capsule_sym._errors import InvalidInput
from capsule_sym._map.many import spread
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import Scene

# The following are distances over 1 + the largest entry of the states.
_REPEATED, _SETTLED = 1e-12, 1e-9  # change of a run that has settled: within rounding; at its end
_ROUNDING = 1e-11  # changes that rounding may put in any order
_NEARLY = 1e-3  # change of a run that may be near to an orbit
_NEAR, _WITHIN = 1e-2, 0.1  # distance of an orbit from its guess; of one that is then approached
_SAME = 1e-8  # distance of equal orbits
_FIRST = 4  # excitation periods of the first test, doubled each time: most runs arrive early
_BLOCK = 4096  # runs that are followed together, and kept at a time limit: some seconds of work


class Cycle(NamedTuple):
    """Stable closed orbit: its states at phase 0, (period_number, 3), and `multiplier`.

    That is the largest modulus of the Floquet multipliers of one period of the orbit.
    """

    states: Vector
    multiplier: float

    @property
    def rate(self) -> float:
        """Factor by which a small distance from the orbit shrinks in an excitation period."""
        return float(self.multiplier ** (1 / len(self.states)))

    def distance(self, states: Vector) -> Vector:
        """Distance of each state, (n, 3), from the nearest one of the orbit, (n,).

        It is the largest absolute entry of their difference.
        """
        each = [abs(states - state).max(axis=1) for state in self.states]
        return np.asarray(np.min(each, axis=0))

    def same(self, other: Cycle) -> bool:
        """True if both have as many states, within 1e-8 times 1 + the largest entry of `self`."""
        scale = _SAME * (1 + abs(self.states).max())
        alike = self.states.shape == other.states.shape
        return alike and bool(self.distance(other.states).max() <= scale)


class Arrivals(NamedTuple):
    """Attractors reached by n runs, with their last states; each array has one row a run."""

    numbers: NDArray[np.int16]
    """Number of the attractor, NONE if none is reached, or one whose orbit is not found."""
    undecided: NDArray[np.bool_]
    """True for a run that did not finish: undecided, or longer than its share of the time."""
    states: Vector
    """Last states of the runs at phase 0, before that those of the starts, (n, 3)."""

    @classmethod
    def begun(cls, states: Vector) -> Arrivals:
        """Arrivals before the first period: no attractor, a copy of the start states (n, 3)."""
        n = len(states)
        return cls(np.full(n, NONE, np.int16), np.zeros(n, bool), states.copy())


class KnownOrbits(Runs):
    """Parameter sets, `rows` (m, k), and the known stable orbits of each, `cycles`."""

    def __init__(self, rows: Vector, scene: Scene, threads: int = 1, share: float = 1.0) -> None:
        super().__init__(scene, threads, share)
        self.rows = rows
        self.cycles: list[list[Cycle]] = [[] for _ in rows]
        self.near: list[tuple[int, int, Vector, Vector]] = []
        """Row, number of the orbit there, centre and axes of ellipsoids that the map shrinks."""

    def numbered(self, groups: Sequence[int], cycles: Sequence[Cycle | None]) -> list[int]:
        """Number of each orbit among those of its row, NONE for None.

        Unknown ones are added, with their neighbourhoods.
        """
        numbers, new = list[int](), list[tuple[int, int, Cycle]]()
        for row, cycle in zip(groups, cycles, strict=True):
            if cycle is None:
                numbers.append(NONE)
                continue
            known = self.cycles[row]
            same = (k for k, one in enumerate(known) if one.same(cycle))
            numbers.append(next(same, len(known)))
            if numbers[-1] == len(known):
                new.append((row, len(known), cycle))
                known.append(cycle)
        if new:
            self._surround(new)
        return numbers

    def _surround(self, new: Sequence[tuple[int, int, Cycle]]) -> None:
        """Find the neighbourhoods of new orbits, each with its row and number there."""
        counts = [len(cycle.states) for *_, cycle in new]
        rows, owners = np.repeat([[row, number] for row, number, _ in new], counts, axis=0).T
        states = np.concatenate([cycle.states for *_, cycle in new])
        axes = self.axes_about(self.rows[rows], states, np.repeat(counts, counts))
        found = zip(rows.tolist(), owners.tolist(), states, axes, strict=True)
        self.near += [one for one in found if np.isfinite(one[-1]).all()]

    def inside(self, groups: NDArray[np.intp], states: Vector) -> NDArray[np.int16]:
        """Number of the orbit of its row in whose neighbourhood each state is, (n,), NONE for none.

        The states, (n, 3), are at phase 0.
        """
        numbers, least = np.full(len(states), NONE, np.int16), np.ones(len(states))
        for row, number, centre, axes in self.near:
            here = np.flatnonzero(groups == row)
            distance = np.linalg.norm((states[here] - centre) @ axes, axis=1)
            inside = distance <= least[here]
            numbers[here[inside]], least[here[inside]] = number, distance[inside]
        return numbers

    def destination(
        self,
        groups: NDArray[np.intp],
        runs: Arrivals,
        phases: ArrayLike,
        periods: int,
        *,
        report: Callable[[int], object] | None = None,
    ) -> Arrivals:
        """Continue n runs in place until they have arrived, for at most so many excitation periods.

        `groups`, (n,), is the row of each run's parameters, `phases` are those of the starts. A run
        is computed in parts of 4, 8, 16, ... periods. Unknown orbits are solved and added. `report`
        is called with the number of runs that are over. Raises TimeUp if the present watch is over;
        the runs keep their last states.
        """
        times = spread("phases", phases, (len(runs.states),)).copy()
        numbers, undecided, ends = runs
        for first in range(0, len(times), _BLOCK):
            last, done, length = min(first + _BLOCK, len(times)), 0, _length(_FIRST, periods)
            left = np.arange(first, last)
            while left.size and length > 1:
                check_time()
                # All states of the last periods are kept, to detect repetition.
                begin = self.rows[groups[left]], ends[left], times[left]
                good, marks = self._marks(*begin, length)
                undecided[np.delete(left, good)] = True
                left, done = left[good], done + length
                ends[left], times[left] = marks[:, -1], 0.0
                change, guess = _changes(marks)
                at_rest = change <= (_REPEATED if done < periods else _SETTLED)
                guess[~(at_rest | (change <= _NEARLY))] = 0
                numbers[left] = self.identify(groups[left], ends[left], guess, at_rest)
                left = left[(numbers[left] == NONE) & ~at_rest]
                length = _length(2 * length, periods - done)
                if report is not None:
                    report(last - left.size)
        return runs

    def identify(
        self,
        groups: NDArray[np.intp],
        ends: Vector,
        periods: NDArray[Any],
        settled: NDArray[np.bool_],
    ) -> NDArray[np.int16]:
        """Number of the orbit on which each run ends, (n,); unknown orbits are solved and added.

        `ends`, (n, 3), are states at phase 0. The runs nearly repeat after `periods`, (n,), or
        never if it is 0. Ends outside the known neighbourhoods are closed by Newton's method, of
        each row first one, then twice as many each time: most of the others are in the
        neighbourhoods of the first orbits. An end that is not `settled` is numbered only within a
        neighbourhood. Ends without a stable orbit have the number NONE.
        """
        numbers, most = self.inside(groups, ends), 1
        left = np.flatnonzero((numbers == NONE) & (periods > 0))
        left = left[np.argsort(groups[left], kind="stable")]
        while left.size:
            check_time()
            rows = groups[left]
            first = np.arange(left.size) - np.searchsorted(rows, rows) < most
            chosen, left, most = left[first], left[~first], 2 * most
            cycles = self.closed(groups[chosen], ends[chosen], periods[chosen])
            found = self.numbered(groups[chosen].tolist(), cycles)
            numbers[chosen] = np.where(
                settled[chosen], found, self.inside(groups[chosen], ends[chosen])
            )
            numbers[left] = self.inside(groups[left], ends[left])
            left = left[numbers[left] == NONE]
        return numbers

    def approached(self, states: Vector) -> list[Cycle | None]:
        """Stable orbit that the run of each row approaches from a state at phase 0, (m, 3).

        Newton's method finds the orbit. The distance of the run from it then shrinks to a tenth, in
        the time in which a small one shrinks to a hundredth, at most 2^15 periods. None for a run
        that approaches none, none of at most 16 periods, or one more slowly.
        """
        found: list[Cycle | None] = [None] * len(states)
        good, marks = self._marks(self.rows, states, 0.0, 2 * LONGEST)
        ends = marks[:, -1]
        cycles = self.closed(good, ends, _changes(marks)[1], _WITHIN)
        rates = np.clip([one.rate if one else 1.0 for one in cycles], 0.01, 1 - NEUTRAL)
        waits = np.ceil(np.log2(math.log(0.01) / np.log(rates)))
        for power in np.unique(waits[waits <= 16]).astype(int).tolist():
            chosen = np.flatnonzero(waits == power)
            run = self.run(self.rows[good[chosen]], ends[chosen], 0.0, 2 ** min(power, 15))
            for k, state in zip(chosen.tolist(), run.states, strict=True):
                if (cycle := cycles[k]) is not None:
                    before, now = cycle.distance(np.array([ends[k], state]))
                    if now <= max(before / 10, _SAME * (1 + abs(cycle.states).max())):
                        found[int(good[k])] = cycle
        return found

    def closed(
        self, groups: NDArray[np.intp], states: Vector, periods: NDArray[Any], near: float = _NEAR
    ) -> list[Cycle | None]:
        """Stable orbits that Newton's method finds near states at phase 0, (n, 3); None for none.

        They have `periods`, (n,), or a divisor of it. `near` is the largest distance from the
        state, over 1 + its largest entry.
        """
        rows = self.rows[groups]
        centres, monodromies, _ = self.close(rows, states, periods)
        multipliers, scales = spectral_radii(monodromies), 1 + abs(states).max(axis=1)
        near_by = abs(centres - states).max(axis=1) <= near * scales
        good = np.flatnonzero((multipliers < 1 - NEUTRAL) & near_by)
        cycles: list[Cycle | None] = [None] * len(states)
        for number in np.unique(periods[good]).tolist():
            these = good[periods[good] == number]
            runs = self.run(rows[these], centres[these], 0.0, number, "stroboscopic")
            for i, at in enumerate(these.tolist()):
                if runs.success[i]:
                    cycles[at] = _once(runs[i], number, float(multipliers[at]), scales[at])
        return cycles

    def _marks(
        self, rows: Vector, states: Vector, phases: ArrayLike, periods: int
    ) -> tuple[NDArray[np.intp], Vector]:
        """Indices of the runs that succeed, and their states at the last marks, (n, marks, 3).

        The marks are the last min(16, periods - 1) + 1 ends of periods.
        """
        short = min(LONGEST, periods - 1)
        run = self.run(rows, states, phases, periods - short)
        good = np.flatnonzero(run.success)
        run = self.run(rows[good], run.states[good], 0.0, short, "stroboscopic")
        marks = run.kept[np.repeat(run.success, np.diff(run.offsets))]
        return good[run.success], marks.reshape(-1, short + 1, 3)


def _length(most: int, left: int) -> int:
    """Periods until the next test: at most so many, and one more if it would be left alone."""
    return left if left <= most + 1 else most


def _changes(marks: Vector) -> tuple[Vector, NDArray[np.intp]]:
    """Least change of runs from an earlier mark to the last one, and the periods between; (n,).

    The change is over 1 + the largest entry of the marks, (n, marks, 3).
    """
    change = abs(marks[:, -2::-1] - marks[:, -1:]).max(axis=2)
    change /= 1 + abs(marks).max(axis=(1, 2))[:, None]
    least = change.min(axis=1)
    # For a settled run rounding decides after which number of turns it is nearest.
    guess = 1 + (change <= np.maximum(2 * least, _ROUNDING)[:, None]).argmax(axis=1)
    return least, guess


def _once(marks: Vector, number: int, multiplier: float, scale: float) -> Cycle | None:
    """Orbit from its marks over so many periods, or over the least divisor after which it repeats.

    None if it does not repeat. `multiplier` is that of all these periods.
    """
    for part in range(1, number + 1):
        if not number % part and abs(marks[part] - marks[0]).max() <= _SAME * scale:
            return Cycle(marks[:part].copy(), multiplier ** (part / number))
    return None


def known_orbits(orbits: Sequence[Orbit], threads: int = 1, share: float = 1.0) -> KnownOrbits:
    """Stable orbits of one parameter set, in this order; equal ones count once.

    Raises InvalidInput without orbits, for unstable ones, and for different parameters.
    """
    if not orbits:
        raise InvalidInput("orbits", orbits, "one orbit or more")
    for orbit in orbits:
        if not orbit.success or not abs(orbit.multipliers[0]) < 1 - NEUTRAL:
            raise InvalidInput("orbits", orbit, "stable periodic orbits")
        if orbit.parameters != orbits[0].parameters:
            raise InvalidInput("orbits", orbit, "orbits at the same parameters")
    row = [[*orbits[0].parameters.to_dict().values()]]
    found = KnownOrbits(np.array(row), orbits[0].scene, threads, share)
    cycles = [
        Cycle(stroboscopic(whole_orbit(orbit)), float(abs(orbit.multipliers[0])))
        for orbit in orbits
    ]
    found.numbered([0] * len(cycles), cycles)
    return found
