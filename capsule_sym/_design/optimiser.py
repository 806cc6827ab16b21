"""Optimisation: a survey chooses starts, each is refined to an optimum, and the best is kept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._design.led import (
    FINEST,
    LAST,
    LONGER,
    ends_uphill,
    jumps_beside,
    led_beside,
    led_to,
    refined,
    scattered,
    stepped_back,
    worst_at,
)
from capsule_sym._design.local import Search
from capsule_sym._design.optimum import Optimum, OptimumStatus, failed_limits, optimum_of
from capsule_sym._design.polish import (
    BASIN,
    KINK,
    MARGIN,
    Rest,
    bifurcation_of,
    polish,
    with_limit,
)
from capsule_sym._design.program import Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._design.stationary import rough
from capsule_sym._design.survey import Candidate, Survey, Surveyor
from capsule_sym._map.drift import mean_force
from capsule_sym._map.result import record
from capsule_sym._native import check_time

_FIRST, _NEAR = 0.02, 0.01  # of the bounds: first steps of searches
_FINE = 1e-6  # of the bounds: the last steps, before conditions are solved
_BETWEEN = 3e-3  # of the bounds: first steps from a cell of many
_COARSE = 1e-4  # of the bounds: the last steps of searches that are not precise
_EFFORT = 200  # orbits that are solved for until a better place is looked for
_MOST, _LITTLE = 600, 100  # the same, at the end, and where many searches follow
_FOLLOWED = 3  # of the places found, of which conditions are solved
_BOUNDED = 2  # places where they cannot be solved, that are looked at to the end
_BETTER = 1e-8  # units of the objective
_CLEARLY = 1e-5  # the same, of a place next to one where no conditions could be solved
_RIDDLED = 0.02  # of neighbours on different motions
_SCATTERED = "near to it {:.0%} of neighbours lead elsewhere: better places may lie between"
_HOPEFUL = 0.1  # units of the objective that a search for a boundary may gain
_BESIDE = 0.99  # of friction: a mean force that nearly drags the device


class Optimiser:
    """One optimisation, from its survey to its result; a surrounding watch limits its time.

    If it is not to be `precise`, places at boundaries of basins have about eight digits, and it is
    not looked for better ones around the result: many searches of a front replace that.
    """

    def __init__(self, program: Program, precise: bool = True) -> None:
        self.program, self.surveyor, self.precise = program, Surveyor(program), precise
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.best: Place | None = None
        """The best place that was passed."""
        self.rests: list[Rest] = []
        self.open: list[Place] = []
        """Places that the starts lead to, without conditions that could be solved."""
        self.tried: list[tuple[Place, int]] = []
        """Places next to which no optimum was found that starts lead to, with the effort of it."""
        self.found: Optimum | None = None

    @property
    def result(self) -> Optimum:
        """Result; after the time limit the best so far."""
        found = self.found or self.unfinished()
        return replace(found, statistics=record(self, "evaluations followed samples"))

    def run(self, survey: Survey) -> None:
        """Survey, polish the best candidates, and find the best optimum."""
        self.samples = survey.samples
        most = survey.follow
        first = self.places(self.surveyor.candidates(survey))
        if self.surveyor.flat:
            self.found = self.told(OptimumStatus.FLAT, self.surveyor.flat)
            return
        begin = self.inside(first, most)
        near = [] if begin else self.made_feasible(first) or first
        further = map(self.places, self.surveyor.more(most))
        rounds = filter(None, (self.inside(places, most) for places in further))
        begin = begin or [place for place in near if not place.beyond] or next(rounds, [])
        if begin:
            self.found = self.of(begin, rounds)
        else:
            self.found = self.infeasible(near[0]) if near else self.nowhere()

    def places(self, candidates: Sequence[Candidate]) -> list[Place]:
        """Places of the survey's candidates, in its units."""
        self.program = self.surveyor.program
        every = (self.program.place(one.u, one.motions) for one in candidates)
        places = [place for place in every if place is not None]
        self.keep(*places)
        return places

    def keep(self, *places: Place) -> None:
        """Keep the best of places passed."""
        known = [] if self.best is None else [self.best]
        self.best = min([*known, *places], key=lambda place: place.rank, default=None)

    def inside(self, places: Sequence[Place], most: int) -> list[Place]:
        """Places within the limits; if there are none, at most so many cells of the last round."""
        if inside := [place for place in places if not place.beyond]:
            return inside
        # The objective may gain more beyond a limit than the penalty takes.
        cells = map(self.program.begin, self.surveyor.within(most))
        return [place for place in cells if place is not None and not place.beyond]

    def of(self, begin: Sequence[Place], rounds: Iterator[list[Place]]) -> Optimum:
        """The best optimum near to places, and to those of further rounds of the survey."""
        begin = sorted(begin, key=_worst)
        self.look(begin[0])
        if self.precise or self.open:
            self.search(begin)
        for more in rounds:
            self.search(more)
        for place in sorted(self.open, key=_worst)[:_BOUNDED]:
            if not self.rests or place.worst < self.level_at_rest - _BETTER:
                self.rests.append(self.bounded(place))
        best = self.best_rest
        bound = min(self.rests, key=lambda rest: np.fmin(rest.limit, rest.found.place.worst))
        if bound.limit < best.found.place.worst:  # what is best is elsewhere, and not reached
            best = replace(best, bifurcation=bound.bifurcation, limit=bound.limit)
        return self.optimum(best)

    @property
    def best_rest(self) -> Rest:
        """The best place at rest."""
        return min(self.rests, key=lambda rest: (not rest.whole, rest.found.place.worst))

    def search(self, begin: list[Place]) -> None:
        """Search near to places, and solve for the optimum next to the best that is found."""
        finest = _FINE if self.precise else _COARSE
        for place in sorted(begin, key=_worst)[:_FOLLOWED]:
            near = refined(self.program, place, _FIRST, finest)
            if near.worst < self.level - _BETTER:
                self.look(near)

    @property
    def level_at_rest(self) -> float:
        """Target that the best place at rest approaches."""
        values = [np.fmin(rest.limit, rest.found.place.worst) for rest in self.rests]
        return float(min(values, default=np.inf))

    @property
    def level(self) -> float:
        """Value to improve."""
        return min([self.level_at_rest, *map(_worst, self.open)])

    def look(self, place: Place) -> None:
        """Solve for the optimum next to a place; undecided if there is none."""
        check_time()
        self.followed += 1
        self.program.tell(f"search {self.followed}")
        self.keep(place)
        rest = self.solved(place)
        if rest is None:
            self.open.append(place)
        else:
            self.rests.append(rest)

    def optimum(self, rest: Rest) -> Optimum:
        """Result of a place, with a hint if needed."""
        found = optimum_of(rest)
        hint = "" if found.status is OptimumStatus.OPTIMAL else _beside_dragging(found)
        if self.precise and found.bifurcation in (BASIN, KINK):
            share = scattered(self.program, rest.found.place)
            hint += f"; {_SCATTERED.format(share)}" if share > _RIDDLED else ""
        return replace(found, message=found.message + hint)

    def solved(self, place: Place, effort: int = _EFFORT) -> Rest | None:
        """The optimum next to a place, if the starts lead to it; None if none is found."""
        if ends_uphill(self.program, place):
            return None
        if any(spent >= effort and _no_better(place, one) for one, spent in self.tried):
            return None
        rest = polish(self.program, place, effort)
        if rest is not None and rest.whole:
            led = led_beside if rest.held else led_to
            if led(self.program, rest.found.place):
                return with_limit(rest)
        self.tried.append((place, effort if rest is None else _MOST))
        return None

    def bounded(self, place: Place) -> Rest:
        """Best place next to a given one within a basin boundary, or borders that meet."""
        if not self.precise:
            return self.bounded_near(place)
        if ends_uphill(self.program, place, lost=True):
            return self.at_boundary(place)
        if rest := self.solved(place, _MOST):
            return rest
        program, kind, limit = self.program, KINK, place.worst
        motion = max(place.motions, key=lambda motion: motion.multiplier)
        if program.margin is None and motion.multiplier > 1 - MARGIN:
            program, kind = replace(program, margin=MARGIN), bifurcation_of(motion)
        elif jumps_beside(program, place):
            return self.at_boundary(place)
        size = LAST if kind == KINK else _NEAR
        place = refined(program, place, size, FINEST, LONGER)
        limit = place.worst if kind == KINK else limit
        return _bounded_at(program, place, kind, limit)

    def bounded_near(self, place: Place) -> Rest:
        """The same, at a boundary within about 1e-4 of the bounds."""
        program = self.program
        place = refined(program, place, _BETWEEN, _COARSE)
        if rest := self.solved(place):
            return rest
        motion, kind = max(place.motions, key=lambda motion: motion.multiplier), KINK
        if ends_uphill(program, place, lost=True) or jumps_beside(program, place):
            kind, back = BASIN, stepped_back(program, place)
            place = place if back.beyond else back
        elif motion.multiplier > 1 - MARGIN:
            kind = bifurcation_of(motion)
        return _bounded_at(program, place, kind, place.worst)

    def at_boundary(self, place: Place) -> Rest:
        """The best place of a basin boundary found next to one, a little inside."""
        place = stepped_back(self.program, refined(self.program, place, LAST, FINEST, LONGER))
        return _bounded_at(self.program, place, BASIN, place.worst)

    def from_place(self, u: Vector, level: float) -> Optimum | None:
        """Optimum next to a place; None if it is beyond the limits, or not below a level."""
        inside = [place for place in self.go(self.program, u) if not place.beyond]
        if not inside or inside[0].worst > level:
            return None
        rest = self.solved(inside[0], _LITTLE)
        if rest is None:
            led = self.led(inside, u)
            if led is None or led.worst > level + _HOPEFUL:
                return None
            rest = self.bounded_near(led)
        self.found = self.optimum(rest)
        return self.result

    def led(self, places: Sequence[Place], u: Vector) -> Place | None:
        """The first of places to which starts lead, as they do to the one at `u`."""
        worst = worst_at(self.program, np.array([place.u for place in places])).tolist()
        for one, place in zip(worst, places, strict=True):
            if abs(one - place.worst) < _BETTER or np.array_equal(place.u, u):
                return place
        return None

    def nowhere(self) -> Optimum:
        """Result if no start leads to a motion, or to one on which all limits are defined."""
        if self.surveyor.best is None:
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
        passed = self.best
        if self.rests and passed and (passed.beyond or passed.worst >= self.level_at_rest):
            found = optimum_of(self.best_rest)
        elif passed is not None:
            found = self.rough(passed)
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

    def go(self, program: Program, u: Vector) -> list[Place]:
        """Places passed by a search from u, the best first; empty without a motion."""
        program.tell(f"search {self.followed + 1}")
        self.followed, self.evaluations = self.followed + 1, self.evaluations + 1
        first = program.begin(u)
        if first is None:
            return []
        search = Search(replace(program, again=self.precise), first)
        places = search.run()
        self.evaluations += search.evaluations - 1
        if not program.elastic:
            self.keep(places[0])
        check_time()
        return places

    def made_feasible(self, begin: Sequence[Place]) -> list[Place]:
        """Places next to those at which the violation of the limits is least."""
        elastic = replace(self.program, elastic=True)
        ends = [places[0] for place in begin if (places := self.go(elastic, place.u))]
        ends.sort(key=_worst)
        again = [self.go(self.program, place.u) for place in ends[:2]]
        return sorted((places[0] for places in again if places), key=lambda place: place.beyond)


def _worst(place: Place) -> float:
    return place.worst


def _bounded_at(program: Program, place: Place, kind: str, limit: float) -> Rest:
    """Best place within a bound of this kind, without conditions that could be solved."""
    return Rest(program, rough(program, place), whole=True, bifurcation=kind, limit=limit)


def _no_better(place: Place, one: Place) -> bool:
    """True for a place near to one, not clearly better, and on the same itineraries."""
    pairs = zip(place.motions, one.motions, strict=True)
    return (
        place.worst > one.worst - _CLEARLY
        and bool(abs(place.u - one.u).max() < _NEAR)
        and all(a.itinerary == b.itinerary and a.period_number == b.period_number for a, b in pairs)
    )


def _beside_dragging(found: Optimum) -> str:
    """Hint that the mean force at a result nearly drags the device; else empty."""
    force, bound, _ = mean_force(dimensionless(found.system))
    if abs(force) < _BESIDE * bound:
        return ""
    said = f"the mean force of drive and load, {force:.9g}, nearly reaches friction, {bound:.9g}"
    return f"; there {said}"
