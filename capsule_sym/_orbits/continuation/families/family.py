"""Families of periodic orbits in their parameters: equations, conditions, and states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._orbits.continuation.families.arclength import Solution, corrected, tangent
from capsule_sym._orbits.continuation.families.states import Ending, Problem, State, Stop
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.continuation.points.conditions import Condition, evaluate_test_functions
from capsule_sym._orbits.continuation.points.extended import (
    EventSolution,
    ExtendedSystem,
    OrbitEquations,
)
from capsule_sym._orbits.shooting.admissibility import Inequality, inequalities
from capsule_sym._orbits.shooting.changes import zero_segments
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.orbit import Orbit

# Other test functions that may vanish along a curve of a smooth bifurcation; a cusp is found
# from the curve's tangent.
_WATCHED = {
    kinds.FOLD: (kinds.PERIOD_DOUBLING, kinds.RESONANCE_1_1),
    kinds.PERIOD_DOUBLING: (kinds.FOLD, kinds.RESONANCE_1_2, kinds.GENERALIZED_DOUBLING),
    kinds.NEIMARK_SACKER: (kinds.FOLD, kinds.PERIOD_DOUBLING),
}


class Family(OrbitEquations):
    """Orbits of one itinerary with free parameters, and one condition less than parameters.

    The condition is that the segment `zero_segment` has the duration 0, or that the test function
    `critical` of a smooth bifurcation vanishes.
    """

    def __init__(
        self,
        problem: Problem,
        orbit: Orbit,
        zero_segment: int | None = None,
        critical: str | None = None,
    ) -> None:
        self.problem, (numbers, self.axes, self.settings) = problem, problem
        values, self.critical = [float(value) for value in orbit.values], critical
        segments: tuple[int, ...] = ()
        if zero_segment is not None:
            segments = zero_segments(orbit.itinerary, orbit.z, zero_segment)
        conditions = () if critical is None else (Condition(critical),)
        super().__init__(numbers, values, self.axes, orbit.itinerary, segments, conditions)

    @property
    def zero_segment(self) -> int | None:
        """Segment of duration 0, or the first of two."""
        return self.segments[0] if self.segments else None

    def direction(self, segment: int) -> Vector:
        """Direction of the unknowns (many,) in which the duration of a segment grows."""
        unit = np.eye(kinds.DURATIONS + len(self.itinerary))[kinds.DURATIONS + segment]
        return np.append(unit[self.rest], np.zeros(len(self.axes)))

    def corrected(
        self, guess: Vector, normal: Vector, tolerance: float | None = None
    ) -> Solution | None:
        """Point of the family in the plane through the guess, by Newton's method; None if none."""
        return corrected(self.evaluate, guess, normal, self.settings, tolerance)

    def corrected_at(self, guess: Vector, k: int, value: float) -> Solution | None:
        """Point of the family near a guess at which the unknown k has this value; None if none."""
        guess, normal = guess.copy(), np.eye(len(guess))[k]
        guess[k] = value
        return self.corrected(guess, normal)

    def state(self, u: Vector, along: Vector, solution: Solution | None = None) -> State:
        """State at u, or at a given solution, with its tangent in the direction `along`."""
        _, by, orbit = solution.at if solution else self.evaluate(u)
        orbit = replace(orbit, iterations=solution.steps if solution else 0)
        held = inequalities(self.numbers, orbit.itinerary, orbit.system, self.segments)
        try:
            direction = tangent(by, along)
        except np.linalg.LinAlgError:
            detail = f"no tangent at {self.problem.where(orbit)}"
            raise Stop(Ending.NOT_CONVERGED, detail) from None
        return State(u, orbit, held, direction, self.tests(orbit))

    @property
    def watched(self) -> tuple[str, ...]:
        """Test functions that are monitored along the path."""
        if self.critical is not None:
            return _WATCHED[self.critical]
        return kinds.SMOOTH if self.zero_segment is None else (*kinds.SMOOTH, kinds.DEGENERATE)

    def tests(self, orbit: Orbit) -> dict[str, float]:
        """Test functions at an orbit of the path."""
        found = evaluate_test_functions(orbit)
        others = [name for name in self.watched if name not in found]
        tests = [Condition(name, self.zero_segment) for name in others]
        return found | {one.name: one.value(self.numbers, orbit) for one in tests}

    def solved(
        self, orbit: Orbit, names: tuple[str, ...], segments: tuple[int, ...] = ()
    ) -> EventSolution | None:
        """Orbit near a guess at which test functions vanish and segments have the duration 0.

        All equations are solved as one system; None if Newton's method does not converge.
        """
        free = tuple(axis.path for axis in self.axes)
        like = np.linalg.svd(orbit.system.by_z)[2][-1]
        conditions = [Condition(name, self.zero_segment, like) for name in names]
        try:
            return ExtendedSystem(
                self.numbers, orbit.values, free, orbit.itinerary, segments, conditions
            ).solve(orbit.z)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None

    def tightest(self, state: State) -> Inequality:
        """Inequality with the least value. Raises Stop if it fails."""
        least = min(state.held, key=lambda one: float(one.value))
        if least.value <= 0:
            named, where = least.named(state.orbit.itinerary), self.problem.where(state.orbit)
            raise Stop(Ending.NO_ADMISSIBLE_ORBIT, f"{named} fails at {where}")
        return least
