"""Optimisation: a survey, a population, searches from the best places, and a polish of the best.

The survey looks at places all over the bounds; a population evolves from its best places. Searches
begin at places that no neighbour betters. SciPy's SLSQP follows the motion of each by continuation,
also where the start state no longer settles on it. Of the best places it passes the first is kept
on whose motion the start state settles. If not two of several end at the best, there is a
second round of other places, another population, and searches.

The best two of these are polished to the conditions of an optimum, over the itineraries that meet
there. The second is polished only if neither the first's value nor its limit at a loss of stability
is as good. If a place is left that is better than all optima, a further search from it gives a
result without solved conditions. Where that search finds better motions on which the start state
does not settle, a bisection looks for a better place before the basin boundary.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from capsule_sym._native import check_time

# Of a round, at most: searches, and those of them that find nothing better. Of 152 random problems
# the first was the best of eight in 144. Beside a basin boundary most find nothing.
_SEARCHES, _FAILED = 8, 2
_TRIED = 8  # best places of a search that are checked by a run from the start state
_POLISHED = 2  # places polished: the second only if the first gives nothing as good
_MORE = "allow more time, or smaller bounds"
_UNSATISFIED = "no place within the bounds was found to satisfy "


class Optimisation:
    """One optimisation, from its survey to its result; a surrounding watch limits its time."""

    def __init__(self, survey: Survey) -> None:
        self.survey = survey
        self.followed = 0
        self.best: Place | None = None
        """Best place of the searches or from which they begin, on the start's own motion."""
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
        """Survey, evolve, search from the best places, and polish the best that searches pass.

        It sets `found`. Raises TimeUp after the time limit, and InvalidInput as `Survey.run`.
        """
        self.survey.run(samples, seed)  # in a share of the time; sets the units
        check_time()
        if self.survey.flat:
            self.found = self.ended(Status.FLAT, self.survey.flat)
            return
        self.survey.evolve()
        places = self.descents()
        if not _agreed(places):
            self.survey.cover(samples, seed, skipped=samples)
            self.survey.evolve()
            places = sorted([*places, *self.descents()], key=lambda place: place.rank)
        self.polish(places)
        self.found = self.conclude(places)

    def descents(self, searches: int = _SEARCHES) -> list[Place]:
        """Best place of each of at most so many searches, the best first.

        The second that finds no better place than its first is the last.
        """
        found, failed = list[Place](), 0
        for first in map(self.program.begin, self.survey.starts(searches)):
            if (best := self.descend(first)) is not None:
                found.append(best)
            failed += best is first
            if failed == _FAILED:
                break
        return sorted(found, key=lambda place: place.rank)

    def descend(self, first: Place | None) -> Place | None:
        """Best place of a search on whose motion the start state settles, of the best eight.

        Without one it is the first place. None if there is no first place.
        """
        self.followed += 1
        self.program.progress(f"search {self.followed}")
        if first is None:
            return None
        self.best = min(first, self.best or first, key=lambda place: place.rank)
        passed = local_search(self.program, first)[:_TRIED]
        best = next(filter(self.settles_there, passed), first)
        self.best = min(best, self.best, key=lambda place: place.rank)
        check_time()
        return best

    def polish(self, places: Sequence[Place]) -> None:
        """Add optima from those of the best two places that satisfy the limits and may be better.

        If the first of them without solved conditions is better than all optima, the best place of
        a search from it is added.
        """
        unsolved = list[Place]()
        for place in places[:_POLISHED]:
            if place.beyond or place.objective > self.least - KEPT:
                continue  # beyond a limit, or no better than an optimum so far or its limit
            if found := self.solved(place):
                self.optima.append(found)
            else:
                unsolved.append(place)
        if unsolved and unsolved[0].objective < self.least - KEPT:
            self.optima.append(self.unsolved(unsolved[0]))

    def solved(self, place: Place) -> LocalOptimum | None:
        """Optimum next to a place, on whose motion the start state settles; None if not found."""
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

    def conclude(self, places: Sequence[Place]) -> Optimum:
        """Result: the best optimum, or the reason why there is none.

        `places` are the best ones of the searches.
        """
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
        if np.any(self.survey.cells.merit(program) < BEYOND):
            message = "at no place to search from are the metric's derivatives finite"
            return self.ended(Status.NOT_CONVERGED, message)
        return self.ended(Status.INFEASIBLE, _UNSATISFIED + " and ".join(program.texts))

    def unfinished(self) -> Optimum:
        """Result at the time limit: the best optimum or other place that was found."""
        cells, place = self.survey.cells, self.best
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


def _agreed(places: Sequence[Place]) -> bool:
    """True if two searches have ended at the best place, or there was one search at most."""
    if len(places) < 2:
        return True
    return bool(np.all(np.subtract(places[1].rank, places[0].rank) <= KEPT))
