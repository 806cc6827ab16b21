"""Curves of bifurcations in two parameters, and the curves that leave their special points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.checks import checked_seconds
from capsule_sym._map.labelled import Labelled
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.bifurcations import SMOOTH, Bifurcation
from capsule_sym._orbits.continuation.continuation import check_points
from capsule_sym._orbits.continuation.curve_points import CodimensionTwoPoint, CurvePoint
from capsule_sym._orbits.continuation.curve_run import RESONANCES, CurveRun
from capsule_sym._orbits.continuation.events import (
    CUSP,
    DEGENERATE,
    FOLD,
    GENERALIZED_DOUBLING,
    NEIMARK_SACKER,
    RESONANCE_1_1,
    RESONANCE_1_2,
)
from capsule_sym._orbits.continuation.normal_forms import doubled
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.continuation.path import corrected
from capsule_sym._orbits.continuation.states import OUT_OF_TIME, Axis, Ending, State, Stop
from capsule_sym._orbits.continuation.stepping import Continuation, vanishing
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.orbit import Orbit, columns_of
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, springless
from capsule_sym._parameters import Parameters

__all__ = ["CodimensionTwoPoint", "Curve", "CurvePoint", "check", "continue_bifurcation"]
__all__ += ["curves_from"]

_FINE = (Ending.REACHED, Ending.RETURNED, Ending.CODIMENSION_TWO)
_THERE = 1e-6  # least duration, beside a point, of a segment that has the duration 0 there
_APART = (3e-2, 1e-2, 1e-1)  # of a doubled orbit from that which doubles, where folds are sought
_LOOSE = 1e-6  # so near to that point rounding moves them along their curve
_BEGIN = (Ending.CODIMENSION_TWO, "the point from which the curve is followed")
# The type of the other curve through a point where this vanishes; None where there is none.
_OTHER = {
    CUSP: None,
    DEGENERATE: None,
    GENERALIZED_DOUBLING: FOLD,
    RESONANCE_1_1: NEIMARK_SACKER,
    RESONANCE_1_2: NEIMARK_SACKER,
}


_RESONANT = {resonance: kind for kind, resonance in RESONANCES.items()}


@dataclass(frozen=True)
class Curve(Labelled):
    """A curve of bifurcations in two parameters: points in order, and why each of its ends is.

    `origin` says from which point of codimension two the curve is followed, as "cusp" or such, and
    is empty for one from a bifurcation on a branch. All values are dimensionless.
    """

    type: str
    parameters: tuple[str, str]
    points: tuple[CurvePoint, ...]
    codimension_two: tuple[CodimensionTwoPoint, ...]
    endings: tuple[tuple[Ending, str], tuple[Ending, str]]
    origin: str = ""
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
        """Whether both ends are where a curve ends: at the ranges, where it began, in a point."""
        return all(end in _FINE for end, _ in self.endings)

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
        return min(self.endings, key=lambda end: end[0] in _FINE)

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
    max_seconds: float = math.inf,
) -> Curve:
    """The curve through a bifurcation in its parameter and a second one, within two ranges.

    The ranges, dimensionless, are those of the bifurcation's parameter and of the second, and hold
    the bifurcation; no step is longer than 1/`points` of either. Where another inequality of the
    itinerary fails, the point is located exactly and the curve goes on in the itinerary beyond.
    After `max_seconds` it ends with that status. Raises InvalidInput for a second parameter that is
    none or is the first, and for ranges that are not ascending, leave the parameters' own, or do
    not hold the bifurcation, and where beta varies from a bifurcation at beta = 0 of a motion that
    passes the spring.
    """
    first, orbit = bifurcation.parameter, bifurcation.orbit
    axes = _axes(orbit, (first, second), ranges)
    check_points(points)
    if "beta" in (first, second) and springless(orbit):
        allowed = (
            "> 0 where it varies: at 0 events of this motion come in pairs, beyond they do not"
        )
        raise InvalidInput("beta", 0.0, allowed)
    segment = bifurcation.segment
    if bifurcation.symmetry == KEPT:
        orbit, segment = halved_at(orbit, segment) or (orbit, segment)
    ending, limit = OUT_OF_TIME, Watch(checked_seconds(max_seconds))
    with backend("numpy") as numbers, np.errstate(all="ignore"), limit:
        try:
            starts = _both_ways(numbers, orbit, axes, bifurcation.type, segment)
            return _followed(bifurcation.type, starts, points)
        except Stop as stop:
            ending = stop.ending, stop.detail
    return Curve(bifurcation.type, (first, second), (), (), (ending, ending))


def curves_from(
    curve: Curve,
    ranges: tuple[tuple[float, float], tuple[float, float]],
    *,
    points: int = 50,
    known: Sequence[Curve] = (),
    max_seconds: float = math.inf,
) -> tuple[Curve, ...]:
    """The other curves that pass a curve's points of codimension two, within two ranges.

    At a multiplier 1 or -1 on a curve of border collisions it is that of folds or period doublings,
    at two border collisions, or at a degenerate one, that of the other collision, at a 1:1 or 1:2
    resonance that of Neimark-Sacker bifurcations, or from these that of folds or period doublings.
    None leaves a cusp: the curve of folds itself passes. At a generalized period doubling a curve
    of folds of the doubled orbits begins. Each curve is given once, and none that is among those
    `known`. The ranges are dimensionless. After `max_seconds` the last curve ends with that
    status. Raises InvalidInput as `continue_bifurcation` does.
    """
    check_points(points)
    found: list[Curve] = []
    kind, limit = curve.type, Watch(checked_seconds(max_seconds))
    with backend("numpy") as numbers, np.errstate(all="ignore"), limit:
        for point in curve.codimension_two:
            kind = _other(curve.type, point.types[1])
            passed = (_passes(one, kind, point) for one in (curve, *known, *found))
            if not kind or any(passed):
                continue
            axes = _axes(point.orbit, curve.parameters, ranges)
            try:
                starts = _beside_point(numbers, point, axes, kind)
            except Stop:
                continue
            if starts:
                new = _followed(kind, starts, points)
                meeting = replace(point, types=point.types[::-1], lines=point.lines[::-1])
                others = (one for one in new.codimension_two if not one.at(point.values))
                meetings = (meeting, *others)
                origin = f"{point.types[0]} and {point.types[1]}"
                found.append(replace(new, codimension_two=meetings, origin=origin))
        return tuple(found)
    return (*found, Curve(kind, curve.parameters, (), (), (OUT_OF_TIME, OUT_OF_TIME)))


def _other(kind: str, meets: str) -> str:
    """The type of the other curve through a point of a curve; empty where there is none."""
    if kind == NEIMARK_SACKER and meets in _RESONANT:
        return _RESONANT[meets]
    return _OTHER.get(meets, meets) or ""


class _Start(NamedTuple):
    """A state of a curve to follow it from, and whether the curve's other half has it too."""

    continuation: Continuation
    state: State
    shared: bool


def _axes(
    orbit: Orbit, names: tuple[str, str], ranges: tuple[tuple[float, float], tuple[float, float]]
) -> tuple[Axis, ...]:
    """What varies along curves, from a point within; raises InvalidInput."""
    check(orbit.parameters, names, ranges)
    axes = []
    for name, (low, high) in zip(names, ranges, strict=True):
        value = orbit.values[PARAMETERS.index(name)]
        if not low <= value <= high:
            raise InvalidInput(name, (low, high), f"an ascending range that holds {float(value)!r}")
        axes.append(Axis(ParameterPath(name), float(low), float(high)))
    return tuple(axes)


def _both_ways(
    numbers: Backend, orbit: Orbit, axes: tuple[Axis, ...], kind: str, segment: int | None
) -> list[_Start]:
    """The starts of both halves at an orbit; the first is that of a falling second parameter."""
    critical = kind if kind in SMOOTH else None
    continuations = [Continuation(numbers, orbit, axes, segment, critical) for _ in range(2)]
    u = continuations[0].unknowns(orbit.z, orbit.values)
    null = np.linalg.svd(continuations[0].equations(u).by)[2][-1]
    ways = (-null, null) if null[-1] > 0 else (null, -null)
    return [
        _Start(one, one.state(u, way), shared=True)
        for one, way in zip(continuations, ways, strict=True)
    ]


def _followed(kind: str, starts: Sequence[_Start], points: int) -> Curve:
    """The curve of a type from one or two starts."""
    runs = [CurveRun(start.continuation, kind, points) for start in starts]
    endings = [runs[0].go(starts[0].state)]
    one, other = runs[0], runs[-1]
    if len(runs) > 1 and endings[0][0] is not Ending.RETURNED:
        endings.append(other.go(starts[1].state))
    first = starts[0].continuation.axes
    names = (first[0].name, first[1].name)
    if len(endings) == 1:
        begin = (Ending.RETURNED, "") if endings[0][0] is Ending.RETURNED else _BEGIN
        return Curve(kind, names, (*one.points[::-1],), (*one.meetings[::-1],), (endings[0], begin))
    ahead = other.points[1:] if starts[0].shared else other.points
    return Curve(
        kind,
        names,
        (*one.points[::-1], *ahead),
        (*one.meetings[::-1], *other.meetings),
        (endings[0], endings[1]),
    )


def _passes(curve: Curve, kind: str, point: CodimensionTwoPoint) -> bool:
    """Whether a curve of a type passes a point."""
    return curve.type == kind and any(one.at(point.values) for one in curve.codimension_two)


def _beside_point(
    numbers: Backend, point: CodimensionTwoPoint, axes: tuple[Axis, ...], kind: str
) -> list[_Start]:
    """The starts of the other curve through a point, on the sides on which it is a motion."""
    orbit, segments, smooth = point.orbit, point.segments, kind in SMOOTH
    if point.types[1] == GENERALIZED_DOUBLING:
        return _doubled_folds(numbers, orbit, axes)
    if (half := halved_at(orbit, None)) is not None:
        orbit, _ = half
    if len(segments) == 1 and not smooth:
        return _both_ways(numbers, orbit, axes, kind, segments[0])
    if not segments:
        return _both_ways(numbers, orbit, axes, kind, None) if smooth else []
    # The curve's own segment, of duration 0 here, is there on one side of the point only.
    own, zero_segment = segments[0], None if smooth else segments[1]

    def continuation() -> Continuation:
        return Continuation(numbers, orbit, axes, zero_segment, kind if smooth else None)

    def crossed() -> Iterator[_Start]:
        one = continuation()
        beyond = one.cross(vanishing(orbit, own))
        if beyond is not None:
            yield _Start(one, beyond.state, shared=False)

    def kept() -> Iterator[_Start]:
        one = continuation()
        u = one.unknowns(orbit.z, orbit.values)
        index = 4 + own - (zero_segment is not None and zero_segment < own)
        for state in one.around(u):
            if state.u[index] > _THERE:
                yield _Start(one, state, shared=False)

    found = []
    for side in (kept, crossed):
        try:
            found += [start for start in side() if _holds(start.state)][:1]
        except (InvalidInput, Stop):
            continue
    return found


def _doubled_folds(numbers: Backend, orbit: Orbit, axes: tuple[Axis, ...]) -> list[_Start]:
    """The start of the folds of doubled orbits, from the generalized doubling of an orbit.

    Of doubled orbits whose halves are so far apart, to either side, which are the same, the fold
    is next to the point: the parameters differ by the square of that.
    """
    whole = doubled(numbers, orbit)
    continuation = Continuation(numbers, whole, axes, critical=FOLD)
    u = continuation.unknowns(whole.z, whole.values)
    along = np.append(np.linalg.svd(whole.system.by_z)[2][-1], np.zeros(len(axes)))
    for distance in _APART:
        solution = corrected(continuation.equations, u + distance * along, along, _LOOSE)
        if solution is None or not all(0 <= q <= 1 for q in solution.u[-len(axes) :]):
            continue
        state = continuation.state(solution.u, along, solution)
        if _holds(state):
            return [_Start(continuation, state, shared=False)]
    return []


def _holds(state: State) -> bool:
    return all(one.value > 0 for one in state.held)


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
