"""Many searches side by side, from cells of a survey to places next to their optima.

Each follows its motion by the core. It minimises the objective of the worst scenario, with a
penalty beyond limits. This function has kinks, where itineraries and worst scenarios change; the
BFGS method with weak Wolfe conditions works in spite of them (Lewis & Overton, Math. Program. 141,
2013, doi 10.1007/s10107-012-0514-2). SciPy's BFGS searches from one place at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import Grid
from capsule_sym._design.program import Program
from capsule_sym._design.settled import attracting, branch_of
from capsule_sym._orbits.metrics.many import Performances

PENALTY = 10.0
"""Units of the objective for a limit exceeded by its own unit."""
_FALLS = 1e-4  # least share of the predicted decrease
_SHORTER = 0.3  # factor of the next step after one that was too long
_REACH = 0.2  # largest step, in the bounds
_AT_REST = 1e-5  # least step, in the bounds


@dataclass(eq=False)
class Places:
    """Places u (n, k) with a motion in each of m scenarios.

    The merit is infinite if a motion is lost. `states` (n, m, 3) are at forcing angle 0, `numbers`
    (n, m) excitation periods, `rows` (n, m, p) parameters, and `states_by` (n, m, 3, p) the
    derivatives of the states by these.
    """

    u: Matrix
    states: NDArray[np.float64]
    numbers: NDArray[np.int64]
    rows: NDArray[np.float64]
    states_by: NDArray[np.float64]
    worst: Vector
    """Objective of the worst scenario, over its unit."""
    beyond: Vector
    """Largest violation of a limit, over its unit."""
    merit: Vector
    """Function to minimise: the objective, with a penalty beyond limits."""
    slope: Matrix
    """Derivatives of the merit by the scaled variables."""
    found: list[Performances]
    """Motions of each scenario."""

    def __len__(self) -> int:
        return len(self.u)

    def of(self, some: NDArray[Any]) -> Places:
        """Some of the places, by indices or a mask."""
        own = {
            one.name: getattr(self, one.name)[some] for one in fields(self) if one.name != "found"
        }
        return Places(found=[one.of(some) for one in self.found], **own)

    def branch(self, i: int) -> tuple[tuple[int, ...], ...]:
        """Period numbers and itineraries of the motions of place i."""
        pairs = zip(self.found, self.numbers[i].tolist(), strict=True)
        return tuple(branch_of(one, i, number) for one, number in pairs)

    def put(self, some: NDArray[Any], other: Places) -> None:
        """Replace some of the places."""
        for one in fields(self):
            if one.name != "found":
                getattr(self, one.name)[some] = getattr(other, one.name)
        for mine, new in zip(self.found, other.found, strict=True):
            mine.records[some], mine.fields[some] = new.records, new.fields
            mine.__dict__.pop("multipliers", None)


def places_of(program: Program, u: Matrix, found: list[Performances], numbers: Any) -> Places:
    """Places with the motions found in each scenario."""
    n, m, k = len(u), len(program.scenarios), len(program.names)
    sizes = program.sizes
    objective, slopes = np.full((n, m), np.inf), np.zeros((n, m, k))
    slacks, slacks_by = np.full((n, m, len(sizes)), np.inf), np.zeros((n, m, len(sizes), k))
    rows, good = [], np.ones(n, bool)
    for j, (scenario, motions) in enumerate(zip(program.scenarios, found, strict=True)):
        grid = Grid(program, scenario, u)
        rows.append(grid.rows)
        values = grid.of(motions)
        objective[:, j] = values.objective / program.unit
        slopes[:, j] = values.objective_by / program.unit
        count = len(program.limits)
        slacks[:, j, :count] = values.slacks / sizes[:count]
        slacks_by[:, j, :count] = values.slacks_by / sizes[:count, None]
        if program.margin is not None:
            slacks[:, j, -1] = 1 - program.margin - abs(motions.multipliers[:, 0])
        good &= attracting(motions, gradients=True) & (np.asarray(numbers)[:, j] > 0)
    at = np.arange(n)
    which = objective.argmax(axis=1)
    worst, slope = objective[at, which], slopes[at, which]
    flat, flat_by = slacks.reshape(n, -1), slacks_by.reshape(n, -1, k)
    beyond = np.maximum(0.0, -flat.min(axis=1, initial=0.0))
    if flat.shape[1]:
        tight = flat.argmin(axis=1)
        slope = slope - PENALTY * np.where(beyond > 0, 1.0, 0.0)[:, None] * flat_by[at, tight]
    merit = worst + PENALTY * beyond
    good &= np.isfinite(merit) & np.isfinite(slope).all(axis=1)
    return Places(
        u,
        np.stack([one.states for one in found], axis=1),
        np.asarray(numbers),
        np.stack(rows, axis=1),
        np.stack([one.by_parameter for one in found], axis=1),
        worst,
        beyond,
        np.where(good, merit, np.inf),
        np.where(good[:, None], slope, 0.0),
        found,
    )


def moved(program: Program, places: Places, u: Matrix) -> Places:
    """Places at other variables, with the motions next to the known ones."""
    found = []
    for j, scenario in enumerate(program.scenarios):
        grid = Grid(program, scenario, u)
        by = np.einsum("nsp,np->ns", places.states_by[:, j], grid.rows - places.rows[:, j])
        begin = places.states[:, j] + by
        begin = np.where(np.isfinite(begin), begin, places.states[:, j])
        allowed = grid.allowed
        grid.rows = np.where(allowed[:, None], grid.rows, places.rows[:, j])
        one = grid.closed(begin, places.numbers[:, j])
        one.records["status"][~allowed] = 255
        found.append(one)
    return places_of(program, u, found, places.numbers)


def climb(program: Program, begin: Places, steps: int, length: float) -> Places:
    """Final places of searches from places; the first step of each has this length."""
    at = begin.of(np.arange(len(begin)))
    n, k = at.u.shape
    inverse, known = np.zeros((n, k, k)), np.zeros(n, bool)
    direction, share, long = np.zeros((n, k)), np.ones(n), np.full(n, length)
    aim, running = np.ones(n, bool), np.isfinite(at.merit)
    for _ in range(steps):
        slope = np.where(free_of(at), at.slope, 0.0)
        size = abs(slope).max(axis=1)
        running &= size > 0
        fresh = running & aim & ~known
        inverse[fresh] = np.eye(k) * (long[fresh] / size[fresh])[:, None, None]
        goal = -np.einsum("nij,nj->ni", inverse, slope) * (slope != 0)
        uphill = running & aim & ((goal * slope).sum(axis=1) >= 0)
        goal[uphill] = -slope[uphill] * (long[uphill] / size[uphill])[:, None]
        goal *= np.minimum(1.0, _REACH / np.maximum(abs(goal).max(axis=1), 1e-300))[:, None]
        direction[aim], share[aim], aim[:] = goal[aim], 1.0, False
        some = np.flatnonzero(running)
        if not len(some):
            break
        here = at.of(some)
        u = np.clip(here.u + share[some, None] * direction[some], 0.0, 1.0)
        step = u - here.u
        there = moved(program, here, u)
        gone = abs(step).max(axis=1)
        promised = (here.slope * step).sum(axis=1)
        falls = there.merit < here.merit + _FALLS * np.minimum(promised, 0.0)
        gain = there.slope - here.slope
        bent = (gain * step).sum(axis=1)
        curved = falls & (bent > 1e-12 * gone)
        inverse[some[curved]] = _updated(inverse[some[curved]], step[curved], gain[curved])
        known[some[curved]] = True
        at.put(some[falls], there.of(falls))
        # If the slope only grows, the step continues in the same direction, twice as long.
        aim[some[curved]] = True
        on = falls & ~curved
        share[some[on]] *= 2.0
        share[some[on]] = np.minimum(
            share[some[on]], _REACH / np.maximum(abs(direction[some[on]]).max(axis=1), 1e-300)
        )
        share[some[~falls]] *= _SHORTER
        long[some[~falls]] = np.maximum(gone[~falls] * _SHORTER, _AT_REST)
        short = gone < _AT_REST
        # A search without progress restarts along the slope, once.
        again = ~falls & short & known[some]
        known[some[again]], aim[some[again]] = False, True
        running[some[short & ~again]] = False
    return at


def free_of(at: Places) -> NDArray[np.bool_]:
    """Mask (n, k) of variables that no bound holds."""
    held: NDArray[np.bool_] = ((at.u <= 0) & (at.slope > 0)) | ((at.u >= 1) & (at.slope < 0))
    return ~held


def _updated(inverse: Any, step: Matrix, gain: Matrix) -> Any:
    """Updated inverse Hessians (n, k, k), from steps and the changes of slopes over them."""
    rho = 1.0 / (gain * step).sum(axis=1)
    k = step.shape[1]
    left = np.eye(k) - rho[:, None, None] * step[:, :, None] * gain[:, None, :]
    return (
        left @ inverse @ left.transpose(0, 2, 1)
        + rho[:, None, None] * step[:, :, None] * step[:, None, :]
    )
