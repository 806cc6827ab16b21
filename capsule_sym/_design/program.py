"""Optimisation problem: objective, limits and stability as functions of scaled variables.

The variables u are parameters of a system, each scaled by its bounds to [0, 1]. The objective is
that of the worst scenario; limits hold in all scenarios.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design import evaluation
from capsule_sym._design.borders import multiplier_by
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.quantities import (
    Function,
    Limit,
    System,
    dimensionless,
    dimensionless_slopes,
    named,
    of,
    real,
    valued,
)
from capsule_sym._errors import InvalidInput
from capsule_sym._native import check_time
from capsule_sym._parameters import names_of
from capsule_sym._systems import factors_of

STARTS, STABLE = AMONG = "starts", "stable"
"""Motions to consider: those on which the given starts settle, or all stable ones."""
KEPT = 1e-7
"""Violation of a limit that counts as none, and difference of objectives that are the same, in
their units: a run that has settled is as close to its motion."""
CLOSE = 1e-6
"""Distance of places that count as one, a share of each range: rounding is far below, and changes
of an itinerary rarely are within it."""


@dataclass(frozen=True)
class Scenario:
    """A start (x_r, v_r, v_c), and factors of parameters by name."""

    state: tuple[float, float, float]
    factors: Mapping[str, float]

    def system(self, system: System) -> System:
        """System with its parameters at this end of their tolerances."""
        changed = {name: getattr(system, name) * by for name, by in self.factors.items()}
        return system.replace(**changed) if changed else system

    def weights(self, system: System) -> Vector:
        """Factors from derivatives by this scenario's parameters to those by all, (k,)."""
        return np.array([self.factors.get(name, 1.0) for name in names_of(system)])


def scenarios_of(
    starts: Sequence[Sequence[float]], tolerances: Mapping[str, float] | None, system: System
) -> tuple[Scenario, ...]:
    """Scenarios: all starts with all ends of the tolerances, and with none; raises InvalidInput."""
    if not isinstance(starts, Sequence | np.ndarray) or not len(starts):
        raise InvalidInput("starts", starts, "one state (x_r, v_r, v_c) or more")
    states = []
    for one in starts:
        state = tuple(one) if isinstance(one, Sequence | np.ndarray) else ()
        if len(state) != 3 or not all(map(real, state)):
            raise InvalidInput("starts", one, "states (x_r, v_r, v_c) of finite numbers")
        states.append((float(state[0]), float(state[1]), float(state[2])))
    factors = factors_of(tolerances, system)
    return tuple(Scenario(state, one) for state in states for one in factors)


@dataclass(frozen=True, eq=False)
class Place:
    """Objective and slacks of m scenarios at some variables, with derivatives by all parameters.

    The objective is to be minimised, over its unit; a slack is the distance to its limit, over its
    unit. `objective` is (m,), `slacks` (n,), in the order of scenarios, for each its limits, then
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
        """True if all values are finite."""
        rows = self.objective, self.objective_by, self.slacks, self.slacks_by
        return all(bool(np.all(np.isfinite(row))) for row in rows)

    @property
    def worst(self) -> float:
        """Objective in the worst scenario."""
        return float(self.objective.max())

    @property
    def beyond(self) -> float:
        """Largest violation of a limit; 0 if all hold."""
        return max(0.0, -float(self.slacks.min(initial=0.0)) - KEPT)

    @property
    def rank(self) -> tuple[float, float]:
        """Order of places, the least is the best: violation of limits, then objective."""
        return self.beyond, self.worst


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
    """Divisor of the objective: its variation."""
    limit_units: tuple[float, ...] = ()
    """Divisors of the limits' slacks; by default the limit, unless it is 0."""
    among: str = STARTS
    """Motions to consider: those from the "starts", or all "stable" ones."""
    progress: Callable[[str], object] | None = None
    """Called with messages of progress."""
    again: bool = True
    """True if a motion that is lost on the way to other variables is looked for by a run."""
    seeds: tuple[tuple[float, float, float], ...] = ()
    """Starts of some of the searched motions, if all stable ones are considered."""

    @property
    def name(self) -> str:
        """Name of the metric."""
        return named(self.function)

    def tell(self, doing: str) -> None:
        """Report progress."""
        if self.progress is not None:
            self.progress(doing)

    def system_at(self, u: Vector) -> System:
        """System at the scaled variables u."""
        values = self.low + u * (self.high - self.low)
        values = np.where(u == 1.0, self.high, values)
        return self.system.replace(**dict(zip(self.names, values.tolist(), strict=True)))

    def u_of(self, system: System) -> Vector:
        """Scaled variables of a system."""
        values = np.array([getattr(system, name) for name in self.names])
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)

    def systems_at(self, u: Vector) -> Iterator[System]:
        """System of each scenario at the scaled variables u."""
        system = self.system_at(u)
        return (one.system(system) for one in self.scenarios)

    def by_u(self, rows: Matrix) -> Matrix:
        """Derivatives by the scaled variables, from those by all parameters, (..., k)."""
        columns = [names_of(self.system).index(name) for name in self.names]
        found: Matrix = rows[..., columns] * (self.high - self.low)
        return found

    def by_all(self, u: Vector, scenario: Scenario, by: Vector) -> Vector:
        """Derivatives by all parameters, from those (7,) by a scenario's dimensionless ones."""
        system = scenario.system(self.system_at(u))
        found: Vector = by @ dimensionless_slopes(system) * scenario.weights(system)
        return found

    def settled(self, u: Vector, states: Matrix | None = None) -> tuple[Motion, ...] | None:
        """Motions on which the scenarios' starts, or other states, settle; None if one has none."""
        begin = [one.state for one in self.scenarios] if states is None else states.tolist()
        return self._each(u, begin, lambda state, p: evaluation.settle(p, state))

    def followed(self, motions: Sequence[Motion], u: Vector) -> tuple[Motion, ...] | None:
        """Motions continued to other variables; None if one is lost."""
        return self._each(u, motions, partial(evaluation.continue_motion, again=self.again))

    def extended(self, motions: Sequence[Motion], u: Vector) -> tuple[Motion, ...] | None:
        """The orbits of the same itineraries at other variables, admissible or not."""
        return self._each(u, motions, evaluation.same_itinerary_at)

    def _each(
        self, u: Vector, known: Sequence[Any], find: Callable[[Any, Any], Motion | None]
    ) -> tuple[Motion, ...] | None:
        """Motions found from what is known of each, and its parameters; None if one is missing."""
        found = []
        for one, system in zip(known, self.systems_at(u), strict=True):
            check_time()
            motion = find(one, dimensionless(system))
            if motion is None:
                return None
            found.append(motion)
        return tuple(found)

    def begin(self, u: Vector) -> Place | None:
        """Place with the motions of the scenarios' own starts; None if a start has no motion."""
        return self.place(u, self.settled(u))

    def place(self, u: Vector, motions: tuple[Motion, ...] | None) -> Place | None:
        """Place with these motions; None without motions, or if a value is not finite."""
        with suppress(np.linalg.LinAlgError):  # at a fold
            if motions is not None and (found := self.at(u, motions)).finite:
                return found
        return None

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at other variables, its motions continued from a known one."""
        return self.place(u, self.followed(near.motions, u))

    def at(self, u: Vector, motions: tuple[Motion, ...]) -> Place:
        """Objective and slacks of motions at u."""
        units = np.append(self.sign * self.unit, self.sizes)
        values, slopes = [], []
        for one, motion, system in zip(self.scenarios, motions, self.systems_at(u), strict=True):
            found = of(motion.metrics, system)
            rows = [valued("metric", self.function, found)]
            rows += [limit.slack(found) for limit in self.limits]
            if self.margin is not None:
                slack = 1 - self.margin - motion.multiplier
                rows.append((slack, -multiplier_by(motion) @ dimensionless_slopes(system)))
            values.append([value for value, _ in rows] / units)
            slopes.append(np.stack([by for _, by in rows]) * one.weights(system) / units[:, None])
        every_value, by = np.array(values), np.array(slopes)
        slack_rows = by[:, 1:].reshape(-1, by.shape[-1])
        return Place(
            u, motions, every_value[:, 0], by[:, 0], every_value[:, 1:].ravel(), slack_rows
        )

    @property
    def sizes(self) -> Vector:
        """Unit of each slack of a scenario, of its stability last."""
        units = [abs(limit.value) or 1.0 for limit in self.limits]
        return np.array([*(self.limit_units or units), *([1.0] * (self.margin is not None))])

    @property
    def texts(self) -> tuple[str, ...]:
        """Texts of the limits of a scenario, its stability last."""
        found = [limit.text for limit in self.limits]
        if self.margin is not None:
            found.append(f"largest multiplier <= {1 - self.margin:g}")
        return tuple(found)
