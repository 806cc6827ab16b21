"""Survey of the bounds: places all over them, then a population that evolves to better ones.

The places are Sobol's, some on the faces of the bounds. Differential evolution (Storn & Price 1997,
by SciPy) begins with the best of them. All places are kept: searches start at the best ones that
are distant from each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import BEYOND, Grid, evaluate, together, unknown
from capsule_sym._design.program import KEPT, Program
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._map.labelled import package
from capsule_sym._native import Watch, check_time, core_of, present
from capsule_sym._parameters import SceneParameters
from capsule_sym._processes import sobol

_SHARE = 0.3  # share of the time that is left: searches and polish take the rest
_WITHOUT_CORE = 8  # times fewer places where there is no core
_ON_FACES = 1.5  # factor of every third place's distance from the middle, up to the bounds
_MEMBERS = 12  # of the population, for each variable
_NEIGHBOURS = 4  # places for each variable that a start betters: two to each side
APART = 0.02
"""Distance of two starts of searches, a share of each range: nearer ones end at one optimum."""


def evolved(
    merit: Callable[[Matrix], Vector],
    bounds: Sequence[tuple[float, float]],
    generations: int,
    tol: float,
    **begin: Any,
) -> Any:
    """Population within bounds after some generations, by a merit of many places at once.

    It ends before where the deviation of its merits is below `tol` of their mean.
    """
    return package("scipy.optimize").differential_evolution(
        lambda x: np.minimum(merit(x.T), BEYOND**1.5),
        bounds,
        maxiter=generations,
        tol=tol,
        polish=False,
        vectorized=True,
        updating="deferred",
        **begin,
    )


class Survey:
    """Places of an optimisation and their units."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.cells = unknown(program, np.empty((0, len(program.names))))
        self.unknown = ""
        """Number of unknown places, as a text; empty if there are none."""
        self.started = list[int]()
        """Places at which searches started."""
        self.flat = ""
        """Reason why no place is better than another."""

    def run(self, samples: int, seed: int) -> None:
        """Evaluate places all over the bounds; the first ones set the units of the program.

        Raises InvalidInput if the metric is nowhere finite.
        """
        if core_of(self.program.system.scene) is None:
            samples = -(-samples // _WITHOUT_CORE)
        u = sobol(len(self.program.names), samples, seed)
        u[2::3] = np.clip((u[2::3] - 0.5) * _ON_FACES + 0.5, 0.0, 1.0)
        self.program.tell(f"survey, {counted(len(u), 'place')}")
        with Watch(_SHARE * present().left):
            self.cells = evaluate(self.program, u)
        if count := self.cells.unknown:
            self.unknown = f"{count:,} of {counted(len(u), 'place')}"
        self.flat = self._flat()
        if not self.flat:
            self._scale()

    @property
    def best(self) -> int | None:
        """The best place; None if none has a motion."""
        merit = self.cells.merit(self.program)
        return int(np.argmin(merit)) if len(merit) and merit.min() < np.inf else None

    def look(self, u: Matrix) -> Vector:
        """Merit of further places, which are kept."""
        cells = evaluate(self.program, u)
        check_time()
        self.cells = together([self.cells, cells])
        return cells.merit(self.program)

    def evolve(self, generations: int) -> None:
        """Evolve a population from the best places by differential evolution."""
        merit, k = self.cells.merit(self.program), self.cells.u.shape[1]
        order = np.argsort(merit, kind="stable")[: _MEMBERS * k]
        order = order[np.isfinite(merit[order])]
        if len(order) < 5 or not generations or core_of(self.program.system.scene) is None:
            return  # the method takes five members
        begin = {"init": self.cells.u[order], "rng": len(self.cells)}
        evolved(self.look, [(0.0, 1.0)] * k, generations, KEPT, **begin)

    def starts(self, most: int) -> list[int]:
        """The best places that none of their neighbours betters, at most so many.

        Each is given once, and none next to one given before.
        """
        merit, (n, k) = self.cells.merit(self.program), self.cells.u.shape
        if not n:
            return []
        tree = package("scipy.spatial").KDTree(self.cells.u)
        near = tree.query(self.cells.u, min(n, _NEIGHBOURS * k))[1].reshape(n, -1)
        peaks = np.flatnonzero((merit <= merit[near].min(axis=1)) & np.isfinite(merit))
        chosen = list[int]()
        for i in peaks[np.argsort(merit[peaks], kind="stable")].tolist():
            apart = [abs(self.cells.u[i] - self.cells.u[j]).max() for j in self.started]
            if len(chosen) < most and min(apart, default=1.0) > APART:
                chosen.append(i)
                self.started.append(i)
        return chosen

    def _scale(self) -> None:
        """Set the units of the objective and the limits."""
        worst, moving = self.cells.worst, ~np.isnan(self.cells.worst)
        finite = worst[np.isfinite(worst)]
        if not len(finite):
            check_time()
            if moving.any():
                allowed = "a function that is finite somewhere within the bounds"
                raise InvalidInput("metric", self.program.name, allowed)
            return
        units = []
        for limit, slacks in zip(
            self.program.limits, abs(self.cells.slacks[moving].T), strict=False
        ):
            largest = slacks[np.isfinite(slacks)].max(initial=0.0)
            units.append(abs(limit.value) or float(largest) or 1.0)
        unit = float(np.subtract(*np.quantile(finite, (0.75, 0.25)))) or float(np.ptp(finite))
        # A power of two: a value over it, and times it again, is the same value.
        unit = 2.0 ** round(math.log2(unit or abs(finite[0]) or 1.0))
        self.program = replace(self.program, unit=unit, limit_units=tuple(units))

    def _flat(self) -> str:
        """Reason why the metric is constant; else empty."""
        program, scene = self.program, self.program.system.scene
        cells = self.cells.of(~np.isnan(self.cells.worst))
        moving, found = cells.worst, np.unique(cells.worst)
        if len(found) != 1 or (len(moving) == 1 and 0 < abs(found[0]) < np.inf):
            return ""
        value = f"is {abs(found[0]):g}" if np.isfinite(found[0]) else "has no number"
        said = f"{program.name} {value} at each of {counted(len(moving), 'surveyed place')}"
        if cells.peaks.max() > 0 or not scene.facts.SYMMETRIC:
            # In contact, or by a bias, a capsule may drift.
            same = len(moving) > 1 and np.isfinite(found[0]) and cells.beyond(program).min() <= KEPT
            return f"{said}, and nothing changes it" if same else ""
        device = not isinstance(program.system, SceneParameters)
        names = {tied: name for name, (tied, _) in scene.facts.DRIVEN.items()} if device else {}
        gaps, springs = zip(*scene.facts.STOPS, strict=True)
        rows = Grid(program, program.scenarios[0], cells.u).rows
        if not rows[:, [scene.facts.PARAMETERS.index(one) for one in springs]].any():
            stiffer = " or ".join(names.get(one, one) for one in springs)
            return f"{said}: the spring has no stiffness: raise {stiffer}"
        lower, force = " or ".join(names.get(one, one) for one in gaps), names.get("alpha", "alpha")
        return f"{said}: the mass does not reach the spring: lower {lower} or raise {force}"
