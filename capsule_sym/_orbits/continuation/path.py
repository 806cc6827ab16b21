"""The loop along a path: predict, correct, detect events, locate and cross them, record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._native import TimeUp
from capsule_sym._native.watch import TOLD
from capsule_sym._orbits.continuation.conditions import EXACT, Condition, EventSolution
from capsule_sym._orbits.continuation.crossing import Continuation
from capsule_sym._orbits.continuation.kinds import FOLD
from capsule_sym._orbits.continuation.locating import first_event, hides, smooth_between
from capsule_sym._orbits.continuation.problem import (
    OUT_OF_TIME,
    Corrected,
    Event,
    SmoothEvent,
    Spot,
    Stop,
)
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import same, whole_orbit

# Lengths are measured in the unknowns u.
_FIRST_STEP = 1e-2  # length of the first step, and of the first after an event
LEAST_STEP = 1e-8  # least length of a step
_LARGEST_STEP = 0.2  # largest length of a step
_LARGEST_SHARE = 0.02
"""Growth of the largest length with the largest entry of u beyond `_SLOW_SIZE`."""
_SLOW_SIZE = 50.0  # entry of u, such as a duration, above which steps grow
_LEAST_COSINE = 0.95  # of the angle between tangents before and after a step
_LEAST_SEARCHED_STEP = 1e-5  # length above which a step is searched for pairs of bifurcations
_CLEAR_SHARE = 0.1
"""Share of the values at the ends of a step above which a cubic counts as nonzero."""
_SMALL_TEST = 0.3  # value of a test function below which it may vanish twice in a step
_LEAST_RETURN = 0.25  # least share of a step that turns back to the border of the range

_SLOWEST = 1e-9  # change of q along the path that counts as none
_CLOSED_DISTANCE = 1e-6  # of a closed path from its first point, as shares of the ranges
_UNIT = 2.0**-53
_ROUNDINGS = 8


class Step(NamedTuple):
    """State after a step, the events on it in order, and the length of the next step to try."""

    state: Spot
    smooth: list[SmoothEvent]
    event: Event | None
    at_border: bool
    next: float


class PathRun(ABC):
    """Run of a continuation, with at least `points` steps over each varied range."""

    first: Spot
    last: Spot | None = None
    """First and last state that were added."""
    unlocated: Sequence[str] = ()
    """Inequalities that failed in the last step tried, without a located event."""
    _falls = False
    """True if the parameter's rate along the path fell in the last step, which had no event."""

    def __init__(self, continuation: Continuation, points: int, most: int) -> None:
        self.continuation, self.problem = continuation, continuation.problem
        self.largest, self.most = 1 / points, most

    def follow(self, begin: Callable[[], Spot]) -> tuple[Status, str]:
        """Continue the path from a state to its end; returns the reason for the end."""
        length = _FIRST_STEP
        try:
            self.first = begin()
            self.add(self.first)
            self.last = self.first
            for count in range(1, self.most):
                before = self.last
                at = ", ".join(f"{value:.4g}" for value in self.problem.values(before.orbit))
                TOLD.get()(f"{counted(count, 'point')}, at {at}")
                self.last, length = self._step(before, length)
                if self.closes(before, self.last):
                    return Status.RETURNED, self.problem.where(self.last.orbit)
        except Stop as stop:
            return stop.ending, stop.detail
        except TimeUp:
            return OUT_OF_TIME
        return Status.TOO_MANY_POINTS, counted(self.most, "point")

    def _step(self, state: Spot, length: float) -> tuple[Spot, float]:
        try:
            step = self.advance(state, length)
        except Stop as stop:
            beyond = self.pass_unlocated(state, " and ".join(self.unlocated))
            if beyond is None:
                raise stop
            self.add(beyond)
            return beyond, _FIRST_STEP
        for one in step.smooth:
            self.record_smooth(one)
        self.check(state, step)
        if step.event is not None:
            beyond = self.cross(state, step.state, step.event)
            self.add(beyond)
            return beyond, step.next
        self.add(step.state)
        if step.at_border:
            self.reach_border(step.state)
        return step.state, step.next

    def advance(self, state: Spot, length: float) -> Step:
        """Step of this length or shorter; no parameter's q changes by more than about `largest`.

        Raises Stop if even the shortest step is too long.
        """
        fastest = np.max(abs(state.tangent[-len(self.problem.axes) :]))
        slow = max(0.0, np.max(abs(state.u)) - _SLOW_SIZE)
        longest = _LARGEST_STEP + _LARGEST_SHARE * slow
        length = min(length, longest, self.largest / max(fastest, _SLOWEST))
        while length >= LEAST_STEP:
            step = self._tried(state, length)
            if step is not None:
                before, after = (abs(one.tangent[-1]) for one in (state, step.state))
                self._falls = step.event is None and bool(after < before)
                return step
            length /= 2
        detail = f"no further point at {self.problem.where(state.orbit)}"
        if not self.unlocated:
            raise Stop(Status.NOT_CONVERGED, detail)
        failing = f"{' and '.join(self.unlocated)} fails without a located event"
        raise Stop(Status.NO_ADMISSIBLE_ORBIT, f"{detail}: {failing}")

    def _tried(self, state: Spot, length: float) -> Step | None:
        """Step of this length; None if it is too long."""
        family, guess = self.continuation, state.u + length * state.tangent
        solution, at_border = family.corrected(guess, state.tangent), False
        # A step may leave both ranges: the second q is tested at the border of the first.
        for k in range(-len(self.problem.axes), 0):
            if solution is not None and not 0 <= solution.u[k] <= 1:
                solution = self._at_border(state, solution, k, float(solution.u[k] > 1))
                at_border = True
        if solution is None:
            return None
        new = family.state(solution.u, state.tangent, solution)
        if new.tangent @ state.tangent < _LEAST_COSINE:
            return None
        if length > _LEAST_SEARCHED_STEP and self._may_skip_two(state, new):
            return None
        failing = [one for one in new.held if one.value <= 0]
        event = first_event(family, state, new, failing)
        self.unlocated = ()
        if failing and (event is None or hides(family, state, new, event)):
            self.unlocated = [one.named(family.itinerary) for one in failing]
            return None
        smooth = smooth_between(family, state, new, event.share if event else 1.0)
        further = 2 * length if solution.steps <= 3 else length
        further = _FIRST_STEP if event else further
        return Step(new, smooth, event, at_border, further)

    def _may_skip_two(self, old: Spot, new: Spot) -> bool:
        """True if a step may have passed two bifurcations of one type, without a change of sign.

        The test uses the cubics through both ends: that of the parameter, which turns back at
        folds, and those of small test functions.
        """
        change, share = new.u - old.u, _CLEAR_SHARE
        one_parameter = len(self.problem.axes) == 1
        length = float(np.linalg.norm(change))
        if one_parameter:
            slopes = np.array([old.tangent[-1], new.tangent[-1]]) * length
            slopes, chord = np.sign(slopes[0]) * slopes, np.sign(slopes[0]) * change[-1]
            # Beyond an event the parameter starts slowly: only a falling slope may reach 0.
            falls = self._falls or slopes[1] < slopes[0]
            clear = share * max(slopes) if falls else 0.0
            if min(slopes) > 0 and least_slope_between(chord, slopes) < clear:
                return True
        for name in EXACT:
            if name not in self.continuation.watched or (
                name == FOLD and len(self.problem.axes) == 1
            ):
                continue
            ends = np.array([old.tests[name], new.tests[name]])
            if ends[0] * ends[1] > 0 and min(abs(ends)) < _SMALL_TEST:
                sides = [self._slope(name, state) * length for state in (old, new)]
                slopes, ends = np.sign(ends[0]) * np.array(sides), abs(ends)
                if slopes[0] < 0 < slopes[1] and least_between(ends, slopes) < share * min(ends):
                    return True
        return False

    def _slope(self, name: str, state: Spot) -> float:
        """Derivative of a test function along the path."""
        return float(self.continuation.row(state.orbit, Condition(name)) @ state.tangent)

    def _at_border(self, state: Spot, beyond: Corrected, k: int, edge: float) -> Corrected | None:
        """Point at which a step leaves the range.

        None if it is not found, or if the path turns back near the border.
        """
        family, step = self.continuation, beyond.u - state.u
        found = family.corrected_at(state.u + (edge - state.u[k]) / step[k] * step, k, edge)
        if found is None or (edge - 0.5) * state.tangent[k] > 0:
            return found
        ahead = (found.u - state.u) @ state.tangent
        return found if ahead > _LEAST_RETURN * np.linalg.norm(step) else None

    def cross(self, old: Spot, new: Spot, event: Event) -> Spot:
        """Record an event and return the state beyond it. Raises Stop if there is none."""
        failed, failure = event.failed.named(old.orbit.itinerary), "there is no orbit"
        beyond, state, stop = None, None, None
        try:
            beyond = self.continuation.cross(event)
            if beyond is not None:
                failure = self.failure(beyond.state)
                state = None if failure else self.continuation.symmetric(beyond.state)
        except InvalidInput as error:
            failure = str(error)
        except Stop as error:
            failure, stop = error.detail, error
        if state is None:
            joined = self.beyond(old, event.solution.orbit, new.u - old.u)
            state = None if joined is None else joined[1]
        orbit = self.record_event(event, old, new, state, failed)
        if state is None:
            detail = f"{failed} fails at {self.problem.where(orbit)}; beyond, {failure}"
            if stop is not None and stop.ending is not Status.NO_ADMISSIBLE_ORBIT:
                raise stop
            raise Stop(Status.NO_ADMISSIBLE_ORBIT, detail)
        for one in beyond.smooth if beyond is not None and not failure else ():
            self.record_smooth(one)
        return state

    def beyond(self, old: Spot, orbit: Orbit, along: Vector) -> tuple[Orbit, Spot] | None:
        """Last orbit before a point at which the path ends, and state beyond; None if none.

        `old` is the last state, `along` the direction, and `orbit` that of the point, or of `old`
        if the point is not located.
        """
        return None

    def pass_unlocated(self, state: Spot, failed: str) -> Spot | None:
        """State beyond a point to which no step leads, which is recorded; None if there is none.

        `failed` names the inequalities that fail there without a located event.
        """
        return None

    def errors(self, found: EventSolution) -> list[float]:
        """Uncertainties of the varied parameters at a smooth bifurcation, with their rounding."""
        values = self.problem.values(found.orbit)
        both = zip(found.uncertainties, values, strict=True)
        return [float(error) + _ROUNDINGS * _UNIT * abs(value) for error, value in both]

    @abstractmethod
    def add(self, state: Spot) -> None:
        """Add a point. Raises Stop if it is not admissible."""

    @abstractmethod
    def record_smooth(self, one: SmoothEvent) -> None:
        """Record a smooth bifurcation."""

    @abstractmethod
    def record_event(
        self, event: Event, old: Spot, new: Spot, beyond: Spot | None, failed: str
    ) -> Orbit:
        """Record a border collision between two states; returns its orbit."""

    def failure(self, state: Spot) -> str:
        """Reason why a state beyond an event is not admissible; empty if it is."""
        return state.failure

    @abstractmethod
    def check(self, old: Spot, step: Step) -> None:
        """Raises Stop if the path ends within a step."""

    def closes(self, old: Spot, new: Spot) -> bool:
        """True if the path passes its first point between two states."""
        # The first orbit may begin at another switch: parameters are compared, then orbits.
        varied = range(-len(self.problem.axes), 0)
        k = max(varied, key=lambda j: abs(new.u[j] - old.u[j]))
        mark = self.first.u[k]
        share = (mark - old.u[k]) / (new.u[k] - old.u[k])
        if not 0 < share <= 1 or old.orbit.itinerary != new.orbit.itinerary:
            return False
        there = self.continuation.corrected_at(old.u + share * (new.u - old.u), k, mark)
        if there is None:
            return False
        apart = max(abs(there.u[j] - self.first.u[j]) for j in varied)
        first = whole_orbit(self.first.orbit)
        return bool(apart < _CLOSED_DISTANCE and same(whole_orbit(there.at.orbit), first))

    def reach_border(self, state: Spot) -> None:
        """Raises Stop at the border of the range."""
        raise Stop(Status.REACHED, self.problem.where(state.orbit))


def least_between(ends: Vector, slopes: Vector) -> float:
    """Least value on [0, 1] of the cubic with these values and derivatives at 0 and 1."""
    return _least(_cubic(ends[1] - ends[0], slopes) + ends[0])


def least_slope_between(chord: float, slopes: Vector) -> float:
    """Least derivative on [0, 1] of the cubic with these derivatives at 0 and 1.

    `chord` is the difference of its values at the ends.
    """
    return _least(_cubic(chord, slopes).deriv())


def _cubic(chord: float, slopes: Vector) -> np.poly1d:
    """Cubic that is 0 at 0 and `chord` at 1, with these derivatives there."""
    first, last = slopes
    return np.poly1d([first + last - 2 * chord, 3 * chord - 2 * first - last, first, 0.0])


def _least(polynomial: np.poly1d) -> float:
    inside = [float(at.real) for at in polynomial.deriv().r if at.imag == 0 and 0 < at.real < 1]
    return float(min(polynomial(np.array([0.0, 1.0, *inside]))))
