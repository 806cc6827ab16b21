"""Stable motions on a grid of drives, joined where one continues another, and ways among them.

From one drive on, each motion is continued to the drives beside it: to first order, then closed by
the map. This says about which motions are joined: a way counts once its orbit is followed along it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._map.labelled import package
from capsule_sym._native import check_time
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._systems import System, dimensionless

_MOST = 4  # motions at one drive
_BENT = 0.3  # of its change in a step, by which a motion is off its first order at most
_ROUGH = 0.01  # of the motion's size, that it is off beside that
_ONE = 1e-5  # of that size, by which motions differ that are one
_SLOW = 0.05  # over 1 less the multiplier: what a drive counts more where motions settle slowly
Vector = NDArray[np.float64]


class _Motion(NamedTuple):
    """A stable motion: its state at phase 0, and derivatives of that by the parameters."""

    row: Vector
    state: Vector
    by: Vector
    period_number: int
    multiplier: float

    def at(self, row: Vector) -> Vector:
        """Its state at other parameters, to first order."""
        found: Vector = self.state + self.by @ (row - self.row)
        return found

    def leads_to(self, state: Vector, row: Vector) -> bool:
        """Whether a state at other parameters may be that of its own branch."""
        guess = self.at(row)
        allowed = _BENT * abs(guess - self.state) + _ROUGH * (1 + abs(self.state).max())
        return bool(np.all(abs(state - guess) <= allowed))

    def is_one(self, other: _Motion) -> bool:
        """Whether both are one motion, at one drive."""
        return bool(abs(self.state - other.state).max() <= _ONE * (1 + abs(self.state).max()))


class Reachable:
    """Motions at the drives of a grid, all that the orbit at the first of two drives leads to.

    `bounds` has the least and the largest value of each parameter that a drive varies; the grid has
    about so many `drives`.
    """

    def __init__(
        self,
        system: System,
        bounds: Mapping[str, Sequence[float]],
        ends: tuple[Mapping[str, float], Mapping[str, float]],
        orbits: tuple[Orbit, Orbit],
        drives: int,
    ) -> None:
        count = max(3, round(drives ** (1 / len(bounds))))
        axes = [
            np.unique(
                [
                    *np.linspace(bounds[name][0], bounds[name][1], count),
                    *(end[name] for end in ends),
                ]
            )
            for name in bounds
        ]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        self.shape, values = grid.shape[:-1], grid.reshape(-1, len(axes))
        self.drives = [dict(zip(bounds, row, strict=True)) for row in values.tolist()]
        low, high = np.array(list(bounds.values())).T
        self.scaled = (values - low) / (high - low)
        plain = [dimensionless(system.replace(**dict[str, Any](one))) for one in self.drives]
        self.rows = np.array([[*one.to_dict().values()] for one in plain])
        self.scene = plain[0].scene
        self.motions: list[_Motion] = []
        self.places: list[int] = []
        """The drive of each motion."""
        self.at: dict[int, list[int]] = {}
        """The motions at each drive."""
        self.joined: set[tuple[int, int]] = set()
        """Motions next to each other of which one continues the other."""
        self.refused: set[tuple[int, int]] = set()
        begin, self.end = (self.drives.index({name: end[name] for name in bounds}) for end in ends)
        self.goals = self.motions_of(orbits[1], self.end)
        first = self.motions_of(orbits[0], begin)[:1]
        wave = [i for one in first if (i := self.known(begin, one)) is not None]
        while wave:
            check_time()
            wave = self.step([(i, j) for i in wave for j in self.beside(self.places[i])])

    def motions_of(self, orbit: Orbit, drive: int) -> list[_Motion]:
        """An orbit as motions, begun at each of its periods; none where the map has none there."""
        states = stroboscopic(orbit)
        found = self.closed(self.rows[[drive] * len(states)], states, [len(states)] * len(states))
        return [one for one in found if one is not None]

    def closed(self, rows: Vector, states: Vector, periods: Sequence[int]) -> list[_Motion | None]:
        """The stable motions of the map near states (n, 3) at parameters (n, m)."""
        found = performance_many(
            rows, states, periods, energies=False, forces=False, gradients=True, scene=self.scene
        )
        largest, by = abs(found.multipliers[:, 0]), found.by_parameter
        good = found.closed & (largest < 1) & np.isfinite(by).all(axis=(1, 2))
        return [
            _Motion(rows[i], found.states[i], by[i], periods[i], float(largest[i]))
            if good[i]
            else None
            for i in range(len(rows))
        ]

    def known(self, drive: int, motion: _Motion) -> int | None:
        """The number of a motion, of a new one where it was not known; None if they are many."""
        there = self.at.setdefault(drive, [])
        for i in there:
            if self.motions[i].is_one(motion):
                return i
        if len(there) == _MOST:
            return None
        self.motions.append(motion)
        self.places.append(drive)
        there.append(len(self.motions) - 1)
        return there[-1]

    def beside(self, drive: int) -> list[int]:
        """The drives of the grid next to one."""
        place = np.array(np.unravel_index(drive, self.shape))
        steps = np.vstack([np.eye(len(place), dtype=int), -np.eye(len(place), dtype=int)])
        moved = (place + steps)[np.all((place + steps >= 0) & (place + steps < self.shape), axis=1)]
        return [int(one) for one in np.ravel_multi_index(tuple(moved.T), self.shape)]

    def step(self, pairs: Sequence[tuple[int, int]]) -> list[int]:
        """Continue motions to drives; the numbers of those that were not known."""
        new, before = list[int](), len(self.motions)
        rows = self.rows[[drive for _, drive in pairs]]
        begun = [self.motions[i] for i, _ in pairs]
        guesses = np.array([one.at(row) for one, row in zip(begun, rows, strict=True)])
        found = self.closed(rows, guesses, [one.period_number for one in begun])
        for (i, drive), one in zip(pairs, found, strict=True):
            if one is None or not self.motions[i].leads_to(one.state, one.row):
                continue
            if (j := self.known(drive, one)) is not None:
                self.joined |= {(i, j), (j, i)}
                if j >= before and j not in new:
                    new.append(j)
        return new

    def way(self) -> tuple[list[int], bool]:
        """The motions from the first to that of the second drive, or as near to it as they come.

        And whether they come there.
        """
        if not self.motions:
            return [], False
        joined = np.array(sorted(self.joined), dtype=int).reshape(-1, 2)
        lengths = np.linalg.norm(
            np.diff(self.scaled[np.array(self.places)[joined]], axis=1), axis=2
        )
        slow = [1 + _SLOW / (1 - self.motions[j].multiplier) for _, j in joined.tolist()]
        size = (len(self.motions),) * 2
        graph = package("scipy.sparse", "design").csr_array(
            (lengths[:, 0] * slow, tuple(joined.T)), shape=size
        )
        far, before = package("scipy.sparse.csgraph", "design").dijkstra(
            graph, indices=0, return_predecessors=True
        )
        goals = [
            i for i in self.at.get(self.end, ()) if any(map(self.motions[i].is_one, self.goals))
        ]
        last = min(goals, key=lambda i: float(far[i]), default=0)
        whole = bool(goals and np.isfinite(far[last]))
        if not whole:
            apart = np.linalg.norm(self.scaled[self.places] - self.scaled[self.end], axis=1)
            last = int(np.where(np.isfinite(far), apart, np.inf).argmin())
        way = [last]
        while way[-1] != 0:
            way.append(int(before[way[-1]]))
        return way[::-1], whole

    def straightened(self, way: Sequence[int]) -> list[int]:
        """A way with as few corners as straight lines of motions leave."""
        chosen = [0]
        while (at := chosen[-1]) < len(way) - 1:
            ahead = [k for k in range(at + 2, len(way)) if (way[at], way[k]) not in self.refused]
            reached = self.straight(way[at], [way[k] for k in ahead])
            chosen.append(max((k for k in ahead if way[k] in reached), default=at + 1))
        return [way[k] for k in chosen]

    def straight(self, i: int, others: Sequence[int]) -> set[int]:
        """Those of some motions to which a straight line of drives leads from one."""
        begin, left = self.motions[i], dict.fromkeys(others, self.motions[i])
        apart = self.scaled[[self.places[j] for j in others]] - self.scaled[self.places[i]]
        steps = 1 + int(2 * abs(apart).max(initial=0.0) * max(self.shape))
        for step in range(1, steps + 1):
            check_time()
            rows = np.array(
                [begin.row + step / steps * (self.motions[j].row - begin.row) for j in left]
            )
            if not len(rows):
                break
            guesses = np.array([one.at(row) for one, row in zip(left.values(), rows, strict=True)])
            found = self.closed(rows, guesses, [begin.period_number] * len(rows))
            left = {
                j: one
                for (j, last), one in zip(left.items(), found, strict=True)
                if one is not None and last.leads_to(one.state, one.row)
            }
        return {j for j, one in left.items() if one.is_one(self.motions[j])}

    def refuse(self, i: int, j: int) -> None:
        """Let no way go straight from one motion to another."""
        self.refused |= {(i, j), (j, i)}
        self.joined -= {(i, j), (j, i)}

    def drive(self, i: int) -> dict[str, float]:
        """The drive of a motion."""
        return self.drives[self.places[i]]

    def told(self) -> str:
        """How many drives were reached, in words."""
        return f"{len(self.at)} of {len(self.drives)} drives of a grid"
