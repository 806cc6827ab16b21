"""Optimisation: a survey chooses starts, each is refined to an optimum, and the best is kept.

From each start SciPy's SLSQP follows the motion. The best places on its way to which the scenarios'
starts lead are polished to conditions of an optimum. If there are none, as at a basin boundary,
populations around it find the best place that the starts lead to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.cells import BEYOND, evaluate
from capsule_sym._design.evaluation import closed
from capsule_sym._design.local import LocalSearch
from capsule_sym._design.optimum import Optimum, OptimumStatus, failed_limits, optimum_of
from capsule_sym._design.polish import (
    BASIN,
    EFFORT,
    KINK,
    MARGIN,
    Rest,
    bifurcation_of,
    polish,
    with_limit,
)
from capsule_sym._design.program import STABLE, Place, Program
from capsule_sym._design.quantities import dimensionless
from capsule_sym._design.stationary import rough
from capsule_sym._design.survey import Survey, evolved
from capsule_sym._map.drift import mean_force
from capsule_sym._map.result import record
from capsule_sym._native import check_time, core_of

# Generations of a population, and searches by SLSQP; the last round is for optima without
# conditions.
_ROUNDS = ((0, 10), (80, 6), (150, 4))
_POLISHED = 2  # places of which conditions are solved
_PASSED = 8  # best places on the way of a search, or inside a boundary, that are tried as its end
_STEPS = (0.02, 0.02, 2e-4)  # of the bounds: reaches of populations, one after another
_FINE = 1e-11  # deviation of their merits, over the mean, at which they end
_MEMBERS, _GENERATIONS = 6, 50  # of each, for each variable, and of it
_LAST = 4  # times the effort of other places: of the last one
_AROUND, _CLOSE = 32, 1e-6  # places around one, and their distance, of the bounds
_SAME = 1e-7  # units of the objective: between two runs to one motion
_BESIDE = 1e-8  # of the bounds: places around one on a border
_JUMP = 3.0  # times what the gradient explains: another motion
_INSET = (1e-8, 1e-7, 1e-6, 1e-5)  # of the bounds: from a basin boundary inwards
_WITHIN = 0.1  # of that: distance of neighbours on the same motion
_LOSS = 1e-4  # units of the objective: lost by that at most
_DRAGGED = 0.99  # of friction: a mean force that nearly drags the device


class Optimiser:
    """One optimisation, from its survey to its result; a surrounding watch limits its time."""

    def __init__(self, program: Program, effort: int = EFFORT) -> None:
        """`effort` is the number of orbits that may be solved for, for the conditions of one."""
        self.survey, self.effort = Survey(program), effort
        self.evaluations, self.followed, self.samples = 0, 0, 0
        self.best: Place | None = None
        """Best place that the starts lead to."""
        self.tried: list[Place] = []
        """Places of which conditions were to be solved."""
        self.rests: list[Rest] = []
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
            self.found = self.empty(OptimumStatus.FLAT, self.survey.flat)
            return
        places = list[Place]()
        for generations, starts in _ROUNDS:
            self.survey.evolve(generations)
            begin = map(self.place, self.survey.starts(starts))
            places += filter(None, map(self.descend, begin))
            places.sort(key=_rank)
            if generations and self.polish(places):
                break
        self.found = self.told(places)

    def polish(self, places: Sequence[Place]) -> bool:
        """Polish the best places; True if the best of all is an optimum whose conditions hold."""
        unsolved = list[Place]()
        for place in places[:_POLISHED]:
            known = any(place is one for one in self.tried)
            if known or place.beyond or place.worst > self.level - _SAME:
                continue
            self.tried.append(place)
            rest = self.solved(place)
            if rest is None:
                unsolved.append(place)
            else:
                self.rests.append(rest)
        if unsolved and unsolved[0].worst < self.level - _SAME:
            self.rests.append(self.bounded(unsolved[0]))
        best = min(self.rests, key=lambda rest: rest.found.place.worst, default=None)
        return best is not None and best.bifurcation not in (BASIN, KINK)

    def told(self, places: Sequence[Place]) -> Optimum:
        """Best optimum, or why there is none, by the best places."""
        if not places:
            return self.nowhere()
        if not self.rests:
            return self.infeasible(places[0])
        best = min(self.rests, key=lambda rest: (not rest.whole, rest.found.place.worst))
        beyond = min(self.rests, key=lambda rest: np.fmin(rest.limit, rest.found.place.worst))
        if beyond.limit < best.found.place.worst:  # what is best is elsewhere, and not reached
            best = replace(best, bifurcation=beyond.bifurcation, limit=beyond.limit)
        return self.optimum(best)

    @property
    def level(self) -> float:
        """Value to improve."""
        values = [np.fmin(rest.limit, rest.found.place.worst) for rest in self.rests]
        return float(min(values, default=np.inf))

    def descend(self, first: Place | None) -> Place | None:
        """Best place that the starts lead to on the way of a search from one."""
        self.followed += 1
        self.program.tell(f"search {self.followed}")
        if first is None:
            return None
        search = LocalSearch(self.program, first)
        places = search.run()
        self.evaluations += search.evaluations
        kept = next(iter(self.led(places[:_PASSED])), first)
        if self.best is None or kept.rank < self.best.rank:
            self.best = kept
        check_time()
        return kept

    def place(self, i: int) -> Place | None:
        """Place of the survey, with derivatives."""
        cells, u = self.survey.cells, self.survey.cells.u[i]
        if core_of(self.program.system.scene) is None:
            return self.program.begin(u)
        motions = [
            closed(dimensionless(system), state, int(number))
            for system, state, number in zip(
                self.program.systems_at(u), cells.states[i], cells.numbers[i], strict=True
            )
        ]
        if any(motion is None for motion in motions):
            return self.program.begin(u)
        return self.program.place(u, tuple(motion for motion in motions if motion is not None))

    def led(self, places: Sequence[Place], longer: int = 1, apart: float = 0.0) -> list[Place]:
        """Those of places to whose motions the starts lead, there or at most so far `apart`."""
        if self.program.among == STABLE or core_of(self.program.system.scene) is None:
            return [one for one in places if all(m.multiplier < 1 for m in one.motions)]
        draw = np.random.default_rng(0)
        u = [one.u + apart * draw.uniform(-1, 1, len(one.u)) for one in places]
        found = evaluate(self.program, np.clip(u, 0.0, 1.0), longer=longer)
        values = found.objectives / self.program.unit
        same = [
            bool(np.all(abs(own - one.objective[: len(own)]) < _SAME * (1 + abs(own))))
            for one, own in zip(places, values, strict=True)
        ]
        return [one for one, kept in zip(places, same, strict=True) if kept]

    def solved(self, place: Place, times: int = 1) -> Rest | None:
        """Optimum next to a place, if the starts lead to it; None if none is found.

        The effort is so many `times` the usual one.
        """
        check_time()
        if self.stable(place) and self.jumps(place):
            return None
        rest = polish(self.program, place, times * self.effort)
        if rest is None or not rest.whole:
            return None
        # Exactly on a border each period of a run may have a switch that the core cannot decide.
        apart, tries = (_BESIDE, _AROUND) if rest.held else (0.0, 1)
        return with_limit(rest) if self.led([rest.found.place] * tries, 2, apart) else None

    def stable(self, place: Place) -> bool:
        """True if no bifurcation of a motion is near, or a margin of stability is required."""
        moduli = [motion.multiplier for motion in place.motions]
        return self.program.margin is not None or max(moduli) <= 1 - MARGIN

    def bettered(self, place: Place) -> Place:
        """Best place that the starts lead to, next to a given one, by populations around it."""
        if core_of(self.program.system.scene) is None:
            return place
        for step in _STEPS:
            low, high = np.maximum(place.u - step, 0.0), np.minimum(place.u + step, 1.0)
            found = evolved(
                partial(self.merit, near=place),
                [*zip(low, high, strict=True)],
                _GENERATIONS,
                _FINE,
                x0=place.u,
                popsize=_MEMBERS,
                rng=0,
            )
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

    def bounded(self, place: Place, precise: bool = True) -> Rest:
        """Best place next to a given one that no conditions hold; the place if not `precise`."""
        if precise:
            place = self.bettered(place)
            if rest := self.solved(place, _LAST):
                return rest
        kind, motion = KINK, max(place.motions, key=lambda motion: motion.multiplier)
        if self.jumps(place):
            kind, place = BASIN, self.inset(place)
        elif not self.stable(place):
            kind = bifurcation_of(motion)
        found = rough(self.program, place)
        return Rest(self.program, found, whole=True, bifurcation=kind, limit=place.worst)

    def jumps(self, place: Place, close: float = _CLOSE) -> bool:
        """True if the starts lead elsewhere from places close around one."""
        merit = self.merit(self.around(place, close), place)
        slopes = self.program.by_u(np.vstack([place.objective_by, place.slacks_by]))
        steep = float(np.linalg.norm(slopes, axis=1).max())
        change = _JUMP * steep * close * np.sqrt(len(place.u)) + _SAME
        # A merit of BEYOND or more has the largest violation of a limit.
        left, beyond = merit < BEYOND, merit / BEYOND - 1
        return bool(np.any(np.where(left, merit > place.worst + change, beyond > change)))

    def around(self, place: Place, far: float) -> Matrix:
        """Variables of random places around one."""
        draw = np.random.default_rng(0).uniform(-1, 1, (_AROUND, len(place.u)))
        return np.clip(place.u + far * draw, 0.0, 1.0)

    def inset(self, place: Place) -> Place:
        """Place a little inside a basin boundary, with all of its neighbours on the same motion."""
        for far in _INSET:
            u = self.around(place, far)
            for i in np.argsort(self.merit(u, place))[:_PASSED]:
                back = self.beside(place, u[i])
                if back is None or back.beyond or back.worst > place.worst + _LOSS:
                    continue
                if not self.jumps(back, _WITHIN * far) and self.led([back], 8):
                    return back
        return place

    def optimum(self, rest: Rest) -> Optimum:
        """Result of a place, with a hint if the mean force nearly drags the device there."""
        found = optimum_of(rest)
        force, bound, _ = mean_force(dimensionless(found.system))
        if found.status is OptimumStatus.OPTIMAL or abs(force) < _DRAGGED * bound:
            return found
        said = (
            f"the mean force of drive and load, {force:.9g}, nearly reaches friction, {bound:.9g}"
        )
        return replace(found, message=f"{found.message}; there {said}")

    def nowhere(self) -> Optimum:
        """Result if no start leads to a motion, or to one on which all limits are defined."""
        numbers = self.survey.cells.numbers
        if np.all(numbers < 0):
            return self.empty(OptimumStatus.TIME_LIMIT, "no place is known")
        if not np.any((numbers > 0).all(axis=1)):
            return self.empty(OptimumStatus.NO_MOTION, "no start leads to a periodic motion")
        message = (
            f"no place within the bounds was found to satisfy {' and '.join(self.program.texts)}"
        )
        return self.empty(OptimumStatus.INFEASIBLE, message)

    def infeasible(self, place: Place) -> Optimum:
        """Result if no place satisfies the constraints, with those that fail at the best place."""
        failed = failed_limits(self.program, place)
        message = f"no place within the bounds was found to satisfy {failed}"
        return replace(self.rough(place), status=OptimumStatus.INFEASIBLE, message=message)

    def unfinished(self) -> Optimum:
        """Result at the time limit: the best place, or the best one of the survey."""
        found, message = self.empty(), "time limit reached: this is the best place so far"
        if self.rests and (self.best is None or self.level <= self.best.worst):
            found = optimum_of(min(self.rests, key=lambda rest: rest.found.place.worst))
        elif self.best is not None:
            found = self.rough(self.best)
        elif (i := self.survey.best) is not None:
            system = self.program.system_at(self.survey.cells.u[i])
            over = {name: float(getattr(system, name)) for name in self.program.names}
            value = self.program.sign * float(self.survey.cells.worst[i])
            found = replace(found, system=system, over=over, value=value)
        else:
            message = "time limit reached, and no place was found"
        return replace(found, status=OptimumStatus.TIME_LIMIT, message=message)

    def empty(self, status: OptimumStatus = OptimumStatus.TIME_LIMIT, message: str = "") -> Optimum:
        """Result without a place."""
        program = self.program
        return Optimum(
            program.name, program.sign < 0, program.system, status=status, message=message
        )

    def rough(self, place: Place) -> Optimum:
        """Result of a place that is no optimum."""
        return optimum_of(Rest(self.program, rough(self.program, place)))


def _rank(place: Place) -> tuple[float, float]:
    return place.rank
