"""One half of a curve of bifurcations in two parameters: step by step, to its end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._native import TimeUp
from capsule_sym._orbits.continuation.bifurcations import (
    SmoothEvent,
    evaluate_test_functions,
    noise,
    rotations,
)
from capsule_sym._orbits.continuation.curve_points import CodimensionTwoPoint, CurvePoint
from capsule_sym._orbits.continuation.events import (
    DEGENERATE,
    FOLD,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    RESONANCE_1_1,
    RESONANCE_1_2,
    BorderCollision,
    Place,
    place,
)
from capsule_sym._orbits.continuation.path import corrected
from capsule_sym._orbits.continuation.states import OUT_OF_TIME, Ending, Event, State, Stop, where
from capsule_sym._orbits.continuation.stepping import FIRST, Continuation
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, OrbitStatus
from capsule_sym._orbits.shooting.symmetry import whole_orbit

_MOST_POINTS = 5_000
_UNIT = 2.0**-53
_ROUNDINGS = 8
_ILL = 1e-8  # uncertainty from which on a system of equations is taken for singular
RESONANCES = {FOLD: RESONANCE_1_1, PERIOD_DOUBLING: RESONANCE_1_2}
"""What a curve of rotations meets where both multipliers are those of a smooth bifurcation."""
_SADDLES = "the multipliers of product 1 are real"
_CLOSED = 1e-6  # unknowns of one point of a closed curve, found twice, differ by less
_RESONANT = 1e-6  # derivative of the characteristic polynomial at a double multiplier
_NEAR = 0.1  # how far from where a curve ends a degenerate point is looked for


class CurveRun:
    """One half of a curve of a bifurcation type, from a state of a continuation on."""

    def __init__(self, continuation: Continuation, kind: str, points: int) -> None:
        self.continuation, self.kind, self.axes = continuation, kind, continuation.axes
        self.largest = 1 / points
        self.points: list[CurvePoint] = []
        self.meetings: list[CodimensionTwoPoint] = []
        self.last: State | None = None

    def go(self, first: State) -> tuple[Ending, str]:
        """Follow the curve from a state to its end, and say why it ends."""
        try:
            return self._go(first)
        except TimeUp:
            return OUT_OF_TIME

    def _go(self, first: State) -> tuple[Ending, str]:
        begin, step = first.orbit.itinerary, FIRST
        try:
            self._add(first)
            self.last = first
            while len(self.points) < _MOST_POINTS:
                before = self.last
                self.last, step = self._step(before, step)
                if self.last.orbit.itinerary == begin and self._between(before, self.last, first):
                    raise Stop(Ending.RETURNED, where(self.last.orbit, self.axes))
        except Stop as stop:
            fine = (Ending.REACHED, Ending.RETURNED, Ending.CODIMENSION_TWO)
            if stop.ending not in fine and self.last and self._ends_in_point(self.last):
                return Ending.CODIMENSION_TWO, where(self.meetings[-1].orbit, self.axes)
            return stop.ending, stop.detail
        return Ending.TOO_MANY_POINTS, f"{_MOST_POINTS} points"

    def _between(self, old: State, new: State, first: State) -> bool:
        """Whether the curve passes its first point between two neighbours."""
        if old.orbit.itinerary != new.orbit.itinerary:
            return False
        step = new.u - old.u
        share = (first.u - old.u) @ step / (step @ step)
        if not 0 < share <= 1:
            return False
        there = old.u + share * step
        solution = corrected(self.continuation.equations, there, step / np.linalg.norm(step))
        return solution is not None and bool(np.linalg.norm(solution.u - first.u) < _CLOSED)

    def _place(self, orbit: Orbit, segment: int | None) -> Place:
        if segment is None:
            return Place(self.kind, "", ())
        found = place(orbit.itinerary, orbit.system, segment)
        return found or Place("corner of higher codimension", "", ())

    def _values(self, orbit: Orbit) -> tuple[float, float]:
        first, second = (axis.value(orbit.values) for axis in self.axes)
        return first, second

    def _add(self, state: State) -> None:
        tightest = self.continuation.tightest(state)
        segment, values = self.continuation.zero_segment, self._values(state.orbit)
        line = self._place(state.orbit, segment).line
        orbit, residual, status = state.orbit, float(state.orbit.residual), state.orbit.status
        orbit = whole_orbit(orbit)
        if self.continuation.critical is not None:
            test = abs(state.tests[self.continuation.critical])
            residual = max(residual, test)
            status = status if test <= noise(state.orbit) else OrbitStatus.NOT_CONVERGED
        self.points.append(
            CurvePoint(values, line, orbit, segment, tightest, residual, orbit.iterations, status)
        )

    def _step(self, state: State, step: float) -> tuple[State, float]:
        new, smooth, event, at_border, step = self.continuation.advance(state, step, self.largest)
        for name, one in smooth:
            self._meet_smooth(_named(self.kind, name, one.orbit), one, state, new)
        if self.kind == NEIMARK_SACKER and not rotations(new.orbit):
            last = self.meetings[-1].orbit if smooth else state.orbit
            raise Stop(Ending.CODIMENSION_TWO, f"{where(last, self.axes)}; beyond, {_SADDLES}")
        if event is not None:
            return self._cross(state, event), step
        self._add(new)
        if at_border:
            raise Stop(Ending.REACHED, where(new.orbit, self.axes))
        return new, step

    def _meet_smooth(self, name: str, one: SmoothEvent, old: State, new: State) -> None:
        here = self._place(one.orbit, self.continuation.zero_segment)
        values = np.array(self._values(one.orbit))
        moved = np.array(self._values(new.orbit)) - self._values(old.orbit)
        errors = np.array(one.uncertainties or abs(moved) * one.doubt)
        first, second = (errors + _ROUNDINGS * _UNIT * abs(values)).tolist()
        self.meetings.append(
            CodimensionTwoPoint(
                types=(here.type, name),
                lines=(here.line, ""),
                values=self._values(one.orbit),
                uncertainties=(first, second),
                residual=one.residual,
                iterations=one.iterations,
                status=one.status,
                failed="",
                itinerary_before=one.orbit.itinerary.whole,
                itinerary_after=one.orbit.itinerary.whole,
                orbit=whole_orbit(one.orbit),
                segments=()
                if self.continuation.zero_segment is None
                else (self.continuation.zero_segment,),
            )
        )

    def _cross(self, old: State, event: Event) -> State:
        """Record a point where a second segment has duration 0; go on in the itinerary beyond."""
        located = self._regular(event.located)
        at = located.orbit("numpy")
        zero_segment = None if self.continuation.zero_segment is None else located.segments[0]
        here, there = self._place(at, zero_segment), self._place(at, event.segment)
        stop, beyond, neighbour = None, None, None
        try:
            beyond = self.continuation.cross(event)
            neighbour = self.continuation.symmetric(beyond.state) if beyond else None
        except InvalidInput as error:
            stop = Stop(Ending.NO_ADMISSIBLE_ORBIT, str(error))
        except Stop as error:
            stop = error
        if self.meetings and self.meetings[-1].types[1] == DEGENERATE and self._met(at):
            self.meetings.pop()
        before, after = old.orbit.itinerary, neighbour.orbit.itinerary.whole if neighbour else None
        failed = event.failed.named(before)
        self._meet_border(located, at, (here, there), failed, (before.whole, after))
        if beyond is None or neighbour is None:
            message = f"{failed} fails at {where(at, self.axes)}"
            raise stop or Stop(Ending.NO_ADMISSIBLE_ORBIT, message)
        for name, one in beyond.smooth:
            self._meet_smooth(_named(self.kind, name, one.orbit), one, beyond.point, beyond.state)
        self._add(neighbour)
        return neighbour

    def _regular(self, located: BorderCollision) -> BorderCollision:
        """Where two segments vanish together, by a system of equations that is regular there.

        At a degenerate point their durations are not independent: one vanishes with the next
        derivative of its guard.
        """
        if len(located.segments) < 2 or max(located.uncertainties) < _ILL:
            return located
        return self._degenerate(located.orbit("numpy"), located.segments) or located

    def _degenerate(self, orbit: Orbit, segments: tuple[int, ...]) -> BorderCollision | None:
        """The point near an orbit at which the first of some segments is degenerate.

        Where a neighbour vanishes with it, one of all the conditions follows from the others.
        """
        z = orbit.z.copy()
        z[[4 + segment for segment in segments]] = 0.0
        continuation = Continuation(self.continuation.numbers, orbit, self.axes, segments[0])
        found = continuation.solved(replace(orbit, z=z), (DEGENERATE,), segments)
        near = found is not None and max(abs(found.z - z)) < _NEAR
        return found if near else None

    def _met(self, at: Orbit) -> bool:
        """Whether the last point of codimension two is at this orbit's parameters."""
        return bool(self.meetings) and self.meetings[-1].at(self._values(at))

    def _ends_in_point(self, state: State) -> bool:
        """Whether the curve has ended in a degenerate point, which is then recorded."""
        orbit, zero_segment = state.orbit, self.continuation.zero_segment
        known = self.meetings and self.meetings[-1].itinerary_after is None
        if known or zero_segment is None or orbit.itinerary.mirrored:
            return False
        n, found = len(orbit.itinerary), None
        adjacent = [
            k
            for k in ((zero_segment - 1) % n, (zero_segment + 1) % n)
            if orbit.durations[k] < _NEAR
        ]
        for segments in (
            *((k, zero_segment) for k in adjacent),
            *((zero_segment, k) for k in adjacent),
            (zero_segment,),
        ):
            found = found or self._degenerate(orbit, segments)
        if found is None:
            return False
        others = [k for k in found.segments if k != zero_segment]
        at = found.orbit("numpy")
        if not self._met(at):
            here = self._place(at, zero_segment)
            there = self._place(at, others[0]) if others else Place(DEGENERATE, "", ())
            found = found._replace(segments=(zero_segment, *others))
            self._meet_border(found, at, (here, there), "", (orbit.itinerary.whole, None))
        return True

    def _meet_border(
        self,
        located: BorderCollision,
        at: Orbit,
        places: tuple[Place, Place],
        failed: str,
        itineraries: tuple[Itinerary, Itinerary | None],
    ) -> None:
        """Record a point of border collisions, with the itineraries before it and beyond."""
        (here, there), (before, after) = places, itineraries
        first, second = (float(value) for value in located.uncertainties[-2:])
        self.meetings.append(
            CodimensionTwoPoint(
                types=(here.type, there.type),
                lines=(here.line, there.line),
                values=self._values(at),
                uncertainties=(first, second),
                residual=float(located.residual),
                iterations=located.iterations,
                status=at.status,
                failed=failed,
                itinerary_before=before,
                itinerary_after=after,
                orbit=whole_orbit(at),
                segments=located.segments,
            )
        )


def _named(kind: str, name: str, orbit: Orbit) -> str:
    """What vanishes at an orbit: a resonance where both multipliers of a rotation are 1 or -1."""
    resonance = RESONANCES.get(name, name)
    if kind != NEIMARK_SACKER or abs(evaluate_test_functions(orbit)[resonance]) > _RESONANT:
        return name
    return resonance
