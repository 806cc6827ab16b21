"""Objective and limits at many cells of the bounds, by runs from the scenarios' starts."""

from __future__ import annotations

import math
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design import evaluation
from capsule_sym._design.cells import Grid
from capsule_sym._design.program import Program, Scenario
from capsule_sym._design.quantities import dimensionless, of, valued
from capsule_sym._design.settled import Settled, joined, settle_many
from capsule_sym._errors import counted
from capsule_sym._native import core_of, present
from capsule_sym._parameters import SceneParameters

_CELLS = 1024  # in memory at once
_FIRST, _LEAST, _MOST = 32, 64, 128  # excitation periods of the stretches of a run: the first one,
# the longest one at least, and where nothing is known of damping
_FOLDINGS, _LONGEST = 25.0, 8  # of transients by damping alone, and times the first at most


class Overview(NamedTuple):
    """Worst objective (n,) and least slacks (n, limits), approximately.

    nan without a motion, infinite if a function is not finite.
    """

    worst: Vector
    slacks: Matrix
    in_contact: bool
    """True if the spring is compressed at some point."""
    stiff: bool
    """True if the spring has a stiffness at some point."""
    motions: tuple[Settled, ...] = ()
    """Motions of each scenario; none without the core."""

    def with_more(self, other: Overview) -> Overview:
        """These and other cells."""
        pairs = zip(self.motions, other.motions, strict=True)
        return Overview(
            np.append(self.worst, other.worst),
            np.vstack([self.slacks, other.slacks]),
            self.in_contact or other.in_contact,
            self.stiff or other.stiff,
            tuple(joined(pair) for pair in pairs),
        )

    def beyond(self, program: Program) -> Vector:
        """Excess over a limit or the margin of stability (n,), in units of the limits."""
        sizes = program.sizes[: self.slacks.shape[1]]
        found: Vector = np.maximum(0.0, -(self.slacks / sizes).min(axis=1, initial=np.inf))
        if program.margin is not None:
            for one in self.motions:  # fewer where the time is over
                over = abs(one.found.multipliers[:, 0]) - 1 + program.margin
                over = np.where(one.period_numbers > 0, over, 0.0)
                found[: len(over)] = np.maximum(found[: len(over)], over)
        return found

    def flat(self, program: Program) -> str:
        """Reason why no drift is possible if the metric is constant; else empty."""
        moving = self.worst[~np.isnan(self.worst)]
        found = np.unique(moving)
        one = len(moving) == 1 and 0 < abs(found[0]) < np.inf
        if len(found) != 1 or self.in_contact or one:
            return ""
        scene = program.system.scene
        if not scene.facts.SYMMETRIC:
            return ""  # a bias moves the capsule without contact
        names = dict(zip(scene.facts.PARAMETERS, scene.facts.PARAMETERS, strict=True))
        if not isinstance(program.system, SceneParameters):
            names |= {tied: name for name, (tied, _) in scene.facts.DRIVEN.items()}
        gaps, springs = (
            " or ".join(names[one] for one in kind) for kind in zip(*scene.facts.STOPS, strict=True)
        )
        value = f"is {abs(found[0]):g}" if np.isfinite(found[0]) else "has no number"
        why = f"the mass does not reach the spring: lower {gaps} or raise {names['alpha']}"
        if not self.stiff:
            why = f"the spring has no stiffness: raise {springs}"
        return f"{program.name} {value} at each of {len(moving)} surveyed places: {why}"


def overview(
    program: Program, points: Matrix, states: Matrix | None = None, longer: int = 1
) -> Overview:
    """Objective and slacks of the scenarios at points (n, k), without units.

    A point for which there is no time has no motion. With `states` (n, 3) runs of the first
    scenario begin there, and those of the others on the motions that these lead to. The last
    stretch of a run is `longer` by a power of two.
    """
    scenarios, worst = program.scenarios, np.full(len(points), -np.inf)
    least = np.full((len(points), len(program.limits)), np.inf)
    kept: list[list[Settled]] = [[] for _ in scenarios]
    contact, stiff, total = 0.0, False, len(points) * len(scenarios)
    for first, (k, one) in product(range(0, len(points), _CELLS), enumerate(scenarios)):
        if present().over:
            worst[first:] = np.nan
            break
        block = slice(first, first + _CELLS)
        program.tell(
            f"survey, {first * len(scenarios) + k * len(points[block])} of {counted(total, 'run')}"
        )
        grid = Grid(program, one, points[block])
        springs = [grid.scene.facts.PARAMETERS.index(name) for _, name in grid.scene.facts.STOPS]
        stiff |= bool((grid.rows[:, springs] > 0).any())
        if core_of(grid.scene) is None:
            for i in range(len(points))[block]:
                value, slacks, peak = _one(program, points[i], one)
                worst[i] = np.maximum(worst[i], value)
                least[i], contact = np.minimum(least[i], slacks), max(contact, peak)
            continue
        begin: Any = one.state
        if states is not None:
            begin = kept[0][-1].found.states if k else states[block]
        found = settled(grid, begin, _lasting(grid) * longer)
        kept[k].append(found)
        values, moving = grid.of(found.found), found.period_numbers > 0
        contact = max(contact, found.found["peak_contact"][moving].max(initial=0.0))
        objective = np.where(moving, values.objective, np.nan)
        worst[block] = np.maximum(worst[block], objective)
        least[block] = np.minimum(least[block], np.where(moving[:, None], values.slacks, np.inf))
    return Overview(worst, least, contact > 0, stiff, tuple(joined(one) for one in kept if one))


def _lasting(grid: Grid) -> Any:
    """Excitation periods of the longest stretch of runs (n,), by their damping."""
    if "zeta" not in (names := grid.scene.facts.PARAMETERS):
        return np.array(_MOST)
    omega, zeta = (grid.rows[:, names.index(name)] for name in ("omega", "zeta"))
    with np.errstate(divide="ignore"):
        needed = _FOLDINGS * omega / (math.tau * zeta) / _FIRST
    stretches = np.floor(np.log2(1 + np.minimum(needed, _LONGEST)))
    return np.maximum(_FIRST * 2 ** stretches.astype(int), _LEAST)


def settled(grid: Grid, states: ArrayLike, most: Any) -> Settled:
    """The motions that starts lead to; none where parameters are not allowed."""
    own = [*dimensionless(grid.program.system).to_dict().values()]
    rows = np.where(grid.allowed[:, None], grid.rows, own)
    found = settle_many(rows, states, first=_FIRST, most=most, scene=grid.scene)
    found.period_numbers[~grid.allowed] = 0
    return found


def _one(program: Program, u: Vector, scenario: Scenario) -> tuple[float, Vector, float]:
    """Objective and slacks of a scenario at a point, and the largest contact force."""
    system = scenario.system(program.system_at(u))
    motion = evaluation.settle(dimensionless(system), scenario.state)
    if motion is None:
        return np.nan, np.full(len(program.limits), np.inf), 0.0
    found = of(motion.metrics, system)
    value = valued("metric", program.function, found)[0] * program.sign
    slacks = np.array([limit.slack(found)[0] for limit in program.limits])
    slacks = np.where(np.isfinite(slacks), slacks, -np.inf)
    return value if np.isfinite(value) else np.inf, slacks, motion.metrics["peak_contact"].value
