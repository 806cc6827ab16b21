"""Continuation of an orbit: to a value, or both ways within a range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, Number
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.branches.branch import Branch, BranchRun
from capsule_sym._orbits.continuation.families.states import Ending, Problem, State, Stop
from capsule_sym._orbits.continuation.families.stepping import Continuation, first_half
from capsule_sym._orbits.continuation.parameter_paths import (
    Axis,
    Function,
    ParameterPath,
    parameter_path,
)
from capsule_sym._orbits.continuation.settings import DEFAULT, ContinuationSettings, computing
from capsule_sym._orbits.shooting.admissibility import is_admissible
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.identity import same
from capsule_sym._orbits.shooting.orbit import NoOrbit, Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import SceneParameters

_SHARE = "share"  # parameter of a straight line, from 0 to 1


def continue_orbit(
    orbit: Orbit,
    parameter: str,
    to: float,
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    settings: ContinuationSettings = DEFAULT,
    max_seconds: float = math.inf,
) -> Branch:
    """Branch through an orbit, from its value of a parameter to another one (dimensionless).

    At least `points` steps are taken, more where the branch bends or the itinerary changes. The
    branch passes folds, contains stable and unstable orbits, and continues from itinerary to
    itinerary until the parameter leaves the range between the two values. Its `status` and
    `message` give the reason for an earlier end; it ends after `max_seconds` at the latest. Other
    parameters may vary with it: `ties` has for each a function, or a text such as "0.5*omega**2".
    `parameter` may then also be a new name of which one tied parameter is an affine function.
    `settings` has the step lengths and tolerances. Raises InvalidInput for an unknown parameter
    that is not tied, a value that the parameter cannot have, equal values, and an orbit whose
    parameters are not on the path.
    """
    axis = axis_from(orbit, parameter_path(parameter, ties, orbit.scene), to)
    with computing(points, settings, max_seconds, orbit.scene) as (numbers, limit):
        continuation, u = _begin(Problem(numbers, (axis,), settings), orbit)
        with limit:
            # The branch itself records the time limit.
            found = BranchRun(continuation, points).go(u, np.eye(len(u))[-1])
    return found


def continue_straight(
    orbit: Orbit, parameters: SceneParameters, *, points: int = 100
) -> Branch | None:
    """Branch along a straight line to other parameters; None if they are the orbit's own."""
    begin, end = orbit.parameters.to_dict(), parameters.to_dict()
    # The first of them gives the share: the parameter that changes most.
    names = sorted(end, key=lambda name: -abs(end[name] - begin[name]))
    ties = {
        name: f"{begin[name]!r} + {end[name] - begin[name]!r}*{_SHARE}"
        for name in names
        if end[name] != begin[name]
    }
    if not ties:
        return None
    return continue_orbit(orbit, _SHARE, 1.0, points=points, ties=ties)


def continue_both_ways(
    orbit: Orbit,
    parameter: str,
    ends: Sequence[float],
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    settings: ContinuationSettings = DEFAULT,
    max_seconds: float = math.inf,
) -> tuple[Branch, ...]:
    """Branch through an orbit in a range (low, high) around it: one if it is closed, else two.

    A closed branch (an isola) returns to the same orbit at the same value; its status is
    "returned". Otherwise the first branch goes from the orbit to larger values, the second to
    smaller ones. Arguments, units and errors are otherwise those of `continue_orbit`.
    """
    axis = axis_within(orbit.parameters, orbit.values, parameter, ends, ties)
    with computing(points, settings, max_seconds, orbit.scene) as (numbers, limit):
        return follow_both_ways(numbers, orbit, axis, points, settings, limit)[0]


def follow_both_ways(
    numbers: Backend,
    orbit: Orbit,
    axis: Axis,
    points: int,
    settings: ContinuationSettings,
    limit: Watch,
) -> tuple[tuple[Branch, ...], tuple[Orbit, ...]]:
    """Branches of `continue_both_ways`, and their other orbits at the value of the first orbit."""
    found: list[Branch] = []
    passed: list[Orbit] = []
    for side in (1.0, -1.0):
        continuation, u = _begin(Problem(numbers, (axis,), settings), orbit)
        run = _PassingRun(continuation, points)
        with limit:
            found.append(run.go(u, side * np.eye(len(u))[-1]))
        passed += run.passed
        if found[-1].status is Ending.RETURNED:
            return (found[-1],), tuple(run.passed)
    return tuple(found), tuple(passed)


def _begin(problem: Problem, orbit: Orbit) -> tuple[Continuation, Vector]:
    """Continuation of an orbit, and its unknowns."""
    start = first_half(orbit, problem.axes) or orbit
    continuation = Continuation(problem, start)
    return continuation, continuation.unknowns(start)


def axis_from(orbit: Orbit, path: ParameterPath, to: float) -> Axis:
    """Axis from an orbit on a path to a value of the varied parameter; raises InvalidInput."""
    if isinstance(orbit, NoOrbit):
        raise InvalidInput("orbit", orbit, f"an orbit that was found ({orbit.message})")
    if isinstance(to, bool) or not isinstance(to, int | float) or not math.isfinite(to):
        raise InvalidInput(path.name, to, "finite")
    if path.name in path.names:
        orbit.parameters.replace(**{path.name: to})
    axis = Axis(path, float(path.value(orbit.values)), float(to))
    if axis.begin == axis.end:
        raise InvalidInput("to", axis.end, f"other than {axis.begin}, the branch's start")
    axis.check(orbit.parameters, orbit.values)
    return axis


def axis_within(
    parameters: SceneParameters,
    values: Sequence[Number],
    parameter: str,
    ends: Sequence[float],
    ties: Mapping[str, Function | str] | None = None,
) -> Axis:
    """Axis of a parameter between ends, starting from the values of all; raises InvalidInput."""
    path = parameter_path(parameter, ties, parameters.scene)
    try:
        low, high = map(float, ends)
    except (TypeError, ValueError):
        raise InvalidInput("ends", ends, "two numbers, low and high") from None
    axis, value = Axis(path, low, high), float(path.value(values))
    for end in (low, high) if path.name in path.names else ():
        parameters.replace(**{path.name: end})
    axis.check(parameters, values)
    if not low < value < high:
        raise InvalidInput("ends", (low, high), f"ascending, with {value!r} between them")
    return axis


class _PassingRun(BranchRun):
    """A run that records each orbit at its start value, and stops when it returns to the first."""

    passed: tuple[Orbit, ...] = ()

    def add(self, state: State) -> None:
        super().add(state)
        mark, before = self.first.u[-1], self.last
        if before is None or not (before.u[-1] - mark) * (state.u[-1] - mark) < 0:
            return
        orbit = self._orbit_at_start(before, state)
        if orbit is None:
            return
        if same(orbit, self.points[0].orbit):
            raise Stop(Ending.RETURNED, self.problem.where(orbit))
        self.passed += (orbit,)

    def _orbit_at_start(self, before: State, after: State) -> Orbit | None:
        """Orbit between two neighbours at the start value of the run; None if there is none."""
        mark = self.first.u[-1]
        for state, other in ((before, after), (after, before)):
            step = state.tangent / state.tangent[-1]
            if state.orbit.itinerary == other.orbit.itinerary:
                step = (other.u - state.u) / (other.u[-1] - state.u[-1])
            guess = state.u + (mark - state.u[-1]) * step
            solution = Continuation(self.problem, state.orbit).corrected_at(guess, -1, mark)
            if solution is None:
                continue
            orbit: Orbit = whole_orbit(solution.at.orbit)
            if min(orbit.durations) > 0 and is_admissible(orbit):
                return orbit
        return None
