"""Objective and limits of many motions at once, as of `Program.at`, in arrays.

A metric is a `Slope` with a value of shape (n,) and a slope (k, n), by the k scaled variables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import drifting
from capsule_sym._design.program import Program, Scenario
from capsule_sym._design.quantities import Function, valued, values_of, with_derived
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.many import METRICS, Performances, performance_many
from capsule_sym._parameters import Scene, SceneDevice
from capsule_sym._processes import processors


@dataclass(frozen=True, eq=False)
class Values:
    """Objectives (n,) to minimise, and slacks (n, limits), of n motions, without units.

    Derivatives (n, k) and (n, limits, k) are by the scaled variables. A value that is not finite is
    the worst one.
    """

    objective: Vector
    objective_by: Matrix
    slacks: Matrix
    slacks_by: NDArray[np.float64]


class Grid:
    """Parameters of a scenario at points u (n, k) of a program, and metrics there."""

    def __init__(self, program: Program, scenario: Scenario, u: Matrix) -> None:
        self.program, self.count = program, len(u)
        system, span = program.system, program.high - program.low
        self.scene: Scene = system.scene
        at = np.where(u == 1.0, program.high, program.low + u * span)
        given: dict[str, Slope] = {
            name: Slope(value, 0.0) for name, value in values_of(system).items()
        }
        for i, name in enumerate(program.names):
            slope = np.zeros((len(span), 1))
            slope[i] = span[i]
            given[name] = Slope(at[:, i], slope)
        for name, by in scenario.factors.items():
            given[name] = given[name] * by
        self.own = self.scene.values(**given)
        self.device = isinstance(system, SceneDevice)
        with np.errstate(all="ignore"):
            ratios = self.own.ratios() if self.device else given
        plain = [_lifted(ratios[name]) for name in self.scene.facts.PARAMETERS]
        self.rows = np.array([np.broadcast_to(one.value, self.count) for one in plain]).T.copy()
        """Dimensionless parameters, (n, p)."""
        shape = len(span), self.count
        self.rows_by = np.array([np.broadcast_to(one.slope, shape) for one in plain])
        """Derivatives of the parameters by the scaled variables, (p, k, n)."""

    @property
    def allowed(self) -> NDArray[np.bool_]:
        """Mask (n,) of points whose parameters the scene allows."""
        low, high = np.array([*self.scene.facts.RANGES.values()]).T
        found: NDArray[Any] = ((self.rows >= low) & (self.rows <= high)).all(axis=1)
        gaps = [self.scene.facts.PARAMETERS.index(name) for name, _ in self.scene.facts.STOPS]
        return found & (self.rows[:, gaps].sum(axis=1) > 0) if len(gaps) > 1 else found

    def closed(self, states: Matrix, numbers: NDArray[np.int64]) -> Performances:
        """Motions closed near states (n, 3), of so many excitation periods (n,)."""
        how: dict[str, Any] = {"gradients": True, "threads": processors(), "scene": self.scene}
        return performance_many(self.rows, states, numbers, **how)

    def of(self, found: Performances) -> Values:
        """Objective and slacks of one motion at each point; nan if it is not closed."""
        values, gradients = found.values, found.gradients.copy()
        drift = np.isin(METRICS, ("velocity", "progression"))
        at_rest = ~drifting(
            self.scene, self.rows, found.fields, values, abs(found.multipliers[:, 0])
        )
        values[at_rest[:, None] & drift] = 0.0
        gradients[at_rest[:, None] & drift] = 0.0
        with np.errstate(all="ignore"):
            by = np.einsum("nmp,pkn->mkn", gradients, self.rows_by)
            metrics = {name: Slope(values[:, i], by[i]) for i, name in enumerate(METRICS)}
            every = self._with_derived(metrics)
            objective, slope = self._valued("metric", self.program.function, every, "")
            objective, slope = objective * self.program.sign, slope * self.program.sign
            slacks = np.empty((self.count, len(self.program.limits)))
            slacks_by = np.empty((*slacks.shape, len(self.program.names)))
            for j, limit in enumerate(self.program.limits):
                held, by_u = self._valued("subject_to", limit.function, every, limit.text)
                slacks[:, j] = np.where(
                    np.isfinite(held), (held - limit.value) * limit.sign, -np.inf
                )
                slacks_by[:, j] = by_u * limit.sign
        return Values(np.where(np.isfinite(objective), objective, np.inf), slope, slacks, slacks_by)

    def _with_derived(self, metrics: Mapping[str, Slope]) -> dict[str, Slope]:
        """All metrics and parameters by name, in SI units if the system is a device."""
        rows = map(Slope, self.rows.T, self.rows_by)
        own = dict(zip(self.scene.facts.PARAMETERS, rows, strict=True))
        found = with_derived(metrics, own, self.scene.facts.BOUNDS)
        if self.device:
            found = {name: one * self.own.scale(name) for name, one in found.items()}
        every: dict[str, Slope] = found | vars(self.own)
        return every

    def _valued(
        self, field: str, function: Function, every: Mapping[str, Slope], text: str
    ) -> tuple[Vector, Matrix]:
        """Values (n,) and derivatives (n, k) of a function of the metrics."""
        shape = self.count, len(self.program.names)
        try:
            found: Any = function(every)
            value = np.broadcast_to(np.asarray(found.value), self.count)
            slope = np.broadcast_to(np.asarray(found.slope, dtype=float), shape[::-1]).T
            if np.iscomplexobj(value) or not isinstance(found, Slope):
                raise TypeError
        except Exception:  # a function that does not accept arrays is evaluated one by one
            value, slope = np.empty(self.count), np.zeros(shape)
            full = shape[::-1]
            for i in range(self.count):
                one = {
                    name: Slope(
                        float(np.broadcast_to(each.value, self.count)[i]),
                        np.broadcast_to(each.slope, full)[:, i],
                    )
                    for name, each in every.items()
                }
                value[i], slope[i] = valued(field, function, one, text)
        return value.astype(float), np.where(np.isfinite(value)[:, None], slope, 0.0)


def _lifted(value: Any) -> Slope:
    return value if isinstance(value, Slope) else Slope(value, 0.0)
