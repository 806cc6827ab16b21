"""What is optimised: objective, limits and stability as functions of scaled variables.

The variables u are parameters of a system, each scaled by its bounds to between 0 and 1. A scenario
is a start of the motion with parameters at an end of their tolerances; the objective counts in the
worst one, and limits hold in all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design import evaluation
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.quantities import (
    Function,
    Limit,
    System,
    dimensionless,
    of,
    real,
    valued,
)
from capsule_sym._errors import InvalidInput
from capsule_sym._native import Watch
from capsule_sym._parameters import Parameters, names_of

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
_STEP = 1e-3  # of a variable's range, in the differences of a multiplier
KEPT = 1e-7
"""How far beyond a limit counts as within, over the size of the limit."""
_CELLS = 4096  # of a survey in memory at once
_FAR = 0.25  # a slack of stability that the next step does not use up


class Differences(NamedTuple):
    """Weights of a function at steps, for its derivative: to both sides, and to one."""

    central: tuple[tuple[int, float], ...]
    one_sided: tuple[tuple[int, float], ...]


COARSE = Differences(((-1, -0.5), (1, 0.5)), ((0, -1.5), (1, 2.0), (2, -0.5)))
FINE = Differences(
    ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)),
    ((0, -25 / 12), (1, 4.0), (2, -3.0), (3, 4 / 3), (4, -1 / 4)),
)
WHOLE = Differences(*FINE)
"""As fine, and by all parameters, not by the variables alone."""


@dataclass(frozen=True)
class Scenario:
    """A start (x_r, v_r, v_c), and factors of parameters by name."""

    state: tuple[float, float, float]
    factors: Mapping[str, float]

    def system(self, system: System) -> System:
        """The system with its parameters at this end of their tolerances."""
        changed = {name: getattr(system, name) * by for name, by in self.factors.items()}
        return replace(system, **changed) if changed else system

    def weights(self, system: System) -> Vector:
        """What a derivative by a parameter of this scenario's system is by the parameter, (k,)."""
        return np.array([self.factors.get(name, 1.0) for name in names_of(system)])


def scenarios_of(
    starts: Sequence[Sequence[float]], tolerances: Mapping[str, float] | None, system: System
) -> tuple[Scenario, ...]:
    """All starts with all ends of the tolerances, and with none; raises InvalidInput."""
    if not isinstance(starts, Sequence | np.ndarray) or not len(starts):
        raise InvalidInput("starts", starts, "one state (x_r, v_r, v_c) or more")
    states = []
    for one in starts:
        state = tuple(one) if isinstance(one, Sequence | np.ndarray) else ()
        if len(state) != 3 or not all(map(real, state)):
            raise InvalidInput("starts", one, "states (x_r, v_r, v_c) of finite numbers")
        states.append((float(state[0]), float(state[1]), float(state[2])))
    tolerances = {} if tolerances is None else tolerances
    if not isinstance(tolerances, Mapping):
        raise InvalidInput("tolerances", tolerances, "a share for each of some parameters")
    for name, by in tolerances.items():
        if name not in names_of(system):
            raise InvalidInput("tolerances", name, f"of {', '.join(names_of(system))}")
        if not (real(by) and 0 < by < 1):
            raise InvalidInput(f"tolerance of {name}", by, "a share between 0 and 1")
    ends = product(*((1 - by, 1 + by) for by in tolerances.values()))
    factors: list[dict[str, float]] = [{}] if tolerances else []
    factors += [dict(zip(tolerances, one, strict=True)) for one in ends]
    return tuple(Scenario(state, one) for state in states for one in factors)


@dataclass(frozen=True, eq=False)
class Place:
    """Objective and slacks of m scenarios at some variables, with derivatives by all parameters.

    The objective is to be least, over its unit; a slack is how far within a limit, over its own.
    `objective` (m,), `slacks` (n,), in the order of scenarios, each with all its limits and at last
    its stability.
    """

    u: Vector
    motions: tuple[Motion, ...]
    objective: Vector
    objective_by: Matrix
    slacks: Vector
    slacks_by: Matrix

    @property
    def finite(self) -> bool:
        """Whether there are numbers for all of it."""
        rows = self.objective, self.objective_by, self.slacks, self.slacks_by
        return all(bool(np.all(np.isfinite(row))) for row in rows)


class Overview(NamedTuple):
    """About what the worst objective (n,) and the least slacks (n, limits) are.

    nan where there is no motion, infinite where a function has no number.
    """

    worst: Vector
    slacks: Matrix
    in_contact: bool
    """Whether the spring is compressed somewhere."""
    stiff: bool
    """Whether it has a stiffness somewhere."""

    def flat(self, name: str, system: System) -> str:
        """Why no drift is possible where the metric is the same everywhere; else empty."""
        found = np.unique(self.worst[~np.isnan(self.worst)])
        count = int(np.count_nonzero(~np.isnan(self.worst)))
        if len(found) != 1 or self.in_contact or (count == 1 and 0 < abs(found[0]) < np.inf):
            return ""
        own = isinstance(system, Parameters)
        value = f"is {abs(found[0]):g}" if np.isfinite(found[0]) else "has no number"
        why = f"the mass does not reach the spring: lower {'delta' if own else 'G'} or raise "
        why += "alpha" if own else "P_d"
        if not self.stiff:
            why = f"the spring has no stiffness: raise {'beta' if own else 'k2'}"
        return f"{name} {value} at each of {count} surveyed places: {why}"


@dataclass(frozen=True)
class Program:
    """Minimise `sign` times a function of the metrics over variables between bounds."""

    system: System
    names: tuple[str, ...]
    low: Vector
    high: Vector
    function: Function
    sign: int
    limits: tuple[Limit, ...]
    margin: float | None
    scenarios: tuple[Scenario, ...]
    unit: float = 1.0
    """What the objective is divided by: how much it varies."""
    limit_units: tuple[float, ...] = ()
    """What the slack of each limit is divided by; its limit where that is not 0."""
    elastic: bool = False
    """Whether the limits themselves are what is optimised: the least slack is to be greatest."""
    watch: Watch = field(default_factory=Watch)
    """The limit of time, of all that is done with the program."""
    progress: Callable[[str], object] | None = None
    """Called with what is done, in words."""

    def tell(self, doing: str) -> None:
        """Says what is done to who wants to know."""
        if self.progress is not None:
            self.progress(doing)

    def system_at(self, u: Vector) -> System:
        """The system where the scaled variables are u."""
        values = self.low + u * (self.high - self.low)
        values = np.where(u == 1.0, self.high, values)
        return replace(self.system, **dict(zip(self.names, values.tolist(), strict=True)))

    @property
    def columns(self) -> list[int]:
        """The variables' places among the parameters of the system."""
        return [names_of(self.system).index(name) for name in self.names]

    def settled(self, u: Vector) -> tuple[Motion, ...] | None:
        """The motions that the scenarios' starts lead to; None where one leads to none."""
        system, found = self.system_at(u), []
        for one in self.scenarios:
            own = dimensionless(one.system(system))
            motion = None if self.watch.over else evaluation.settle(own, one.state, 0.0, self.watch)
            if motion is None:
                return None
            found.append(motion)
        return tuple(found)

    def followed(self, motions: Sequence[Motion], u: Vector) -> tuple[Motion, ...] | None:
        """The motions that these become at other variables; None where one is lost, or in time."""
        return self._moved(partial(evaluation.continue_motion, watch=self.watch), motions, u)

    def extended(self, motions: Sequence[Motion], u: Vector) -> tuple[Motion, ...] | None:
        """The orbits of the same itineraries at other variables, admissible or not."""
        return self._moved(evaluation.same_itinerary_at, motions, u)

    def _moved(
        self,
        how: Callable[[Motion, Parameters], Motion | None],
        motions: Sequence[Motion],
        u: Vector,
    ) -> tuple[Motion, ...] | None:
        system, found = self.system_at(u), []
        for one, motion in zip(self.scenarios, motions, strict=True):
            own = dimensionless(one.system(system))
            moved = None if self.watch.over else how(motion, own)
            if moved is None:
                return None
            found.append(moved)
        return tuple(found)

    def at(self, u: Vector, motions: tuple[Motion, ...], by: Differences = COARSE) -> Place:
        """Objective and slacks of motions there, the stability's derivatives by differences."""
        system = self.system_at(u)
        count = len(names_of(system))
        objective, slacks = list[tuple[float, Vector]](), list[tuple[float, Vector]]()
        for one, motion in zip(self.scenarios, motions, strict=True):
            own = one.system(system)
            found = of(motion.metrics, own)
            factors = one.weights(system)
            value, slope = valued("metric", self.function, found)
            scale = self.sign / self.unit
            objective.append((value * scale, slope * scale * factors))
            for limit in self.limits:
                value, slope = limit.slack(found)
                slacks.append((value, slope * factors))
            if self.margin is not None:
                slack = 1 - self.margin - motion.multiplier
                slacks.append((slack, self._by_differences(u, motion, one, by)))
        sizes = np.tile(self.sizes, len(self.scenarios))
        slacks = [
            (value / size, by / size) for (value, by), size in zip(slacks, sizes, strict=True)
        ]
        if self.elastic:
            objective, slacks = [(-value, -by) for value, by in slacks], []
        return Place(
            u,
            motions,
            np.array([value for value, _ in objective]),
            np.array([by for _, by in objective]).reshape(-1, count),
            np.array([value for value, _ in slacks]),
            np.array([by for _, by in slacks]).reshape(-1, count),
        )

    @property
    def sizes(self) -> Vector:
        """The unit of each slack of a scenario, of its stability last."""
        units = [abs(limit.value) or 1.0 for limit in self.limits]
        return np.array([*(self.limit_units or units), *([1.0] * (self.margin is not None))])

    @property
    def texts(self) -> tuple[str, ...]:
        """The limits of a scenario in words, its stability last."""
        found = [limit.text for limit in self.limits]
        if self.margin is not None:
            found.append(f"largest multiplier <= {1 - self.margin:g}")
        return tuple(found)

    def _by_differences(self, u: Vector, motion: Motion, one: Scenario, how: Differences) -> Vector:
        """Derivatives of the stability's slack by differences; 0 far from its limit."""
        system = one.system(self.system_at(u))
        by = np.zeros(len(names_of(system)))
        if how is COARSE and 1 - cast(float, self.margin) - motion.multiplier > _FAR:
            return by
        spans = dict(zip(self.names, self.high - self.low, strict=True))
        for k, name in enumerate(names_of(system)):
            if how is not WHOLE and name not in spans:
                continue
            value = getattr(system, name)
            step = _STEP * spans.get(name, abs(value) or 1.0)
            # Beside 0 the differences are to one side, and in a search beside a border as well.
            ways = [how.one_sided if value < 2 * step else how.central]
            if how is COARSE and ways[0] is how.central:
                ways += [how.one_sided, tuple((-place, -weight) for place, weight in how.one_sided)]
            for weights in ways:
                moved = [replace(system, **{name: value + place * step}) for place, _ in weights]
                found = [
                    evaluation.same_itinerary_at(motion, dimensionless(system), how is COARSE)
                    for system in moved
                ]
                if all(found):
                    by[k] = -sum(
                        weight * cast(Motion, end).multiplier / step
                        for (_, weight), end in zip(weights, found, strict=True)
                    )
                    break
        return by * one.weights(system)

    def survey(self, points: Matrix, scenarios: Sequence[Scenario]) -> Overview:
        """The objective and the slacks of some scenarios at points (n, k), in no units."""
        worst = np.full(len(points), -np.inf)
        least = np.full((len(points), len(self.limits)), np.inf)
        contact, stiff, total = 0.0, False, len(points) * len(scenarios)
        for first, (k, one) in product(range(0, len(points), _CELLS), enumerate(scenarios)):
            cells = len(points[first : first + _CELLS])
            self.tell(f"survey, {first * len(scenarios) + k * cells} of {total} runs")
            own = [one.system(self.system_at(u)) for u in points[first : first + _CELLS]]
            plain = [dimensionless(system) for system in own]
            about = evaluation.survey(plain, one.state, self.watch)
            stiff |= any(p.beta > 0 for p in plain)
            for i, (system, metrics) in enumerate(zip(own, about, strict=True), first):
                if not metrics:
                    worst[i] = np.nan
                    continue
                contact = max(contact, metrics["peak_contact"].value)
                found = of(metrics, system)
                value = valued("metric", self.function, found)[0] * self.sign
                worst[i] = np.maximum(worst[i], value if np.isfinite(value) else np.inf)
                for j, limit in enumerate(self.limits):
                    slack = limit.slack(found)[0]
                    least[i, j] = min(least[i, j], slack if np.isfinite(slack) else -np.inf)
        return Overview(worst, least, contact > 0, stiff)

    def scaled(self, name: str, worst: Vector, least: Matrix) -> Program:
        """The same in units of what a survey found.

        Raises InvalidInput where the metric has no number.
        """
        moving = ~np.isnan(worst)
        if not moving.any() or (self.watch.over and not np.isfinite(worst[moving]).any()):
            return self
        allowed = "a function that has a finite number somewhere within the bounds"
        if not np.isfinite(worst[moving]).any():
            raise InvalidInput("metric", name, allowed)
        finite = worst[np.isfinite(worst)]
        upper, lower = np.quantile(finite, (0.75, 0.25))
        units = []
        for limit, slacks in zip(self.limits, abs(least[moving].T), strict=True):
            largest = slacks[np.isfinite(slacks)].max(initial=0.0)
            units.append(abs(limit.value) or float(largest) or 1.0)
        return replace(self, unit=float(upper - lower) or 1e-300, limit_units=tuple(units))
