"""Branches followed both ways from an orbit inside a range: closed ones are isolas."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Number, backend
from capsule_sym._map.checks import checked_seconds
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.continuation import Branch, Run, check_points
from capsule_sym._orbits.continuation.parameter_paths import Function, parameter_path
from capsule_sym._orbits.continuation.path import Vector, corrected
from capsule_sym._orbits.continuation.states import Axis, Ending, State, Stop, where
from capsule_sym._orbits.continuation.stepping import Continuation, first_half
from capsule_sym._orbits.shooting.admissibility import is_admissible
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.identity import same
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import Parameters


def continue_both_ways(
    orbit: Orbit,
    parameter: str,
    ends: Sequence[float],
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    max_seconds: float = math.inf,
) -> tuple[Branch, ...]:
    """The branch through an orbit in a range (low, high) around it: one if it is closed, else two.

    A closed branch, an isola, comes back to the same orbit at the same value: its status is
    "returned". Else the first goes to larger values from the orbit on, the second to smaller ones.
    Arguments, units and errors are otherwise those of `continue_orbit`.
    """
    found, _ = follow_both_ways(
        orbit, parameter, ends, points=points, ties=ties, max_seconds=max_seconds
    )
    return found


def follow_both_ways(
    orbit: Orbit,
    parameter: str,
    ends: Sequence[float],
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    max_seconds: float = math.inf,
) -> tuple[tuple[Branch, ...], tuple[Orbit, ...]]:
    """The branches of `continue_both_ways`, and other orbits of them at the value of the first."""
    axis = checked_axis(orbit.parameters, orbit.values, parameter, ends, ties)
    check_points(points)
    limit = Watch(checked_seconds(max_seconds))
    found: list[Branch] = []
    passed: list[Orbit] = []
    with backend("numpy") as numbers, np.errstate(all="ignore"):
        start = first_half(orbit, (axis,)) or orbit
        for side in (1.0, -1.0):
            continuation = Continuation(numbers, start, (axis,))
            u = continuation.unknowns(start.z, start.values)
            along = np.zeros(len(u))
            along[-1] = side
            run = _PassingRun(continuation, u, along, points)
            with limit:
                found.append(run.go())  # says itself that the time was over
            passed += run.passed
            if found[-1].status is Ending.RETURNED:
                return (found[-1],), tuple(run.passed)
    return tuple(found), tuple(passed)


def checked_axis(
    parameters: Parameters,
    values: Sequence[Number],
    parameter: str,
    ends: Sequence[float],
    ties: Mapping[str, Function | str] | None = None,
) -> Axis:
    """The path of a parameter between ends, from `values` of all; raises InvalidInput."""
    path = parameter_path(parameter, ties)
    try:
        low, high = map(float, ends)
    except (TypeError, ValueError):
        raise InvalidInput("ends", ends, "two numbers, low and high") from None
    value = float(path.value(values))
    if path.name in PARAMETERS:
        for end in (low, high):
            parameters.replace(**{path.name: end})
    path.check(parameters, low, high)
    if not low < value < high:
        raise InvalidInput("ends", (low, high), f"ascending, with {value!r} between them")
    if not path.holds([float(one) for one in values]):
        tied = [name for name, _ in path.ties]
        raise InvalidInput("ties", tied, f"such that they hold for the orbit at {value!r}")
    return Axis(path, low, high)


class _PassingRun(Run):
    """A run that notices every orbit at the value where it began, and ends at the first again."""

    def __init__(self, continuation: Continuation, u: Vector, along: Vector, points: int) -> None:
        super().__init__(continuation, u, along, points)
        self.passed: list[Orbit] = []
        self._before: State | None = None

    def _add(self, state: State) -> None:
        super()._add(state)
        before, self._before = self._before, state
        if (
            before is None
            or not (before.u[-1] - self.start[-1]) * (state.u[-1] - self.start[-1]) < 0
        ):
            return
        orbit = self._orbit_at_start(before, state)
        if orbit is None:
            return
        if same(orbit, self.points[0].orbit):
            raise Stop(Ending.RETURNED, where(orbit, (self.axis,)))
        self.passed.append(orbit)

    def _orbit_at_start(self, before: State, after: State) -> Orbit | None:
        """The orbit between two neighbours at the value where the run began; None if none."""
        mark = self.start[-1]
        for state, other in ((before, after), (after, before)):
            continuation = Continuation(self.continuation.numbers, state.orbit, (self.axis,))
            step = state.tangent / state.tangent[-1]
            if state.orbit.itinerary == other.orbit.itinerary:
                step = (other.u - state.u) / (other.u[-1] - state.u[-1])
            guess = state.u + (mark - state.u[-1]) * step
            guess[-1] = mark
            normal = np.zeros(len(guess))
            normal[-1] = 1.0
            solution = corrected(continuation.equations, guess, normal)
            if solution is None:
                continue
            orbit: Orbit = whole_orbit(solution.at.made)
            if min(orbit.durations) > 0 and is_admissible(orbit):
                return orbit
        return None
