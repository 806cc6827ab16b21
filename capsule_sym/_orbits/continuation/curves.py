"""Curves of bifurcations in two parameters, and the points where two conditions meet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.labelled import Labelled
from capsule_sym._orbits.continuation.bifurcations import (
    SMOOTH,
    Bifurcation,
    SmoothEvent,
    noise,
    sorted_multipliers,
)
from capsule_sym._orbits.continuation.continuation import check_points
from capsule_sym._orbits.continuation.events import DEGENERATE, BorderCollision, Place, place
from capsule_sym._orbits.continuation.following import FIRST, Follower
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.continuation.path import Vector
from capsule_sym._orbits.continuation.states import Axis, Ending, Event, State, Stop, where
from capsule_sym._orbits.shooting.admissibility import Inequality
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, OrbitStatus, columns_of
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, springless, whole_orbit
from capsule_sym._parameters import Parameters

_MOST_POINTS = 5_000
_UNIT = 2.0**-53
_ROUNDINGS = 8
_ILL = 1e-8  # uncertainty from which on a system of equations is taken for singular
_NEAR = 0.1  # how far from where a curve ends a degenerate point is looked for
_SAME = 1e-9  # parameters of one point, found twice, differ by less


@dataclass(frozen=True)
class CurvePoint:
    """A bifurcating orbit, the values of the two parameters, the line, the tightest inequality.

    `segment` is the segment of duration 0, None on the curve of a smooth bifurcation. `residual` is
    the largest entry of the equations, that of the bifurcation among them, `iterations` counts
    Newton's steps, and `status` says whether they are solved.
    """

    values: tuple[float, float]
    line: str
    orbit: Orbit
    segment: int | None
    admissibility: Inequality
    residual: float
    iterations: int
    status: OrbitStatus

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the orbit, the largest modulus first.

        At a border collision they are those of the itinerary with the segment: only at a
        grazing-sliding bifurcation has the other itinerary others.
        """
        return sorted_multipliers(self.orbit)


@dataclass(frozen=True)
class CodimensionTwoPoint:
    """A point of a curve where a second condition holds, located exactly; dimensionless.

    `types` and `lines` are those of the curve and of the second condition; `values` the two
    parameters with bounds on their rounding errors. `itinerary_after` is None where the curve ends.
    """

    types: tuple[str, str]
    lines: tuple[str, str]
    values: tuple[float, float]
    uncertainties: tuple[float, float]
    residual: float
    iterations: int
    status: OrbitStatus
    failed: str
    itinerary_before: Itinerary
    itinerary_after: Itinerary | None
    orbit: Orbit


@dataclass(frozen=True)
class Curve(Labelled):
    """A curve of bifurcations in two parameters: points in order, and why each of its ends is."""

    type: str
    parameters: tuple[str, str]
    points: tuple[CurvePoint, ...]
    codimension_two: tuple[CodimensionTwoPoint, ...]
    endings: tuple[tuple[Ending, str], tuple[Ending, str]]
    dimension = "point"

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The points as columns, arrays of shape (n,).

        The two parameters have their own names; of each point there are the line, and its orbit's
        itinerary, period number, progression and start.
        """
        values = np.array([point.values for point in self.points], dtype=float).reshape(-1, 2)
        return {
            self.parameters[0]: values[:, 0],
            self.parameters[1]: values[:, 1],
            "line": np.array([point.line for point in self.points], dtype=np.str_),
            **columns_of([point.orbit for point in self.points]),
            "residual": np.array([float(point.residual) for point in self.points]),
            "status": np.array([str(point.status) for point in self.points], dtype=np.str_),
        }

    @property
    def success(self) -> bool:
        """Whether both ends are where the curve was to end: at the ranges, or where it began."""
        return all(end in (Ending.REACHED, Ending.RETURNED) for end, _ in self.endings)

    @property
    def status(self) -> Ending:
        """Why the curve ends: of the two ends the first that is not where it was to be."""
        return self._worst[0]

    @property
    def message(self) -> str:
        """The status in words."""
        return self._worst[1]

    @property
    def statistics(self) -> dict[str, Any]:
        """How many points there are, and Newton's steps to all of them."""
        steps = sum(point.iterations for point in self.points)
        return {"points": len(self.points), "iterations": steps}

    @property
    def _worst(self) -> tuple[Ending, str]:
        fine = (Ending.REACHED, Ending.RETURNED)
        return min(self.endings, key=lambda end: end[0] in fine)

    def attributes(self) -> dict[str, Any]:
        """The type of the bifurcations, and why the curve ends."""
        return {"type": self.type, "endings": [str(ending) for ending, _ in self.endings]}

    def __repr__(self) -> str:
        counts = f"{len(self.points)} points, {len(self.codimension_two)} of codimension two"
        ends = " and ".join(ending for ending, _ in self.endings)
        return f"<Curve of {self.type} in {', '.join(self.parameters)}: {counts}, ending {ends}>"


def continue_bifurcation(
    bifurcation: Bifurcation,
    second: str,
    ranges: tuple[tuple[float, float], tuple[float, float]],
    *,
    points: int = 50,
) -> Curve:
    """The curve through a bifurcation in its parameter and a second one, within two ranges.

    The ranges are those of the bifurcation's parameter and of the second, and hold the
    bifurcation; no step is longer than 1/`points` of either. Where another inequality of the
    itinerary fails, the point is located exactly and the curve goes on in the itinerary beyond.
    Raises InvalidInput for a second parameter that is none or is the first, and for ranges that are
    not ascending, leave the parameters' own, or do not hold the bifurcation, and where beta varies
    from a bifurcation at beta = 0 of a motion that passes the spring.
    """
    first = bifurcation.parameter
    orbit, axes = bifurcation.orbit, []
    check(orbit.parameters, (first, second), ranges)
    check_points(points)
    for name, (low, high) in zip((first, second), ranges, strict=True):
        value = orbit.values[PARAMETERS.index(name)]
        if not low <= value <= high:
            raise InvalidInput(name, (low, high), f"an ascending range that holds {float(value)!r}")
        axes.append(Axis(ParameterPath(name), float(low), float(high)))
    if "beta" in (first, second) and springless(orbit):
        allowed = (
            "> 0 where it varies: at 0 events of this motion come in pairs, beyond they do not"
        )
        raise InvalidInput("beta", 0.0, allowed)
    with backend("numpy") as numbers, np.errstate(all="ignore"):
        one, other = (
            _Curve(numbers, bifurcation, (axes[0], axes[1]), side, points) for side in (-1, 1)
        )
        back, ahead = one.go(), (Ending.RETURNED, "")
        if back[0] is not Ending.RETURNED:
            ahead = other.go()
    return Curve(
        bifurcation.type,
        (first, second),
        (*one.points[::-1], *other.points[1:]),
        (*one.meetings[::-1], *other.meetings),
        (back, ahead),
    )


def check(
    base: Parameters, names: tuple[str, str], ranges: tuple[tuple[float, float], ...]
) -> None:
    """Raises InvalidInput unless these are two parameters and ascending ranges of theirs."""
    first, second = names
    if first not in PARAMETERS:
        raise InvalidInput("first", first, f"one of {', '.join(PARAMETERS)}")
    if second not in PARAMETERS or second == first:
        others = (name for name in PARAMETERS if name != first)
        raise InvalidInput("second", second, f"one of {', '.join(others)}")
    try:
        pairs = [(low, high) for low, high in ranges]
        (_, _) = pairs
    except (TypeError, ValueError):
        allowed = f"two ranges, such as ((0.1, 2.0), (3.0, 3.3)) of {first} and {second}"
        raise InvalidInput("ranges", ranges, allowed) from None
    for name, (low, high) in zip(names, pairs, strict=True):
        for edge in (low, high):
            base.replace(**{name: edge})
        if not low < high:
            raise InvalidInput(name, (low, high), "an ascending range")


class _Curve:
    """One half of a curve, from the bifurcation on."""

    def __init__(
        self,
        numbers: Backend,
        bifurcation: Bifurcation,
        axes: tuple[Axis, Axis],
        side: int,
        points: int,
    ) -> None:
        critical = bifurcation.type if bifurcation.type in SMOOTH else None
        orbit, segment = bifurcation.orbit, bifurcation.segment
        if bifurcation.symmetry == KEPT:
            orbit, segment = halved_at(orbit, segment) or (orbit, segment)
        self.orbit = orbit
        self.follower = Follower(numbers, orbit, axes, segment, critical)
        self.bifurcation, self.axes, self.side, self.largest = bifurcation, axes, side, 1 / points
        self.points: list[CurvePoint] = []
        self.meetings: list[CodimensionTwoPoint] = []
        self.last: State | None = None

    def go(self) -> tuple[Ending, str]:
        """Follow the curve to its end, and say why it ends."""
        orbit = self.orbit
        u = self.follower.unknowns(orbit.z, orbit.values)
        try:
            self.last = self.follower.state(u, self._outwards(u))
            self._add(self.last)
            step = FIRST
            while len(self.points) < _MOST_POINTS:
                self.last, step = self._step(self.last, step)
                if self._back(self.last):
                    raise Stop(Ending.RETURNED, where(self.last.orbit, self.axes))
        except Stop as stop:
            if stop.ending is not Ending.REACHED and self.last is not None:
                self._at_end(self.last)
            return stop.ending, stop.detail
        return Ending.TOO_MANY_POINTS, f"{_MOST_POINTS} points"

    def _outwards(self, u: Vector) -> Vector:
        """The curve's direction, of which the side is that of the second parameter's change."""
        null = np.linalg.svd(self.follower.equations(u).by)[2][-1]
        return null * (self.side if null[-1] > 0 else -self.side)  # type: ignore[no-any-return]

    def _back(self, state: State) -> bool:
        """Whether the curve is closed: one step from its first point, in the same itinerary."""
        begin = self.orbit
        if state.orbit.itinerary != begin.itinerary or len(self.points) < 10:
            return False
        u = self.follower.unknowns(begin.z, begin.values)
        return bool(np.linalg.norm(state.u - u) < self.largest / 2)

    def _place(self, orbit: Orbit, segment: int | None) -> Place:
        if segment is None:
            return Place(self.bifurcation.type, "", ())
        found = place(orbit.itinerary, orbit.shot, segment)
        return found or Place("corner of higher codimension", "", ())

    def _values(self, orbit: Orbit) -> tuple[float, float]:
        first, second = (axis.value(orbit.values) for axis in self.axes)
        return first, second

    def _add(self, state: State) -> None:
        tightest = self.follower.tightest(state)
        segment, values = self.follower.born, self._values(state.orbit)
        line = self._place(state.orbit, segment).line
        orbit, residual, status = state.orbit, float(state.orbit.residual), state.orbit.status
        orbit = whole_orbit(orbit)
        if self.follower.critical is not None:
            test = abs(state.tests[self.follower.critical])
            residual = max(residual, test)
            status = status if test <= noise(state.orbit) else OrbitStatus.NOT_CONVERGED
        self.points.append(
            CurvePoint(values, line, orbit, segment, tightest, residual, orbit.iterations, status)
        )

    def _step(self, state: State, step: float) -> tuple[State, float]:
        new, smooth, event, at_border, step = self.follower.advance(state, step, self.largest)
        for name, one in smooth:
            self._meet_smooth(name, one, state, new)
        if event is not None:
            return self._cross(state, event), step
        self._add(new)
        if at_border:
            raise Stop(Ending.REACHED, where(new.orbit, self.axes))
        return new, step

    def _meet_smooth(self, name: str, one: SmoothEvent, old: State, new: State) -> None:
        here = self._place(one.orbit, self.follower.born)
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
            )
        )

    def _cross(self, old: State, event: Event) -> State:
        """Record a point where a second segment has duration 0; go on in the itinerary beyond."""
        located = self._regular(event.located)
        at = located.orbit("numpy")
        born = None if self.follower.born is None else located.segments[0]
        here, there = self._place(at, born), self._place(at, event.segment)
        stop, beside = None, None
        try:
            beside = self.follower.cross(event)
            beside = self.follower.symmetric(beside) if beside else None
        except InvalidInput as error:
            stop = Stop(Ending.NO_ADMISSIBLE_ORBIT, str(error))
        except Stop as error:
            stop = error
        if self.meetings and self.meetings[-1].types[1] == DEGENERATE:
            last = np.array(self.meetings[-1].values)
            if max(abs(last - self._values(at))) <= _SAME:
                self.meetings.pop()
        before, after = old.orbit.itinerary, beside.orbit.itinerary.whole if beside else None
        failed = event.failed.named(before)
        self._meet_border(located, at, (here, there), failed, (before.whole, after))
        if beside is None:
            message = f"{failed} fails at {where(at, self.axes)}"
            raise stop or Stop(Ending.NO_ADMISSIBLE_ORBIT, message)
        self._add(beside)
        return beside

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
        follower = Follower(self.follower.numbers, orbit, self.axes, segments[0])
        found = follower.solved(replace(orbit, z=z), (DEGENERATE,), segments)
        near = found is not None and max(abs(found.z - z)) < _NEAR
        return found if near else None

    def _at_end(self, state: State) -> None:
        """Record the degenerate point at which the curve may have ended."""
        orbit, born = state.orbit, self.follower.born
        if born is None or orbit.itinerary.mirrored:
            return
        n, found = len(orbit.itinerary), None
        beside = [k for k in ((born - 1) % n, (born + 1) % n) if orbit.durations[k] < _NEAR]
        for segments in (*((k, born) for k in beside), *((born, k) for k in beside), (born,)):
            found = found or self._degenerate(orbit, segments)
        if found is None:
            return
        others = [k for k in found.segments if k != born]
        at = found.orbit("numpy")
        here = self._place(at, born)
        there = self._place(at, others[0]) if others else Place(DEGENERATE, "", ())
        self._meet_border(found, at, (here, there), "", (orbit.itinerary.whole, None))

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
            )
        )
