"""Optimisation: a survey chooses starts, each is searched, and the best is polished.

From each start SciPy's SLSQP follows the motion. The best places on its way to which the start
leads are polished to conditions of an optimum. If these are not solved, as at a basin boundary, a
population around the best place finds the best that the start leads to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import evaluate
from capsule_sym._design.optimum import Optimum, failed_limits, optimum_of
from capsule_sym._design.polish import (
    BASIN,
    KINK,
    MARGIN,
    PIECES,
    bifurcation_of,
    polish,
    with_limit,
)
from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._design.stationary import SOLVED, LocalOptimum, balanced, local_search
from capsule_sym._design.survey import MEMBERS, Survey, evolved
from capsule_sym._errors import Status
from capsule_sym._map.result import record
from capsule_sym._native import check_time

_GENERATIONS = 60  # of a population, at most: its places are then close to each other
_STARTS = 12  # of searches: two for each of six variables
_TRIED = 8  # best places on the way of a search that may be its end: bounds the runs after one
_POLISHED = 2  # places of which conditions are solved: bounds their time
# Shares of each range: reaches of the populations around a place. The best of the first is often at
# its edge, so that the second has the same reach; the third is for the last digits.
_REACHES = 0.02, 0.02, 2e-4
_UNSATISFIED = "no place within the bounds was found to satisfy "


class Optimisation:
    """One optimisation, from its survey to its result; a surrounding watch limits its time."""

    def __init__(self, survey: Survey) -> None:
        self.survey = survey
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.best: Place | None = None
        """Best place that the start leads to."""
        self.optima: list[LocalOptimum] = []
        self.found: Optimum | None = None

    @property
    def program(self) -> Program:
        """Problem, with the units that the survey has set."""
        return self.survey.program

    @property
    def result(self) -> Optimum:
        """Result; after the time limit the best so far."""
        found = self.found or self.unfinished()
        if self.survey.unknown:
            unknown = f"; {self.survey.unknown} are unknown: allow more time, or smaller bounds"
            found = replace(found, message=found.message + unknown)
        return replace(found, statistics=record(self, "evaluations followed samples"))

    @property
    def optimum(self) -> LocalOptimum:
        """Best optimum."""
        return min(self.optima, key=lambda one: one.place.objective)

    def run(self, samples: int, seed: int, starts: int = _STARTS) -> None:
        """Survey, search from the best places, and polish the best of what the start leads to."""
        self.samples = samples
        self.survey.run(samples, seed)
        check_time()
        if self.survey.flat:
            self.found = self.ended(Status.FLAT, self.survey.flat)
            return
        self.survey.evolve(_GENERATIONS)
        places = self.descents(starts)
        self.polish(places)
        self.found = self.conclude(places)

    def descents(self, starts: int) -> list[Place]:
        """Best places of searches from so many starts, the best first."""
        begin = map(self.program.begin, self.survey.starts(starts))
        return sorted(filter(None, map(self.descend, begin)), key=lambda place: place.rank)

    def descend(self, first: Place | None) -> Place | None:
        """Best place that the start leads to on the way of a search from one."""
        self.followed += 1
        self.program.tell(f"search {self.followed}")
        if first is None:
            return None
        best = next(filter(self.start_reaches, self.search(first)[:_TRIED]), first)
        if self.best is None or best.rank < self.best.rank:
            self.best = best
        check_time()
        return best

    def search(self, first: Place) -> list[Place]:
        """Places on the way of a search that follows the motion, the best first."""
        places = local_search(self.program, first)
        self.evaluations += len(places)
        return places

    def polish(self, places: Sequence[Place]) -> None:
        """Polish the best places; around the best without conditions a population evolves."""
        unsolved = list[Place]()
        for place in places[:_POLISHED]:
            if place.beyond or place.objective > self.level - KEPT:
                continue
            if found := self.solved(place):
                self.optima.append(found)
            else:
                unsolved.append(place)
        if unsolved and unsolved[0].objective < self.level - KEPT:
            self.optima.append(self.bounded(self.improved(unsolved[0])))

    def solved(self, place: Place, pieces: int = PIECES) -> LocalOptimum | None:
        """Optimum next to a place, if the start leads to it; None if none is found."""
        check_time()
        found = polish(self.program, place, pieces)
        if found and found.kkt_satisfied and self.start_reaches(found.place):
            return with_limit(found)
        return None

    @property
    def level(self) -> float:
        """Value to improve."""
        values = [np.fmin(one.limit, one.place.objective) for one in self.optima]
        return float(min(values, default=np.inf))

    def start_reaches(self, place: Place) -> bool:
        """True if the start leads to the motion of a place."""
        found = self.program.begin(place.u)
        return found is not None and bool(np.isclose(place.objective, found.objective, KEPT, KEPT))

    def improved(self, place: Place) -> Place:
        """Best place that the start leads to, next to a given one, by populations around it."""
        for reach in _REACHES:
            low, high = np.maximum(place.u - reach, 0.0), np.minimum(place.u + reach, 1.0)
            bounds = [*zip(low, high, strict=True)]
            how = {"x0": place.u, "popsize": MEMBERS, "rng": 0, "atol": SOLVED}
            better = self.program.begin(evolved(self.merit, bounds, _GENERATIONS, **how))
            place = better if better is not None and better.rank < place.rank else place
        return place

    def merit(self, u: Matrix) -> Vector:
        """Merit of places."""
        check_time()
        self.evaluations += len(u)
        return evaluate(self.program, u).merit(self.program)

    def bounded(self, place: Place) -> LocalOptimum:
        """Place that no conditions hold, and what bounds it."""
        kind = KINK
        if self.search(place)[0].rank < (place.beyond, place.objective - KEPT):
            kind = BASIN  # the motion is better beyond
        elif self.program.margin is None and place.motion.multiplier > 1 - MARGIN:
            kind = bifurcation_of(place.motion)
        found = balanced(self.program, place)
        return replace(found, kkt_satisfied=True, bifurcation=kind, limit=place.objective)

    def conclude(self, places: Sequence[Place]) -> Optimum:
        """Best optimum, or why there is none, by the best places."""
        program, numbers = self.program, self.survey.cells.numbers
        if self.optima:
            return optimum_of(self.optimum)
        if places:
            message = _UNSATISFIED + failed_limits(program, places[0])
            return self.ended(Status.INFEASIBLE, message, places[0])
        if (numbers < 0).all():
            return self.ended(Status.TIME_LIMIT, "no place is known")
        if not np.any(numbers > 0):
            return self.ended(Status.NO_MOTION, "the start leads to no periodic motion")
        return self.ended(Status.INFEASIBLE, _UNSATISFIED + " and ".join(program.texts))

    def unfinished(self) -> Optimum:
        """Result at the time limit: the best place that was found."""
        cells, place = self.survey.cells, self.best
        merit = cells.merit(self.program)
        if place is None and np.isfinite(merit).any():
            place = self.program.begin(cells.u[merit.argmin()])
        if place is None:
            return self.ended(Status.TIME_LIMIT, "time limit reached, and no place was found")
        message = "time limit reached: this is the best place so far"
        return self.ended(Status.TIME_LIMIT, message, place)

    def ended(self, status: Status, message: str, place: Place | None = None) -> Optimum:
        """Result that is no optimum, with a place if there is one."""
        program = self.program
        found = Optimum(program.name, program.sign < 0, program.system)
        if place is not None:
            found = optimum_of(replace(balanced(program, place), kkt_satisfied=False))
        return replace(found, status=status, message=message)
