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
from capsule_sym._attractors.neighbourhoods import NONE, stroboscopic
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._native import Watch, check_time, core_of, present
from capsule_sym._orbits.continuation.branches.branch import Branch
from capsule_sym._orbits.continuation.branches.continuing import continue_orbit
from capsule_sym._orbits.continuation.families.family import Ending
from capsule_sym._orbits.continuation.parameter_paths import Function, ParameterPath, parameter_path
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._parameters import SceneParameters

_POINTS = 5  # least number of steps of a branch between two values
_BEYOND = 1e-3  # share of the interval beyond the last orbit of a branch at which others are sought
_MOST_RUNS = 10**7
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
    rows = np.array([row_at(path, parameters, value) for value in grid])
    settling = KnownOrbits(rows, parameters.scene, threads)
    following = _Following(parameters, path, grid, settling)
    groups = np.repeat(np.arange(len(grid)), len(states))
    runs = Arrivals.begun(np.tile(states, (len(grid), 1)))
    status = Status.TIME_LIMIT
    with Watch(checked_seconds(max_seconds)):
        following.settling.destination(
            groups,
            runs,
            np.tile(times, len(grid)),
            periods,
            report=None if progress is None else lambda done: progress(done, len(groups)),
        )
        following.link()
        left = np.flatnonzero(runs.numbers == NONE)
        runs.numbers[left] = following.settling.inside(groups[left], runs.states[left])
        status = Status.FINISHED
    numbers = runs.numbers.reshape(len(grid), -1)
    return ContinuedAttractors(
        name,
        grid,
        len(states),
        following.branches(numbers),
        (numbers == NONE).sum(axis=1),
        periods,
        status,
        parameters,
    )


class _Following:
    """Orbits at all values, and their identity between neighbouring values."""

    def __init__(
        self, base: SceneParameters, path: ParameterPath, values: Vector, settling: KnownOrbits
    ) -> None:
        self.base, self.path, self.values, self.settling = base, path, values, settling
        # By side, 1 or -1: the orbit at the next value, or the reason why there is none.
        self.next: dict[int, dict[_Cell, _Cell]] = {1: {}, -1: {}}
        self.ends: dict[int, dict[_Cell, Change]] = {1: {}, -1: {}}

    def link(self) -> None:
        """Continue every orbit to the next values on both sides, or to a bifurcation before."""
        while True:
            pending = {side: self._pending(side) for side in (1, -1)}
            if not any(pending.values()):
                return
            for side, cells in pending.items():
                self._carry(cells, side)
                for cell in cells:
                    if cell not in self.next[side]:
                        self._follow(cell, side)

    def branches(self, numbers: NDArray[np.int16]) -> tuple[AttractorBranch, ...]:
        """Attractors along the parameter, from the orbit numbers, (m, n), of all starts."""
        found = list[AttractorBranch]()
        counts = [
            np.bincount(row[row >= 0], minlength=len(cycles)).tolist()
            for row, cycles in zip(numbers, self.settling.cycles, strict=True)
        ]
        heads = [cell for cell in self._cells() if cell not in self.next[-1]]
        for head in sorted(heads, key=lambda cell: (cell[0], -counts[cell[0]][cell[1]])):
            cells = [head]
            while (after := self.next[1].get(cells[-1])) is not None:
                cells.append(after)
            number = np.array([counts[i][k] for i, k in cells])
            total = numbers.shape[1]
            found.append(
                AttractorBranch(
                    len(found),
                    self.path,
                    self.base,
                    self.values[[i for i, _ in cells]],
                    number,
                    number / total,
                    np.array([interval(one, total) for one in number.tolist()]),
                    tuple(self.settling.cycles[i][k] for i, k in cells),
                    self._end(head, -1),
                    self._end(cells[-1], 1),
                )
            )
        return tuple(found)

    def _cells(self) -> list[_Cell]:
        every = enumerate(self.settling.cycles)
        return [(i, k) for i, cycles in every for k in range(len(cycles))]

    def _pending(self, side: int) -> list[_Cell]:
        last = len(self.values) - 1 if side > 0 else 0
        known = self.next[side].keys() | self.ends[side].keys()
        return [cell for cell in self._cells() if cell[0] != last and cell not in known]

    def _end(self, cell: _Cell, side: int) -> Change | None:
        if cell[0] == (len(self.values) - 1 if side > 0 else 0):
            return None
        return self.ends[side].get(cell) or Change(
            math.nan, "not sought", self._between(cell, side), None, "time limit reached"
        )

    def _between(self, cell: _Cell, side: int) -> tuple[float, float]:
        here, there = sorted((cell[0], cell[0] + side))
        return float(self.values[here]), float(self.values[there])

    def _carry(self, cells: Sequence[_Cell], side: int) -> None:
        """Link orbits that lead to each other by a step along their tangent, and one back."""
        if not cells:
            return
        there = self._carried(cells, [self._cycle(cell) for cell in cells], side)
        found = [(cell, cycle) for cell, cycle in zip(cells, there, strict=True) if cycle]
        if not found:
            return
        beyond = [(i + side, k) for (i, k), _ in found]
        back = self._carried(beyond, [cycle for _, cycle in found], -side)
        for (cell, cycle), returned in zip(found, back, strict=True):
            own = self._cycle(cell)
            if returned is not None and own.same(returned):
                self._join(cell, cycle, side)

    def _cycle(self, cell: _Cell) -> Cycle:
        return self.settling.cycles[cell[0]][cell[1]]

    def _carried(
        self, cells: Sequence[_Cell], cycles: Sequence[Cycle], side: int
    ) -> list[Cycle | None]:
        """Orbits at the next value, of as many periods, to which orbits lead."""
        rows, scene = self.settling.rows, self.settling.scene
        here = np.array([i for i, _ in cells])
        states = np.array([cycle.states[0] for cycle in cycles])
        periods = np.array([len(cycle.states) for cycle in cycles])
        if core_of(scene) is not None:
            given = rows[here], states, periods
            many = performance_many(*given, energies=False, forces=False, scene=scene)
            moved = rows[here + side] - rows[here]
            guess = states + (many.by_parameter @ moved[:, :, None])[:, :, 0]
            states = np.where(np.isfinite(guess).all(axis=1)[:, None], guess, states)
        found = self.settling.closed(here + side, states, periods)
        return [
            one if one is not None and len(one.states) == count else None
            for one, count in zip(found, periods.tolist(), strict=True)
        ]

    def _join(self, cell: _Cell, cycle: Cycle, side: int) -> None:
        """Identify an orbit at the next value with the attractor here."""
        row = cell[0] + side
        (number,) = self.settling.numbered([row], [cycle])
        other = (row, number)
        if other not in self.next[-side]:
            self.next[side][cell], self.next[-side][other] = other, cell
            self.ends[-side].pop(other, None)

    def _follow(self, cell: _Cell, side: int) -> None:
        """Continue a branch from an orbit to the next value, or to its end."""
        check_time()
        i, ends = cell[0], self._between(cell, side)
        orbit = closed_orbit(placed_at(self.path, self.base, self.values[i]), self._cycle(cell))
        if orbit is None:
            why = "the orbit's equations are not solved"
            self.ends[side][cell] = Change(math.nan, "not located", ends, None, why)
            return
        branch = continue_orbit(
            orbit,
            self.path.name,
            float(self.values[i + side]),
            points=_POINTS,
            ties=dict(self.path.ties) or None,
            max_seconds=present().left,
        )
        check_time()
        lost = loss(branch)
        if lost is None and branch.status in (Ending.RETURNED, Ending.TURNED_BACK):
            lost = self._doubling(branch, cell, side)
        if lost is not None:
            self.ends[side][cell] = Change(lost.value, lost.type, ends, lost, _passed(lost))
            return
        if branch.status is Ending.REACHED:
            last = branch.points[-1].orbit
            state = stroboscopic(last)[0]
            closed = self.settling.closed(
                np.array([i + side]), state[None], np.array([last.itinerary.period_number])
            )[0]
            if closed is not None:
                self._join(cell, closed, side)
        if cell not in self.next[side]:
            why = f"the branch ends ({branch.status}): {branch.message}"
            self.ends[side][cell] = Change(math.nan, "not located", ends, None, why)

    def _doubling(self, branch: Branch, cell: _Cell, side: int) -> Bifurcation | None:
        """Period doubling at which a branch of doubled orbits retraces itself.

        It is sought on the orbit of half the period beyond it, since border collisions may hide it.
        """
        turn = max(branch.points, key=lambda point: side * point.value)
        periods, (low, high) = turn.orbit.itinerary.period_number, self._between(cell, side)
        near = _BEYOND * (high - low)
        at = turn.value + side * near
        if periods % 2 or not low < at < high:
            return None
        state = stroboscopic(turn.orbit)[0].tolist()
        orbit = orbit_at(placed_at(self.path, self.base, at), state, periods // 2)
        if orbit is None:
            return None
        back, ties = float(self.values[cell[0]]), dict(self.path.ties) or None
        found = loss(continue_orbit(orbit, self.path.name, back, points=_POINTS, ties=ties))
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


def _passed(one: Bifurcation) -> str:
    """Message with the itineraries on both sides of a bifurcation."""
    return f"{one.itinerary_before} → {one.itinerary_after or 'none'}"
