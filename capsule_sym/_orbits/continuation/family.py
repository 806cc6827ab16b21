"""Families of periodic orbits in their parameters: equations, conditions, and states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._map.backend import Backend
from capsule_sym._orbits.continuation.bifurcations import (
    SMOOTH,
    evaluate_test_functions,
    gradient_of_test_function,
    noise,
)
from capsule_sym._orbits.continuation.events import (
    CUSP,
    DEGENERATE,
    FOLD,
    GENERALIZED_DOUBLING,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    RESONANCE_1_1,
    RESONANCE_1_2,
    BorderCollision,
    Condition,
    Vanishing,
    solve_event,
)
from capsule_sym._orbits.continuation.normal_forms import cubic, degeneracy, quadratic
from capsule_sym._orbits.continuation.path import (
    Evaluation,
    Solution,
    Vector,
    tangent,
)
from capsule_sym._orbits.continuation.states import Axis, Ending, State, Stop, where
from capsule_sym._orbits.shooting.admissibility import Inequality, inequalities
from capsule_sym._orbits.shooting.equations import PARAMETERS, shooting
from capsule_sym._orbits.shooting.orbit import Orbit

EXACT = (*SMOOTH, RESONANCE_1_1, RESONANCE_1_2)  # test functions of the monodromy matrix
# What else may vanish along a curve of a smooth bifurcation; a cusp is seen by the curve's tangent.
_WATCHED = {
    FOLD: (PERIOD_DOUBLING, RESONANCE_1_1),
    PERIOD_DOUBLING: (FOLD, RESONANCE_1_2, GENERALIZED_DOUBLING),
    NEIMARK_SACKER: (FOLD, PERIOD_DOUBLING),
}


class Family:
    """Orbits of one itinerary with free parameters, and a condition for each but one of them.

    The condition is that the segment `zero_segment` has the duration 0, or that the test function
    `critical` of a smooth bifurcation vanishes. The unknowns u are z, without the duration of a
    segment `zero_segment`, and q of each axis.
    """

    def __init__(
        self,
        numbers: Backend,
        orbit: Orbit,
        axes: tuple[Axis, ...],
        zero_segment: int | None = None,
        critical: str | None = None,
    ) -> None:
        self.numbers, self.axes = numbers, axes
        self.itinerary, self.zero_segment, self.critical = orbit.itinerary, zero_segment, critical
        self.values = [float(value) for value in orbit.values]

    def unknowns(self, z: Vector, values: tuple[float, ...]) -> Vector:
        """The unknowns of an orbit."""
        z = np.array(z, dtype=float)
        kept = z if self.zero_segment is None else np.delete(z, 4 + self.zero_segment)
        return np.array([*kept, *(axis.share(values) for axis in self.axes)])

    def orbit(self, u: Vector) -> Orbit:
        """The orbit, or what is to become one, of these unknowns."""
        count = len(self.axes)
        z, values = u[:-count], list(self.values)
        if self.zero_segment is not None:
            z = np.insert(z, 4 + self.zero_segment, 0.0)
        for axis, q in zip(self.axes, u[-count:], strict=True):
            values = axis.placed(values, float(q))
        system = shooting(self.numbers, values, self.itinerary, z)
        return Orbit(tuple(values), self.itinerary, z, system, self.numbers.name)

    def equations(self, u: Vector) -> Evaluation:
        """The equations at u, and the orbit."""
        orbit = self.orbit(u)
        system = orbit.system
        by_z = (
            system.by_z
            if self.zero_segment is None
            else np.delete(system.by_z, 4 + self.zero_segment, axis=1)
        )
        by_q = [axis.along(system.by_p, orbit.values) for axis in self.axes]
        by, residual = np.column_stack([by_z, *by_q]), system.residual
        if self.critical is not None:
            row = self.row(orbit, self.critical)
            residual = np.append(residual, evaluate_test_functions(orbit)[self.critical])
            by = np.vstack([by, row])
        return Evaluation(residual, by, orbit)

    def row(self, orbit: Orbit, name: str) -> Vector:
        """Gradient of a test function by the unknowns."""
        row = self._gradient(orbit, name)
        row[-len(self.axes) :] *= [axis.end - axis.begin for axis in self.axes]
        return row if self.zero_segment is None else np.delete(row, 4 + self.zero_segment)

    def _gradient(self, orbit: Orbit, name: str) -> Vector:
        """Gradient of a test function of the monodromy matrix by z and what varies."""
        unit = np.eye(len(PARAMETERS))
        along = [axis.path.along(unit, axis.value(orbit.values)) for axis in self.axes]
        return gradient_of_test_function(self.numbers, orbit, name, np.array(along))

    def state(self, u: Vector, along: Vector, solution: Solution | None = None) -> State:
        """The state at u, which a solution may be of, with its tangent in the direction `along`."""
        _, by, orbit = solution.at if solution else self.equations(u)
        orbit = replace(orbit, iterations=solution.steps if solution else 0)
        held = inequalities(self.numbers, orbit.itinerary, orbit.system, self.zero_segment)
        try:
            direction = tangent(by, along)
        except np.linalg.LinAlgError:
            raise Stop(Ending.NOT_CONVERGED, f"no tangent at {where(orbit, self.axes)}") from None
        return State(u, orbit, held, direction, self.tests(orbit))

    @property
    def watched(self) -> tuple[str, ...]:
        """The test functions that are looked at along the path."""
        if self.critical is not None:
            return _WATCHED[self.critical]
        return SMOOTH if self.zero_segment is None else (*SMOOTH, DEGENERATE)

    def tests(self, orbit: Orbit) -> dict[str, float]:
        """The test functions at an orbit of the path."""
        found = evaluate_test_functions(orbit)
        others = (name for name in self.watched if name not in found)
        return found | {name: self._test(name, orbit) for name in others}

    def _test(self, name: str, orbit: Orbit) -> float:
        if name == DEGENERATE and self.zero_segment is not None:
            return degeneracy(self.numbers, orbit, self.zero_segment)
        if name == GENERALIZED_DOUBLING:
            there = cubic(self.numbers, orbit)
            return there.term / there.closing
        return evaluate_test_functions(orbit)[name]

    def _condition(self, name: str, like: Vector) -> Condition:
        def value(orbit: Orbit) -> Vanishing:
            if name in EXACT:
                found, gradient = self._test(name, orbit), self._gradient(orbit, name)
                return Vanishing(found, noise(orbit), gradient)
            if name == CUSP:
                return Vanishing(quadratic(self.numbers, orbit, like).term, noise(orbit))
            return Vanishing(self._test(name, orbit), noise(orbit))

        return value

    def solved(
        self, orbit: Orbit, names: tuple[str, ...], segments: tuple[int, ...] = ()
    ) -> BorderCollision | None:
        """The orbit near a guess at which test functions vanish and segments have the duration 0.

        All as one system of equations; None where Newton's method finds none.
        """
        free = tuple(axis.path for axis in self.axes)
        like = np.linalg.svd(orbit.system.by_z)[2][-1]
        conditions = [self._condition(name, like) for name in names]
        try:
            return solve_event(
                self.numbers, orbit.values, free, orbit.itinerary, orbit.z, segments, conditions
            )
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None

    def tightest(self, state: State) -> Inequality:
        """The inequality with the least value. Raises Stop where it fails."""
        least = min(state.held, key=lambda one: float(one.value))
        if least.value <= 0:
            detail = (
                f"{least.named(state.orbit.itinerary)} fails at {where(state.orbit, self.axes)}"
            )
            raise Stop(Ending.NO_ADMISSIBLE_ORBIT, detail)
        return least
