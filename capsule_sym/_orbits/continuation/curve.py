"""A curve of bifurcations in two parameters, and the computation of one half of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import brief
from capsule_sym._native import TimeUp
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.bifurcations import (
    CodimensionTwoPoint,
    CurvePoint,
    solution_fields,
)
from capsule_sym._orbits.continuation.conditions import (
    EventSolution,
    evaluate_test_functions,
    has_rotations,
    noise,
    orbit_at,
)
from capsule_sym._orbits.continuation.crossing import Continuation
from capsule_sym._orbits.continuation.path import LEAST_STEP, PathRun, Step
from capsule_sym._orbits.continuation.problem import OUT_OF_TIME, Event, SmoothEvent, Spot, Stop
from capsule_sym._orbits.shooting.admissibility import LANDING
from capsule_sym._orbits.shooting.changes import insert_segment, rotated
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, columns_of
from capsule_sym._orbits.shooting.symmetry import whole_orbit

_SINGULAR_UNCERTAINTY = 1e-8
"""Of a codimension-two point, above which its equations count as singular."""
_DEGENERATE_DISTANCE = 0.1  # from the end of a curve, within which a degenerate point is sought
_RESONANCE_TOLERANCE = 1e-6
"""Derivative of the characteristic polynomial at a double multiplier 1 or -1."""
_MOST_CURVE_POINTS = 5_000  # of each half of a curve

_FINE = (Status.REACHED, Status.RETURNED, Status.CODIMENSION_TWO)


@dataclass(frozen=True)
class Curve(Labelled):
    """Curve of bifurcations in two parameters: points in order, and the reasons for its ends.

    `endings` has the status and the message of both ends, that at the first point first. All values
    are dimensionless.
    """

    type: str
    parameters: tuple[str, str]
    points: tuple[CurvePoint, ...]
    codimension_two: tuple[CodimensionTwoPoint, ...]
    endings: tuple[tuple[Status, str], tuple[Status, str]]

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Points as columns, arrays of shape (n,).

        The two parameters have their own names. Each point has its line, residual and status, the
        largest modulus of its multipliers, and of its orbit the itinerary, period number,
        progression, average velocity and the state at the start of its first segment, which is not
        at phase 0.
        """
        values = np.array([point.values for point in self.points], dtype=float).reshape(-1, 2)
        return {
            self.parameters[0]: values[:, 0],
            self.parameters[1]: values[:, 1],
            "line": np.array([point.line for point in self.points], dtype=np.str_),
            "largest_multiplier": np.array([abs(one.multipliers[0]) for one in self.points]),
            **columns_of([point.orbit for point in self.points]),
            "residual": np.array([float(point.residual) for point in self.points]),
            "status": np.array([str(point.status) for point in self.points], dtype=np.str_),
        }

    @property
    def success(self) -> bool:
        """True if both ends are regular.

        Such an end is at the border of a range, in a codimension-two point, or at the start, to
        which a closed curve returns.
        """
        return all(end in _FINE for end, _ in self.endings)

    @property
    def status(self) -> Status:
        """Reason of the first irregular end; without one, of the first end."""
        return self._worst[0]

    @property
    def message(self) -> str:
        """Message of the first irregular end; without one, of the first end."""
        return self._worst[1]

    @property
    def _worst(self) -> tuple[Status, str]:
        return min(self.endings, key=lambda end: end[0] in _FINE)

    def __repr__(self) -> str:
        points, two = counted(len(self.points), "point"), len(self.codimension_two)
        text = f"{points}, {two} codimension-two, {self.type}"
        return brief(self, text, f"in {' and '.join(self.parameters)}")


_NEAR_HALVES, _EQUAL_HALVES = 1e-2, 1e-3
"""Largest distances in state and time of halves, where a curve has ended and where it is ended."""
_NEAR_POINT = 1e-2
"""Shares of the ranges within which unsolved points are those of a solved one."""
_SADDLES = "the multipliers of product 1 are real"


class CurveRun(PathRun):
    """One half of a curve of a bifurcation type, from a state of a continuation."""

    _crossing = False
    """True between a codimension-two point and the next point of the curve."""

    def __init__(self, continuation: Continuation, kind: str, points: int) -> None:
        super().__init__(continuation, points, _MOST_CURVE_POINTS)
        self.kind = kind
        self.points: list[CurvePoint] = []
        self.codimension_two: list[CodimensionTwoPoint] = []

    def go(self, first: Spot) -> tuple[Status, str]:
        """Continue the curve from a state to its end; returns the reason for the end."""
        ending, detail = self.follow(lambda: first)
        if ending not in (Status.NOT_CONVERGED, Status.NO_ADMISSIBLE_ORBIT):
            return ending, detail
        named = any(point.itinerary_after is None for point in self.codimension_two[-1:])
        ends = () if named else (self._ends_halved, self._ends_in_point)
        try:
            if self.last and any(end(self.last) for end in ends):
                where = self.problem.where(self.codimension_two[-1].orbit)
                return Status.CODIMENSION_TWO, where
        except TimeUp:
            return OUT_OF_TIME
        if self._crossing:
            self.codimension_two[-1] = replace(self.codimension_two[-1], itinerary_after=None)
            return Status.CODIMENSION_TWO, detail
        if self.last and self.unlocated:
            self._record_unlocated(self.last)
        return ending, detail

    def check(self, old: Spot, step: Step) -> None:
        """Raises Stop where a Neimark-Sacker curve ends: beyond, the multipliers are real.

        Also where the folds of doubled orbits end: beyond, the halves exchange places.
        """
        if self.kind == kinds.FOLD and self._halves_meet(old, step.state):
            raise Stop(Status.CODIMENSION_TWO, self.problem.where(self.codimension_two[-1].orbit))
        if self.kind == kinds.NEIMARK_SACKER and not has_rotations(step.state.orbit):
            last = self.codimension_two[-1].orbit if step.smooth else old.orbit
            detail = f"{self.problem.where(last)}; beyond, {_SADDLES}"
            raise Stop(Status.CODIMENSION_TWO, detail)

    def add(self, state: Spot) -> None:
        tightest, orbit = self.continuation.tightest(state), state.orbit
        segment, critical = self.continuation.zero_segment, self.continuation.critical
        test = 0.0 if critical is None else abs(state.tests[critical])
        solved = orbit.success and (critical is None or test <= noise(orbit))
        point = CurvePoint(
            values=self._values(orbit),
            line=self._place(orbit, segment).line,
            orbit=whole_orbit(orbit),
            segment=segment,
            admissibility=tightest,
            residual=max(float(orbit.residual), test),
            iterations=orbit.iterations,
            status=Status.CONVERGED if solved else Status.NOT_CONVERGED,
        )
        self.points.append(point)
        self._crossing = False

    def _place(self, orbit: Orbit, segment: int | None) -> kinds.EventType:
        if segment is None:
            return kinds.EventType(self.kind)
        return kinds.place(orbit, segment)

    def _values(self, orbit: Orbit) -> tuple[float, float]:
        first, second = self.problem.values(orbit)
        return first, second

    def record_smooth(self, one: SmoothEvent) -> None:
        found, segment = one.solution, self.continuation.zero_segment
        found = found._replace(
            uncertainties=tuple(self.errors(found)), segments=() if segment is None else (segment,)
        )
        orbit, name, resonance = found.orbit, one.type, kinds.RESONANCES.get(one.type)
        if self.kind == kinds.NEIMARK_SACKER and resonance is not None:
            # Both multipliers of a rotation are 1 or -1.
            size = abs(evaluate_test_functions(orbit)[resonance])
            near = size <= _RESONANCE_TOLERANCE
            name = resonance if near else name
        whole, places = orbit.itinerary.whole, (self._place(orbit, segment), kinds.EventType(name))
        self._record(found, places, (whole, whole), solved=one.solved)

    def _record(
        self,
        found: EventSolution,
        places: tuple[kinds.EventType, kinds.EventType],
        itineraries: tuple[Itinerary, Itinerary | None],
        failed: str = "",
        solved: bool = True,
    ) -> None:
        """Record a codimension-two point, with the itineraries before and after it."""
        here, there = places
        first, second = (float(value) for value in found.uncertainties[-2:])
        point = CodimensionTwoPoint(
            types=(here.type, there.type),
            lines=(here.line, there.line),
            values=self._values(found.orbit),
            uncertainties=(first, second),
            failed=failed,
            itinerary_before=itineraries[0],
            itinerary_after=itineraries[1],
            segments=found.segments,
            **solution_fields(found, solved),
        )
        self.codimension_two.append(point)

    def failure(self, state: Spot) -> str:
        return ""  # a degenerate point may be next to this one: `add` has the inequalities

    def record_event(
        self, event: Event, old: Spot, new: Spot, beyond: Spot | None, failed: str
    ) -> Orbit:
        found = self._regular(event.solution)
        at, segment = found.orbit, None if self.continuation.critical else found.segments[0]
        places = self._place(at, segment), self._place(at, event.segment)
        after = beyond and beyond.orbit.itinerary.whole
        known, self._crossing = self.codimension_two, True
        if known and known[-1].at(self._values(at)):
            if known[-1].types[1] == kinds.DEGENERATE:
                known.pop()
            elif after is None:
                return at  # conditions coincide: the curve ends at the point that it passes
        self._record(found, places, (old.orbit.itinerary.whole, after), failed)
        return at

    def _regular(self, found: EventSolution) -> EventSolution:
        """Point where two segments vanish together, from equations that are regular there.

        At a degenerate point their durations are dependent: one vanishes with the next derivative
        of its guard.
        """
        ill = max(found.uncertainties) >= _SINGULAR_UNCERTAINTY
        if len(found.segments) < 2 or not ill:
            return found
        return self._degenerate(found.orbit, found.segments) or found

    def _degenerate(self, orbit: Orbit, segments: tuple[int, ...]) -> EventSolution | None:
        """Point near an orbit at which the first of several segments is degenerate.

        If a neighbour vanishes with it, one of all conditions follows from the others.
        """
        return self._vanishing(orbit, segments, (kinds.DEGENERATE,))

    def _vanishing(
        self, orbit: Orbit, segments: tuple[int, ...], names: tuple[str, ...] = ()
    ) -> EventSolution | None:
        """Point near an orbit at which segments and test functions vanish together."""
        z = orbit.z.copy()
        z[[kinds.DURATIONS + segment for segment in segments]] = 0.0
        continuation = Continuation(self.problem, orbit, segments[0])
        found = continuation.solved(replace(orbit, z=z), names, segments)
        near = _DEGENERATE_DISTANCE
        return found if found is not None and max(abs(found.orbit.z - z)) < near else None

    def _record_unlocated(self, state: Spot) -> None:
        """Record the point next to the last state where inequalities fail, as not solved."""
        orbit, failed = state.orbit, " and ".join(self.unlocated)
        length = 2 * LEAST_STEP  # of the last step that was tried, at most
        sizes = (abs(axis.width) * length for axis in self.problem.axes)
        here = EventSolution(orbit, self.continuation.segments, orbit.residual, tuple(sizes))
        places = self._place(orbit, self.continuation.zero_segment), kinds.HIGHER
        self._record(here, places, (orbit.itinerary.whole, None), failed, solved=False)

    def _halves_meet(self, old: Spot, new: Spot) -> bool:
        """True if the halves of an orbit become equal in a step or ahead; the point is recorded."""
        if old.orbit.itinerary.period_number % 2:
            return False
        before, after = map(_between_halves, (old.orbit, new.orbit))
        if before @ after < 0:  # they exchange places
            share = before @ before / (before @ before - before @ after)
            return self._halved(self.continuation.orbit(old.u + share * (new.u - old.u)), math.inf)
        size, small = (float(np.linalg.norm(one)) for one in (before, after))
        if not small < min(_EQUAL_HALVES, size):
            return False
        return self._halved(new.orbit, _EQUAL_HALVES, new.u - old.u)

    def _ends_halved(self, state: Spot) -> bool:
        """True if the halves of a doubled orbit have become equal: the point is then recorded."""
        ahead = state.tangent if self.kind == kinds.FOLD else None
        return self._halved(state.orbit, _NEAR_HALVES, ahead)

    def _halved(self, orbit: Orbit, near: float, along: Vector | None = None) -> bool:
        """True if the curve ends next to an orbit whose halves are so near; the point is recorded.

        The point is within the ranges, and if `along` is given ahead in this direction of u.
        Folds of doubled orbits end where their half doubles, and a segment vanishes that only one
        half has; if both have the same segments, they end where that doubling is degenerate.
        """
        own, folds = self.continuation.zero_segment, self.kind == kinds.FOLD
        half = _half(orbit, own, near) if folds or own is not None else None
        if half is None:
            return False
        guess, segment = half
        names: tuple[str, ...] = (kinds.PERIOD_DOUBLING,)
        if segment is None:
            names = *names, kinds.GENERALIZED_DOUBLING
        family = Continuation(self.problem, guess, segment)
        found = family.solved(guess, names, family.segments)
        if found is None or abs(found.orbit.z - guess.z).max() > _DEGENERATE_DISTANCE:
            return False
        shares, here = self._shares(found.orbit), self._shares(orbit)
        behind = along is not None and float((shares - here) @ along[-2:]) < 0
        if behind or not all(abs(shares - 0.5) <= 0.5):
            return False
        while self.codimension_two and self._is_unsolved(self.codimension_two[-1], shares):
            self.codimension_two.pop()  # of the doubled orbit's equations, singular at this point
        there = kinds.EventType(names[-1])
        if segment is not None:
            there = kinds.place(found.orbit, segment)
        both = kinds.EventType(kinds.FOLD), there
        if not folds:
            both = there, kinds.EventType(kinds.PERIOD_DOUBLING)
        self._record(found, both, (orbit.itinerary.whole, None))
        return True

    def _is_unsolved(self, point: CodimensionTwoPoint, shares: Vector) -> bool:
        """True for an unsolved point next to these shares of the ranges."""
        apart = max(abs(self._shares(point.orbit) - shares))
        return not point.success and bool(apart < _NEAR_POINT)

    def _shares(self, orbit: Orbit) -> Vector:
        """Places of the parameters in their ranges, (2,)."""
        return np.array([axis.share(orbit.values) for axis in self.problem.axes], dtype=float)

    def _ends_in_point(self, state: Spot) -> bool:
        """True if the curve has ended in a degenerate point, which is then recorded."""
        # After a failed crossing the continuation has another itinerary than the last point.
        orbit, own = state.orbit, self.points[-1].segment
        known = self.codimension_two[-1:]
        if own is None or orbit.itinerary.mirrored:
            return False
        n, near = len(orbit.itinerary), _DEGENERATE_DISTANCE
        adjacent = [k for k in ((own - 1) % n, (own + 1) % n) if orbit.durations[k] < near]
        tried = (*((k, own) for k in adjacent), *((own, k) for k in adjacent), (own,))
        solutions = (self._degenerate(orbit, segments) for segments in tried)
        found = next((one for one in solutions if one is not None), None)
        if found is None:
            found = self._lands(state, own, adjacent)
            if found is None:
                return False
            own = found.segments[0]
        others = [k for k in found.segments if k != own]
        at = found.orbit
        if not any(point.at(self._values(at)) for point in known):
            there = self._place(at, others[0]) if others else kinds.EventType(kinds.DEGENERATE)
            found = found._replace(segments=(own, *others))
            self._record(found, (self._place(at, own), there), (orbit.itinerary.whole, None))
        return True

    def _lands(self, state: Spot, own: int, adjacent: Sequence[int]) -> EventSolution | None:
        """Point near a state at which a drift lands with the pull at its bound.

        The segment of the curve vanishes there with the neighbours and the rest that is inserted.
        """
        orbit, numbers = state.orbit, self.problem.numbers
        for one in state.held:
            if one.kind != LANDING or not one.value < _DEGENERATE_DISTANCE or not adjacent:
                continue
            try:
                change, rest = insert_segment(numbers, orbit.itinerary, orbit.z, orbit.system, one)
            except InvalidInput:  # the fields are no itinerary
                continue
            kept = [k for k in (change.kept[k] for k in (own, *adjacent)) if k is not None]
            like = replace(orbit, itinerary=change.itinerary, z=change.z)
            found = self._vanishing(like, (kept[0], rest, *kept[1:]))
            if found is not None:
                return found
        return None


def _between_halves(orbit: Orbit) -> Vector:
    """Change of the state from an orbit's start to half its time later, (3,)."""
    motion = orbit.trajectory()
    first, last = motion.span
    begin, middle = motion([first, (first + last) / 2])[:, :3]
    return np.asarray(middle - begin)


def _half(orbit: Orbit, own: int | None, near: float) -> tuple[Orbit, int | None] | None:
    """Half of a doubled orbit with its segment of duration 0, as a guess, and its index there.

    The segment may be absent from the other half. Without its index `own` it is the first that only
    one half has, or None if both have the same. None if no two states half the time apart differ by
    less than `near`.
    """
    itinerary, n, durations = orbit.itinerary, len(orbit.itinerary), orbit.durations
    if itinerary.period_number % 2 or itinerary.mirrored:
        return None
    states = [np.array(flow.start, dtype=float) for flow in orbit.system.flows]
    found = []
    for start, count in product(range(n), range(1, n)):
        late = durations[(start + np.arange(count)) % n].sum() - durations.sum() / 2
        apart = max(abs(late), abs(states[start] - states[(start + count) % n]).max())
        inside = 2 * count >= n if own is None else (own - start) % n < count
        if inside and apart < near:
            found.append((apart, start, count))
    if not found:
        return None
    _, start, count = min(found)
    turned = rotated(orbit.numbers, itinerary, orbit.z, orbit.system, start)
    fields, others = turned.itinerary.fields[:count], turned.itinerary.fields[count:]
    segment = None if own is None else (own - start) % n
    if own is None and fields != others:
        if len(fields) == len(others):
            return None
        pairs = zip(fields, (*others, None), strict=False)
        segment = next(k for k, (one, other) in enumerate(pairs) if one != other)
    try:
        once = Itinerary.of(fields, itinerary.period_number // 2, scene=itinerary.scene)
    except InvalidInput:
        return None
    z = turned.z[: kinds.DURATIONS + count]
    return orbit_at(orbit.numbers, orbit.values, once, z), segment
