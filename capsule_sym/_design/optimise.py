"""The parameters at which a metric of the steady motion is greatest or least.

A survey of the bounds chooses starts; from each, SciPy's SLSQP follows the motion with exact
gradients, through changes of itinerary, at which metrics are continuous; Newton's method on the
optimum's conditions ends it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.borders import distances
from capsule_sym._design.evaluation import agrees
from capsule_sym._design.kinks import Kink, by_u, kink_beside
from capsule_sym._design.local import Search
from capsule_sym._design.optimum import Constraint, Optimum, OptimumStatus, Tightest
from capsule_sym._design.program import WHOLE, Place, Program, scenarios_of
from capsule_sym._design.quantities import (
    UNITS,
    Function,
    System,
    function_of,
    limits_of,
    names_of,
    of,
)
from capsule_sym._design.stationary import Stationary, rough, stationary
from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import POSITIVE, Parameters

_FOLLOWED = 3  # starts, at most, from which the optimum is sought
_APART = 0.15  # of the bounds, between two of them
_SOLVED = 1e-9
_KEPT = 1e-7  # how far beyond a limit counts as within
Vector = NDArray[np.float64]


def optimise(
    metric: str | Function,
    over: Mapping[str, Sequence[float]],
    base: System | None = None,
    *,
    maximise: bool = True,
    subject_to: Sequence[object] = (),
    margin: float | None = None,
    starts: Sequence[Sequence[float]] = ((0.0, 0.0, 0.0),),
    tolerances: Mapping[str, float] | None = None,
    samples: int = 256,
    seed: int = 0,
) -> Optimum:
    """The parameters at which a metric of the steady motion is greatest, or least.

    `metric` is the name of one, arithmetic of metrics and parameters such as "velocity/work", or a
    function of them: it gets them by name and gives a number, by arithmetic. The names are
    velocity, speed, progression, work, damper_loss, friction_loss, power, peak_force,
    peak_contact, speed_per_work and cost_of_transport; energies and progression are per excitation
    period, speed_per_work is `|progression|` over work. `over` has for each parameter that varies
    its bounds; `base` has the others. All is dimensionless, or in SI units where `base` is
    PhysicalParameters. `subject_to` has constraints: "peak_force <= 2", or (function, "<=", 2).
    With a `margin` no Floquet multiplier is above 1 less it.

    The motion is the one that each of `starts` leads to, states (x_r, v_r, v_c) at phase 0,
    dimensionless; with several, or with `tolerances` of parameters as shares, such as {"mu": 0.1},
    the worst motion counts: of all starts, with all parameters at the ends of their tolerances.
    `samples` is the size of the survey that chooses where to begin; `seed` makes it another.

    The optimum is a local one, the best of those that were found. Raises InvalidInput for names,
    bounds or texts that are not allowed.
    """
    program = program_of(metric, over, base, maximise, subject_to, margin, starts, tolerances or {})
    if isinstance(samples, bool) or not isinstance(samples, int) or samples < 1:
        raise InvalidInput("samples", samples, "a whole number >= 1")
    name = metric if isinstance(metric, str) else getattr(metric, "__name__", "function")
    return _Optimiser(program, name).run(samples, seed)


def program_of(
    metric: str | Function,
    over: Mapping[str, Sequence[float]],
    base: System | None,
    maximise: bool,
    subject_to: Sequence[object],
    margin: float | None,
    starts: Sequence[Sequence[float]],
    tolerances: Mapping[str, float],
) -> Program:
    """What is optimised, checked; raises InvalidInput."""
    system = Parameters() if base is None else base
    names, low, high = _bounds(over, system)
    if margin is not None and not 0 <= margin < 1:
        raise InvalidInput("margin", margin, "from 0 to below 1")
    if isinstance(subject_to, str):
        subject_to = (subject_to,)
    return Program(
        system=system,
        names=names,
        low=low,
        high=high,
        function=function_of("metric", metric, system),
        sign=-1 if maximise else 1,
        limits=limits_of(subject_to, system),
        margin=margin,
        scenarios=scenarios_of(starts, tolerances, system),
    )


def _bounds(
    over: Mapping[str, Sequence[float]], system: System
) -> tuple[tuple[str, ...], Any, Any]:
    """Names of the variables, and their bounds."""
    if not over:
        raise InvalidInput("over", dict(over), "one parameter or more, each with its bounds")
    for name, bounds in over.items():
        if name not in names_of(system):
            raise InvalidInput("over", name, f"of {', '.join(names_of(system))}")
        ends = tuple(bounds)
        allowed = "two finite numbers that ascend, from 0 on"
        if len(ends) != 2 or not all(
            isinstance(end, int | float) and not isinstance(end, bool) and math.isfinite(end)
            for end in ends
        ):
            raise InvalidInput(f"bounds of {name}", bounds, allowed)
        if not 0 <= ends[0] < ends[1] or (name in POSITIVE and ends[0] == 0):
            raise InvalidInput(
                f"bounds of {name}",
                ends,
                allowed.replace("from", "above") if name in POSITIVE else allowed,
            )
    low, high = np.array([[float(end) for end in bounds] for bounds in over.values()]).T
    return tuple(over), low, high


class _Optimiser:
    """One optimisation, from its survey to its result."""

    def __init__(self, program: Program, name: str) -> None:
        self.program, self.name = program, name
        self.evaluations, self.followed, self.samples = 0, 0, 0

    def run(self, samples: int, seed: int) -> Optimum:
        """Survey, follow the best starts, and tell of the best optimum."""
        runs = [self.go(self.program, u) for u in self.starts(samples, seed)]
        runs = [places for places in runs if places]
        if not runs:
            return self.none(OptimumStatus.NO_MOTION, "no start leads to a periodic motion")
        if not any(_feasible(places[0]) for places in runs):
            runs = self.made_feasible(runs)
            if not _feasible(runs[0][0]):
                return self.infeasible(runs[0][0])
        runs = [places for places in runs if _feasible(places[0])]
        runs.sort(key=lambda places: float(places[0].objective.max()))
        for places in runs:
            if (found := self.ended(places)) is not None:
                return found
        return self.told(rough(self.program, runs[0][0]), None)

    def from_place(self, u: Vector) -> Optimum | None:
        """The optimum that is next to a place; None where there is none."""
        places = self.go(self.program, u)
        return self.ended(places) if places and _feasible(places[0]) else None

    def starts(self, samples: int, seed: int) -> list[Vector]:
        """Where to begin: of a survey the feasible first, then the best, apart from each other."""
        points = _spread(len(self.program.names), samples, seed)
        self.samples = samples
        worst, least = self.program.survey(points)
        known = np.flatnonzero(np.isfinite(worst))
        order = known[np.lexsort((worst[known], np.maximum(0.0, -least)[known]))]
        chosen: list[Vector] = []
        for i in order.tolist():
            if all(abs(points[i] - one).max() > _APART for one in chosen):
                chosen.append(points[i])
            if len(chosen) == _FOLLOWED:
                break
        return chosen

    def go(self, program: Program, u: Vector) -> list[Place]:
        """The places that a search from u passed, the best first."""
        search = Search(program)
        places = search.go(u)
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
        return sorted(found, key=lambda places: -_worst(self.program, places[0]))

    def ended(self, places: Sequence[Place]) -> Optimum | None:
        """The optimum where a search came to rest, if it satisfies all conditions."""
        found = stationary(self.program, places[0])
        if found is not None and self.holds(found, places[0]):
            return self.told(found, None)
        kink = kink_beside(self.program, places)
        if kink is not None and all(self.confirmed(side) for side in kink.sides):
            return self.told(kink.found, kink)
        return None

    def holds(self, found: Stationary, near: Place) -> bool:
        """Whether a stationary place is an optimum that the map realises, next to another place."""
        place = found.place
        return (
            found.residual < _SOLVED
            and found.minimal
            and bool(np.all((place.u >= 0.0) & (place.u <= 1.0)))
            and _feasible(place)
            and float(place.objective.max())
            < near.objective.max() + _KEPT * abs(near.objective.max())
            and all(motion.realised for motion in place.motions)
            and self.confirmed(place)
        )

    def confirmed(self, place: Place) -> bool:
        """Whether the starts do lead to these motions."""
        settled = self.program.settled(place.u)
        return settled is not None and all(map(agrees, place.motions, settled))

    def told(self, found: Stationary, kink: Kink | None) -> Optimum:
        """The result of a place that was found, by words and numbers."""
        program, place = self.program, found.place
        system, sign = program.system_at(place.u), program.sign
        value = sign * float(place.objective.max())
        status, message = OptimumStatus.OPTIMAL, "the conditions of an optimum hold"
        if kink is not None:
            status = OptimumStatus.OPTIMAL_AT_BORDER
            message = "an optimum on a border: the gradients of both sides point to it"
        elif not (found.residual < _SOLVED and found.minimal):
            status = OptimumStatus.NOT_CONVERGED
            message = "the best that was found does not satisfy the conditions of an optimum"
        whole = program.at(place.u, place.motions, WHOLE)
        slopes = sign * (found.weights @ whole.objective_by - found.multipliers @ whole.slacks_by)
        if kink is not None:
            slopes = slopes - sign * found.border * kink.border_by
        count = len(program.texts)
        constraints = [
            Constraint(
                text=text,
                slack=float(place.slacks[s * count + i]),
                multiplier=float(found.multipliers[s * count + i]),
                active=bool(found.multipliers[s * count + i] > 0),
                scenario=s,
            )
            for s in range(len(program.scenarios))
            for i, text in enumerate(program.texts)
        ]
        ranges = program.high - program.low
        return Optimum(
            metric=self.name,
            maximised=sign < 0,
            system=system,
            over={name: float(getattr(system, name)) for name in program.names},
            value=value,
            metrics=_metrics(place, program.scenarios[0].system(system)),
            success=status in (OptimumStatus.OPTIMAL, OptimumStatus.OPTIMAL_AT_BORDER),
            status=status,
            message=message,
            residual=found.residual,
            constraints=tuple(constraints),
            bounds={
                name: float(abs(found.bounds[i])) / float(ranges[i])
                for i, name in enumerate(program.names)
                if place.u[i] in (0.0, 1.0)
            },
            slopes={
                name: float(slopes[k])
                for k, name in enumerate(names_of(system))
                if name not in program.names
            },
            orbits=tuple(motion.orbit for motion in place.motions if motion.orbit is not None),
            itinerary=place.motions[0].itinerary,
            multiplier=max(motion.multiplier for motion in place.motions),
            tightest=self.tightest(place),
            border=None
            if kink is None
            else tuple(" ".join(side.motions[kink.which].itinerary) for side in kink.sides),
            sides=None if kink is None else kink.slopes,
            statistics=self.statistics,
        )

    def tightest(self, place: Place) -> Tightest:
        """The inequality of a scenario's motion that the variables reach first, to first order."""
        nearest = Tightest("", math.inf, math.inf)
        for which, motion in enumerate(place.motions):
            for one in distances(orbit := motion.orbit):
                assert orbit is not None
                slope = float(np.linalg.norm(by_u(self.program, place.u, which, one.by)))
                value = float(one.inequality.value)
                far = value / slope if slope else math.inf
                if far < nearest.distance:
                    nearest = Tightest(one.inequality.named(orbit.itinerary), value, far)
        return nearest

    @property
    def statistics(self) -> dict[str, Any]:
        return {
            "evaluations": self.evaluations,
            "followed": self.followed,
            "samples": self.samples,
        }

    def infeasible(self, place: Place) -> Optimum:
        """That no place satisfies the constraints: which fail where the worst fails least."""
        program = self.program
        count, named = len(program.texts), []
        for k in np.argsort(place.slacks).tolist():
            if place.slacks[k] < -_KEPT:
                text = program.texts[k % count]
                named.append(f"{text} by {-place.slacks[k]:.3g}")
        message = f"no place within the bounds was found to satisfy {' and '.join(named)}"
        found = self.told(rough(program, place), None)
        return replace(found, success=False, status=OptimumStatus.INFEASIBLE, message=message)

    def none(self, status: OptimumStatus, message: str) -> Optimum:
        """That there is no motion."""
        nan = math.nan
        return Optimum(
            metric=self.name,
            maximised=self.program.sign < 0,
            system=self.program.system,
            over={},
            value=nan,
            metrics={},
            success=False,
            status=status,
            message=message,
            residual=nan,
            constraints=(),
            bounds={},
            slopes={},
            orbits=(),
            itinerary=(),
            multiplier=nan,
            tightest=Tightest("", nan, nan),
            border=None,
            sides=None,
            statistics=self.statistics,
        )


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
    return bool(place.slacks.min(initial=0.0) >= -_KEPT)


def _worst(program: Program, place: Place) -> float:
    """The least slack, in units of the limits."""
    sizes = np.tile(program.sizes, len(program.scenarios))
    return float((place.slacks / sizes).min(initial=0.0))


def _metrics(place: Place, system: System) -> dict[str, float]:
    """All metrics of the first scenario's motion."""
    found = of(place.motions[0].metrics, system)
    return {name: float(found[name].value) for name in UNITS}
