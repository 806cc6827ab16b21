"""Identity of attractors between values of a parameter, and their births and deaths."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.attractor import closed_orbit, interval
from capsule_sym._attractors.branches import AttractorBranch, Change, placed_at
from capsule_sym._attractors.destinations import Cycle, KnownOrbits
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._errors import Status
from capsule_sym._native import check_time, present
from capsule_sym._orbits.continuation.bifurcations import Bifurcation
from capsule_sym._orbits.continuation.branch import Branch
from capsule_sym._orbits.continuation.continue_orbits import continue_orbit
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._parameters import SceneParameters

_POINTS = 5  # least number of steps of a branch between two values, which are near
_Cell = tuple[int, int]  # index of a value, number of an orbit there


class Links:
    """Orbits at all values, and their identity between neighbouring values."""

    def __init__(
        self, base: SceneParameters, path: ParameterPath, values: Vector, known: KnownOrbits
    ) -> None:
        self.base, self.path, self.values, self.known = base, path, values, known
        # By side, 1 or -1: the orbit at the next value, or the reason why there is none.
        self.next: dict[int, dict[_Cell, _Cell]] = {1: {}, -1: {}}
        self.ends: dict[int, dict[_Cell, Change]] = {1: {}, -1: {}}

    def link(self) -> None:
        """Continue every orbit to the next values on both sides, or to its branch's end before.

        Raises TimeUp if the present watch is over; the links found remain.
        """
        while any([self._linked(1), self._linked(-1)]):
            pass

    def branches(self, numbers: NDArray[np.int16]) -> tuple[AttractorBranch, ...]:
        """Attractors along the parameter, from the orbit numbers, (m, n), of all starts.

        They are in the order of their first values, and of the most starts there.
        """
        found, total = list[AttractorBranch](), numbers.shape[1]
        counts = {cell: int((numbers[cell[0]] == cell[1]).sum()) for cell in self._cells()}
        heads = [cell for cell in self._cells() if cell not in self.next[-1]]
        for head in sorted(heads, key=lambda cell: (cell[0], -counts[cell])):
            cells = [head]
            while (after := self.next[1].get(cells[-1])) is not None:
                cells.append(after)
            number = np.array([counts[cell] for cell in cells])
            intervals = np.array([interval(one, total) for one in number.tolist()])
            values, cycles = self.values[[i for i, _ in cells]], tuple(map(self._cycle, cells))
            ends = self._end(head, -1), self._end(cells[-1], 1)
            of = len(found), self.path, self.base, values, number, number / total, intervals
            found.append(AttractorBranch(*of, cycles, *ends))
        return tuple(found)

    def _cells(self) -> list[_Cell]:
        every = enumerate(self.known.cycles)
        return [(i, k) for i, cycles in every for k in range(len(cycles))]

    def _cycle(self, cell: _Cell) -> Cycle:
        return self.known.cycles[cell[0]][cell[1]]

    def _open(self, cell: _Cell, side: int) -> bool:
        """True if an orbit has still to be continued to a side."""
        linked = cell in self.next[side] or cell in self.ends[side]
        return not linked and 0 <= cell[0] + side < len(self.values)

    def _end(self, cell: _Cell, side: int) -> Change | None:
        if self._open(cell, side):
            return self._change(cell, side, None, "time limit reached")
        return self.ends[side].get(cell)

    def _change(self, cell: _Cell, side: int, at: Bifurcation | None, why: str) -> Change:
        """Birth or death at a bifurcation, or the reason why none is located."""
        low, high = sorted(self.values[[cell[0], cell[0] + side]].tolist())
        if at is None:
            return Change(math.nan, "not located", (low, high), None, why)
        passed = f"{at.itinerary_before} → {at.itinerary_after or 'none'}"
        return Change(at.value, at.type, (low, high), at, passed)

    def _linked(self, side: int) -> bool:
        """Continue the orbits that are open on a side; True if there were any."""
        cells = [cell for cell in self._cells() if self._open(cell, side)]
        # Orbits are the same that lead to each other by a step along their tangent, and one back.
        there = self._carried(cells, [self._cycle(cell) for cell in cells], side)
        found = [(cell, cycle) for cell, cycle in zip(cells, there, strict=True) if cycle]
        beyond = [(i + side, k) for (i, k), _ in found]
        back = self._carried(beyond, [cycle for _, cycle in found], -side)
        for (cell, cycle), returned in zip(found, back, strict=True):
            if returned is not None and self._cycle(cell).same(returned):
                self._join(cell, cycle, side)
        for cell in cells:
            if cell not in self.next[side]:
                self._follow(cell, side)
        return bool(cells)

    def _carried(
        self, cells: Sequence[_Cell], cycles: Sequence[Cycle], side: int
    ) -> list[Cycle | None]:
        """Orbit of as many periods to which each leads at the next value, by Newton's method.

        Its guess is a step along the tangent. None if it finds no stable orbit nearby.
        """
        if not cells:
            return []
        rows, here = self.known.rows, np.array([i for i, _ in cells])
        states = np.array([cycle.states[0] for cycle in cycles])
        periods = np.array([len(cycle.states) for cycle in cycles])
        _, _, tangents = self.known.close(rows[here], states, periods)
        guess = states + (tangents @ (rows[here + side] - rows[here])[:, :, None])[:, :, 0]
        states = np.where(np.isfinite(guess).all(axis=1)[:, None], guess, states)
        found = zip(self.known.closed(here + side, states, periods), periods, strict=True)
        return [one if one and len(one.states) == count else None for one, count in found]

    def _join(self, cell: _Cell, cycle: Cycle, side: int) -> None:
        """Identify an orbit at the next value with the attractor here, unless another one is."""
        row = cell[0] + side
        other = row, self.known.numbered([row], [cycle])[0]
        if other not in self.next[-side]:
            self.next[side][cell], self.next[-side][other] = other, cell
            self.ends[-side].pop(other, None)

    def _branch(self, orbit: Orbit, to: float) -> Branch:
        ties, left = dict(self.path.ties) or None, present().left
        of = orbit, self.path.name, to
        found = continue_orbit(*of, points=_POINTS, ties=ties, max_seconds=left)
        check_time()
        return found

    def _follow(self, cell: _Cell, side: int) -> None:
        """Continue a branch from an orbit to the next value, or record its end before."""
        check_time()
        i, lost, why = cell[0], None, "the orbit's equations are not solved"
        orbit = closed_orbit(placed_at(self.path, self.base, self.values[i]), self._cycle(cell))
        if orbit is not None:
            branch = self._branch(orbit, float(self.values[i + side]))
            why = f"the branch ends ({branch.status}): {branch.message}"
            lost = loss(branch)
            if lost is None and branch.status in (Status.RETURNED, Status.TURNED_BACK):
                lost = self._doubling(branch, cell, side)
            if lost is None and branch.status is Status.REACHED:
                states = stroboscopic(branch.points[-1].orbit)
                at = np.array([i + side]), states[:1], np.array([len(states)])
                for closed in filter(None, self.known.closed(*at)):
                    self._join(cell, closed, side)
        if cell not in self.next[side]:
            self.ends[side][cell] = self._change(cell, side, lost, why)

    def _doubling(self, branch: Branch, cell: _Cell, side: int) -> Bifurcation | None:
        """Period doubling at which a branch of doubled orbits retraces itself.

        It is sought on the orbit of half the period beyond it, since border collisions may hide it.
        None if it is not found.
        """
        turn = max(branch.points, key=lambda point: side * point.value)
        low, high = sorted(self.values[[cell[0], cell[0] + side]])
        states = stroboscopic(turn.orbit)
        near = 1e-3 * (high - low)  # far enough beyond the turn, and near enough to be its doubling
        at = turn.value + side * near
        if len(states) % 2 or not low < at < high:
            return None
        there = placed_at(self.path, self.base, at)
        if (orbit := orbit_at(there, states[0].tolist(), len(states) // 2)) is None:
            return None
        found = loss(self._branch(orbit, float(self.values[cell[0]])))
        return found if found is not None and abs(found.value - turn.value) <= near else None


def loss(branch: Branch) -> Bifurcation | None:
    """First bifurcation on a branch beyond which its orbits are unstable or do not exist.

    None if the whole branch is stable, or ends without a bifurcation.
    """
    for one in branch.bifurcations:
        after = one.multipliers_after
        if not after or abs(after[0]) >= 1:
            return one
    return None
