"""Optimisation: a survey, a population, searches from the best places, and a polish of the best.

The survey looks at places all over the bounds. A population evolves from places that no neighbour
betters. SciPy's SLSQP searches from at most eight such places. Its motion is continued from the
nearest known place; where it is lost, the motion on which a run from there settles takes its place.
Of the eight best places of a search the best is kept on whose motion the start state settles, else
the place where the search began. A round ends after two searches whose better places are all beyond
a basin boundary, as far as these eight tell. If there are several searches, and only one ends at
the best value, a second round follows, in half of the time left: other places, another population,
and searches.

The best two of the places kept are polished to the conditions of an optimum, over the itineraries
that meet there. The second is polished only if it is better than the first's optimum, and than the
limit of that at a loss of stability. A place gives no optimum if its conditions are not solved, or
if the start state settles elsewhere. If one is better than all optima and their limits, a further
search from it gives a result without solved conditions, which counts as an optimum at a border.
Where the start state settles neither on the best motion that this search finds nor on another
better one there, a bisection looks for a better place before the basin boundary.
"""

from __future__ import annotations

from bisect import insort
from dataclasses import replace

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.cells import BEYOND
from capsule_sym._design.optimum import Optimum, failed_limits, optimum_of
from capsule_sym._design.polish import (
    BASIN,
    KINK,
    MARGIN,
    bifurcation_of,
    polish,
    with_limit,
)
from capsule_sym._design.program import CLOSE, KEPT, Place, Program
from capsule_sym._design.stationary import LocalOptimum, balanced, local_search
from capsule_sym._design.survey import Survey
from capsule_sym._errors import Status, counted
from capsule_sym._map.result import record
from capsule_sym._native import Watch, check_time, present

# Of a round, at most: searches, and those whose better places are all beyond a basin boundary. Of
# 152 random problems the first search was the best of eight in 144.
_SEARCHES, _FAILED = 8, 2
_TRIED = 8  # best places of a search that are checked by a run from the start state
_POLISHED = 2  # places polished: the second only if the first gives nothing as good
_MORE = "allow more time, or smaller bounds"
_UNSATISFIED = "no place within the bounds was found to satisfy "


class Optimisation:
    """One optimisation, from its survey to its result; a surrounding watch limits its time."""

    def __init__(self, survey: Survey) -> None:
        self.survey = survey
        self.followed, self.failed = 0, 0
        self.kept: list[Place] = []
        """Places kept of the searches, the best first, on the start's own motion."""
        self.optima: list[LocalOptimum] = []
        self.found: Optimum | None = None

    @property
    def program(self) -> Program:
        """Problem, with the units that the survey has set."""
        return self.survey.program

    @property
    def result(self) -> Optimum:
        """Result; after the time limit the best of optima and searches, else of the survey."""
        found = self.found or self.unfinished()
        survey = self.survey
        if count := survey.unknown:
            unknown = f"; {count:,} of {counted(survey.samples, 'place')} are unknown"
            found = replace(found, message=f"{found.message}{unknown}: {_MORE}")
        return replace(found, statistics=record(self, "followed") | record(survey, "samples"))

    @property
    def optimum(self) -> LocalOptimum:
        """Best of `optima`, with solved conditions or without; raises ValueError without any."""
        return min(self.optima, key=lambda one: one.place.objective)

    def run(self, samples: int, seed: int) -> None:
        """Survey, evolve, search in one round or two, and polish the best two places kept.

        It sets `found`. Raises TimeUp after the time limit, and InvalidInput as `Survey.run`.
        """
        self.survey.run(samples, seed)  # in a share of the time; sets the units
        check_time()
        if self.survey.flat:
            self.found = self.ended(Status.FLAT, self.survey.flat)
            return
        self.survey.evolve()
        self.descend_all()
        if not self.agreed:
            with Watch(present().left / 2):  # the rest is for the polish
                self.survey.cover(samples, seed, skipped=samples)
                check_time()
                self.survey.evolve()
                self.descend_all()
            check_time()
        self.polish()
        self.found = self.conclude()

    def descend_all(self, searches: int = _SEARCHES) -> None:
        """Search from at most so many places of the survey.

        The searches end after two that have better places, but the start settles on none of them.
        """
        most = self.failed + _FAILED
        for first in filter(None, map(self.program.begin, self.survey.starts(searches))):
            self.descend(first)
            if self.failed == most:
                break

    @property
    def agreed(self) -> bool:
        """True if two searches ended at the best value, or fewer than two had a place to begin."""
        if len(self.kept) < 2:
            return True
        return np.allclose(self.kept[0].rank, self.kept[1].rank, 0.0, KEPT)

    def descend(self, first: Place) -> None:
        """Keep the best of a search's eight best places on whose motion the start state settles.

        Without one it is the first place.
        """
        self.followed += 1
        self.program.progress(f"search {self.followed}")
        best = first
        try:
            passed = local_search(self.program, first)[:_TRIED]
            best = next(filter(self.settles_there, passed), first)
            self.failed += best is first and passed[0] is not first
        finally:  # also if the time is over
            insort(self.kept, best, key=lambda place: place.rank)
        check_time()

    def polish(self) -> None:
        """Add optima from those of the best two places kept that satisfy the limits.

        The second has to be better than the first's optimum, and than its limit at a loss of
        stability. If the first of them that gives none is better than all optima, the best place
        that a search from it finds is added.
        """
        unsolved = list[Place]()
        for place in self.kept[:_POLISHED]:
            if place.beyond or place.objective > self.least - KEPT:
                continue  # beyond a limit, or no better than an optimum so far or its limit
            if found := self.solved(place):
                self.optima.append(found)
            else:
                unsolved.append(place)
        if unsolved and unsolved[0].objective < self.least - KEPT:
            self.optima.append(self.unsolved(unsolved[0]))

    def solved(self, place: Place) -> LocalOptimum | None:
        """Optimum next to a place; None if it is not solved, or the start settles elsewhere."""
        check_time()
        found = polish(self.program, place)
        if found and found.kkt_satisfied and self.settles_there(found.place):
            return with_limit(found)
        return None

    @property
    def least(self) -> float:
        """Least objective of the optima so far, or limit of it; infinite without any."""
        values = [np.fmin(one.limit, one.place.objective) for one in self.optima]
        return float(min(values, default=np.inf))

    def settles_there(self, place: Place) -> bool:
        """True if the start state settles on a motion of the same objective and limits there."""
        found, limits = self.program.begin(place.u), slice(len(self.program.limits))
        if found is None or abs(place.objective - found.objective) > KEPT:
            return False
        return np.allclose(place.slacks[limits], found.slacks[limits], KEPT, KEPT)

    def unsolved(self, place: Place) -> LocalOptimum:
        """Best place of a search from one, taken without solved conditions, and what bounds it.

        It is a basin boundary if the search finds better motions, and the start state settles
        neither on the best of them nor on another one there that is better than the place. If it
        settles on the best, or none is better, it is the bifurcation of a motion with a multiplier
        above 1 - MARGIN, if no margin is given. Else it is a kink.
        """
        level, kind = (place.beyond, place.objective - KEPT), KINK
        passed = local_search(self.program, place)[:_TRIED]
        check_time()
        better = [one for one in passed if one.rank < level]
        place = next(filter(self.settles_there, better), place)
        if better and place is not better[0]:
            there = self.program.begin(better[0].u)
            if there is not None and there.rank < place.rank:
                place = there  # on another motion, which is better too
            else:
                kind, place = BASIN, self.inset(place, better[0].u)
        elif self.program.margin is None and place.motion.multiplier > 1 - MARGIN:
            kind = bifurcation_of(place.motion) or kind
        found = balanced(self.program, place)
        return replace(found, kkt_satisfied=True, bifurcation=kind, limit=place.objective)

    def inset(self, place: Place, beyond: Vector) -> Place:
        """Last place before a basin boundary on the way to variables beyond it, by bisection.

        It is the given place if that is better.
        """
        last = place
        while abs(beyond - last.u).max() > CLOSE:
            middle = (last.u + beyond) / 2
            found = self.program.beside(last, middle)
            if found is not None and self.settles_there(found):
                last = found
            else:
                beyond = middle
        return min(place, last, key=lambda one: one.rank)

    def conclude(self) -> Optimum:
        """Result: the best optimum, or the reason why there is none."""
        program, numbers = self.program, self.survey.cells.numbers
        if self.optima:
            return optimum_of(self.optimum)
        if self.kept:
            message = _UNSATISFIED + failed_limits(program, self.kept[0])
            return self.ended(Status.INFEASIBLE, message, self.kept[0])
        if (numbers < 0).all():
            return self.ended(Status.TIME_LIMIT, "no place is known")
        if not np.any(numbers > 0):
            return self.ended(Status.NO_MOTION, "the start leads to no periodic motion")
        if np.any(self.survey.cells.merit(program) < BEYOND):
            message = "at no place to search from are the metric's derivatives finite"
            return self.ended(Status.NOT_CONVERGED, message)
        return self.ended(Status.INFEASIBLE, _UNSATISFIED + " and ".join(program.texts))

    def unfinished(self) -> Optimum:
        """Result at the time limit: the best optimum or other place that was found."""
        cells, place = self.survey.cells, next(iter(self.kept), None)
        if place and self.optima and self.optimum.place.objective <= place.objective + KEPT:
            place = self.optimum.place
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
