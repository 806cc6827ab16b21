"""Survey of the bounds: places all over them, then a population that evolves to better ones.

The places are Sobol's. Differential evolution (Storn & Price 1997, by SciPy) begins with those that
no neighbour betters, distant from each other, and the best of the others. Its places are kept too:
searches start at the best ones that no neighbour betters, distant from each other.

Between its ends a front has one survey of both metrics. In each generation random halves of
the places within the limits are drawn. Those that no other of a half betters have children. A
child differs from one of them, drawn evenly
along the approximate front, by a random multiple of the difference to another one; in single
variables it is a multiple of the range instead.
The same places, with a bound on the second metric, show where a point of the front is searched.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import Cells, evaluate, together
from capsule_sym._design.functions import Function, Limit, named
from capsule_sym._design.program import KEPT, Program
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._map.labelled import package
from capsule_sym._native import Watch, check_time, present
from capsule_sym._native.watch import silent
from capsule_sym._processes import sobol

# Members of a population for each variable: SciPy has 15, but a survey gives the best of many.
_MEMBERS = 6
_GENERATIONS = 60  # of a population, at most: after them its places are mostly close together
# Share of each range beyond its bounds: places there count as the nearest ones within, so that a
# population also meets the bounds themselves, where many optima are.
_OUTSIDE = 0.1
_SHARE = 0.3  # of the time that is left: evolution, searches and polish take the rest
_APART = 0.02  # distance of two starts, a share of each range: nearer ones end at one optimum


class Survey:
    """Places of an optimisation, and its problem with the units that they set."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.cells = evaluate(program, np.empty((0, len(program.names))))
        self.samples, self.unknown = 0, 0
        """Number of places all over the bounds so far, and of the unknown ones among them."""
        self.flat = ""
        """Message that the metric is constant; empty if it is not."""

    def run(self, samples: int, seed: int) -> None:
        """Evaluate places all over the bounds; unless the metric is flat they set the units.

        Raises InvalidInput if there are motions, and the metric is finite at none of them.
        """
        self.cover(samples, seed)
        self.flat = self._flat()
        if not self.flat:
            self._scale()

    def cover(self, samples: int, seed: int, skipped: int = 0) -> None:
        """Evaluate places all over the bounds, in place of all places so far.

        They are Sobol's after the skipped ones. Those are unknown for which there is no time, or
        whose run the core cannot decide.
        """
        self.program.progress(f"survey, {counted(samples, 'place')}")
        u = sobol(len(self.program.names), skipped + samples, seed)[skipped:]
        with Watch(_SHARE * present().left):
            self.cells = evaluate(self.program, u)
        self.samples += samples
        self.unknown += self.cells.unknown

    def look(self, u: Matrix) -> Vector:
        """Merit of further places, which are kept; raises TimeUp after the time limit."""
        cells = evaluate(self.program, u)
        self.cells = together([self.cells, cells])
        check_time()
        return cells.merit(self.program)

    def evolve(self) -> None:
        """Evolve a population: good places distant from each other, and the best of the others.

        Nothing evolves with fewer than five places of finite merit. Raises TimeUp.
        """
        merit, most = self.cells.merit(self.program), _MEMBERS * len(self.program.names)
        best = self.cells.u[np.argsort(merit, kind="stable")[: np.isfinite(merit).sum()]]
        if len(best) >= 5:  # SciPy makes no population of fewer
            members = {u.tobytes(): u for u in [*self.starts(most), *best]}
            package("scipy.optimize").differential_evolution(
                lambda x: self.look(x.T.clip(0.0, 1.0)),
                [(-_OUTSIDE, 1 + _OUTSIDE)] * len(self.program.names),
                init=np.array([*members.values()][:most]),
                maxiter=_GENERATIONS,
                tol=0.0,
                atol=KEPT,
                rng=self.samples,
                polish=False,
                vectorized=True,
                updating="deferred",
            )

    def starts(self, most: int) -> list[Vector]:
        """At most `most` places that none of their neighbours betters, the best first.

        They are distant from each other, and of finite merit.
        """
        different = np.unique(self.cells.u, axis=0, return_index=True)[1]
        cells = self.cells.of(np.sort(different))
        merit, (n, k) = cells.merit(self.program), cells.u.shape
        tree = package("scipy.spatial").KDTree(cells.u)
        near = tree.query(cells.u, min(n, 4 * k))[1].reshape(n, -1)  # with itself
        peaks = np.flatnonzero((merit <= merit[near].min(axis=1)) & np.isfinite(merit))
        chosen = list[Vector]()
        for u in cells.u[peaks[np.argsort(merit[peaks], kind="stable")]]:
            if len(chosen) < most and all(abs(u - one).max() > _APART for one in chosen):
                chosen.append(u)
        return chosen

    def _scale(self) -> None:
        """Set the units of the objective and the limits; unchanged without any motion.

        Raises InvalidInput as `run`.
        """
        objective, moving = self.cells.objective, ~np.isnan(self.cells.objective)
        finite = objective[np.isfinite(objective)]
        if not len(finite):
            check_time()
            if moving.any():
                allowed = "a function that is finite somewhere within the bounds"
                raise InvalidInput("metric", self.program.name, allowed)
            return
        slacks = abs(self.cells.slacks[moving])
        largest = np.where(np.isfinite(slacks), slacks, 0.0).max(axis=0).tolist()
        limits = zip(self.program.limits, largest, strict=False)
        units = tuple(abs(limit.value) or most or 1.0 for limit, most in limits)
        unit = float(np.subtract(*np.quantile(finite, (0.75, 0.25)))) or float(np.ptp(finite))
        # A power of two: a value over it, and times it again, is the same value.
        unit = 2.0 ** round(math.log2(unit or abs(finite[0]) or 1.0))
        self.program = replace(self.program, unit=unit, limit_units=units)

    def _flat(self) -> str:
        """Message that the metric is the same at all places with a motion; else empty.

        It is also empty if all are beyond a limit, and for a single motion unless its metric is 0.
        """
        cells = self.cells.of(~np.isnan(self.cells.objective))
        found, count = np.unique(cells.objective), len(cells)
        if len(found) != 1 or not np.isfinite(found[0]) or (count == 1 and found[0]):
            return ""
        if cells.beyond(self.program).min() > KEPT:
            return ""
        places = counted(count, "surveyed place")
        return f"{self.program.name} is {self.program.sign * found[0] + 0.0:g} at each of {places}"


_FRONTS, _CHILDREN = 24, 256  # generations of a front, and children of each
_STEPS = -4.0, -0.5  # powers of ten: steps of a child, of a difference of places or of the range
_DRAWN = 0.5  # share of the places, at random, whose front has children: it differs each time


class FrontSurvey(Survey):
    """Places with both metrics of a front.

    The second metric is the last limit, at most 0: its slack is the metric times -1.
    """

    def __init__(self, first: Program, cost: Function, cost_range: float, seed: int) -> None:
        """`cost_range` is the unit of the second metric."""
        self.count, self.draw = len(first.limits), np.random.default_rng(seed)
        limits = (*first.limits, Limit(named(cost), cost, 0.0, -1))
        units = (*first.limit_units, cost_range)
        super().__init__(replace(first, limits=limits, limit_units=units))

    def both(self, cells: Cells) -> Matrix:
        """Both metrics (n, 2) of places, to be minimised.

        Infinite beyond limits, and without a motion or finite values.
        """
        both = np.column_stack([cells.objective, -cells.slacks[:, self.count]])
        slacks = np.delete(cells.slacks / self.program.sizes, self.count, axis=1)
        beyond = (slacks < -KEPT).any(axis=1)
        both[beyond | ~np.isfinite(both).all(axis=1)] = np.inf
        return both

    def values(self, u: Matrix) -> Matrix:
        """Both metrics (n, 2) of other places, which are not kept."""
        return self.both(evaluate(self.program, u))

    def bounded(self, bound: float) -> Survey:
        """Survey of these places by the first metric, with the second one at most at a bound."""
        program = self.program
        *limits, cost = program.limits
        cost = cost._replace(value=bound, text=f"{cost.text} <= {bound:.6g}")
        found = Survey(replace(program, progress=silent, limits=(*limits, cost)))
        slacks = self.cells.slacks + bound * (np.arange(len(program.sizes)) == self.count)
        found.cells = replace(self.cells, slacks=slacks)
        return found

    def evolve(self) -> None:
        """Evaluate children of the best trade-offs, generation by generation; raises TimeUp."""
        for _ in range(_FRONTS if len(self.front) else 0):
            one, two = self._parents(), self._parents()
            step = 10 ** self.draw.uniform(*_STEPS, one.shape) * self.draw.normal(size=one.shape)
            alone = self.draw.uniform(size=one.shape) < 1 / one.shape[1]
            self.look(np.clip(one + step * np.where(alone, 1.0, two - one), 0.0, 1.0))

    @property
    def front(self) -> Matrix:
        """Both metrics (n, 2) of the places that no other betters, by increasing second metric."""
        both = self.both(self.cells)
        return both[trade_offs(both)]

    def _parents(self) -> Matrix:
        """Variables (256, k) of parents, drawn evenly along the front of half of the places."""
        both = self.both(self.cells)
        some = self.draw.permutation(np.flatnonzero(np.isfinite(both[:, 0])))
        some = some[: max(1, int(_DRAWN * len(some)))]
        front = some[trade_offs(both[some])]
        both = both[front]
        steps = abs(np.diff(both, axis=0)) / (np.ptp(both, axis=0) + (np.ptp(both, axis=0) == 0))
        length = np.append(0.0, np.cumsum(steps.sum(axis=1)))
        at = self.draw.uniform(0.0, length[-1], size=_CHILDREN)
        nearest = np.round(np.interp(at, length, np.arange(len(front)))).astype(int)
        return np.asarray(self.cells.u[front[nearest]])


def trade_offs(both: Matrix) -> NDArray[np.intp]:
    """Indices of places with finite metrics that no other betters, by increasing second metric.

    `both` are the metrics (n, 2), to be minimised. Of equal places one is taken.
    """
    order = np.lexsort(both.T)
    before = np.minimum.accumulate(np.append(np.inf, both[order, 0]))[:-1]
    return np.asarray(order[both[order, 0] < before])
