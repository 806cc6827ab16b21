"""An optimisation: a survey chooses starts, each is followed to an optimum; the best is kept."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.evaluation import agrees
from capsule_sym._design.kinks import Kink, kink_beside
from capsule_sym._design.local import Search
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.results import infeasible, nowhere, optimum_of
from capsule_sym._design.stationary import SOLVED, Stationary, rough, stationary

_WORSE = 1e-5  # units of the objective: a search rests a little beyond its limits
_AGAIN = 4  # searches that go on from the best place, where others left it
_REACH = 0.1  # of the bounds, of the first of them
_SHORTER = 0.2  # the next one's, where it finds nothing better
_APART = 0.15  # of the bounds, between two of them
Vector = NDArray[np.float64]


class Survey(NamedTuple):
    """How many cells are surveyed, which ones, and at how many of them searches begin at most."""

    samples: int
    seed: int
    follow: int


class _Cell(NamedTuple):
    """A cell of a survey, in the order in which cells are taken."""

    beyond: float
    """How far it is beyond the limits."""
    worst: float
    """The objective, of the worst scenario; where not all are run, of the first."""
    number: int
    whole: bool
    """Whether all scenarios are run."""


class Optimiser:
    """One optimisation, from its survey to its result."""

    def __init__(self, program: Program, name: str) -> None:
        self.program, self.name = program, name
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.flat = ""  # why no place is better than another
        self.surveyed = Optimum(name, program.sign < 0, program.system)  # the best cell

    def run(self, survey: Survey) -> Optimum:
        """Survey, follow the best starts, and tell of the best optimum."""
        starts = self.starts(survey)
        runs = [places for u in starts if (places := self.go(self.program, u))]
        if not runs:
            return self.counted(self.nowhere(bool(starts)))
        if not any(_feasible(places[0]) for places in runs):
            runs = self.made_feasible(runs) or runs
            if not _feasible(runs[0][0]):
                return self.counted(infeasible(self.program, self.name, runs[0][0]))
        runs = [places for places in runs if _feasible(places[0])]
        runs.sort(key=lambda places: float(places[0].objective.max()))
        best = runs[0][0]
        for places in runs:
            found = self.ended(places)
            if found is not None and self.as_good(found, best):
                return found
        return self.from_best(runs[0])

    def from_best(self, places: list[Place]) -> Optimum:
        """What is found where searches left a place, the best, that is no optimum."""
        reach = _REACH
        for _ in range(_AGAIN):
            if self.program.watch.over:
                break
            again = self.go(self.program, places[0].u, reach)
            if not again or Search.rank(again[0]) >= Search.rank(places[0]):
                reach *= _SHORTER
                continue
            places = sorted([*again, *places], key=Search.rank)
            found = self.ended(places)
            if found is not None and self.as_good(found, places[0]):
                return found
        return self.result(rough(self.program, places[0]), None)

    def nowhere(self, moving: bool) -> Optimum:
        """That no start leads to a motion, or to none at which limits have numbers."""
        if self.flat:
            status, message = OptimumStatus.FLAT, self.flat
        elif not moving:
            status, message = OptimumStatus.NO_MOTION, "no start leads to a periodic motion"
        else:
            status, texts = OptimumStatus.INFEASIBLE, " and ".join(self.program.texts)
            message = f"no place within the bounds was found to satisfy {texts}"
        return nowhere(self.program, self.name, status, message)

    def as_good(self, found: Optimum, best: Place) -> bool:
        """Whether an optimum is as good as the best place that is known to be feasible."""
        value = self.program.sign * found.value / self.program.unit
        return value <= float(best.objective.max()) + _WORSE

    def from_place(self, u: Vector) -> Optimum | None:
        """The optimum that is next to a place; None where there is none."""
        places = self.go(self.program, u)
        return self.ended(places) if places and _feasible(places[0]) else None

    def starts(self, survey: Survey) -> list[Vector]:
        """Where to begin: of a survey the feasible first, then the best, apart from each other."""
        points = _spread(len(self.program.names), survey.samples, survey.seed)
        self.samples = survey.samples
        first, *others = self.program.scenarios
        found = self.program.survey(points, [first])
        if others and found.flat(self.name, self.program.system):
            found, others = self.program.survey(points, [first, *others]), []
        if reason := found.flat(self.name, self.program.system):
            self.flat = reason
            return []
        self.program = self.program.scaled(self.name, found.worst, found.slacks)
        sizes = self.program.sizes[: found.slacks.shape[1]]

        def ranked(worst: float, slacks: Vector, i: int, whole: bool) -> _Cell:
            return _Cell(max(0.0, -float((slacks / sizes).min(initial=np.inf))), worst, i, whole)

        known = np.flatnonzero(np.isfinite(found.worst)).tolist()
        cells = [ranked(float(found.worst[i]), found.slacks[i], i, not others) for i in known]
        heapify(cells)
        chosen: list[Vector] = []
        # No further scenario makes a cell better: only the best have to be run in all of them.
        while cells and len(chosen) < survey.follow and not self.program.watch.over:
            _, worst, i, whole = heappop(cells)
            if any(abs(points[i] - one).max() <= _APART for one in chosen):
                continue
            if not whole:
                more = self.program.survey(points[i : i + 1], others)
                if np.isfinite(more.worst[0]):
                    slacks = np.minimum(found.slacks[i], more.slacks[0])
                    heappush(cells, ranked(max(worst, float(more.worst[0])), slacks, i, True))
                continue
            if not chosen:
                self.keep(points[i], worst)
            chosen.append(points[i])
        whole_cells = [cell for cell in cells if cell.whole]
        if whole_cells and not chosen:  # for want of time
            self.keep(points[min(whole_cells).number], min(whole_cells).worst)
        if chosen and (place := Search(self.program).begin(chosen[0])) is not None:
            # A few cells may vary less than the objective does.
            slope = abs(Search(self.program).by_u(place.objective_by)).max()
            if not slope and np.ptp(found.worst[known]) == 0.0:
                told = f"{self.name} is {abs(found.worst[known[0]]):g}"
                self.flat = (
                    f"{told} at each of {len(known)} surveyed places, and nothing changes it"
                )
                return []
            self.program = replace(self.program, unit=self.program.unit * max(1.0, float(slope)))
        return chosen

    def keep(self, u: Vector, worst: float) -> None:
        """Keep a cell of the survey as its best."""
        system = self.program.system_at(u)
        over = {name: float(getattr(system, name)) for name in self.program.names}
        value = self.program.sign * worst
        self.surveyed = replace(self.surveyed, system=system, over=over, value=value)

    def go(self, program: Program, u: Vector, reach: float = 1.0) -> list[Place]:
        """The places that a search from u passed, the best first."""
        self.program.tell(f"search {self.followed + 1}")
        search = Search(program)
        places = search.go(u, reach)
        self.evaluations += search.evaluations
        self.followed += 1
        return places

    def made_feasible(self, runs: Sequence[list[Place]]) -> list[list[Place]]:
        """Runs from places at which the limits hold as far as they can."""
        elastic = replace(self.program, elastic=True)
        ends = [self.go(elastic, places[0].u) for places in runs]
        ends.sort(key=lambda places: float(places[0].objective.max()) if places else math.inf)
        again = [self.go(self.program, places[0].u) for places in ends[:2] if places]
        found = [places for places in again if places]
        return sorted(found, key=lambda places: -float(places[0].slacks.min(initial=0.0)))

    def ended(self, places: Sequence[Place]) -> Optimum | None:
        """The optimum where a search came to rest, if it satisfies all conditions."""
        found = stationary(self.program, places[0])
        if self.program.watch.over:
            return None
        if found is not None and self.holds(found, places[0]):
            return self.result(found, None)
        kink = kink_beside(self.program, places)
        if kink is not None and all(self.confirmed(side) for side in kink.sides):
            return self.result(kink.found, kink)
        return None

    def holds(self, found: Stationary, near: Place) -> bool:
        """Whether a stationary place is an admissible optimum, next to another place."""
        place = found.place
        return (
            found.residual < SOLVED
            and found.minimal
            and bool(np.all((place.u >= 0.0) & (place.u <= 1.0)))
            and _feasible(place)
            and float(place.objective.max()) <= float(near.objective.max()) + _WORSE
            and all(motion.admissible for motion in place.motions)
            and self.confirmed(place)
        )

    def confirmed(self, place: Place) -> bool:
        """Whether the starts do lead to these motions."""
        settled = self.program.settled(place.u)
        return settled is not None and all(map(agrees, place.motions, settled))

    def result(self, found: Stationary, kink: Kink | None) -> Optimum:
        """The result of a place."""
        return self.counted(optimum_of(self.program, self.name, found, kink))

    def counted(self, found: Optimum) -> Optimum:
        """A result with how much it took, and whether time was short."""
        if self.program.watch.over and not (found.success or self.flat):
            found = found if found.over else self.surveyed
            rest = ": this is the best place so far" if found.over else ", and no place was found"
            status, message = OptimumStatus.TIME_LIMIT, f"the time is over{rest}"
            found = replace(found, success=False, status=status, message=message)
        counts = {
            "evaluations": self.evaluations,
            "followed": self.followed,
            "samples": self.samples,
        }
        return replace(found, statistics=counts)


def _spread(dimension: int, count: int, seed: int) -> Any:
    """Points (count, dimension) evenly in (0, 1), by steps whose ratios are badly approximable.

    The steps are powers of the root above 1 of x^(d + 1) = x + 1, of dimension d.
    """
    root = 2.0
    for _ in range(64):
        root = (1 + root) ** (1 / (dimension + 1))
    steps = root ** -np.arange(1.0, dimension + 1)
    begin = np.random.default_rng(seed).uniform(size=dimension) if seed else 0.5
    return (begin + np.outer(np.arange(1, count + 1), steps)) % 1.0


def _feasible(place: Place) -> bool:
    return bool(place.slacks.min(initial=0.0) >= -KEPT)
