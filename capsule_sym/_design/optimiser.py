"""Optimisation: a survey chooses starts, each is refined to an optimum, and the best is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.evaluation import agrees
from capsule_sym._design.led import best_led, next_led
from capsule_sym._design.local import Search
from capsule_sym._design.optimum import Optimum, OptimumStatus, failed_limits, optimum_of
from capsule_sym._design.polish import BASIN, KINK, NOT_LED, Rest, polish
from capsule_sym._design.program import STABLE, Place, Program
from capsule_sym._design.stationary import rough
from capsule_sym._design.survey import Survey, Surveyor
from capsule_sym._map.dragging import mean_force
from capsule_sym._native import check_time
from capsule_sym._parameters import SceneDevice

_HOPEFUL = 0.05  # units of the objective that a polish may gain, unless one has gained more
_SAME = 1e-6  # of the bounds: distance of equal places
_REACH = 0.05  # of the bounds: first box of places on which the starts settle
_NEAR = 1e-4  # the same, if no border of these places is known
_BOXES = (1e-2, 1e-4, 1e-6)  # of the bounds, around a result
_BETTER = 1e-8  # units of the objective
_BESIDE = 0.99  # of friction: a mean force that nearly drags the device
Vector = NDArray[np.float64]


class Optimiser:
    """One optimisation, from its survey to its result; a surrounding watch limits its time."""

    def __init__(self, program: Program) -> None:
        self.program, self.surveyor = program, Surveyor(program)
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.best: Place | None = None
        """Best place so far."""
        self.edge: Place | None = None
        """Best place on which the starts settle, if it was searched."""
        self.found: Optimum | None = None

    @property
    def result(self) -> Optimum:
        """Result; after the time limit the best so far."""
        found = self.found or self.unfinished()
        counts = {
            "evaluations": self.evaluations,
            "followed": self.followed,
            "samples": self.samples,
        }
        return replace(found, statistics=counts)

    def run(self, survey: Survey) -> None:
        """Survey, polish the best candidates, and find the best optimum."""
        self.samples = survey.samples
        candidates = self.surveyor.candidates(survey)
        self.program, moving = self.surveyor.program, self.surveyor.best is not None
        places = [self.program.place(one.u, one.motions) for one in candidates]
        runs = [[place] for place in places if place is not None]
        self.best = min((place for (place,) in runs), key=lambda place: place.rank, default=None)
        self.found = self.of(runs) if runs else self.nowhere(moving)

    def of(self, runs: list[list[Place]]) -> Optimum:
        """Best optimum of the ends of searches."""
        if all(places[0].beyond for places in runs):
            runs = self.made_feasible(runs) or runs
            if runs[0][0].beyond:
                return self.infeasible(runs[0][0])
        runs = [places for places in runs if not places[0].beyond]
        rests, hope = list[Rest](), _HOPEFUL
        for places in sorted(runs, key=lambda places: places[0].worst):
            check_time()
            self.program.tell(f"search {len(rests) + 1}")
            if all(promising(places[0], rest, hope) for rest in rests):
                self.followed += 1
                rests.append(self.checked(self.polished(places)))
                hope = max(hope, 2 * (places[0].worst - rests[-1].found.place.worst))
        best = min(rests, key=lambda rest: (not rest.whole, rest.found.place.worst))
        bound = min(rests, key=lambda rest: np.fmin(rest.limit, rest.found.place.worst))
        if bound.limit < best.found.place.worst:  # the best is elsewhere, and not reached
            best = replace(best, bifurcation=bound.bifurcation, limit=bound.limit)
        return self.optimum(best)

    def optimum(self, rest: Rest) -> Optimum:
        """Result of a place, with a hint if needed."""
        found = optimum_of(rest)
        hint = "" if found.status is OptimumStatus.OPTIMAL else _beside_dragging(found)
        return replace(found, message=found.message + hint)

    def checked(self, rest: Rest) -> Rest:
        """Check by boxes of places around the optimum; returns a better one if found."""
        draw = np.random.default_rng(0)
        for size in _BOXES:
            place = rest.found.place
            better = next_led(self.program, place, size, draw)
            if better is not None and better.worst < np.fmin(rest.limit, place.worst) - _BETTER:
                other = self.polished([better, place])
                if other.found.place.worst < place.worst:
                    rest = other
        return rest

    def polished(self, places: Sequence[Place]) -> Rest:
        """Optimum next to the first of some places, over motions on which the starts settle."""
        rest = polish(self.program, places[0])
        if rest is not None and rest.whole and self.confirmed(rest.found.place):
            return rest
        known = places[0]
        if rest is not None:  # in terms of this program; one with its own margin has more slacks
            last = rest.found.place
            known = self.program.place(last.u, last.motions) or known
        if not self.confirmed(known) or known.beyond:
            led = (place for place in places if not place.beyond and self.confirmed(place))
            near = next(led, None)
            if near is None:
                return Rest(self.program, rough(self.program, places[0]), bifurcation=NOT_LED)
            known, bounded = near, BASIN
        else:
            bounded = KINK
        if self.edge is not None and self.edge.worst <= known.worst:
            place = self.edge  # of those from a better place
        else:
            place = best_led(self.program, known, _REACH if bounded == BASIN else _NEAR)
            self.edge = place if bounded == BASIN else None
        rest = polish(self.program, place)
        if rest is not None and rest.whole and self.confirmed(rest.found.place):
            return rest
        found = rough(self.program, place)
        return Rest(self.program, found, whole=True, bifurcation=bounded, limit=place.worst)

    def from_place(self, u: Vector) -> Optimum | None:
        """Optimum next to a place; None if none is within the limits."""
        inside = [place for place in self.go(self.program, u) if not place.beyond]
        self.found = self.optimum(self.polished(inside)) if inside else None
        return self.found and self.result

    def nowhere(self, moving: bool) -> Optimum:
        """Result if no start leads to a motion, or to one on which all limits are defined."""
        if self.surveyor.flat:
            return self.told(OptimumStatus.FLAT, self.surveyor.flat)
        if not moving:
            return self.told(OptimumStatus.NO_MOTION, "no start leads to a periodic motion")
        texts = " and ".join(self.program.texts)
        message = f"no place within the bounds was found to satisfy {texts}"
        return self.told(OptimumStatus.INFEASIBLE, message)

    def infeasible(self, place: Place) -> Optimum:
        """Result if no place satisfies the constraints, with those that fail at the best place."""
        failed = failed_limits(self.program, place)
        message = f"no place within the bounds was found to satisfy {failed}"
        return replace(self.rough(place), status=OptimumStatus.INFEASIBLE, message=message)

    def unfinished(self) -> Optimum:
        """Result at the time limit: the best place, or cell of the survey."""
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
        return replace(found, status=OptimumStatus.TIME_LIMIT, message=f"time limit reached{rest}")

    def told(self, status: OptimumStatus = OptimumStatus.TIME_LIMIT, message: str = "") -> Optimum:
        """Result without a place."""
        program = self.program
        return Optimum(
            program.name, program.sign < 0, program.system, status=status, message=message
        )

    def rough(self, place: Place) -> Optimum:
        """Result of a place that is no optimum."""
        return optimum_of(Rest(self.program, rough(self.program, place)))

    def go(self, program: Program, u: Vector, reach: float = 1.0) -> list[Place]:
        """Places passed by a search from u, the best first; empty without a motion."""
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
        """Runs from places at which the violation of the limits is least."""
        elastic = replace(self.program, elastic=True)
        ends = [places for run in runs if (places := self.go(elastic, run[0].u))]
        ends.sort(key=lambda places: places[0].worst)
        again = [self.go(self.program, places[0].u) for places in ends[:2]]
        return sorted((places for places in again if places), key=lambda places: places[0].beyond)

    def confirmed(self, place: Place) -> bool:
        """True if the starts settle on these motions, or if all stable motions are considered."""
        if self.program.among == STABLE:
            return all(motion.multiplier < 1 for motion in place.motions)
        settled = self.program.settled(place.u)
        return settled is not None and all(map(agrees, place.motions, settled))


def promising(place: Place, rest: Rest, hope: float) -> bool:
    """True if a place may lead to a better optimum than a known one, by a gain of `hope`."""
    found = rest.found.place
    return place.worst < found.worst + hope and abs(place.u - found.u).max() > _SAME


def _beside_dragging(found: Optimum) -> str:
    """Hint that the mean force at a result nearly drags the device; else empty."""
    system = found.system
    own = system.dimensionless() if isinstance(system, SceneDevice) else system
    force, bound, _ = mean_force(own)
    if abs(force) < _BESIDE * bound:
        return ""
    said = f"the mean force of drive and load, {force:.9g}, nearly reaches friction, {bound:.9g}"
    return f"; there {said}"
