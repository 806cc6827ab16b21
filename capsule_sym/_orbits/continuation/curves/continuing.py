"""Curves of bifurcations, and the curves that start at their codimension-two points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._orbits.continuation.curves.curve import Curve, CurveRun
from capsule_sym._orbits.continuation.families.crossing import (
    Continuation,
    Restart,
    doubled_starts,
    keeps_images,
    vanishing,
)
from capsule_sym._orbits.continuation.families.family import OUT_OF_TIME, Problem, Spot, Stop
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath, PathAxis
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation, CodimensionTwoPoint
from capsule_sym._orbits.continuation.settings import DEFAULT, ContinuationSettings, computing
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, springless
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters

_BEGIN = (Status.CODIMENSION_TWO, "the point at which the curve starts")
# Type of the other curve through a point where this test function vanishes; None if none.
_OTHER = {
    kinds.CUSP: None,
    kinds.DEGENERATE: None,
    kinds.GENERALIZED_DOUBLING: kinds.FOLD,
    kinds.RESONANCE_1_1: kinds.NEIMARK_SACKER,
    kinds.RESONANCE_1_2: kinds.NEIMARK_SACKER,
}
_RESONANT = {resonance: kind for kind, resonance in kinds.RESONANCES.items()}

Range = tuple[float, float]
Ranges = tuple[Range, Range]


def continue_bifurcation(
    bifurcation: Bifurcation,
    second: str,
    ranges: Ranges,
    *,
    points: int = 50,
    settings: ContinuationSettings = DEFAULT,
    max_seconds: float = math.inf,
) -> Curve:
    """Curve through a bifurcation in its parameter and a second one, within two ranges.

    The curve is followed in both directions until a parameter leaves its range. No step is longer
    than 1/`points` of either range. Where another inequality of the itinerary fails, the point is
    located exactly, and the curve continues in the itinerary beyond.

    Parameters
    ----------
    bifurcation : Bifurcation
        Bifurcation at which the curve starts, as `branch.at("PD1")` gives; dimensionless.
    second : str
        Name of the second parameter, other than that of the bifurcation.
    ranges : pair of pairs of float, ((low, high), (low, high))
        Ranges of the bifurcation's parameter and of the second one, dimensionless. Each is
        ascending, within the parameter's own range, and contains the value of the bifurcation.
    points : int, default 50, 1 to 5,000
        Least number of steps over each range.
    settings : ContinuationSettings, default ContinuationSettings()
        Step lengths and tolerances, dimensionless.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    Curve
        Points in order, codimension-two points, and `endings` with the status and the message of
        both ends. After `max_seconds` an end has status "time-limit".

    Raises
    ------
    InvalidInput
        For a second parameter that is unknown or is the first. For ranges that are not ascending,
        exceed the parameters' own, or do not contain the bifurcation. If the stiffness of a stop
        varies from 0 for a motion that passes the stop. For a symmetry breaking, if the motions do
        not keep their mirror images on the curve.

    Notes
    -----
    One condition is added to the equations of the orbit: a segment of duration 0, or a zero of the
    test function. The curve is followed by pseudo-arclength. At a codimension-two point two
    conditions are solved for as one system, with a bound on the rounding error of the solution.

    See Also
    --------
    curves_from : other curves through the codimension-two points.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.9)), "alpha", 1.0, points=4)
    >>> ranges = (0.9, 1.0), (3.2, 3.4)
    >>> curve = cs.continue_bifurcation(branch.at("AS1"), "gamma", ranges, points=5)
    >>> print(curve.type, [str(status) for status, _ in curve.endings])
    adding-sliding ['reached', 'reached']
    >>> print([round(value, 6) for value in curve.points[0].values])
    [0.940605, 3.2]
    """
    first, orbit = bifurcation.parameter, bifurcation.orbit
    axes = _axes(orbit, (first, second), ranges)
    stiffnesses = [name for _, name in orbit.scene.facts.STOPS if name in (first, second)]
    if stiffnesses and springless(orbit):
        allowed = "> 0 if it varies, for a motion that passes the stop"
        raise InvalidInput(stiffnesses[0], 0.0, allowed)
    segment, critical = bifurcation.segment, bifurcation.type
    images = keeps_images(orbit, axes)
    if critical == kinds.SYMMETRY_BREAKING:
        critical = kinds.PERIOD_DOUBLING  # of the half
        if not images:
            raise InvalidInput("second", second, "one with which motions keep their mirror images")
    if bifurcation.symmetry == KEPT and images:
        orbit, segment = halved_at(orbit, segment) or (orbit, segment)
    ending = OUT_OF_TIME
    with computing(points, settings, max_seconds, orbit.scene) as (numbers, limit), limit:
        try:
            starts = _both_ways(Problem(numbers, axes, settings), orbit, critical, segment)
            return _followed(bifurcation.type, starts, points)
        except Stop as stop:
            ending = stop.ending, stop.detail
    return Curve(bifurcation.type, (first, second), (), (), (ending, ending))


def curves_from(
    curve: Curve,
    ranges: Ranges,
    *,
    points: int = 50,
    known: Sequence[Curve] = (),
    settings: ContinuationSettings = DEFAULT,
    max_seconds: float = math.inf,
) -> tuple[Curve, ...]:
    """Other curves that pass the codimension-two points of a curve, within two ranges.

    The other curve depends on the point:

    - a multiplier 1 or -1 on a curve of border collisions: folds or period doublings;
    - two border collisions, or a degenerate one: the other border collision;
    - a 1:1 or 1:2 resonance: Neimark-Sacker bifurcations, or from these folds or period doublings;
    - a cusp: none, since the curve of folds itself passes it;
    - a generalized period doubling: folds of the doubled orbits.

    Each curve is given once, without those in `known`. A point gives none if its other curve has no
    admissible motion there.

    Parameters
    ----------
    curve : Curve
        Curve with codimension-two points, as `continue_bifurcation` gives.
    ranges : pair of pairs of float, ((low, high), (low, high))
        Ranges of the curve's two parameters, dimensionless. Each is ascending, within the
        parameter's own range, and contains the codimension-two points.
    points : int, default 50, 1 to 5,000
        Least number of steps over each range.
    known : sequence of Curve, default ()
        Curves that are not to be given again.
    settings : ContinuationSettings, default ContinuationSettings()
        Step lengths and tolerances, dimensionless.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    tuple of Curve
        The curves. `origin` of each names the two conditions of the point at which it starts. After
        `max_seconds` the last curve ends with status "time-limit".

    Raises
    ------
    InvalidInput
        For ranges as in `continue_bifurcation`; they are checked if another curve may pass a point.
        Also for a number of points or a time that is not allowed.

    See Also
    --------
    continue_bifurcation : curve of a bifurcation.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.3)), "alpha", 0.4, points=3)
    >>> ranges = (0.3, 0.4), (0.0478, 0.05)
    >>> curve = cs.continue_bifurcation(branch.at("AS1"), "zeta", ranges, points=3)
    >>> print([one.types for one in curve.codimension_two])
    [('adding-sliding', 'period doubling')]
    >>> [other] = cs.orbits.curves_from(curve, ranges, points=3)
    >>> print(other.type, "from", other.origin)
    period doubling from adding-sliding and period doubling
    """
    found: list[Curve] = []
    kind = curve.type
    with computing(points, settings, max_seconds, _scene(curve)) as (numbers, limit), limit:
        for point in curve.codimension_two:
            kind = _other(curve.type, point.types[1])
            passed = (_passes(one, kind, point) for one in (curve, *known, *found))
            if not kind or any(passed):
                continue
            problem = Problem(numbers, _axes(point.orbit, curve.parameters, ranges), settings)
            try:
                starts = _beside_point(problem, point, kind)
            except Stop:
                continue
            if starts:
                new = _followed(kind, starts, points)
                shared = replace(point, types=point.types[::-1], lines=point.lines[::-1])
                others = (one for one in new.codimension_two if not one.at(point.values))
                origin = f"{point.types[0]} and {point.types[1]}"
                found.append(replace(new, codimension_two=(shared, *others), origin=origin))
        return tuple(found)
    return (*found, Curve(kind, curve.parameters, (), (), (OUT_OF_TIME, OUT_OF_TIME)))


def _other(kind: str, meets: str) -> str:
    """Type of the other curve through a point of a curve; empty if there is none."""
    if kind == kinds.NEIMARK_SACKER and meets in _RESONANT:
        return _RESONANT[meets]
    return _OTHER.get(meets, meets) or ""


def _passes(curve: Curve, kind: str, point: CodimensionTwoPoint) -> bool:
    return curve.type == kind and any(one.at(point.values) for one in curve.codimension_two)


def _scene(curve: Curve) -> Scene:
    """Scene of a curve's points."""
    return next((one.orbit.scene for one in (*curve.codimension_two, *curve.points)), CAPSULE)


def _axes(orbit: Orbit, names: tuple[str, str], ranges: Ranges) -> tuple[PathAxis, ...]:
    """Axes of two parameters with a point within their ranges; raises InvalidInput."""
    check(orbit.parameters, names, ranges)
    axes = []
    for name, (low, high) in zip(names, ranges, strict=True):
        value = orbit.value(name)
        if not low <= value <= high:
            raise InvalidInput(
                name, (low, high), f"an ascending range that contains {float(value)!r}"
            )
        axes.append(PathAxis(ParameterPath(name, scene=orbit.scene), float(low), float(high)))
    return tuple(axes)


def _both_ways(problem: Problem, orbit: Orbit, kind: str, segment: int | None) -> list[Restart]:
    """Starts of both halves at an orbit; on the first the second parameter decreases."""
    critical = kind if kind in kinds.SMOOTH else None
    both = [Continuation(problem, orbit, segment, critical) for _ in range(2)]
    u = both[0].unknowns(orbit)
    ways = sorted(both[0].directions(u), key=lambda way: float(way[-1]) > 0)
    return [Restart(one, one.state(u, way)) for one, way in zip(both, ways, strict=True)]


def _followed(kind: str, starts: Sequence[Restart], points: int) -> Curve:
    """Curve of a type from one or two starts."""
    runs = [CurveRun(start.continuation, kind, points) for start in starts]
    endings = [runs[0].go(starts[0].state)]
    ahead, crossed, end = [], [], _BEGIN
    if endings[0][0] is Status.RETURNED:
        end = Status.RETURNED, ""
    elif len(runs) > 1:
        end = runs[1].go(starts[1].state)
        shared = np.array_equal(starts[0].state.u, starts[1].state.u)
        ahead = runs[1].points[1:] if shared else runs[1].points
        crossed = runs[1].codimension_two
    first, second = (axis.name for axis in starts[0].continuation.axes)
    return Curve(
        kind,
        (first, second),
        (*runs[0].points[::-1], *ahead),
        (*runs[0].codimension_two[::-1], *crossed),
        (endings[0], end),
    )


def _beside_point(problem: Problem, point: CodimensionTwoPoint, kind: str) -> list[Restart]:
    """Starts of the other curve through a point, on the sides with admissible motions."""
    orbit, segments, smooth = point.orbit, point.segments, kind in kinds.SMOOTH
    if (half := halved_at(orbit, None)) is not None:
        orbit, _ = half
    if point.types[1] == kinds.GENERALIZED_DOUBLING:
        # To either side of the point the doubled orbits are the same. At a distance d of their
        # halves the fold differs from the point by d^2 in the parameters.
        folds = (start for _, start in doubled_starts(problem, orbit, kinds.FOLD))
        return list(islice((one for one in folds if one.state.admissible and _within(one)), 1))
    if len(segments) == 1 and not smooth:
        return _both_ways(problem, orbit, kind, segments[0])
    if not segments:
        return _both_ways(problem, orbit, kind, None) if smooth else []
    # The curve's own segment, of duration 0 here, exists on one side of the point only.
    own, zero_segment = segments[0], None if smooth else segments[1]

    def with_segment(one: Continuation) -> Iterator[Spot]:
        ahead = one.direction(own).argmax()
        for state in one.around(one.unknowns(orbit)):
            if state.u[ahead] > problem.settings.least_duration:
                yield state

    def without_segment(one: Continuation) -> Iterator[Spot]:
        beyond = one.cross(vanishing(orbit, own))
        if beyond is not None:
            yield beyond.state

    found = []
    for side in (with_segment, without_segment):
        one = Continuation(problem, orbit, zero_segment, kind if smooth else None)
        try:
            found += [Restart(one, state) for state in side(one) if state.admissible][:1]
        except (InvalidInput, Stop):
            continue
    return found


def _within(start: Restart) -> bool:
    """True if a state is within the ranges."""
    return all(0 <= q <= 1 for q in start.state.u[-2:])


def check(
    base: SceneParameters, names: tuple[str, str], ranges: tuple[tuple[float, float], ...]
) -> None:
    """Raises InvalidInput unless these are two parameters and ascending ranges of theirs."""
    (first, second), known = names, base.scene.facts.PARAMETERS
    check_one_of("first", first, known)
    check_one_of("second", second, [name for name in known if name != first])
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
