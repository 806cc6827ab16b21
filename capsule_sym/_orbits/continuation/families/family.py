"""Families of periodic orbits in their parameters: equations, conditions, and states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._orbits.continuation.families.arclength import (
    Evaluation,
    Solution,
    Vector,
    corrected,
    tangent,
)
from capsule_sym._orbits.continuation.families.states import Ending, Problem, State, Stop
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.continuation.points.conditions import (
    EXACT,
    Vanishing,
    evaluate_test_functions,
    gradient_of_test_function,
    noise,
    value_of,
)
from capsule_sym._orbits.continuation.points.extended import (
    Condition,
    EventSolution,
    ExtendedSystem,
    orbit_at,
)
from capsule_sym._orbits.shooting.admissibility import Inequality, inequalities
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.orbit import Orbit

# What else may vanish along a curve of a smooth bifurcation; a cusp is seen by the curve's tangent.
_WATCHED = {
    kinds.FOLD: (kinds.PERIOD_DOUBLING, kinds.RESONANCE_1_1),
    kinds.PERIOD_DOUBLING: (kinds.FOLD, kinds.RESONANCE_1_2, kinds.GENERALIZED_DOUBLING),
    kinds.NEIMARK_SACKER: (kinds.FOLD, kinds.PERIOD_DOUBLING),
}


class Family:
    """Orbits of one itinerary with free parameters, and a condition for each but one of them.

    The condition is that the segment `zero_segment` has the duration 0, or that the test function
    `critical` of a smooth bifurcation vanishes. The unknowns u are z, without the duration of a
    segment `zero_segment`, and q of each axis.
    """

    def __init__(
        self,
        problem: Problem,
        orbit: Orbit,
        zero_segment: int | None = None,
        critical: str | None = None,
    ) -> None:
        self.problem, (self.numbers, self.axes, self.settings) = problem, problem
        self.itinerary, self.zero_segment, self.critical = orbit.itinerary, zero_segment, critical
        self.values = [float(value) for value in orbit.values]

    def unknowns(self, orbit: Orbit) -> Vector:
        """The unknowns of an orbit."""
        z = self._without_segment(np.array(orbit.z, dtype=float))
        return np.array([*z, *(axis.share(orbit.values) for axis in self.axes)])

    def direction(self, segment: int) -> Vector:
        """The unknowns' direction (many,) in which the duration of a segment grows."""
        unit = np.eye(kinds.DURATIONS + len(self.itinerary))[kinds.DURATIONS + segment]
        return np.append(self._without_segment(unit), np.zeros(len(self.axes)))

    def _without_segment(self, by_z: Vector) -> Vector:
        """Entries by z, along the last axis, without that of the segment of duration 0."""
        if self.zero_segment is None:
            return by_z
        return np.delete(by_z, kinds.DURATIONS + self.zero_segment, axis=-1)

    def orbit(self, u: Vector) -> Orbit:
        """The orbit, or what is to become one, of these unknowns."""
        count = len(self.axes)
        z, values = u[:-count], list(self.values)
        if self.zero_segment is not None:
            z = np.insert(z, kinds.DURATIONS + self.zero_segment, 0.0)
        for axis, q in zip(self.axes, u[-count:], strict=True):
            values = axis.placed(values, float(q))
        return orbit_at(self.numbers, values, self.itinerary, z)

    def equations(self, u: Vector) -> Evaluation:
        """The equations at u, and the orbit."""
        orbit = self.orbit(u)
        system = orbit.system
        by_q = [axis.along(system.by_p, orbit.values) for axis in self.axes]
        by = np.column_stack([self._without_segment(system.by_z), *by_q])
        if self.critical is None:
            return Evaluation(system.residual, by, orbit)
        residual = np.append(system.residual, evaluate_test_functions(orbit)[self.critical])
        return Evaluation(residual, np.vstack([by, self.row(orbit, self.critical)]), orbit)

    def corrected(
        self, guess: Vector, normal: Vector, tolerance: float | None = None
    ) -> Solution | None:
        """The family's point in the plane through the guess, by Newton's method; None if none."""
        return corrected(self.equations, guess, normal, self.settings, tolerance)

    def corrected_at(self, guess: Vector, k: int, value: float) -> Solution | None:
        """The family's point near a guess at which the unknown k has this value; None if none."""
        guess, normal = guess.copy(), np.eye(len(guess))[k]
        guess[k] = value
        return self.corrected(guess, normal)

    def row(self, orbit: Orbit, name: str) -> Vector:
        """Gradient of a test function by the unknowns."""
        row, count = self._gradient(orbit, name), len(self.axes)
        widths = [axis.end - axis.begin for axis in self.axes]
        return np.append(self._without_segment(row[:-count]), row[-count:] * widths)

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
            detail = f"no tangent at {self.problem.where(orbit)}"
            raise Stop(Ending.NOT_CONVERGED, detail) from None
        return State(u, orbit, held, direction, self.tests(orbit))

    @property
    def watched(self) -> tuple[str, ...]:
        """The test functions that are looked at along the path."""
        if self.critical is not None:
            return _WATCHED[self.critical]
        return kinds.SMOOTH if self.zero_segment is None else (*kinds.SMOOTH, kinds.DEGENERATE)

    def tests(self, orbit: Orbit) -> dict[str, float]:
        """The test functions at an orbit of the path."""
        found = evaluate_test_functions(orbit)
        others = [name for name in self.watched if name not in found]
        return found | {n: value_of(self.numbers, orbit, n, self.zero_segment) for n in others}

    def _condition(self, name: str, like: Vector) -> Condition:
        def vanishing(orbit: Orbit) -> Vanishing:
            value = value_of(self.numbers, orbit, name, self.zero_segment, like)
            gradient = self._gradient(orbit, name) if name in EXACT else None
            return Vanishing(value, noise(orbit), gradient)

        return vanishing

    def solved(
        self, orbit: Orbit, names: tuple[str, ...], segments: tuple[int, ...] = ()
    ) -> EventSolution | None:
        """The orbit near a guess at which test functions vanish and segments have the duration 0.

        All as one system of equations; None where Newton's method finds none.
        """
        free = tuple(axis.path for axis in self.axes)
        like = np.linalg.svd(orbit.system.by_z)[2][-1]
        conditions = [self._condition(name, like) for name in names]
        try:
            return ExtendedSystem(
                self.numbers, orbit.values, free, orbit.itinerary, orbit.z, segments, conditions
            ).solve()
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None

    def tightest(self, state: State) -> Inequality:
        """The inequality with the least value. Raises Stop where it fails."""
        least = min(state.held, key=lambda one: float(one.value))
        if least.value <= 0:
            named, where = least.named(state.orbit.itinerary), self.problem.where(state.orbit)
            raise Stop(Ending.NO_ADMISSIBLE_ORBIT, f"{named} fails at {where}")
        return least
