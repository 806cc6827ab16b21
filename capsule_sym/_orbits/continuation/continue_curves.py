"""Curves of bifurcations in two parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.bifurcations import Bifurcation
from capsule_sym._orbits.continuation.crossing import Continuation, keeps_images
from capsule_sym._orbits.continuation.curve import Curve, CurveRun
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath, PathAxis
from capsule_sym._orbits.continuation.problem import OUT_OF_TIME, Problem, Stop, computing
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, springless
from capsule_sym._parameters import SceneParameters

Range = tuple[float, float]
Ranges = tuple[Range, Range]


def continue_bifurcation(
    bifurcation: Bifurcation,
    second: str,
    ranges: Ranges,
    *,
    points: int = 50,
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
    continue_orbit : branch with bifurcations in one parameter.

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
    segment, kind = bifurcation.segment, bifurcation.type
    images = keeps_images(orbit, axes)
    critical = kind if kind in kinds.SMOOTH else None
    if kind == kinds.SYMMETRY_BREAKING:
        critical = kinds.PERIOD_DOUBLING  # of the half
        if not images:
            raise InvalidInput("second", second, "one with which motions keep their mirror images")
    if bifurcation.symmetry == KEPT and images:
        orbit, segment = halved_at(orbit, segment) or (orbit, segment)
    ending = OUT_OF_TIME
    with computing(points, max_seconds, orbit.scene) as (numbers, limit), limit:
        try:
            problem = Problem(numbers, axes)
            both = [Continuation(problem, orbit, segment, critical) for _ in range(2)]
            return _followed(kind, orbit, both, points)
        except Stop as stop:
            ending = stop.ending, stop.detail
    return Curve(kind, (first, second), (), (), (ending, ending))


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


def _followed(kind: str, orbit: Orbit, both: Sequence[Continuation], points: int) -> Curve:
    """Curve of a type through an orbit, both ways: first so that the second parameter decreases."""
    u = both[0].unknowns(orbit)
    ways = sorted(both[0].directions(u), key=lambda way: float(way[-1]) > 0)
    starts = [one.state(u, way) for one, way in zip(both, ways, strict=True)]
    first, second = (CurveRun(one, kind, points) for one in both)
    begin = first.go(starts[0])
    returned = begin[0] is Status.RETURNED
    end = (Status.RETURNED, "") if returned else second.go(starts[1])
    return Curve(
        kind,
        (both[0].axes[0].name, both[0].axes[1].name),
        (*first.points[::-1], *second.points[1:]),
        (*first.codimension_two[::-1], *second.codimension_two),
        (begin, end),
    )


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
