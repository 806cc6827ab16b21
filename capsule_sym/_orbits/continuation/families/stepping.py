"""Steps along a family of orbits, from one itinerary to the next, and runs of them to an end."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput, counted
from capsule_sym._native import TimeUp
from capsule_sym._native.watch import TOLD
from capsule_sym._orbits.continuation.families.family import (
    OUT_OF_TIME,
    Corrected,
    Ending,
    Event,
    Family,
    Problem,
    SmoothEvent,
    Spot,
    Step,
    Stop,
    least_between,
    least_slope_between,
    tangent,
)
from capsule_sym._orbits.continuation.families.locating import (
    first_event,
    hides,
    matching,
    smooth_between,
)
from capsule_sym._orbits.continuation.parameter_paths import PathAxis
from capsule_sym._orbits.continuation.points.extended import EXACT, EventSolution
from capsule_sym._orbits.continuation.points.kinds import DEGENERATE, FOLD
from capsule_sym._orbits.continuation.points.normal_forms import doubled
from capsule_sym._orbits.shooting.admissibility import (
    DURATION,
    Inequality,
    inequalities,
    pull_rates,
)
from capsule_sym._orbits.shooting.changes import (
    NO_DURATION,
    Exchange,
    insert_segment,
    is_kink,
    remove_segment,
    swap_segment,
    zero_segments,
)
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.itinerary import contact
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import half_orbit, halved_at, symmetric

_PLACES = (0.0, 0.37, 1.0)  # of a range, at which the symmetry of motions is tested
_SLOWEST = 1e-9  # change of q along the path that counts as none


def keeps_images(orbit: Orbit, axes: tuple[PathAxis, ...]) -> bool:
    """True if motions have mirror images over the whole range of the axes."""
    names = orbit.scene.facts.PARAMETERS
    for axis in axes:
        for q in _PLACES:
            values = axis.placed([float(value) for value in orbit.values], q)
            if not symmetric(orbit.parameters.replace(**dict(zip(names, values, strict=True)))):
                return False
    return True


def first_half(orbit: Orbit, axes: tuple[PathAxis, ...]) -> Orbit | None:
    """First half of an orbit that is its own mirror image; None for any other.

    None if a varied parameter removes the symmetry, such as a load or the stiffness of one stop.
    """
    varies = {name for axis in axes for name in (axis.name, *dict(axis.path.ties))}
    scene = orbit.scene
    stiffnesses = {name for _, name in scene.facts.STOPS}
    touches = any(contact(field, scene) for field in orbit.itinerary.fields)
    if varies & stiffnesses and touches and len(scene.facts.STOPS) == 1:
        return None
    if not keeps_images(orbit, axes):
        return None
    return half_orbit(orbit)


def vanishing(orbit: Orbit, segment: int) -> Event:
    """Event that belongs to a segment of duration 0."""
    itinerary, zero = orbit.itinerary, 0 * orbit.z[0]
    same_itinerary = Exchange(itinerary, orbit.z, tuple(range(len(itinerary))))
    solution = EventSolution(orbit, (segment,), orbit.residual, ())
    failed = Inequality(DURATION, segment, None, zero, zero)
    return Event(failed, segment, same_itinerary, solution, 0.0)


class Continuation(Family):
    """A family that is continued step by step, from one itinerary to the next."""

    unlocated: Sequence[str] = ()
    """Inequalities that failed in the last step tried, without a located event."""
    _falls = False
    """True if the parameter changes ever more slowly along the path."""

    def advance(self, state: Spot, length: float, largest: float) -> Step:
        """Step of this length or shorter; no q changes by more than about `largest`.

        Raises Stop if even the shortest step is too long.
        """
        fastest = np.max(abs(state.tangent[-len(self.axes) :]))
        slow = max(0.0, np.max(abs(state.u)) - self.settings.slow_size)
        longest = self.settings.largest_step + self.settings.largest_share * slow
        length = min(length, longest, largest / max(fastest, _SLOWEST))
        while length >= self.settings.least_step:
            step = self._tried(state, length)
            if step is not None:
                before, after = (abs(one.tangent[-1]) for one in (state, step.state))
                self._falls = step.event is None and bool(after < before)
                return step
            length /= 2
        detail = f"no further point at {self.problem.where(state.orbit)}"
        if not self.unlocated:
            raise Stop(Ending.NOT_CONVERGED, detail)
        failing = f"{' and '.join(self.unlocated)} fails without a located event"
        raise Stop(Ending.NO_ADMISSIBLE_ORBIT, f"{detail}: {failing}")

    def _tried(self, state: Spot, length: float) -> Step | None:
        """Step of this length; None if it is too long."""
        guess = state.u + length * state.tangent
        try:
            solution = self.corrected(guess, state.tangent)
            outside = None if solution is None else self._outside(solution.u)
            if solution is not None and outside is not None:
                solution = self._at_border(state, solution, *outside)
        except (ArithmeticError, ValueError):
            return None  # the parameters, or their path, have no value at the guess
        if solution is None:
            return None
        new = self.state(solution.u, state.tangent, solution)
        if new.tangent @ state.tangent < self.settings.least_cosine:
            return None
        if length > self.settings.least_searched_step and self._may_skip_two(state, new):
            return None
        failing = [one for one in new.held if one.value <= 0]
        event = first_event(self, state, new, failing)
        self.unlocated = ()
        if failing and (event is None or hides(self, state, new, event)):
            self.unlocated = [one.named(self.itinerary) for one in failing]
            return None
        smooth = smooth_between(self, state, new, event.share if event else 1.0)
        further = 2 * length if solution.steps <= 3 else length
        further = self.settings.first_step if event else further
        return Step(new, smooth, event, outside is not None, further)

    def _may_skip_two(self, old: Spot, new: Spot) -> bool:
        """True if a step may have passed two bifurcations of one type, without a change of sign.

        The test uses the cubics through both ends: that of the parameter, which turns back at
        folds, and those of small test functions.
        """
        change, share = new.u - old.u, self.settings.clear_share
        length = float(np.linalg.norm(change))
        if len(self.axes) == 1:
            slopes = np.array([old.tangent[-1], new.tangent[-1]]) * length
            slopes, chord = np.sign(slopes[0]) * slopes, np.sign(slopes[0]) * change[-1]
            # Beyond an event the parameter starts slowly: only a falling slope may reach 0.
            falls = self._falls or slopes[1] < slopes[0]
            clear = share * max(slopes) if falls else 0.0
            if min(slopes) > 0 and least_slope_between(chord, slopes) < clear:
                return True
        for name in EXACT:
            if name not in self.watched or (name == FOLD and len(self.axes) == 1):
                continue
            ends = np.array([old.tests[name], new.tests[name]])
            if ends[0] * ends[1] > 0 and min(abs(ends)) < self.settings.small_test:
                sides = [self._slope(name, state) * length for state in (old, new)]
                slopes, ends = np.sign(ends[0]) * np.array(sides), abs(ends)
                if slopes[0] < 0 < slopes[1] and least_between(ends, slopes) < share * min(ends):
                    return True
        return False

    def _slope(self, name: str, state: Spot) -> float:
        """Derivative of a test function along the path."""
        return float(self.row(state.orbit, name) @ state.tangent)

    def _outside(self, u: Vector) -> tuple[int, float] | None:
        """Index and border of the first q outside [0, 1]."""
        for k in range(len(u) - len(self.axes), len(u)):
            if not 0 <= u[k] <= 1:
                return k, float(u[k] > 1)
        return None

    def _at_border(self, state: Spot, beyond: Corrected, k: int, edge: float) -> Corrected | None:
        """Point at which a step leaves the range; None if the path turns back near the border."""
        step = beyond.u - state.u
        found = self.corrected_at(state.u + (edge - state.u[k]) / step[k] * step, k, edge)
        if found is None or (edge - 0.5) * state.tangent[k] > 0:
            return found
        ahead = (found.u - state.u) @ state.tangent
        return found if ahead > self.settings.least_return * np.linalg.norm(step) else None

    def cross(self, event: Event) -> Restart | None:
        """Continue in the itinerary beyond an event, to a state next to it; None if there is none.

        Other events of the same orbit are crossed with it, as for equal forces in both directions.
        Raises Stop if the itineraries on the two sides do not share the condition.
        """
        found, u = self._beyond(event)
        for _ in range(len(self.itinerary) if self.zero_segment is None else 0):
            also = None if found is None else self._also(self.orbit(u), found.state.held)
            if also is None:
                break
            found, u = self._beyond(also)
        return found

    def _also(self, orbit: Orbit, held: Sequence[Inequality]) -> Event | None:
        """Another event of an orbit, from an inequality that fails beyond the first event."""
        for failed in held:
            if failed.value > 0:
                continue
            if failed.kind == DURATION:
                if abs(orbit.durations[failed.segment]) < NO_DURATION:
                    return vanishing(orbit, failed.segment)
                continue
            here = matching(inequalities(self.numbers, self.itinerary, orbit.system), failed)
            if here is not None and abs(here.value) < NO_DURATION:
                change, segment = insert_segment(
                    self.numbers, self.itinerary, orbit.z, orbit.system, failed
                )
                with_it = replace(orbit, itinerary=change.itinerary, z=change.z)
                return vanishing(with_it, segment)._replace(failed=failed)
        return None

    def _beyond(self, event: Event) -> tuple[Restart | None, Vector]:
        """State beyond one segment's event, and the unknowns of the event's orbit there."""
        orbit, segment = event.solution.orbit, event.segment
        broken = self.itinerary.mirrored and not orbit.itinerary.mirrored
        if broken and (self.zero_segment is not None or self.critical):
            raise Stop(Ending.CODIMENSION_TWO, "beyond, the orbit is not its own mirror image")
        self._keep(event.change)
        self.itinerary = orbit.itinerary
        if event.failed.kind == DURATION:
            other = swap_segment(self.itinerary, orbit.z, segment, orbit.system)
            if other is None:
                return self._without(orbit, segment)
            self._keep(other)
            self.itinerary = other.itinerary
            orbit = replace(orbit, itinerary=other.itinerary, z=other.z)
        both, along = zero_segments(self.itinerary, orbit.z, segment), self.direction(segment)
        kinked = is_kink(self.itinerary, both)
        if kinked:
            along = self.direction(both[0]) + _ratio(orbit, both[0]) * self.direction(both[1])
        u = self.unknowns(orbit)
        return self.neighbour(u, along, kinked), u

    def _without(self, orbit: Orbit, segment: int) -> tuple[Restart | None, Vector]:
        """Continue in the itinerary without a segment of duration 0, on its admissible side."""
        change, inequality = remove_segment(
            self.numbers, self.itinerary, orbit.z, orbit.system, segment
        )
        self._keep(change)
        self.itinerary = change.itinerary
        u = self.unknowns(replace(orbit, itinerary=change.itinerary, z=change.z))
        both = [self.neighbour(u, side) for side in self.directions(u)]
        return max(both, key=lambda one: _margin(one, inequality)), u

    def symmetric(self, state: Spot) -> Spot:
        """State of the first half of the orbit, if the orbit is its own mirror image."""
        if self.itinerary.mirrored or self.critical is not None:
            return state
        if self.zero_segment is None:
            half = first_half(state.orbit, self.axes)
        elif not keeps_images(state.orbit, self.axes):
            half = None
        else:
            half, segment = halved_at(state.orbit, self.zero_segment) or (None, None)
            if half is not None and segment is not None:
                self.segments = zero_segments(half.itinerary, half.z, segment)
        if half is None:
            return state
        self.itinerary, count = half.itinerary, len(self.axes)
        u = self.unknowns(half)
        along = np.array([*np.zeros(len(u) - count), *state.tangent[-count:]])
        return self.state(u, along)

    def _keep(self, change: Exchange) -> None:
        kept = [change.kept[segment] for segment in self.segments]
        self.segments = tuple(segment for segment in kept if segment is not None)
        if None in kept:
            raise Stop(Ending.CODIMENSION_TWO, "the segment of duration 0 merges with another")

    def directions(self, u: Vector) -> list[Vector]:
        """The two directions of the curve of solutions at u."""
        null = np.linalg.svd(self.evaluate(u).by)[2][-1]
        return [null, -null]

    def around(self, u: Vector) -> Iterator[Spot]:
        """States next to u on all curves of solutions that pass it.

        Where two curves cross, the null vectors of the equations span a plane, whose directions are
        tried; each curve may be found several times.
        """
        settings = self.settings
        _, sizes, right = np.linalg.svd(self.evaluate(u).by)
        one_curve = sizes[-1] > settings.crossing_ratio * sizes[0]
        count = 2 if one_curve else settings.crossing_directions
        for turn in np.arange(count) * (2 * np.pi / count):
            way = np.cos(turn) * right[-1] + np.sin(turn) * right[-2]
            solution = self.corrected(u + settings.crossing_step * way, way)
            if solution is not None:
                yield self.state(solution.u, way, solution)

    def neighbour(self, u: Vector, along: Vector, straight: bool = False) -> Restart | None:
        """State next to u, in the direction of `along`.

        It is nearer to u if another event is near. `along` is the tangent itself if `straight`.
        """
        at = self.evaluate(u)
        try:
            direction = along / np.linalg.norm(along) if straight else tangent(at.by, along)
        except np.linalg.LinAlgError:
            return None
        states: list[Spot] = []
        for share in self.settings.neighbour_shares:
            step = share * self.settings.neighbour_step * direction
            solution = self.corrected(u + step, direction)
            if solution is not None:
                states.append(self.state(solution.u, direction, solution))
                if states[-1].admissible:
                    break
        else:
            del states[1:]
        if not states:
            return None
        state, point = states[-1], Spot(u, at.orbit, [], direction, self.tests(at.orbit))
        found = smooth_between(self, point, state, 1.0)
        # At a degenerate point its own test function is rounding.
        return Restart(self, state, [one for one in found if one.type != DEGENERATE])


class Restart(NamedTuple):
    """State beside a point from which to continue, and the smooth bifurcations between them."""

    continuation: Continuation
    state: Spot
    smooth: Sequence[SmoothEvent] = ()


def doubled_starts(
    problem: Problem, orbit: Orbit, critical: str | None = None, side: int = 1
) -> Iterator[tuple[float, Restart]]:
    """Doubled orbits beside one at a period doubling, each with its distance.

    At a symmetry breaking they are whole orbits on the two sides of their half. Two curves of
    solutions of the doubled equations cross there; on one the halves move apart while the parameter
    is constant to first order.
    """
    whole, settings = doubled(orbit), problem.settings
    one = Continuation(problem, whole, critical=critical)
    distances, tolerance = settings.doubled_distances, None
    if critical is not None:
        distances, tolerance = settings.fold_distances, settings.fold_tolerance
    u = one.unknowns(whole)
    along = np.append(np.linalg.svd(whole.system.by_z)[2][-1], np.zeros(len(problem.axes))) * side
    for distance in distances:
        solution = one.corrected(u + distance * along, along, tolerance)
        if solution is not None:
            yield distance, Restart(one, one.state(solution.u, along, solution))


def _ratio(orbit: Orbit, first: int) -> float:
    """Ratio of the durations of the slip after and before an edge or a stop, both starting at 0.

    The capsule's acceleration grows from 0 and falls again at the rates of the pull.
    """
    grows, falls = map(float, pull_rates(orbit.itinerary, orbit.system.flows, first))
    if grows * falls >= 0:
        raise Stop(Ending.NO_ADMISSIBLE_ORBIT, "the pull does not turn back where the slip begins")
    return (grows + math.copysign(math.sqrt(grows * (grows - falls)), grows)) / -falls


def _margin(beside: Restart | None, inequality: Inequality) -> tuple[bool, float]:
    """Admissibility of a state, and the value of an inequality; larger is better."""
    if beside is None:
        return False, -float("inf")
    found = matching(beside.state.held, inequality)
    return beside.state.admissible, float(found.value) if found else float("inf")


_UNIT = 2.0**-53
_ROUNDINGS = 8


class PathRun(ABC):
    """Run of a continuation, with at least `points` steps over each varied range."""

    first: Spot
    last: Spot | None = None
    """First and last state that were added."""

    def __init__(self, continuation: Continuation, points: int, most: int) -> None:
        self.continuation, self.problem = continuation, continuation.problem
        self.largest, self.most = 1 / points, most

    def follow(self, begin: Callable[[], Spot]) -> tuple[Ending, str]:
        """Continue the path from a state to its end; returns the reason for the end."""
        length = self.problem.settings.first_step
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
                    return Ending.RETURNED, self.problem.where(self.last.orbit)
        except Stop as stop:
            return stop.ending, stop.detail
        except TimeUp:
            return OUT_OF_TIME
        return Ending.TOO_MANY_POINTS, counted(self.most, "point")

    def _step(self, state: Spot, length: float) -> tuple[Spot, float]:
        try:
            step = self.continuation.advance(state, length, self.largest)
        except Stop as stop:
            beyond = self.pass_unlocated(state, " and ".join(self.continuation.unlocated))
            if beyond is None:
                raise stop
            self.add(beyond)
            return beyond, self.problem.settings.first_step
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
            joined = self.beyond(event.solution.orbit, new.u - old.u)
            state = None if joined is None else joined[1]
        orbit = self.record_event(event, old, new, state, failed)
        if state is None:
            detail = f"{failed} fails at {self.problem.where(orbit)}; beyond, {failure}"
            if stop is not None and stop.ending is not Ending.NO_ADMISSIBLE_ORBIT:
                raise stop
            raise Stop(Ending.NO_ADMISSIBLE_ORBIT, detail)
        for one in beyond.smooth if beyond is not None and not failure else ():
            self.record_smooth(one)
        return state

    def beyond(self, orbit: Orbit, along: Vector) -> tuple[Orbit, Spot] | None:
        """Last orbit before a point at which the path ends, and state beyond; None if none."""
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
        return ""

    @abstractmethod
    def check(self, old: Spot, step: Step) -> None:
        """Raises Stop if the path ends within a step."""

    def closes(self, old: Spot, new: Spot) -> bool:
        """True if the path passes its first point between two states."""
        return False

    def reach_border(self, state: Spot) -> None:
        """Raises Stop at the border of the range."""
        raise Stop(Ending.REACHED, self.problem.where(state.orbit))
