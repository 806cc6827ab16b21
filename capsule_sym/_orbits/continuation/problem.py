"""Families of periodic orbits in their parameters: states, Newton's method, test functions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import Status
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.conditions import (
    Collapse,
    Condition,
    Evaluation,
    EventSolution,
    ExtendedSystem,
    OrbitEquations,
    evaluate_test_functions,
)
from capsule_sym._orbits.continuation.parameter_paths import PathAxis
from capsule_sym._orbits.shooting.admissibility import Inequality, inequalities
from capsule_sym._orbits.shooting.changes import Exchange, zero_segments
from capsule_sym._orbits.shooting.equations import Matrix, Vector
from capsule_sym._orbits.shooting.orbit import Orbit

_MOST_STEPS = 5_000  # largest number of steps that a caller may ask for
_NEWTON_STEPS = 8
_NEWTON_TOLERANCE = 1e-10
"""Step over the size of u that ends the iteration; the error is its square."""
_RESIDUAL_TOLERANCE = 1e-13  # residual over the size of u above which Newton's method continues
_ROUNDING_STEP = 1e-6  # step below which the iteration ends if the residual is rounding

OUT_OF_TIME = Status.TIME_LIMIT, "time limit reached, or interrupted"


class Stop(Exception):
    """Raised where the path ends, with the reason."""

    def __init__(self, ending: Status, detail: str) -> None:
        super().__init__(detail)
        self.ending, self.detail = ending, detail


@contextmanager
def computing(points: int, max_seconds: float, *axes: PathAxis) -> Iterator[Problem]:
    """Problem of a continuation, until the time limit, at which the block is left.

    Raises InvalidInput for a number of points or a time that is not allowed.
    """
    check_points(points)
    limit = Watch(checked_seconds(max_seconds))
    with backend("numpy", axes[0].path.scene) as numbers, np.errstate(all="ignore"), limit:
        yield Problem(numbers, axes)


def check_points(points: int) -> None:
    """Raises InvalidInput unless this is an allowed number of steps."""
    check_count("points", points, 1, _MOST_STEPS)


class Problem(NamedTuple):
    """Number system and axes that all families of a continuation share."""

    numbers: Backend
    axes: tuple[PathAxis, ...]

    def values(self, orbit: Orbit) -> tuple[float, ...]:
        """Values of the varied parameters."""
        return tuple(axis.value(orbit.values) for axis in self.axes)

    def where(self, orbit: Orbit) -> str:
        """The free parameters' values and the itinerary, for a message."""
        named = zip(self.axes, self.values(orbit), strict=True)
        values = ", ".join(f"{axis.name} = {value!r}" for axis, value in named)
        return f"{values}, itinerary {orbit.itinerary}"


class Spot(NamedTuple):
    """Point of the path: unknowns u, the orbit, its inequalities, tangent and test functions."""

    u: Vector
    orbit: Orbit
    held: list[Inequality]
    tangent: Vector
    tests: dict[str, float]

    @property
    def admissible(self) -> bool:
        """True if all inequalities hold."""
        return all(one.value > 0 for one in self.held)

    @property
    def failure(self) -> str:
        """Inequalities that do not hold, as a sentence; empty if all hold."""
        itinerary = self.orbit.itinerary
        failed = " and ".join(one.named(itinerary) for one in self.held if one.value <= 0)
        return f"{failed} fails in {itinerary} at once" if failed else ""


class SmoothEvent(NamedTuple):
    """Test function that vanishes between two states, and the share of the step at its zero.

    If the search has failed, `solved` is False and the orbit is that of the first state.
    """

    type: str
    ends: tuple[Spot, Spot]
    share: float
    solution: EventSolution
    solved: bool = True


class Event(NamedTuple):
    """Failed inequality, the orbit at which it is 0 with a segment of duration 0, and its share.

    `segment` is the index of that segment in the itinerary of `change`, and of the solution.
    """

    failed: Inequality
    segment: int
    change: Exchange
    solution: EventSolution
    share: float


_ROUNDING = 2.0**-51


class Corrected(NamedTuple):
    """Point of the curve, the equations there, and the number of Newton steps."""

    u: Vector
    at: Evaluation
    steps: int


def tangent(by: Matrix, along: Vector) -> Vector:
    """Unit tangent of the curve where its equations have the derivative `by`, (m + 1,).

    It makes an acute angle with `along`. Raises numpy.linalg.LinAlgError at a branch point.
    """
    right = np.zeros(len(along))
    right[-1] = 1.0
    direction = np.linalg.solve(np.vstack([by, along]), right)
    return np.asarray(direction / np.linalg.norm(direction))


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
        self.problem, (numbers, self.axes) = problem, problem
        values, self.critical = [float(value) for value in orbit.values], critical
        segments: tuple[int, ...] = ()
        if zero_segment is not None:
            segments = zero_segments(orbit.itinerary, orbit.z, zero_segment)
        conditions = () if critical is None else (Condition(critical),)
        super().__init__(numbers, values, self.axes, orbit.itinerary, segments, conditions)

    @property
    def zero_segment(self) -> int | None:
        """Segment of duration 0, or the first of two; None without one."""
        return self.segments[0] if self.segments else None

    def direction(self, segment: int) -> Vector:
        """Direction of the unknowns (many,) in which the duration of a segment grows."""
        unit = np.eye(kinds.DURATIONS + len(self.itinerary))[kinds.DURATIONS + segment]
        return np.append(unit[self.rest], np.zeros(len(self.axes)))

    def corrected(self, guess: Vector, normal: Vector) -> Corrected | None:
        """Point of the curve in the plane through the guess, by Newton's method; None if none.

        The iteration ends when a step is within the tolerance, or limited by rounding. None also
        where the parameters, or their path, have no value.
        """
        u, size, found = guess, float("inf"), None
        try:
            for step in range(1, _NEWTON_STEPS + 1):
                at = self.evaluate(u)
                if not np.all(np.isfinite(at.residual)):
                    return None
                rounding = _ROUNDING * (1 + np.max(abs(u)))
                if size < _ROUNDING_STEP and np.max(abs(at.residual)) <= rounding:
                    return Corrected(u, at, step - 1)
                change = np.linalg.solve(
                    np.vstack([at.by, normal]), -np.append(at.residual, normal @ (u - guess))
                )
                u, size = u + change, float(np.linalg.norm(change))
                if size < _NEWTON_TOLERANCE * (1 + np.linalg.norm(u)):
                    found = Corrected(u, self.evaluate(u), step)
                    # Near a segment of duration 0 the inexact derivative leaves a larger residual.
                    if np.max(abs(found.at.residual)) <= _RESIDUAL_TOLERANCE * (1 + np.max(abs(u))):
                        break
        except (ArithmeticError, ValueError):  # LinAlgError is a ValueError
            return None
        return found

    def corrected_at(self, guess: Vector, k: int, value: float) -> Corrected | None:
        """Point of the family near a guess at which the unknown k has this value; None if none."""
        guess, normal = guess.copy(), np.eye(len(guess))[k]
        guess[k] = value
        return self.corrected(guess, normal)

    def state(self, u: Vector, along: Vector, solution: Corrected | None = None) -> Spot:
        """State at u, or at a given solution, with its tangent in the direction `along`.

        Raises Stop if there is no tangent.
        """
        _, by, orbit = solution.at if solution else self.evaluate(u)
        orbit = replace(orbit, iterations=solution.steps if solution else 0)
        held = inequalities(self.numbers, orbit.itinerary, orbit.system, self.segments)
        try:
            direction = tangent(by, along)
        except np.linalg.LinAlgError:
            detail = f"no tangent at {self.problem.where(orbit)}"
            raise Stop(Status.NOT_CONVERGED, detail) from None
        return Spot(u, orbit, held, direction, self.tests(orbit))

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
        return found | {one.name: one.value(orbit) for one in tests}

    def solved(
        self,
        orbit: Orbit,
        names: tuple[str, ...],
        segments: tuple[int, ...] = (),
        collapse: Collapse | None = None,
    ) -> EventSolution | None:
        """Orbit near a guess at which test functions vanish and segments have the duration 0.

        The test functions are those of the orbit without a segment if `collapse` is given. All
        equations are solved as one system; None if Newton's method does not converge.
        """
        free = tuple(axis.path for axis in self.axes)
        like = np.linalg.svd(orbit.system.by_z)[2][-1]
        conditions = [Condition(name, self.zero_segment, like, collapse) for name in names]
        try:
            return ExtendedSystem(
                self.numbers, orbit.values, free, orbit.itinerary, segments, conditions
            ).solve(orbit.z)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None

    def tightest(self, state: Spot) -> Inequality:
        """Inequality with the least value. Raises Stop if it fails."""
        least = min(state.held, key=lambda one: float(one.value))
        if least.value <= 0:
            named, where = least.named(state.orbit.itinerary), self.problem.where(state.orbit)
            raise Stop(Status.NO_ADMISSIBLE_ORBIT, f"{named} fails at {where}")
        return least
