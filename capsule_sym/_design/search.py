"""Optimisation: a survey chooses starts, each is searched, and the best is polished.

From each start SciPy's SLSQP follows the motion. The best places on its way to which the scenarios'
starts lead are polished to conditions of an optimum. If there are none, as at a basin boundary, a
population around the best place finds the best that the starts lead to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import BEYOND, evaluate
from capsule_sym._design.local import LocalSearch
from capsule_sym._design.optimum import Optimum, failed_limits, optimum_of
from capsule_sym._design.polish import BASIN, KINK, MARGIN, LocalOptimum, bifurcation_of, polish
from capsule_sym._design.program import CLOSE, KEPT, STABLE, Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._design.stationary import balanced
from capsule_sym._design.survey import Survey, evolved
from capsule_sym._errors import Status
from capsule_sym._map.drift import mean_force
from capsule_sym._map.result import record
from capsule_sym._native import check_time, core_of

# Generations of the population, and searches after them: with the second round alone, of 8, one of
# 12 problems with six variables or fewer was missed.
_ROUNDS = (0, 10), (80, 6)
_TRIED = 8  # best places on the way of a search that may be its end: bounds the runs after one
_POLISHED = 2  # places of which conditions are solved: bounds their time
# Shares of each range: reaches of the populations around a place. The best of the first is often at
# its edge, so that the second has the same reach; the third is for the last digits.
_REACHES = 0.02, 0.02, 2e-4
_NEIGHBOURS = 32  # places around one: five for each of six variables
_INSETS = 1e-8, 1e-7, 1e-6, 1e-5  # shares of each range: from a basin boundary, the nearest first
_LOSS = 1e-4  # units of the objective: by going inwards, less than a design needs
_JUMP = 3.0  # times the change that the gradient explains: more is another motion, not a kink
_UNSATISFIED = "no place within the bounds was found to satisfy "
_DRAGGED = 0.99  # share of friction: a mean force that nearly drags the device


class Optimisation:
    """One optimisation, from its survey to its result; a surrounding watch limits its time."""

    def __init__(self, program: Program) -> None:
        self.survey = Survey(program)
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.best: Place | None = None
        """Best place that the starts lead to."""
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

    def run(self, samples: int, seed: int) -> None:
        """Survey, search from the best places, and polish the best of what the starts lead to."""
        self.samples = samples
        self.survey.run(samples, seed)
        check_time()
        if self.survey.flat:
            self.found = self.empty(Status.FLAT, self.survey.flat)
            return
        places = list[Place]()
        for generations, starts in _ROUNDS:
            self.survey.evolve(generations)
            begin = map(self.place, self.survey.starts(starts))
            places += filter(None, map(self.descend, begin))
        places.sort(key=lambda place: place.rank)
        self.polish(places)
        self.found = self.conclude(places)

    def descend(self, first: Place | None) -> Place | None:
        """Best place that the starts lead to on the way of a search from one."""
        self.followed += 1
        self.program.tell(f"search {self.followed}")
        if first is None:
            return None
        search = LocalSearch(self.program, first)
        places = search.run()
        self.evaluations += search.evaluations
        reached = (one for one in places[:_TRIED] if self.starts_reach(one))
        best = next(reached, first)
        if self.best is None or best.rank < self.best.rank:
            self.best = best
        check_time()
        return best

    def polish(self, places: Sequence[Place]) -> None:
        """Polish the best places; of the first without conditions the neighbourhood is searched."""
        unsolved = list[Place]()
        for place in places[:_POLISHED]:
            if place.beyond or place.worst > self.level - KEPT:
                continue
            found = self.solved(place)
            if found is None:
                unsolved.append(place)
            else:
                self.optima.append(found)
        if unsolved and unsolved[0].worst < self.level - KEPT:
            self.optima.append(self.bounded(self.improved(unsolved[0])))

    @property
    def level(self) -> float:
        """Value to improve."""
        values = [np.fmin(one.limit, one.found.place.worst) for one in self.optima]
        return float(min(values, default=np.inf))

    def place(self, i: int) -> Place | None:
        """Place of the survey, with derivatives."""
        cells, u = self.survey.cells, self.survey.cells.u[i]
        states = cells.states[i] if np.isfinite(cells.states[i]).all() else None
        return self.program.place(u, self.program.settled(u, states))

    def starts_reach(
        self, place: Place, apart: float = 0.0, tries: int = 1, longer: int = 2
    ) -> bool:
        """True if the starts lead to the motions of a place, there or at most so far `apart`."""
        if self.program.among == STABLE or core_of(self.program.system.scene) is None:
            return all(motion.multiplier < 1 for motion in place.motions)
        u = self.around(place, apart)[:tries]
        values = evaluate(self.program, u, longer=longer).objectives / self.program.unit
        same = np.isclose(place.objective[: values.shape[1]], values, KEPT, KEPT)
        return bool(np.any(np.all(same, axis=1)))

    def solved(self, place: Place) -> LocalOptimum | None:
        """Optimum next to a place, if the starts lead to it; None if none is found."""
        check_time()
        if self.stable(place) and self.at_basin_boundary(place):
            return None
        found = polish(self.program, place)
        if found is None or not found.kkt_satisfied:
            return None
        # Exactly on a border each period of a run may have a switch that the core cannot decide.
        near = (CLOSE / 100, _NEIGHBOURS) if found.active_borders else (0.0, 1)
        return found.with_limit() if self.starts_reach(found.found.place, *near) else None

    def stable(self, place: Place) -> bool:
        """True if no bifurcation of a motion is near, or a margin of stability is required."""
        moduli = [motion.multiplier for motion in place.motions]
        return self.program.margin is not None or max(moduli) <= 1 - MARGIN

    def improved(self, place: Place) -> Place:
        """Best place that the starts lead to, next to a given one, by populations around it."""
        for reach in _REACHES if core_of(self.program.system.scene) else ():
            low, high = np.maximum(place.u - reach, 0.0), np.minimum(place.u + reach, 1.0)
            merit = partial(self.merit, near=place)
            bounds = [*zip(low, high, strict=True)]
            found = evolved(merit, bounds, 50, 1e-11, x0=place.u, popsize=6, rng=0)
            better = self.beside(place, found.x)
            place = better if better is not None and better.rank < place.rank else place
        return place

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at other variables, on the known motions if all stable ones count."""
        if self.program.among == STABLE:
            return self.program.beside(near, u)
        return self.program.begin(u)

    def merit(self, u: Matrix, near: Place) -> Vector:
        """Merit of places, whose runs begin on a known motion if all stable ones count."""
        check_time()
        self.evaluations += len(u)
        states = None
        if self.program.among == STABLE:
            states = np.tile(near.motions[0].at_phase_zero, (len(u), 1))
        return evaluate(self.program, u, states, 2).merit(self.program)

    def bounded(self, place: Place) -> LocalOptimum:
        """Place that no conditions hold, and what bounds it."""
        kind, motion = KINK, max(place.motions, key=lambda motion: motion.multiplier)
        limit = place.worst
        if self.at_basin_boundary(place):
            kind, place = BASIN, self.inset(place)
        elif not self.stable(place):
            kind = bifurcation_of(motion)
        found, limit = balanced(self.program, place), min(limit, place.worst)
        return LocalOptimum(self.program, found, kkt_satisfied=True, bifurcation=kind, limit=limit)

    def at_basin_boundary(self, place: Place, close: float = CLOSE) -> bool:
        """True if the starts lead elsewhere from places close around one."""
        merit = self.merit(self.around(place, close), place)
        slopes = self.program.by_u(np.vstack([place.objective_by, place.slacks_by]))
        steep = float(np.linalg.norm(slopes, axis=1).max())
        change = _JUMP * steep * close * np.sqrt(len(place.u)) + KEPT
        # A merit of BEYOND or more has the largest violation of a limit.
        left, beyond = merit < BEYOND, merit / BEYOND - 1
        return bool(np.any(np.where(left, merit > place.worst + change, beyond > change)))

    def around(self, place: Place, far: float) -> Matrix:
        """Variables of random places around one."""
        draw = np.random.default_rng(0).uniform(-1, 1, (_NEIGHBOURS, len(place.u)))
        return np.clip(place.u + far * draw, 0.0, 1.0)

    def inset(self, place: Place) -> Place:
        """Place a little inside a basin boundary, with all of its neighbours on the same motion."""
        for far in _INSETS:
            u = self.around(place, far)
            for i in np.argsort(self.merit(u, place))[:_TRIED]:
                back = self.beside(place, u[i])
                lost = back is None or back.beyond or back.worst > place.worst + _LOSS
                if back is None or lost or self.at_basin_boundary(back, far / 10):
                    continue
                if self.starts_reach(back, longer=8):
                    return back
        return place

    def conclude(self, places: Sequence[Place]) -> Optimum:
        """Best optimum, or why there is none, by the best places."""
        if not places:
            return self.nowhere()
        if not self.optima:
            return self.infeasible(places[0])
        best = min(self.optima, key=lambda one: (not one.kkt_satisfied, one.found.place.worst))
        beyond = min(self.optima, key=lambda one: np.fmin(one.limit, one.found.place.worst))
        if beyond.limit < best.found.place.worst:  # what is best is elsewhere, and not reached
            best = replace(best, bifurcation=beyond.bifurcation, limit=beyond.limit)
        found = optimum_of(best)
        force, bound, _ = mean_force(dimensionless(found.system))
        if found.status is Status.OPTIMAL or abs(force) < _DRAGGED * bound:
            return found
        drags = (
            f"the mean force of drive and load, {force:.9g}, nearly reaches friction, {bound:.9g}"
        )
        return replace(found, message=f"{found.message}; there {drags}")

    def nowhere(self) -> Optimum:
        """Result if no start leads to a motion, or to one on which all limits are defined."""
        numbers = self.survey.cells.numbers
        if (numbers < 0).any(axis=1).all():
            return self.empty(Status.TIME_LIMIT, "no place is known")
        if not np.any((numbers > 0).all(axis=1)):
            return self.empty(Status.NO_MOTION, "no start leads to a periodic motion")
        failed = " and ".join(self.program.texts)
        return self.empty(Status.INFEASIBLE, _UNSATISFIED + failed)

    def infeasible(self, place: Place) -> Optimum:
        """Result if no place satisfies the constraints, with those that fail at the best place."""
        message = _UNSATISFIED + failed_limits(self.program, place)
        return replace(self.rough(place), status=Status.INFEASIBLE, message=message)

    def unfinished(self) -> Optimum:
        """Result at the time limit: the best place, or the best one of the survey."""
        found, message = self.empty(), "time limit reached: this is the best place so far"
        if self.optima and (self.best is None or self.level <= self.best.worst):
            found = optimum_of(min(self.optima, key=lambda one: one.found.place.worst))
        elif self.best is not None:
            found = self.rough(self.best)
        elif (i := self.survey.best) is not None:
            system = self.program.system_at(self.survey.cells.u[i])
            over = {name: float(getattr(system, name)) for name in self.program.names}
            value = self.program.sign * float(self.survey.cells.worst[i])
            found = replace(found, system=system, over=over, value=value)
        else:
            message = "time limit reached, and no place was found"
        return replace(found, status=Status.TIME_LIMIT, message=message)

    def empty(self, status: Status = Status.TIME_LIMIT, message: str = "") -> Optimum:
        """Result without a place."""
        program = self.program
        return Optimum(
            program.name, program.sign < 0, program.system, status=status, message=message
        )

    def rough(self, place: Place) -> Optimum:
        """Result of a place that is no optimum."""
        return optimum_of(LocalOptimum(self.program, balanced(self.program, place)))
