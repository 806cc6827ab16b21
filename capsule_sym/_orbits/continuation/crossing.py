"""Continuation beyond an event: by equations, and by runs where events lie too close together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map import simulate
from capsule_sym._orbits.continuation import conditions
from capsule_sym._orbits.continuation.conditions import EventSolution, noise
from capsule_sym._orbits.continuation.kinds import DEGENERATE
from capsule_sym._orbits.continuation.locating import matching, smooth_between
from capsule_sym._orbits.continuation.parameter_paths import PathAxis
from capsule_sym._orbits.continuation.problem import (
    Event,
    Family,
    Problem,
    SmoothEvent,
    Spot,
    Stop,
    tangent,
)
from capsule_sym._orbits.shooting.admissibility import (
    DURATION,
    FAR,
    Inequality,
    inequalities,
    pull_rates,
    tightest,
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
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import newton_orbit, orbit_at
from capsule_sym._orbits.shooting.symmetry import (
    half_orbit,
    halved_at,
    symmetric,
    touches,
    whole_orbit,
)
from capsule_sym._parameters import SceneParameters

NEIGHBOUR_STEP = 1e-4  # distance from an event, in u, at which its two sides are evaluated
_NEIGHBOUR_SHARES = (1.0, 0.1, 1e-2, 1e-3)  # of it; a smaller one is used if another event is near
_JUMP = 1e9
"""Least jump of a test function, in units of its rounding: at a segment of duration 0 derivatives
have errors of the cube root of the unit."""
_PLACES = (0.0, 0.37, 1.0)  # of a range, at which the symmetry of motions is tested


def keeps_images(orbit: Orbit, axes: tuple[PathAxis, ...]) -> bool:
    """True if motions have mirror images over the whole range of the axes."""
    values = [float(value) for value in orbit.values]
    placed = (axis.placed(values, q) for axis in axes for q in _PLACES)
    return all(symmetric(orbit.scene.Parameters(*one)) for one in placed)


def first_half(orbit: Orbit, axes: tuple[PathAxis, ...]) -> Orbit | None:
    """First half of an orbit that is its own mirror image; None for any other.

    None if a varied parameter removes the symmetry, such as a load or the stiffness of one stop.
    """
    varies = {name for axis in axes for name in (axis.name, *dict(axis.path.ties))}
    (distance, stiffness), *others = orbit.scene.facts.STOPS
    if touches(orbit.itinerary) and not others:
        if orbit.value(stiffness) != 0 or stiffness in varies:
            return None
        # Without stiffness the stop changes nothing, wherever it is.
        far, number = orbit.parameters.replace(**{distance: FAR}), orbit.itinerary.period_number
        plain = orbit_at(far, _strobe(orbit, number).tolist(), number)
        if plain is None:
            return None
        orbit = conditions.orbit_at(orbit.numbers, orbit.values, plain.itinerary, plain.z)
    return half_orbit(orbit) if keeps_images(orbit, axes) else None


def vanishing(orbit: Orbit, segment: int) -> Event:
    """Event that belongs to a segment of duration 0."""
    itinerary, zero = orbit.itinerary, 0 * orbit.z[0]
    same_itinerary = Exchange(itinerary, orbit.z, tuple(range(len(itinerary))))
    solution = EventSolution(orbit, (segment,), orbit.residual, ())
    failed = Inequality(DURATION, segment, None, zero, zero)
    return Event(failed, segment, same_itinerary, solution, 0.0)


class Continuation(Family):
    """A family that is continued step by step, from one itinerary to the next."""

    def cross(self, event: Event) -> Restart | None:
        """Continue in the itinerary beyond an event, to a state next to it; None if there is none.

        Other events of the same orbit are crossed with it, as for equal forces in both directions.
        Raises Stop if the itineraries on the two sides do not share the condition, and InvalidInput
        if the fields beyond are no itinerary. The continuation may be left in another itinerary in
        each case.
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
            raise Stop(Status.CODIMENSION_TWO, "beyond, the orbit is not its own mirror image")
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
        self._check_continued(u)
        return self.neighbour(u, along, kinked), u

    def _without(self, orbit: Orbit, segment: int) -> tuple[Restart | None, Vector]:
        """Continue in the itinerary without a segment of duration 0, on its admissible side."""
        change, inequality = remove_segment(
            self.numbers, self.itinerary, orbit.z, orbit.system, segment
        )
        self._keep(change)
        self.itinerary = change.itinerary
        u = self.unknowns(replace(orbit, itinerary=change.itinerary, z=change.z))
        self._check_continued(u)
        both = [self.neighbour(u, side) for side in self.directions(u)]
        return max(both, key=lambda one: _margin(one, inequality)), u

    def _check_continued(self, u: Vector) -> None:
        """Raises Stop if the test function of a curve is not 0 at an orbit in the next itinerary.

        The multipliers jump where a drift begins to rest for a moment.
        """
        if self.critical is None:
            return
        orbit = self.orbit(u)
        if abs(self.tests(orbit)[self.critical]) > noise(orbit) * _JUMP:
            where = self.problem.where(orbit)
            raise Stop(Status.CODIMENSION_TWO, f"{where}; beyond, the multipliers are others")

    def symmetric(self, state: Spot) -> Spot:
        """State of the first half of the orbit, if the orbit is its own mirror image.

        Else the state itself, as on a curve of smooth bifurcations.
        """
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
            raise Stop(Status.CODIMENSION_TWO, "the segment of duration 0 merges with another")

    def directions(self, u: Vector) -> list[Vector]:
        """The two directions of the curve of solutions at u."""
        null = np.linalg.svd(self.evaluate(u).by)[2][-1]
        return [null, -null]

    def neighbour(self, u: Vector, along: Vector, straight: bool = False) -> Restart | None:
        """State next to u, in the direction of `along`; None if none is found.

        It is nearer to u if another event is near. If no state that is found is admissible, it is
        the farthest. `along` is the tangent itself if `straight`.
        """
        at = self.evaluate(u)
        try:
            direction = along / np.linalg.norm(along) if straight else tangent(at.by, along)
        except np.linalg.LinAlgError:
            return None
        states: list[Spot] = []
        for share in _NEIGHBOUR_SHARES:
            step = share * NEIGHBOUR_STEP * direction
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


def _ratio(orbit: Orbit, first: int) -> float:
    """Ratio of the durations of the slip after and before an edge or a stop, both starting at 0.

    The capsule's acceleration grows from 0 and falls again at the rates of the pull.
    """
    grows, falls = map(float, pull_rates(orbit.itinerary, orbit.system.flows, first))
    if grows * falls >= 0:
        raise Stop(Status.NO_ADMISSIBLE_ORBIT, "the pull does not turn back where the slip begins")
    return (grows + math.copysign(math.sqrt(grows * (grows - falls)), grows)) / -falls


def _margin(beside: Restart | None, inequality: Inequality) -> tuple[bool, float]:
    """Admissibility of a state, and the value of an inequality; larger is better."""
    if beside is None:
        return False, -float("inf")
    found = matching(beside.state.held, inequality)
    return beside.state.admissible, float(found.value) if found else float("inf")


_GAPS = 10.0 ** np.arange(-10, -3)
"""Distances beyond a point, as shares of the range: from rounding of an event to a short step."""
_HALVINGS = 24
"""Halvings of the interval in which the itinerary changes: to rounding from the longest gap."""
_LEAP = 10.0
"""Largest change of an orbit over a gap, in units of what its tangent leads to."""
_TRANSIENT = 200
"""Excitation periods after which a run next to a stable orbit is on it."""


class Junction(NamedTuple):
    """Orbits next to each other, before and after a change of itinerary."""

    before: Orbit
    after: Orbit


class Rejoining:
    """Search beyond an orbit of a branch, in the direction `way` of its parameter.

    `itinerary` is that of the branch before the orbit, which may have segments of duration 0;
    `steepness` is the change of the orbit's unknowns over that of the parameter's coordinate.
    """

    def __init__(
        self, problem: Problem, itinerary: Itinerary, orbit: Orbit, way: float, steepness: float
    ) -> None:
        (self.axis,), self.way, self.steepness = problem.axes, way, steepness
        self.itinerary, self.orbit = itinerary.whole.cyclic, whole_orbit(orbit)
        self.number = self.orbit.itinerary.period_number
        self.state = _strobe(self.orbit, self.number)

    def junction(self) -> Junction | None:
        """The nearest change of itinerary and the orbits beside it; None if no orbit is beyond."""
        before, below, beyond, above = self.orbit, 0.0, list[Orbit](), 0.0
        for gap in _GAPS.tolist():
            found = self._at(gap)
            if found is not None and found.itinerary.cyclic != self.itinerary:
                beyond, above = [found], gap
                break
            before, below = (before, below) if found is None else (found, gap)
        for _ in range(_HALVINGS if beyond else 0):
            gap = (below + above) / 2
            found = self._at(gap)
            if found is None:
                break
            if found.itinerary.cyclic == self.itinerary:
                before, below = found, gap
            else:
                above = gap
                beyond.append(found)
        # At the change itself the inequalities of both sides are 0.
        alike = (one for one in beyond[::-1] if one.itinerary.cyclic == beyond[-1].itinerary.cyclic)
        after = next((one for one in alike if tightest(one).value > 0), None)
        return None if after is None else Junction(before, after)

    def _at(self, gap: float) -> Orbit | None:
        """Admissible orbit at a distance `gap` in q beyond; None if none is near.

        The map runs from the state of the branch, in the fields that this selects, and Newton's
        method closes the run.
        """
        values = [float(value) for value in self.orbit.values]
        q = float(self.axis.share(values)) + self.way * gap
        # Beyond a grazing the orbit changes by the square root of the distance.
        near = (_LEAP * self.steepness * gap + math.sqrt(gap)) * (1 + abs(self.state).max())
        try:
            parameters = self.orbit.scene.Parameters(*self.axis.placed(values, q))
            found = _closed(parameters, self.state, self.number) if 0 <= q <= 1 else iter(())
            return next((one for one in found if self._apart(one) < near), None)
        except (ArithmeticError, InvalidInput):  # of parameters, their path, or a state
            return None

    def _apart(self, orbit: Orbit) -> float:
        """Least distance between the orbits' states at phase 0."""
        numbers = range(1, orbit.itinerary.period_number + 1)
        return float(min(abs(_strobe(orbit, number) - self.state).max() for number in numbers))


def _strobe(orbit: Orbit, number: int) -> Vector:
    """State of an orbit at phase 0, after so many excitation periods."""
    return np.array(orbit.trajectory()(number * orbit.parameters.period), dtype=float)


def _closed(parameters: SceneParameters, state: Vector, number: int) -> Iterator[Orbit]:
    """Orbits that Newton's method finds from a state, and from the state of a settled run."""
    found = newton_orbit(parameters, state, number)
    if found is not None:
        yield found
    run = simulate(parameters, state.tolist(), periods=_TRANSIENT * number, keep="final")
    for multiple in (1, 2):
        settled = orbit_at(parameters, run.final[1], number * multiple) if run.success else None
        if settled is not None:
            yield settled
