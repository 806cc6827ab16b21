"""An optimisation: a survey chooses starts, each is followed to an optimum; the best is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.evaluation import agrees
from capsule_sym._design.local import Search
from capsule_sym._design.optimum import Optimum, OptimumStatus, failed_limits, optimum_of
from capsule_sym._design.polish import Rest, polish
from capsule_sym._design.program import Place, Program
from capsule_sym._design.stationary import rough
from capsule_sym._design.survey import Survey, Surveyor
from capsule_sym._map.dragging import mean_force
from capsule_sym._native import check_time
from capsule_sym._parameters import SceneDevice

_WORSE = 1e-5  # units of the objective: a search rests a little beyond its limits
_AGAIN = 4  # searches that go on from the best place, where others left it
_REACH = 0.1  # of the bounds, of the first of them
_BESIDE = 0.99  # of friction: a mean force that nearly drags the device
_SHORTER = 0.2  # the next one's, where it finds nothing better
Vector = NDArray[np.float64]


class Optimiser:
    """One optimisation, from its survey to its result; limits of time are those around it."""

    def __init__(self, program: Program) -> None:
        self.program, self.surveyor = program, Surveyor(program)
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.best: Place | None = None
        """The best place that was passed."""
        self.found: Optimum | None = None

    @property
    def result(self) -> Optimum:
        """What was found; the best until then where the time was over."""
        found = self.found or self.unfinished()
        counts = {
            "evaluations": self.evaluations,
            "followed": self.followed,
            "samples": self.samples,
        }
        return replace(found, statistics=counts)

    def run(self, survey: Survey) -> None:
        """Survey, follow the best starts, and find the best optimum."""
        self.samples = survey.samples
        starts = self.surveyor.starts(survey)
        self.program = self.surveyor.program
        runs = [places for u in starts if (places := self.go(self.program, u))]
        self.found = self.of(runs) if runs else self.nowhere(bool(starts))

    def of(self, runs: list[list[Place]]) -> Optimum:
        """The best optimum where searches came to rest."""
        if all(places[0].beyond for places in runs):
            runs = self.made_feasible(runs) or runs
            if runs[0][0].beyond:
                return self.infeasible(runs[0][0])
        runs = [places for places in runs if not places[0].beyond]
        runs.sort(key=lambda places: places[0].worst)
        for places in runs:
            found = self.ended(places)
            if found is not None and self.as_good(found, runs[0][0]):
                return found
        return self.from_best(runs[0])

    def from_best(self, places: list[Place]) -> Optimum:
        """What is found where searches left a place, the best, that is no optimum."""
        reach = _REACH
        for _ in range(_AGAIN):
            again = self.go(self.program, places[0].u, reach)
            if not again or again[0].rank >= places[0].rank:
                reach *= _SHORTER
                continue
            places = sorted([*again, *places], key=lambda place: place.rank)
            found = self.ended(places)
            if found is not None and self.as_good(found, places[0]):
                return found
        found = self.rough(places[0])
        message = found.message
        if not self.confirmed(places[0]):
            message = "the best motion that was found is not one that the starts lead to"
        return replace(found, message=message + _beside_dragging(found))

    def from_place(self, u: Vector) -> Optimum | None:
        """The optimum, or the best place, next to a place; None where none is within the limits."""
        inside = [place for place in self.go(self.program, u) if not place.beyond]
        self.found = self.ended(inside) if inside else None
        if self.found is None:
            known = next((place for place in inside if self.confirmed(place)), None)
            self.found = None if known is None else self.rough(known)
        return self.found and self.result

    def nowhere(self, moving: bool) -> Optimum:
        """No start leads to a motion, or to one at which limits have numbers."""
        if self.surveyor.flat:
            return self.told(OptimumStatus.FLAT, self.surveyor.flat)
        if not moving:
            return self.told(OptimumStatus.NO_MOTION, "no start leads to a periodic motion")
        texts = " and ".join(self.program.texts)
        message = f"no place within the bounds was found to satisfy {texts}"
        return self.told(OptimumStatus.INFEASIBLE, message)

    def infeasible(self, place: Place) -> Optimum:
        """No place satisfies the constraints: which fail where the worst fails least."""
        failed = failed_limits(self.program, place)
        message = f"no place within the bounds was found to satisfy {failed}"
        return replace(self.rough(place), status=OptimumStatus.INFEASIBLE, message=message)

    def unfinished(self) -> Optimum:
        """The best place, or cell of the survey, where the time was over."""
        found, rest = self.told(), ": this is the best place so far"
        if self.best is not None:
            found = self.rough(self.best)
        elif self.surveyor.best is not None:
            _, worst, u = self.surveyor.best
            system = self.program.system_at(u)
            over = {name: float(getattr(system, name)) for name in self.program.names}
            found = replace(found, system=system, over=over, value=self.program.sign * worst)
        else:
            rest = ", and no place was found"
        return replace(found, status=OptimumStatus.TIME_LIMIT, message=f"the time is over{rest}")

    def told(self, status: OptimumStatus = OptimumStatus.TIME_LIMIT, message: str = "") -> Optimum:
        """The result without a place."""
        program = self.program
        return Optimum(
            program.name, program.sign < 0, program.system, status=status, message=message
        )

    def rough(self, place: Place) -> Optimum:
        """The result of a place that is no optimum."""
        return optimum_of(Rest(self.program, rough(self.program, place)))

    def as_good(self, found: Optimum, best: Place) -> bool:
        """Whether an optimum is as good as the best place that is known to be feasible."""
        return self.program.sign * found.value / self.program.unit <= best.worst + _WORSE

    def go(self, program: Program, u: Vector, reach: float = 1.0) -> list[Place]:
        """The places that a search from u passed, the best first; none where there is no motion."""
        program.tell(f"search {self.followed + 1}")
        self.followed, self.evaluations = self.followed + 1, self.evaluations + 1
        first = program.begin(u)
        if first is None:
            return []
        search = Search(program, first, reach)
        places = search.run()
        self.evaluations += search.evaluations - 1
        if not program.elastic and (self.best is None or places[0].rank < self.best.rank):
            self.best = places[0]
        check_time()
        return places

    def made_feasible(self, runs: Sequence[list[Place]]) -> list[list[Place]]:
        """Runs from places at which the limits hold as far as they can."""
        elastic = replace(self.program, elastic=True)
        ends = [places for run in runs if (places := self.go(elastic, run[0].u))]
        ends.sort(key=lambda places: places[0].worst)
        again = [self.go(self.program, places[0].u) for places in ends[:2]]
        return sorted((places for places in again if places), key=lambda places: places[0].beyond)

    def ended(self, places: Sequence[Place]) -> Optimum | None:
        """The optimum where a search came to rest, if it satisfies all conditions."""
        rest = polish(self.program, places[0])
        if rest is not None and rest.whole and self.confirmed(rest.found.place):
            return optimum_of(rest)
        return None

    def confirmed(self, place: Place) -> bool:
        """Whether the starts do lead to these motions."""
        settled = self.program.settled(place.u)
        return settled is not None and all(map(agrees, place.motions, settled))


def _beside_dragging(found: Optimum) -> str:
    """That the mean force at a result nearly drags the device, in words; else nothing."""
    system = found.system
    own = system.dimensionless() if isinstance(system, SceneDevice) else system
    force, bound, _ = mean_force(own)
    if abs(force) < _BESIDE * bound:
        return ""
    said = f"the mean force of drive and load, {force:.9g}, nearly reaches friction, {bound:.9g}"
    return f"; there {said}"
