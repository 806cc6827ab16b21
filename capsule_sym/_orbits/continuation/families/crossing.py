"""Continuation beyond an event: from one itinerary to the next, and to states beside a point."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import Status
from capsule_sym._orbits.continuation.families.family import (
    Event,
    Family,
    Problem,
    SmoothEvent,
    Spot,
    Stop,
    tangent,
)
from capsule_sym._orbits.continuation.families.locating import matching, smooth_between
from capsule_sym._orbits.continuation.parameter_paths import PathAxis
from capsule_sym._orbits.continuation.points.extended import EventSolution
from capsule_sym._orbits.continuation.points.kinds import DEGENERATE
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
            raise Stop(Status.CODIMENSION_TWO, "the segment of duration 0 merges with another")

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
        raise Stop(Status.NO_ADMISSIBLE_ORBIT, "the pull does not turn back where the slip begins")
    return (grows + math.copysign(math.sqrt(grows * (grows - falls)), grows)) / -falls


def _margin(beside: Restart | None, inequality: Inequality) -> tuple[bool, float]:
    """Admissibility of a state, and the value of an inequality; larger is better."""
    if beside is None:
        return False, -float("inf")
    found = matching(beside.state.held, inequality)
    return beside.state.admissible, float(found.value) if found else float("inf")
