"""Runs of many starts at many parameter sets, until each has settled on a closed orbit.

A run has arrived at an orbit once it is within a neighbourhood that the map carries into itself.
Unknown orbits are solved by Newton's method from ends of runs that nearly repeat.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.neighbourhoods import (
    NEUTRAL,
    NONE,
    Neighbourhoods,
    neighbourhoods,
    run_rows,
    stroboscopic,
)
from capsule_sym._map.many import spread
from capsule_sym._map.result import by_fields
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import check_time, core_of
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._parameters import Scene

_FIRST = 2 * LONGEST  # excitation periods before the first test
_REPEATED = 1e-12  # change of a run, over its size, at which it has settled
_ROUNDING = 1e-11  # the same, due to rounding
_SETTLED = 1e-9  # the same at the end of its periods
_NEARLY = 1e-3  # the same at which it may be near to an orbit
_NEAR = 1e-2  # distance of an orbit, over the size, from the state that starts Newton's method
_WITHIN = 0.1  # the same of an orbit that the run is then seen to approach
_NEARER, _SURE = 0.1, 0.01  # shrinking of its distance that is required, and that is awaited
_FARTHEST = 2**15  # excitation periods that are waited for it
_SAME = 1e-8  # the same of two equal orbits
_BLOCK = 4096  # runs that are followed together and kept at a time limit
_FAILURES = 20  # ends of one parameter set without a new orbit, before it is given up


class Cycle(NamedTuple):
    """Stable closed orbit: its states at phase 0, (period_number, 3), and largest multiplier."""

    states: Vector
    multiplier: float

    def distance(self, states: Vector) -> Vector:
        """Distance of each state, (n, 3), from the nearest one of the orbit, (n,)."""
        apart = np.full(len(states), np.inf)
        for state in self.states:
            np.minimum(apart, abs(states - state).max(axis=1), out=apart)
        return apart

    def same(self, other: Cycle) -> bool:
        """True if both are the same orbit."""
        scale = _SAME * (1 + abs(self.states).max())
        alike = self.states.shape == other.states.shape
        return alike and bool(self.distance(other.states).max() <= scale)


class Arrivals(NamedTuple):
    """Attractors reached by n runs, with their final states; each array has one row a run."""

    numbers: NDArray[np.int16]
    """Number of the attractor, NONE if it is an unknown one or none is reached."""
    repeats: NDArray[np.bool_]
    """True for a run that repeats itself on an unknown attractor."""
    states: Vector
    """Final states of the runs at phase 0, (n, 3)."""
    periods: NDArray[np.int64]
    """Excitation periods of each run."""

    def __repr__(self) -> str:
        return by_fields(self)

    @classmethod
    def begun(cls, states: Vector) -> Arrivals:
        """Arrivals before the first period: no attractor yet, states (n, 3) of the starts."""
        n = len(states)
        numbers = np.full(n, NONE, np.int16)
        return cls(numbers, np.zeros(n, bool), states.copy(), np.zeros(n, np.int64))


class Settling:
    """Parameter sets, `rows` (m, k), and the known closed orbits of each, `cycles`.

    Runs that are followed together take at most a `share` of the time left. Runs that the core
    cannot decide may need more: they end without an attractor.
    """

    def __init__(self, rows: Vector, scene: Scene, threads: int = 1, share: float = 1.0) -> None:
        self.rows, self.scene, self.threads, self.share = rows, scene, threads, share
        self.cycles: list[list[Cycle]] = [[] for _ in rows]
        nothing = Neighbourhoods(np.empty((0, 3)), np.empty((0, 3, 3)))
        self.near: list[Neighbourhoods] = [nothing for _ in rows]
        self._owners = [np.empty(0, int) for _ in rows]

    def add(self, found: Sequence[tuple[int, Cycle]]) -> None:
        """Add orbits, each with the row of its parameters."""
        if not found:
            return
        counts = [len(cycle.states) for _, cycle in found]
        at = np.repeat([row for row, _ in found], counts)
        states = np.concatenate([cycle.states for _, cycle in found])
        of = self.rows[at], states, np.repeat(counts, counts), self.scene
        near = neighbourhoods(*of, self.threads)
        for (row, cycle), last in zip(found, np.cumsum(counts).tolist(), strict=True):
            these = slice(last - len(cycle.states), last)
            joined = (
                np.concatenate([old, new[these]])
                for old, new in zip(self.near[row], near, strict=True)
            )
            self.near[row] = Neighbourhoods(*joined)
            number = [len(self.cycles[row])] * len(cycle.states)
            self._owners[row] = np.append(self._owners[row], number)
            self.cycles[row].append(cycle)

    def number(self, row: int, cycle: Cycle) -> int:
        """Number of an orbit among those of a row, NONE if it is unknown."""
        known = (k for k, one in enumerate(self.cycles[row]) if one.same(cycle))
        return next(known, NONE)

    def inside(self, groups: NDArray[np.intp], states: Vector) -> NDArray[np.int16]:
        """Number of the orbit in whose neighbourhood each state is, at its row, (n,)."""
        numbers = np.full(len(states), NONE, np.int16)
        for row in np.unique(groups).tolist():
            here = np.flatnonzero(groups == row)
            inside = self.near[row].contain(states[here])
            arrived = inside != NONE
            numbers[here[arrived]] = self._owners[row][inside[arrived]]
        return numbers

    def follow(
        self,
        groups: NDArray[np.intp],
        runs: Arrivals,
        phases: ArrayLike,
        periods: int,
        *,
        find: bool = True,
        report: Callable[[int], object] | None = None,
    ) -> Arrivals:
        """Continue n runs until they have arrived, for at most so many excitation periods.

        `groups`, (n,), is the row of each run's parameters, `phases` are those of the starts. With
        `find` unknown orbits are solved and added. `report` is called with the number of runs that
        are over. Raises TimeUp if the present watch is over; the runs keep their last states.
        """
        times = spread("phases", phases, (len(runs.states),)).copy()
        numbers, repeats, ends, passed = runs
        for first in range(0, len(times), _BLOCK):
            last, done, length = min(first + _BLOCK, len(times)), 0, min(_FIRST, periods)
            left = np.arange(first, last)
            while left.size and length > 1:
                check_time()
                # All states of the last periods are kept, to detect repetition.
                short = min(LONGEST, length - 1)
                begin = self.rows[groups[left]], ends[left], times[left]
                good, marks = self._marks(*begin, length - short, short)
                left = left[good]
                ends[left], times[left] = marks[:, -1], 0.0
                done += length
                passed[left] = done
                change, guess = _changes(marks)
                at_rest = change <= (_REPEATED if done < periods else _SETTLED)
                numbers[left] = self.inside(groups[left], ends[left])
                if find:
                    nearly = ~at_rest & (change <= _NEARLY)
                    for settled, these in ((False, nearly), (True, at_rest)):
                        some = left[these]
                        of = groups[some], ends[some], guess[these]
                        numbers[some] = self.identify(*of, settled)
                    some = left[numbers[left] == NONE]
                    numbers[some] = self.inside(groups[some], ends[some])
                open_ = numbers[left] == NONE
                repeats[left] = open_ & at_rest
                left = left[open_ & ~at_rest]
                length = min(2 * length, periods - done)
                if report is not None:
                    report(last - left.size)
        return runs

    def identify(
        self, groups: NDArray[np.intp], ends: Vector, periods: NDArray[Any], settled: bool = True
    ) -> NDArray[np.int16]:
        """Numbers of the orbits on which runs end, (n, 3); unknown orbits are solved and added.

        The runs repeat themselves after `periods`, (n,), or never if it is 0. Of all ends outside
        the known neighbourhoods, the one farthest from known orbits is solved next. If the runs
        have `settled` and it leads to its nearest orbit, so do all ends that are nearer to that
        orbit. Otherwise only ends within a neighbourhood are numbered. Ends without a stable orbit
        have the number NONE.
        """
        numbers = self.inside(groups, ends)
        left = np.flatnonzero((numbers == NONE) & (periods > 0))
        failures = np.zeros(len(self.rows), int)
        while left.size:
            check_time()
            apart, nearest = self._nearest(groups[left], ends[left], periods[left])
            order = np.lexsort((apart, groups[left]))
            sorted_groups = groups[left[order]]
            picks = order[np.append(sorted_groups[1:] != sorted_groups[:-1], True)]
            chosen, keep, new = left[picks], np.ones(left.size, bool), []
            keep[picks] = False
            closed = self.closed(groups[chosen], ends[chosen], periods[chosen])
            for pick, cell, cycle in zip(picks.tolist(), chosen.tolist(), closed, strict=True):
                row = int(groups[cell])
                known = NONE if cycle is None else self.number(row, cycle)
                if cycle is not None and known == NONE:
                    known = len(self.cycles[row])
                    new.append((row, cycle))
                elif cycle is None or not settled:
                    failures[row] += 1
                if known != NONE and settled:
                    numbers[cell] = known
                    if nearest[pick] == known:
                        nearer = (groups[left] == row) & (nearest == known)
                        nearer &= apart <= apart[pick]
                        numbers[left[nearer]] = known
                        keep &= ~nearer
            self.add(new)
            left = left[keep & (failures[groups[left]] < _FAILURES)]
            if new:
                here = left[np.isin(groups[left], [row for row, _ in new])]
                numbers[here] = self.inside(groups[here], ends[here])
                left = left[numbers[left] == NONE]
        return numbers

    def approached(self, states: Vector) -> list[Cycle | None]:
        """Stable orbit that the run of each row approaches from a state at phase 0, (m, 3).

        Newton's method finds the orbit, and the run then comes nearer to it. None for a run that
        approaches none, or none of at most 16 periods.
        """
        found: list[Cycle | None] = [None] * len(states)
        good, marks = self._marks(self.rows, states, 0.0, LONGEST, LONGEST)
        (_, guess), ends = _changes(marks), marks[:, -1]
        # Of each orbit: the run's number, and the periods after which it is nearer.
        after = dict[int, list[tuple[int, Cycle]]]()
        for k, cycle in enumerate(self.closed(good, ends, guess, _WITHIN)):
            if cycle is not None:
                wait = math.log(_SURE) / math.log(min(max(cycle.multiplier, _SURE), 1 - NEUTRAL))
                after.setdefault(2 ** math.ceil(math.log2(wait)), []).append((k, cycle))
        for length, some in after.items():
            if length > _FARTHEST:
                continue
            chosen = np.array([k for k, _ in some])
            run = run_rows(self.rows[good[chosen]], ends[chosen], 0.0, length, self.scene)
            for (k, cycle), state in zip(some, run.states, strict=True):
                before, now = cycle.distance(np.array([ends[k], state]))
                if now <= max(_NEARER * before, _SAME * (1 + abs(cycle.states).max())):
                    found[int(good[k])] = cycle
        return found

    def closed(
        self,
        groups: NDArray[np.intp],
        states: Vector,
        periods: NDArray[Any],
        near: float = _NEAR,
    ) -> list[Cycle | None]:
        """Stable orbits that Newton's method finds near states at phase 0, None for none."""
        rows, count = self.rows[groups], len(states)
        found, multipliers = states.copy(), np.full(count, np.nan)
        scales = 1 + abs(states).max(axis=1)
        if core_of(self.scene) is not None:
            many = performance_many(
                rows, states, periods, energies=False, forces=False, scene=self.scene
            )
            found = many.states
            # Orbits of fewer periods have the status "changed" too: the marks below decide.
            multipliers = abs(many.multipliers[:, 0])
        else:
            for i in range(count):
                parameters = self.scene.Parameters(*rows[i].tolist())
                orbit = orbit_at(parameters, states[i].tolist(), int(periods[i]))
                if orbit is not None:
                    found[i] = stroboscopic(orbit)[0]
                    multipliers[i] = abs(orbit.multipliers[0])
        far = abs(found - states).max(axis=1) / scales
        good = np.flatnonzero((multipliers < 1 - NEUTRAL) & (far <= near))
        cycles: list[Cycle | None] = [None] * count
        for number in np.unique(periods[good]).tolist():
            these = good[periods[good] == number]
            given = rows[these], found[these], 0.0, number, self.scene, self.threads
            marks = run_rows(*given, "stroboscopic")
            for i in np.flatnonzero(marks.success).tolist():
                at = int(these[i])
                cycles[at] = _once(marks[i], number, float(multipliers[at]), scales[at])
        return cycles

    def _marks(
        self, rows: Vector, states: Vector, phases: ArrayLike, ahead: int, short: int
    ) -> tuple[NDArray[np.intp], Vector]:
        """Indices of runs that succeed, and their states at the last marks, (n, short + 1, 3)."""
        of = self.scene, self.threads
        run = run_rows(rows, states, phases, ahead, *of, share=self.share)
        good = np.flatnonzero(run.success)
        begin = rows[good], run.states[good], 0.0
        run = run_rows(*begin, short, *of, "stroboscopic", self.share)
        marks = run.kept[np.repeat(run.success, np.diff(run.offsets))]
        return good[run.success], marks.reshape(-1, short + 1, 3)

    def _nearest(
        self, groups: NDArray[np.intp], ends: Vector, periods: NDArray[Any]
    ) -> tuple[Vector, NDArray[np.intp]]:
        """Distance and number of the nearest orbit over such periods, inf if there is none."""
        apart, nearest = np.full(len(ends), np.inf), np.full(len(ends), NONE)
        for row in np.unique(groups).tolist():
            here = np.flatnonzero(groups == row)
            for number, cycle in enumerate(self.cycles[row]):
                some = here[periods[here] % len(cycle.states) == 0]
                distance = cycle.distance(ends[some])
                nearer = distance < apart[some]
                apart[some[nearer]], nearest[some[nearer]] = distance[nearer], number
        return apart, nearest


def _changes(marks: Vector) -> tuple[Vector, NDArray[np.intp]]:
    """Least change of runs over some periods, relative to their size, and the periods; (n,)."""
    change = abs(marks[:, -2::-1] - marks[:, -1:]).max(axis=2)
    change /= 1 + abs(marks).max(axis=(1, 2))[:, None]
    least = change.min(axis=1)
    # For a settled run rounding decides after which number of turns it is nearest.
    guess = 1 + (change <= np.maximum(2 * least, _ROUNDING)[:, None]).argmax(axis=1)
    return least, guess


def _once(marks: Vector, number: int, multiplier: float, scale: float) -> Cycle | None:
    """Orbit from its marks over so many periods, or over a divisor after which it repeats."""
    for part in range(1, number + 1):
        if not number % part and abs(marks[part] - marks[0]).max() <= _SAME * scale:
            return Cycle(marks[:part].copy(), multiplier ** (part / number))
    return None
