"""Survey of the bounds, which chooses the starts of searches and their units.

Cells all over the bounds, including their faces and corners, are run from the scenarios' starts.
From the best of them, distant from each other or on different branches, searches climb side by
side. If the starts do not settle on the motions found, the path back to the cell is bisected.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import Grid
from capsule_sym._design.climb import PENALTY, Places, climb, moved, places_of
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.overview import Overview, overview, settled
from capsule_sym._design.program import STABLE, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._errors import InvalidInput
from capsule_sym._native import check_time, core_of, present

_SEEN = 256  # excitation periods of a run that shows if starts lead to a motion
_ROUNDS = 2048, 8192, 32768, 131072  # cells of surveys before larger ones
_CLIMBERS = 32  # searches side by side
_STEPS = 30  # of each
_PARENTS, _CHILDREN = 64, 1024  # cells with more around them, and how many of these at most
_REACHES = (1.0, 0.25)  # of the distance of cells, to those around the best of them
_ON_FACES = 1.5  # by which every third cell is spread, and cut off at the bounds
_WITHOUT_CORE = 8  # times fewer cells where there is no core
_DRAWN = 2  # states at each cell, besides the starts, where all stable motions count
_SAME = 1e-6  # distance of two states that are one
_HOPEFUL = 0.2  # units of the objective that a search may gain
_ALIKE = 6  # places of one branch at which searches begin
_APART = 1e-3  # of the bounds, between two places at which searches begin
_PARTS, _CUTS = 8, 3  # of a way, of which the last to a place that starts lead to is cut again
_SLIDING = 4  # places from which it is polled where starts lead
_POLL, _POLLS = 0.02, 30  # of the bounds, how far at first, and how often


class Survey(NamedTuple):
    """Number of cells, random seed, and largest number of starts of searches."""

    samples: int
    seed: int
    follow: int

    @property
    def rounds(self) -> list[tuple[int, int]]:
        """Cells and random seeds of its rounds: few cells first, to which more cells add."""
        sizes = [size for size in _ROUNDS if 2 * size <= self.samples] + [self.samples]
        rounds = [(sizes[0], 0), *((size, size) for size in sizes[1:])]
        return rounds + [(max(1, self.samples // 2), self.seed)] * bool(self.seed)


class Candidate(NamedTuple):
    """Start of a search, with the motions of the scenarios there."""

    u: Vector
    motions: tuple[Motion, ...]


class Surveyor:
    """Survey and its results for an optimisation: starts, units, and the best cell."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.flat = ""
        """Reason why no place is better than another."""
        self.best: tuple[float, float, Vector] | None = None
        """Best cell: violation of limits, metric in its own unit, variables."""
        self.rounds: list[tuple[int, int]] = []
        """Cells and random seeds of the rounds to come."""
        self.cells: tuple[Matrix, Overview] | None = None
        """All cells of the last round, if searches begin from the best of them."""

    def candidates(self, survey: Survey) -> list[Candidate]:
        """Starts of searches: feasible places first, then the best, distant from each other.

        They are from the first round that has any. Sets the units of the program. Raises
        InvalidInput if the metric is nowhere finite.
        """
        core, found = core_of(self.program.system.scene) is not None, list[Candidate]()
        self.rounds = survey.rounds if core else [(-(-survey.samples // _WITHOUT_CORE), 0)]
        while self.rounds and not found:
            found = self._round(survey.follow, core, first=True)
        return found

    def more(self, most: int) -> Iterator[list[Candidate]]:
        """Starts of searches from each further round, at most so many."""
        self.cells = None
        while self.rounds:
            yield self._round(most)
            self.cells = None

    def _round(self, most: int, core: bool = True, first: bool = False) -> list[Candidate]:
        """Starts of searches from the next round, at most so many; a `first` one sets the units."""
        count, seed = self.rounds.pop(0)
        points, states, found = self._cells(count, seed)
        if first:
            self.flat = found.flat(self.program)
            if self.flat:
                return []
            self.scale(found)
        if core and states is None:
            points, found = self._nearer(points, found)
        order = self._ranked(points, found)
        check_time()
        if not core:
            begun = [(points[i], self.program.settled(points[i])) for i in order[:most]]
            return [Candidate(u, motions) for u, motions in begun if motions]
        self.cells = points, found
        chosen = self._apart(points, found, order)
        if not chosen:
            return []
        begin = self.closed(points, found, chosen)
        if first:
            slope = float(abs(begin.slope[0]).max())
            values = found.worst[np.isfinite(found.worst)]
            if not slope and np.isfinite(begin.merit[0]) and np.ptp(values) == 0.0:
                told = f"{self.program.name} is {abs(values[0]):g} at each of {len(values)}"
                self.flat = f"{told} surveyed places, and nothing changes it"
                return []
            # A few cells may vary less than the objective does.
            self.program = replace(self.program, unit=_rounded(self.program.unit * max(1.0, slope)))
            begin = self.closed(points, found, chosen)
            self.program.tell("survey, searches")
        return self._chosen(begin, climb(self.program, begin, _STEPS, self._length(count)), most)

    def within(self, most: int) -> Matrix:
        """The best cells within all limits, distant from each other, at most so many."""
        if self.cells is None:
            return np.empty((0, len(self.program.names)))
        points, found = self.cells
        order = self._ranked(points, found)
        inside = order[found.beyond(self.program)[order] == 0]
        return points[self._apart(points, found, inside)[:most]]

    def _nearer(self, points: Matrix, found: Overview) -> tuple[Matrix, Overview]:
        """The cells with more of them around the best, ever nearer."""
        draw, count = np.random.default_rng(0), len(points)
        for reach in _REACHES:
            best = self._ranked(points, found)[:_PARENTS]
            near = points[np.resize(best, min(count // 2, _CHILDREN) * bool(len(best)))]
            if not len(near) or present().over:
                break
            reach *= 4 * self._length(count)
            near = np.clip(near + reach * draw.uniform(-1, 1, near.shape), 0.0, 1.0)
            other = overview(self.program, near)
            check_time()
            points, found = np.vstack([points, near]), found.with_more(other)
        return points, found

    def _cells(self, count: int, seed: int) -> tuple[Matrix, Matrix | None, Overview]:
        """Cells all over the bounds, the states where runs begin if not at the starts, and runs."""
        points, states = with_faces(spread(len(self.program.names), count, seed)), None
        if self.program.among == STABLE:
            states = self._anywhere(points, seed)
            points = np.tile(points, (len(states) // len(points), 1))
        return points, states, overview(self.program, points, states)

    def _anywhere(self, points: Matrix, seed: int) -> Matrix:
        """States from which stable motions are searched at points: the starts, and random ones."""
        draw = np.random.default_rng(seed)
        grid = Grid(self.program, self.program.scenarios[0], points)
        p = dict(zip(grid.scene.facts.PARAMETERS, grid.rows.T, strict=True))
        far = 2 * (1 + p["alpha"] + p[grid.scene.facts.STOPS[0][0]])
        box = np.stack([far, far * p["omega"], far * p["omega"] / (1 + p["gamma"])], axis=1)
        given = [np.tile(state, (len(points), 1)) for state in self.program.seeds]
        return np.vstack([*given, *(box * draw.uniform(-1, 1, box.shape) for _ in range(_DRAWN))])

    def _length(self, count: int) -> float:
        """Half the distance between cells."""
        return float(0.25 * count ** (-1 / len(self.program.names)))

    def _ranked(self, points: Matrix, found: Overview) -> NDArray[np.intp]:
        """The cells that have a motion, the best first."""
        beyond = found.beyond(self.program)
        known = np.flatnonzero(np.isfinite(found.worst))
        if len(known):
            best = known[np.lexsort((found.worst[known], beyond[known]))[0]]
            self.best = float(beyond[best]), float(found.worst[best]), points[best]
        merit = found.worst[known] / self.program.unit + PENALTY * beyond[known]
        order: NDArray[np.intp] = known[np.argsort(merit, kind="stable")]
        return order

    def _apart(self, points: Matrix, found: Overview, order: NDArray[np.intp]) -> list[int]:
        """Best cells, distant from each other, those of one branch more than others."""
        chosen, branches, length = list[int](), list[Any](), self._length(len(points))
        for i in order.tolist():
            near = abs(points[i] - points[chosen]).max(axis=1) if chosen else np.empty(0)
            if near.min(initial=np.inf) < length:
                continue
            own = tuple(one.branch(i) for one in found.motions)
            least = np.array([4.0 if own == other else 1.0 for other in branches]) * length
            if np.all(near >= least):
                chosen.append(i)
                branches.append(own)
            if len(chosen) == _CLIMBERS:
                break
        return chosen

    def closed(self, points: Matrix, found: Overview, chosen: Sequence[int]) -> Places:
        """Places of some cells, with derivatives."""
        u, numbers = points[chosen], [one.period_numbers[chosen] for one in found.motions]
        motions = [
            Grid(self.program, scenario, u).closed(one.found.states[chosen], number)
            for scenario, one, number in zip(
                self.program.scenarios, found.motions, numbers, strict=True
            )
        ]
        return places_of(self.program, u, motions, np.stack(numbers, axis=1))

    def _chosen(self, begin: Places, ends: Places, most: int) -> list[Candidate]:
        """Best places on which the starts settle, among the ends of searches and before."""
        leads = self.leads(ends)
        pool = [(ends, i) for i in np.flatnonzero(leads).tolist()]
        best = min((float(ends.merit[i]) for _, i in pool), default=np.inf)
        # Places on which the starts settle may end on the path to a better place.
        left = np.flatnonzero(~leads & (ends.merit < best) & np.isfinite(begin.merit))
        if len(left):
            left = left[np.argsort(ends.merit[left], kind="stable")][: 2 * _SLIDING]
            edges = self.slide(self._last(begin.of(left), ends.of(left)))
            pool += [(edges, i) for i in range(len(edges))]
        pool.sort(key=lambda one: float(one[0].merit[one[1]]))
        found, branches = list[Candidate](), list[Any]()
        for places, i in pool:
            near = (abs(places.u[i] - one.u).max() < _APART for one in found)
            hopeful = places.merit[i] < pool[0][0].merit[pool[0][1]] + _HOPEFUL
            own = places.branch(i)
            if hopeful and branches.count(own) < _ALIKE and not any(near):
                found.append(self.candidate(places, i))
                branches.append(own)
            if len(found) == most:
                break
        return found

    def _last(self, begin: Places, ends: Places) -> Places:
        """Best places on which starts settle, on the paths from some to others."""
        shares = np.linspace(0.0, 1.0, _PARTS + 1)[:-1]
        last = begin
        for _ in range(_CUTS):
            ways = (ends.u - last.u)[:, None] * shares[:, None]
            n = len(last)
            every = last.of(np.repeat(np.arange(n), _PARTS))
            there = moved(self.program, every, (last.u[:, None] + ways).reshape(n * _PARTS, -1))
            merit = np.where(self.leads(there), there.merit, np.inf).reshape(n, _PARTS)
            merit[:, 0] = np.minimum(merit[:, 0], last.merit)
            chosen = merit.argmin(axis=1)
            beyond = np.minimum(chosen + 1, _PARTS - 1)
            at = there.of(np.arange(n) * _PARTS + beyond)
            some = chosen > 0
            last.put(some, there.of((np.arange(n) * _PARTS + chosen)[some]))
            ends = replace(ends, u=np.where((chosen < _PARTS - 1)[:, None], at.u, ends.u))
        order = np.argsort(last.merit, kind="stable")[:_SLIDING]
        return last.of(order)

    def slide(self, at: Places) -> Places:
        """Best places next to some on which the starts settle, by polls of decreasing size."""
        draw, (n, k) = np.random.default_rng(0), at.u.shape
        reach, count = np.full(n, _POLL), 2 * k + 1
        for _ in range(_POLLS):
            turns = np.linalg.qr(draw.normal(size=(n, k, k)))[0]
            size = np.maximum(abs(at.slope).max(axis=1), 1e-300)
            ways = np.concatenate([turns, -turns, -(at.slope / size[:, None])[:, None]], axis=1)
            u = np.clip(at.u[:, None] + reach[:, None, None] * ways, 0.0, 1.0)
            there = moved(self.program, at.of(np.repeat(np.arange(n), count)), u.reshape(-1, k))
            better = np.flatnonzero(there.merit < np.repeat(at.merit, count))
            merit = np.full(n * count, np.inf)
            merit[better] = np.where(self.leads(there.of(better)), there.merit[better], np.inf)
            chosen = merit.reshape(n, count).argmin(axis=1) + np.arange(n) * count
            falls = merit[chosen] < at.merit
            at.put(falls, there.of(chosen[falls]))
            reach *= np.where(falls, 2.0, 0.4)
        return at

    def candidate(self, places: Places, i: int) -> Candidate:
        """Place i with its motions."""
        u, systems = places.u[i], self.program.systems_at(places.u[i])
        motions = tuple(
            Motion(dimensionless(system), one.of(np.array([i])), int(number))
            for system, one, number in zip(systems, places.found, places.numbers[i], strict=True)
        )
        return Candidate(u, motions)

    def leads(self, places: Places) -> NDArray[np.bool_]:
        """Mask (n,) of places on whose motions the starts settle, if that is required."""
        same = np.isfinite(places.merit)
        if self.program.among == STABLE:
            return same
        for j, scenario in enumerate(self.program.scenarios):
            some = np.flatnonzero(same)
            if len(some):
                grid = Grid(self.program, scenario, places.u[some])
                found = settled(grid, scenario.state, _SEEN)
                far = abs(found.found.states - places.states[some, j]).max(axis=1)
                size = 1 + abs(places.states[some, j]).max(axis=1)
                same[some] &= (found.period_numbers == places.numbers[some, j]) & (
                    far <= _SAME * size
                )
        return same

    def scale(self, found: Overview) -> None:
        """Set the units of the objective and the limits from the survey."""
        moving = ~np.isnan(found.worst)
        finite = found.worst[np.isfinite(found.worst)]
        if not len(finite):
            check_time()
            if moving.any() and not self.rounds:
                allowed = "a function that is finite somewhere within the bounds"
                raise InvalidInput("metric", self.program.name, allowed)
            return
        upper, lower = np.quantile(finite, (0.75, 0.25))
        units = []
        for limit, slacks in zip(self.program.limits, abs(found.slacks[moving].T), strict=True):
            largest = slacks[np.isfinite(slacks)].max(initial=0.0)
            units.append(abs(limit.value) or float(largest) or 1.0)
        unit = _rounded(float(upper - lower) or 1e-300)
        self.program = replace(self.program, unit=unit, limit_units=tuple(units))


def _rounded(unit: float) -> float:
    """The nearest power of two: a value over it, and times it again, is the same value."""
    return 2.0 ** round(math.log2(unit))


def spread(dimension: int, count: int, seed: int) -> Any:
    """Low-discrepancy points (count, dimension) in (0, 1), from badly approximable steps.

    The steps are powers of the root above 1 of x^(d + 1) = x + 1, of dimension d.
    """
    root = 2.0
    for _ in range(64):
        root = (1 + root) ** (1 / (dimension + 1))
    steps = root ** -np.arange(1.0, dimension + 1)
    begin = np.random.default_rng(seed).uniform(size=dimension) if seed else 0.5
    return (begin + np.outer(np.arange(1, count + 1), steps)) % 1.0


def with_faces(points: Matrix) -> Matrix:
    """Points, every third of them moved away from the middle, at most to the bounds."""
    found = points.copy()  # optima are often at bounds
    found[2::3] = np.clip((found[2::3] - 0.5) * _ON_FACES + 0.5, 0.0, 1.0)
    return found
