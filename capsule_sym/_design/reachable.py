"""Stable motions on a grid of drives, linked where one continues another, and paths among them.

From one drive, each motion is continued to the neighbouring drives, to first order, then closed by
the map. Links are approximate: a path is accepted once its orbit is continued along it.
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

_MOST = 4  # largest number of motions at one drive
_BENT = 0.3  # largest relative deviation of a motion from its first-order prediction in a step
_ROUGH = 0.01  # additional deviation, over the motion's size
_ONE = 1e-5  # relative difference below which two motions are equal
_SLOW = 0.05  # additional weight of a drive, over 1 minus the multiplier
Vector = NDArray[np.float64]


class _Motion(NamedTuple):
    """Stable motion: its state at phase 0, and the derivatives of the state by the parameters."""

    row: Vector
    state: Vector
    by: Vector
    period_number: int
    multiplier: float

    def at(self, row: Vector) -> Vector:
        """State at other parameters, to first order."""
        found: Vector = self.state + self.by @ (row - self.row)
        return found

    def leads_to(self, state: Vector, row: Vector) -> bool:
        """True if a state at other parameters may belong to the same branch."""
        guess = self.at(row)
        allowed = _BENT * abs(guess - self.state) + _ROUGH * (1 + abs(self.state).max())
        return bool(np.all(abs(state - guess) <= allowed))

    def is_one(self, other: _Motion) -> bool:
        """True if both are the same motion, at one drive."""
        return bool(abs(self.state - other.state).max() <= _ONE * (1 + abs(self.state).max()))


class Reachable:
    """Motions at the drives of a grid that are reached from the orbit at the first of two drives.

    `bounds` has the least and the largest value of each parameter of the drive; the grid has about
    `drives` points.
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
        """Drive of each motion."""
        self.at: dict[int, list[int]] = {}
        """Motions at each drive."""
        self.joined: set[tuple[int, int]] = set()
        """Neighbouring motions of which one continues the other."""
        self.refused: set[tuple[int, int]] = set()
        begin, self.end = (self.drives.index({name: end[name] for name in bounds}) for end in ends)
        self.goals = self.motions_of(orbits[1], self.end)
        first = self.motions_of(orbits[0], begin)[:1]
        wave = [i for one in first if (i := self.known(begin, one)) is not None]
        while wave:
            check_time()
            wave = self.step([(i, j) for i in wave for j in self.beside(self.places[i])])

    def motions_of(self, orbit: Orbit, drive: int) -> list[_Motion]:
        """Orbit as motions, one for each of its periods; empty if the map has none there."""
        states = stroboscopic(orbit)
        found = self.closed(self.rows[[drive] * len(states)], states, [len(states)] * len(states))
        return [one for one in found if one is not None]

    def closed(self, rows: Vector, states: Vector, periods: Sequence[int]) -> list[_Motion | None]:
        """Stable motions of the map near states (n, 3) at parameters (n, m)."""
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
        """Number of a known motion, or of a new one; None if there are too many."""
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
        """Drives of the grid next to one."""
        place = np.array(np.unravel_index(drive, self.shape))
        steps = np.vstack([np.eye(len(place), dtype=int), -np.eye(len(place), dtype=int)])
        moved = (place + steps)[np.all((place + steps >= 0) & (place + steps < self.shape), axis=1)]
        return [int(one) for one in np.ravel_multi_index(tuple(moved.T), self.shape)]

    def step(self, pairs: Sequence[tuple[int, int]]) -> list[int]:
        """Continue motions to drives; returns the numbers of new ones."""
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
        """Motions from the first drive to the second, or as near to it as possible.

        Also True if the second drive is reached.
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
        """Path with as few corners as straight lines of motions allow."""
        chosen = [0]
        while (at := chosen[-1]) < len(way) - 1:
            ahead = [k for k in range(at + 2, len(way)) if (way[at], way[k]) not in self.refused]
            reached = self.straight(way[at], [way[k] for k in ahead])
            chosen.append(max((k for k in ahead if way[k] in reached), default=at + 1))
        return [way[k] for k in chosen]

    def straight(self, i: int, others: Sequence[int]) -> set[int]:
        """Motions that are reached from one along straight lines of drives."""
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
        """Exclude the straight link between two motions."""
        self.refused |= {(i, j), (j, i)}
        self.joined -= {(i, j), (j, i)}

    def drive(self, i: int) -> dict[str, float]:
        """Drive of a motion."""
        return self.drives[self.places[i]]

    def told(self) -> str:
        """Text with the number of drives reached."""
        return f"{len(self.at)} of {len(self.drives)} drives of a grid"
