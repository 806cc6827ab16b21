"""Attractors along a parameter, with the fractions of starts that lead to each.

The starts run at all values at once. Attractors at neighbouring values are the same if the closed
orbit continues from one value to the other and back, through changes of its itinerary. Otherwise
the branch is continued between the two values, to the bifurcation at which the attractor is born or
dies. An attractor that continues has the fraction 0 where no start leads to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.attractors import Starts, checked_starts, closed_orbit, interval
from capsule_sym._attractors.branches import (
    AttractorBranch,
    Change,
    ContinuedAttractors,
    placed_at,
    row_at,
)
from capsule_sym._attractors.destinations import Arrivals, Cycle, KnownOrbits
from capsule_sym._attractors.neighbourhoods import NONE, close_many, stroboscopic
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._native import Watch, check_time, present
from capsule_sym._orbits.continuation.branches.branch import Branch
from capsule_sym._orbits.continuation.branches.continuing import continue_orbit
from capsule_sym._orbits.continuation.parameter_paths import Function, ParameterPath, parameter_path
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._parameters import SceneParameters

_POINTS = 5  # least number of steps of a branch between two values, which are near
_MOST_RUNS = 10**7  # runs whose states are held in memory
_Cell = tuple[int, int]  # index of a value, number of an orbit there


def continue_attractors(
    parameters: SceneParameters,
    name: str,
    values: ArrayLike,
    starts: Starts,
    *,
    count: int = 400,
    phases: ArrayLike = 0.0,
    ties: Mapping[str, Function | str] | None = None,
    periods: int = 1024,
    threads: int = 1,
    max_seconds: float = SEARCH_SECONDS,
    progress: Callable[[int, int], object] | None = None,
) -> ContinuedAttractors:
    """Attractors at several values of a parameter, continued from value to value.

    The starts run at all values at once. Attractors at neighbouring values are the same if the
    closed orbit continues from one value to the other and back, through changes of its itinerary.
    Where an attractor appears or disappears between two values, its branch is continued exactly
    between them: `birth` and `death` have the bifurcation at which it becomes stable, loses
    stability or ends. An attractor that no start reaches at some value is continued there too, with
    the fraction 0.

    After `max_seconds` the result has what was found so far.

    Parameters
    ----------
    parameters : Parameters or SceneParameters
        Parameters of the capsule or of a scene, dimensionless.
    name : str
        Name of the parameter that varies. With `ties` it may be a new name.
    values : array_like of shape (m,), two or more, ascending
        Values of this parameter, dimensionless. Starts times values are at most 10^7.
    starts : array_like of shape (n, 3), or mapping of str to float or (low, high)
        Start states (x_r, v_r, v_c), dimensionless, or a box, as in `attractors`. They are the same
        at all values.
    count : int, default 400, 1 to 1,000,000
        Number of points of a box. It has no effect on given states.
    phases : float or array_like of shape (n,), default 0, from 0 to below 2 pi/omega
        Phases of given states: times in the excitation period, dimensionless. A box has its own.
    ties : mapping of str to callable or str, optional
        Other parameters that vary with this one, as in `continue_orbit`: for each a function, or a
        text such as "0.5*omega**2".
    periods : int, default 1024, 2 or more
        Length after which a run counts as unsettled, in excitation periods.
    threads : int, default 1, 1 or more
        Number of threads.
    max_seconds : float, default 600, above 0
        Time limit, in seconds of wall time.
    progress : callable, optional
        Function that is called with the number of settled runs and that of all runs.

    Returns
    -------
    ContinuedAttractors
        `branches` has one attractor each, with its `values`, `fractions`, `birth` and `death`.
        `unsettled` has the number of unsettled starts at each value. All quantities are
        dimensionless.

    Raises
    ------
    InvalidInput
        For a value outside its range, an unknown parameter, and values that do not ascend.

    See Also
    --------
    attractors : attractors at one set of parameters.
    plot_attractors : figure of the result.

    Examples
    --------
    An attractor of period 2 loses its second period between two values:

    >>> import capsule_sym as cs
    >>> system = cs.Parameters(omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> box = {"x_r": (-2, 2), "v_r": (-2, 2)}
    >>> along = cs.continue_attractors(system, "alpha", [1.7, 1.75], box, count=20)
    >>> for one in along.branches:
    ...     ends = [f"{at.type} at {at.value:.6f}" if at else "-" for at in (one.birth, one.death)]
    ...     print(one.number, one.fractions, *ends)
    0 [0.75 0.8 ] - -
    1 [0.25] - period doubling at 1.716473
    2 [0.2] period doubling at 1.716473 -
    """
    path = parameter_path(name, ties, parameters.scene)
    try:
        grid = np.array(values, dtype=float)
    except (TypeError, ValueError):
        grid = np.empty(0)
    if grid.ndim != 1 or len(grid) < 2 or not np.all(np.diff(grid) > 0):
        raise InvalidInput("values", values, "two or more numbers, ascending")
    path.check(parameters, grid[0], grid[-1])
    check_count("periods", periods, 2)
    check_count("threads", threads)
    states, times = checked_starts(starts, count, phases, parameters)
    if len(states) * len(grid) > _MOST_RUNS:
        raise InvalidInput(
            "values", len(grid), f"at most {counted(_MOST_RUNS // len(states), 'value')}"
        )
    rows, count = np.array([row_at(path, parameters, value) for value in grid]), len(states)
    known = KnownOrbits(rows, parameters.scene, threads)
    links, groups = _Links(parameters, path, grid, known), np.repeat(np.arange(len(grid)), count)
    runs, total = Arrivals.begun(np.tile(states, (len(grid), 1))), len(groups)
    report = None if progress is None else lambda done: progress(done, total)
    status = Status.TIME_LIMIT
    with Watch(checked_seconds(max_seconds)):
        known.destination(groups, runs, np.tile(times, len(grid)), periods, report=report)
        links.link()
        left = np.flatnonzero(runs.numbers == NONE)
        runs.numbers[left] = known.inside(groups[left], runs.states[left])
        status = Status.FINISHED
    numbers = runs.numbers.reshape(len(grid), -1)
    late = (numbers == NONE).sum(axis=1)
    found = links.branches(numbers)
    return ContinuedAttractors(name, grid, count, found, late, periods, status, parameters)


class _Links:
    """Orbits at all values, and their identity between neighbouring values."""

    def __init__(
        self, base: SceneParameters, path: ParameterPath, values: Vector, known: KnownOrbits
    ) -> None:
        self.base, self.path, self.values, self.known = base, path, values, known
        # By side, 1 or -1: the orbit at the next value, or the reason why there is none.
        self.next: dict[int, dict[_Cell, _Cell]] = {1: {}, -1: {}}
        self.ends: dict[int, dict[_Cell, Change]] = {1: {}, -1: {}}

    def link(self) -> None:
        """Continue every orbit to the next values on both sides, or to a bifurcation before."""
        pending = True
        while pending:
            pending = False
            for side in (1, -1):
                cells = [cell for cell in self._cells() if self._open(cell, side)]
                self._carry(cells, side)
                for cell in cells:
                    if cell not in self.next[side]:
                        self._follow(cell, side)
                pending |= bool(cells)

    def branches(self, numbers: NDArray[np.int16]) -> tuple[AttractorBranch, ...]:
        """Attractors along the parameter, from the orbit numbers, (m, n), of all starts."""
        found, total = list[AttractorBranch](), numbers.shape[1]
        counts = {cell: int((numbers[cell[0]] == cell[1]).sum()) for cell in self._cells()}
        heads = [cell for cell in self._cells() if cell not in self.next[-1]]
        for head in sorted(heads, key=lambda cell: (cell[0], -counts[cell])):
            cells = [head]
            while (after := self.next[1].get(cells[-1])) is not None:
                cells.append(after)
            number = [counts[cell] for cell in cells]
            found.append(
                AttractorBranch(
                    len(found),
                    self.path,
                    self.base,
                    self.values[[i for i, _ in cells]],
                    np.array(number),
                    np.array(number) / total,
                    np.array([interval(one, total) for one in number]),
                    tuple(map(self._cycle, cells)),
                    self._end(head, -1),
                    self._end(cells[-1], 1),
                )
            )
        return tuple(found)

    def _cells(self) -> list[_Cell]:
        every = enumerate(self.known.cycles)
        return [(i, k) for i, cycles in every for k in range(len(cycles))]

    def _cycle(self, cell: _Cell) -> Cycle:
        return self.known.cycles[cell[0]][cell[1]]

    def _open(self, cell: _Cell, side: int) -> bool:
        """True if an orbit has to be continued to a side."""
        linked = cell in self.next[side] or cell in self.ends[side]
        return not linked and 0 <= cell[0] + side < len(self.values)

    def _end(self, cell: _Cell, side: int) -> Change | None:
        open_ = self._open(cell, side)
        why = "not sought", "time limit reached"
        return self._unlocated(cell, side, *why) if open_ else self.ends[side].get(cell)

    def _between(self, cell: _Cell, side: int) -> tuple[float, float]:
        low, high = sorted((cell[0], cell[0] + side))
        return float(self.values[low]), float(self.values[high])

    def _unlocated(self, cell: _Cell, side: int, kind: str, why: str) -> Change:
        return Change(math.nan, kind, self._between(cell, side), None, why)

    def _carry(self, cells: Sequence[_Cell], side: int) -> None:
        """Link orbits that lead to each other by a step along their tangent, and one back."""
        there = self._carried(cells, [self._cycle(cell) for cell in cells], side)
        found = [(cell, cycle) for cell, cycle in zip(cells, there, strict=True) if cycle]
        beyond = [(i + side, k) for (i, k), _ in found]
        back = self._carried(beyond, [cycle for _, cycle in found], -side)
        for (cell, cycle), returned in zip(found, back, strict=True):
            if returned is not None and self._cycle(cell).same(returned):
                self._join(cell, cycle, side)

    def _carried(
        self, cells: Sequence[_Cell], cycles: Sequence[Cycle], side: int
    ) -> list[Cycle | None]:
        """Orbits at the next value, of as many periods, to which orbits lead."""
        if not cells:
            return []
        rows, here = self.known.rows, np.array([i for i, _ in cells])
        states = np.array([cycle.states[0] for cycle in cycles])
        periods = np.array([len(cycle.states) for cycle in cycles])
        tangents = close_many(rows[here], states, periods, self.known.scene).by_parameter
        guess = states + (tangents @ (rows[here + side] - rows[here])[:, :, None])[:, :, 0]
        states = np.where(np.isfinite(guess).all(axis=1)[:, None], guess, states)
        found = self.known.closed(here + side, states, periods)
        return [
            one if one is not None and len(one.states) == count else None
            for one, count in zip(found, periods.tolist(), strict=True)
        ]

    def _join(self, cell: _Cell, cycle: Cycle, side: int) -> None:
        """Identify an orbit at the next value with the attractor here."""
        row = cell[0] + side
        other = row, self.known.numbered([row], [cycle])[0]
        if other not in self.next[-side]:
            self.next[side][cell], self.next[-side][other] = other, cell
            self.ends[-side].pop(other, None)

    def _branch(self, orbit: Orbit, to: float) -> Branch:
        ties, left = dict(self.path.ties) or None, present().left
        name = self.path.name
        found = continue_orbit(orbit, name, to, points=_POINTS, ties=ties, max_seconds=left)
        check_time()
        return found

    def _follow(self, cell: _Cell, side: int) -> None:
        """Continue a branch from an orbit to the next value, or to its end."""
        check_time()
        i, why = cell[0], "the orbit's equations are not solved"
        orbit = closed_orbit(placed_at(self.path, self.base, self.values[i]), self._cycle(cell))
        if orbit is not None:
            branch = self._branch(orbit, float(self.values[i + side]))
            why = f"the branch ends ({branch.status}): {branch.message}"
            lost = loss(branch)
            if lost is None and branch.status in (Status.RETURNED, Status.TURNED_BACK):
                lost = self._doubling(branch, cell, side)
            if lost is not None:
                passed = f"{lost.itinerary_before} → {lost.itinerary_after or 'none'}"
                between = self._between(cell, side)
                self.ends[side][cell] = Change(lost.value, lost.type, between, lost, passed)
                return
            if branch.status is Status.REACHED:
                states = stroboscopic(branch.points[-1].orbit)
                (closed,) = self.known.closed(
                    np.array([i + side]), states[:1], np.array([len(states)])
                )
                if closed is not None:
                    self._join(cell, closed, side)
        if cell not in self.next[side]:
            self.ends[side][cell] = self._unlocated(cell, side, "not located", why)

    def _doubling(self, branch: Branch, cell: _Cell, side: int) -> Bifurcation | None:
        """Period doubling at which a branch of doubled orbits retraces itself.

        It is sought on the orbit of half the period beyond it, since border collisions may hide it.
        """
        turn = max(branch.points, key=lambda point: side * point.value)
        states, (low, high) = stroboscopic(turn.orbit), self._between(cell, side)
        near = 1e-3 * (high - low)  # far enough beyond the turn, and near enough to be its doubling
        at = turn.value + side * near
        if len(states) % 2 or not low < at < high:
            return None
        half = placed_at(self.path, self.base, at), states[0].tolist(), len(states) // 2
        orbit = orbit_at(*half)
        if orbit is None:
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
