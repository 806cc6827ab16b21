"""A survey of the bounds, which chooses where searches begin and in what units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design import evaluation
from capsule_sym._design.program import Program, Scenario
from capsule_sym._design.quantities import dimensionless, of, valued
from capsule_sym._errors import InvalidInput
from capsule_sym._native import check_time, present
from capsule_sym._parameters import SceneParameters

_CELLS = 4096  # in memory at once
_APART = 0.15  # of the bounds, between two places at which searches begin
Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


class Overview(NamedTuple):
    """About what the worst objective (n,) and the least slacks (n, limits) are.

    nan where there is no motion, infinite where a function has no number.
    """

    worst: Vector
    slacks: Matrix
    in_contact: bool
    """Whether the spring is compressed somewhere."""
    stiff: bool
    """Whether it has a stiffness somewhere."""

    def flat(self, program: Program) -> str:
        """Why no drift is possible where the metric is the same everywhere; else empty."""
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


class Survey(NamedTuple):
    """How many cells are surveyed, which ones, and at how many of them searches begin at most."""

    samples: int
    seed: int
    follow: int


def overview(program: Program, points: Matrix, scenarios: Sequence[Scenario]) -> Overview:
    """The objective and the slacks of some scenarios at points (n, k), in no units.

    A point for which there is no time has no motion.
    """
    worst = np.full(len(points), -np.inf)
    least = np.full((len(points), len(program.limits)), np.inf)
    contact, stiff, total = 0.0, False, len(points) * len(scenarios)
    for first, (k, one) in product(range(0, len(points), _CELLS), enumerate(scenarios)):
        if present().over:
            worst[first:] = np.nan
            break
        block = points[first : first + _CELLS]
        program.tell(f"survey, {first * len(scenarios) + k * len(block)} of {total} runs")
        own = [one.system(program.system_at(u)) for u in block]
        plain = [dimensionless(system) for system in own]
        stiff |= any(getattr(p, name) > 0 for p in plain for _, name in p.scene.facts.STOPS)
        about = evaluation.survey(plain, one.state)
        for i, (system, metrics) in enumerate(zip(own, about, strict=True), first):
            if not metrics:
                worst[i] = np.nan
                continue
            contact = max(contact, metrics["peak_contact"].value)
            found = of(metrics, system)
            value = valued("metric", program.function, found)[0] * program.sign
            worst[i] = np.maximum(worst[i], value if np.isfinite(value) else np.inf)
            for j, limit in enumerate(program.limits):
                slack = limit.slack(found)[0]
                least[i, j] = min(least[i, j], slack if np.isfinite(slack) else -np.inf)
    return Overview(worst, least, contact > 0, stiff)


class Surveyor:
    """A survey, and what it says of an optimisation: starts, units, and the best cell."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.flat = ""
        """Why no place is better than another."""
        self.best: tuple[float, float, Vector] | None = None
        """Of the best cell how far it is beyond limits, the metric in its own unit, variables."""

    def starts(self, survey: Survey) -> list[Vector]:
        """Where to begin: the feasible cells first, then the best, apart from each other.

        The program has its units then. Raises InvalidInput where the metric has no number.
        """
        points = spread(len(self.program.names), survey.samples, survey.seed)
        first, *others = self.program.scenarios
        found = overview(self.program, points, [first])
        if others and found.flat(self.program):
            found, others = overview(self.program, points, [first, *others]), []
        if reason := found.flat(self.program):
            self.flat = reason
            return []
        known = np.flatnonzero(np.isfinite(found.worst)).tolist()
        self.scale(found)
        chosen = self._chosen(points, found, known, others, survey.follow)
        if chosen and (place := self.program.begin(chosen[0])) is not None:
            # A few cells may vary less than the objective does.
            slope = float(abs(self.program.by_u(place.objective_by)).max())
            if not slope and np.ptp(found.worst[known]) == 0.0:
                told = f"{self.program.name} is {abs(found.worst[known[0]]):g}"
                self.flat = (
                    f"{told} at each of {len(known)} surveyed places, and nothing changes it"
                )
                return []
            self.program = replace(self.program, unit=self.program.unit * max(1.0, slope))
        return chosen

    def _chosen(
        self,
        points: Matrix,
        found: Overview,
        known: list[int],
        others: Sequence[Scenario],
        most: int,
    ) -> list[Vector]:
        """The best of the known points in all scenarios; `found` has the first one, or all."""
        sizes = self.program.sizes[: found.slacks.shape[1]]

        def ranked(
            worst: float, slacks: Vector, i: int, whole: bool
        ) -> tuple[float, float, int, bool]:
            """A cell as cells are taken; not `whole` if only its first scenario is run."""
            beyond = max(0.0, -float((slacks / sizes).min(initial=np.inf)))
            if whole and (self.best is None or (beyond, worst) < self.best[:2]):
                self.best = beyond, worst, points[i]
            return beyond, worst, i, whole

        cells = [ranked(float(found.worst[i]), found.slacks[i], i, not others) for i in known]
        heapify(cells)
        chosen: list[Vector] = []
        # No further scenario makes a cell better: only the best have to be run in all of them.
        while cells and len(chosen) < most:
            check_time()
            _, worst, i, whole = heappop(cells)
            if any(abs(points[i] - one).max() <= _APART for one in chosen):
                continue
            if whole:
                chosen.append(points[i])
                continue
            more = overview(self.program, points[i : i + 1], others)
            if np.isfinite(more.worst[0]):
                slacks = np.minimum(found.slacks[i], more.slacks[0])
                heappush(cells, ranked(max(worst, float(more.worst[0])), slacks, i, True))
        return chosen

    def scale(self, found: Overview) -> None:
        """Measure the objective and the limits in units of what was found."""
        moving = ~np.isnan(found.worst)
        finite = found.worst[np.isfinite(found.worst)]
        if not len(finite):
            check_time()
            if moving.any():
                allowed = "a function that has a finite number somewhere within the bounds"
                raise InvalidInput("metric", self.program.name, allowed)
            return
        upper, lower = np.quantile(finite, (0.75, 0.25))
        units = []
        for limit, slacks in zip(self.program.limits, abs(found.slacks[moving].T), strict=True):
            largest = slacks[np.isfinite(slacks)].max(initial=0.0)
            units.append(abs(limit.value) or float(largest) or 1.0)
        unit = float(upper - lower) or 1e-300
        self.program = replace(self.program, unit=unit, limit_units=tuple(units))


def spread(dimension: int, count: int, seed: int) -> Any:
    """Points (count, dimension) evenly in (0, 1), by steps whose ratios are badly approximable.

    The steps are powers of the root above 1 of x^(d + 1) = x + 1, of dimension d.
    """
    root = 2.0
    for _ in range(64):
        root = (1 + root) ** (1 / (dimension + 1))
    steps = root ** -np.arange(1.0, dimension + 1)
    begin = np.random.default_rng(seed).uniform(size=dimension) if seed else 0.5
    return (begin + np.outer(np.arange(1, count + 1), steps)) % 1.0
