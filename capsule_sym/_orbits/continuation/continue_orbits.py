"""Continuation of orbits in one parameter, and of bifurcations in two."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._map.checks import check_count, checked_ends
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.bifurcations import Bifurcation
from capsule_sym._orbits.continuation.branch import (
    Branch,
    BranchRun,
    failure_of,
    halves_apart,
)
from capsule_sym._orbits.continuation.crossing import (
    Continuation,
    Rejoining,
    Restart,
    first_half,
    keeps_images,
    vanishing,
)
from capsule_sym._orbits.continuation.curve import Curve, CurveRun
from capsule_sym._orbits.continuation.parameter_paths import (
    Function,
    ParameterPath,
    PathAxis,
    chosen_path,
    parameter_path,
)
from capsule_sym._orbits.continuation.problem import OUT_OF_TIME, Problem, Stop, computing
from capsule_sym._orbits.continuation.records import Origin, labelled_point
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, same
from capsule_sym._parameters import SceneParameters


def continue_orbit(
    orbit: Orbit,
    parameter: str,
    to: float,
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    max_seconds: float = math.inf,
) -> Branch:
    """Branch through an orbit, from its value of a parameter to another one (dimensionless).

    At least `points` steps are taken, more where the branch bends or the itinerary changes. The
    branch passes folds, contains stable and unstable orbits, and continues from itinerary to
    itinerary. It ends where the parameter leaves the range between the two values. Its `status` and
    `message` give the reason for an earlier end. At the time limit it ends with the points so far.

    Parameters
    ----------
    orbit : Orbit
        Orbit at which the branch starts, as `solve_orbit` gives; dimensionless, in double
        precision.
    parameter : str
        Name of the parameter that varies, one of the scene's. With `ties` it may be a new name, of
        which one tied parameter is an affine function.
    to : float, finite
        Value of the parameter at which the branch ends, within the parameter's own range and other
        than the value of the orbit. Dimensionless; a new name has the units that its ties give it.
    points : int, default 100, 1 to 5,000
        Least number of steps over the range.
    ties : mapping of str to callable or str, default None
        Other parameters that vary with the first one. Each name has a function of the first one's
        value, or a text such as "0.5*omega**2"; see `parameter_path`. Values are dimensionless, but
        a new name has the units that its ties give it.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    Branch
        Orbits in order, the bifurcations between them, `status` and `message`. `success` is True if
        the branch reaches `to`.

    Raises
    ------
    InvalidInput
        For an unknown parameter of which no tied one is an affine function, a value that the
        parameter cannot have, and equal values. For an orbit whose parameters are not on the path,
        an orbit in 50 digits, and a result without one. For ties that are not arithmetic, or that
        give values which parameters cannot have. Also for other arguments out of their ranges.

    Notes
    -----
    The equations of a periodic orbit are those of shooting from switch to switch. Branches are
    followed by pseudo-arclength. A border collision is solved for as an orbit with a segment of
    duration 0. Folds, period doublings and Neimark-Sacker bifurcations are zeros of test functions
    of the monodromy matrix.

    See Also
    --------
    continue_both_ways : branches to both ends of a range.
    continue_from : branches that leave a labelled point.
    continue_bifurcation : curve of a bifurcation in two parameters.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> branch = cs.continue_orbit(orbit, "alpha", 1.0, points=4)
    >>> print(branch.status)
    reached
    >>> for one in branch.bifurcations:
    ...     print(one.label, one.type, f"{one.value:.10f}")
    AS1 adding-sliding 0.9409980034
    """
    axis = axis_from(orbit, parameter_path(parameter, ties, orbit.scene), to)
    return _sides_of(orbit, axis, points, max_seconds, (1.0,))[0]


def continue_both_ways(
    orbit: Orbit,
    parameter: str,
    ends: Sequence[float],
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    max_seconds: float = math.inf,
) -> tuple[Branch, ...]:
    """Branch through an orbit in a range (low, high) around it: one if it is closed, else two.

    A closed branch (an isola) returns to the same orbit at the same value; its status is
    "returned", and its `success` False. Otherwise the first branch starts towards larger values,
    the second towards smaller ones. Each is computed as by `continue_orbit`; beyond a fold it may
    end at the other end of the range, also with the status "reached".

    Parameters
    ----------
    orbit : Orbit
        Orbit at which the branches start, as `solve_orbit` gives; dimensionless, in double
        precision.
    parameter : str
        Name of the parameter that varies, one of the scene's. With `ties` it may be a new name, of
        which one tied parameter is an affine function.
    ends : sequence of float, (low, high)
        Range of the parameter, ascending, with the value of the orbit between its ends.
        Dimensionless; a new name has the units that its ties give it.
    points : int, default 100, 1 to 5,000
        Least number of steps over the range.
    ties : mapping of str to callable or str, default None
        Other parameters that vary with the first one. Each name has a function of the first one's
        value, or a text such as "0.5*omega**2"; see `parameter_path`. Values are dimensionless, but
        a new name has the units that its ties give it.
    max_seconds : float, default inf, above 0
        Time limit of both branches together, in seconds of wall time.

    Returns
    -------
    tuple of Branch
        The closed branch, or the branch that starts towards `high` and the one that starts towards
        `low`. After `max_seconds` a branch ends with status "time-limit", possibly without points.

    Raises
    ------
    InvalidInput
        For two ends that are not ascending around the value of the orbit. Otherwise as in
        `continue_orbit`.

    See Also
    --------
    continue_orbit : branch to one value.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> up, down = cs.continue_both_ways(orbit, "alpha", (0.8, 1.0), points=4)
    >>> print(up.points[-1].value, down.points[-1].value)
    1.0 0.8
    >>> print([one.label for one in up.bifurcations], [one.label for one in down.bifurcations])
    ['AS1'] []
    """
    path = parameter_path(parameter, ties, orbit.scene)
    low, high = checked_ends("ends", ends)
    axis, value = _checked_axis(orbit, path, low, high), float(path.value(orbit.values))
    if not low < value < high:
        raise InvalidInput("ends", (low, high), f"ascending, with {value!r} between them")
    return _sides_of(orbit, axis, points, max_seconds, (1.0, -1.0))


def _sides_of(
    orbit: Orbit, axis: PathAxis, points: int, max_seconds: float, sides: Sequence[float]
) -> tuple[Branch, ...]:
    """Branches through an orbit to sides of it; one alone if it is closed."""
    found: list[Branch] = []
    with computing(points, max_seconds, axis) as problem:
        for side in sides:
            start = first_half(orbit, problem.axes) or orbit
            continuation = Continuation(problem, start)
            u = continuation.unknowns(start)
            found.append(BranchRun(continuation, points).go(u, side * np.eye(len(u))[-1]))
            if found[-1].status is Status.RETURNED:
                return (found[-1],)
    missing = len(sides) - len(found)  # a branch itself records the time limit
    return (*found, *(missing * [Branch(axis, (), (), *OUT_OF_TIME)]))


def _checked_axis(orbit: Orbit, path: ParameterPath, begin: float, end: float) -> PathAxis:
    """Axis of an orbit's path between two values; raises InvalidInput."""
    if orbit.backend != "numpy":
        raise InvalidInput("orbit", orbit, "in double precision")
    for value in (begin, end) if path.name in path.names else ():
        orbit.parameters.replace(**{path.name: value})
    axis = PathAxis(path, begin, end)
    axis.check(orbit.parameters, orbit.values)
    return axis


def axis_from(orbit: Orbit, path: ParameterPath, to: float) -> PathAxis:
    """Axis from an orbit on a path to a value of the varied parameter; raises InvalidInput."""
    if not math.isfinite(to):
        raise InvalidInput(path.name, to, "finite")
    value = float(path.value(orbit.values))
    if value == to:
        raise InvalidInput("to", value, f"other than {value}, the branch's start")
    return _checked_axis(orbit, path, value, float(to))


_DOUBLED_DISTANCES = (1e-3, 3e-3, 1e-2, 3e-4, 1e-4)
"""Distances in the unknowns at which a doubled orbit is sought, in this order."""
_DEEPEST = 16  # period doublings in a row: to 65,536 periods


def continue_from(
    source: Branch | Path | str,
    label: str,
    to: float,
    *,
    parameter: str | None = None,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    max_seconds: float = math.inf,
) -> tuple[Branch, ...]:
    """All branches that leave a labelled point of a branch, or of its file, towards a value.

    The result depends on the point:

    - period doubling: the branch itself and that of the doubled orbits;
    - symmetry breaking: the branch itself, and two branches that are mirror images of each other;
    - fold: its two sides;
    - border collision, or corner of higher codimension: the branches on the side of `to`, at a
      non-smooth fold two or none;
    - Neimark-Sacker bifurcation, or an end (EP1, EP2): the branch itself.

    Branches that lead away from `to` are left out.

    Parameters
    ----------
    source : Branch, str or path
        The branch, or the file branch.json that `branch --out` wrote.
    label : str
        Label of the point, such as "PD1". "EP1" and "EP2" are the ends of the branch. On a branch
        of the file that was switched to at PD1, the label of point AS2 is "PD1/AS2".
    to : float, finite
        Value of the varied parameter towards which the branches lead, other than that of the point.
        Dimensionless; a name that is no parameter of the scene has the units of its ties.
    parameter : str, default None
        Name of the parameter that varies. None: that of the branch.
    points : int, default 100, 1 to 5,000
        Least number of steps over the range.
    ties : mapping of str to callable or str, default None
        Other parameters that vary with the first one. Each name has a function of the first one's
        value, or a text such as "0.5*omega**2"; see `parameter_path`. None, without `parameter`:
        those of the branch. Values are dimensionless, but a new name has the units that its ties
        give it.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    tuple of Branch
        The branches. `origin` of a single branch is the label, those of several are "PD1.1",
        "PD1.2", and so on. After `max_seconds` branches end with status "time-limit", some without
        points.

    Raises
    ------
    InvalidInput
        For an unknown label, a file of another version, a value that the parameter cannot have, and
        if no branch leaves in that direction. For a file with ties by Python functions, unless
        `ties` or `parameter` is given. Otherwise as in `continue_orbit`.

    See Also
    --------
    period_doubling_cascade : doubled orbits of a branch, to a depth.
    read_branch : record of a file.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.9)), "alpha", 1.0, points=4)
    >>> [onward] = cs.continue_from(branch, "AS1", 1.0, points=4)
    >>> print(onward.origin, onward.status, f"{onward.points[0].value:.6f}")
    AS1 reached 0.940998

    From the same point in another parameter:

    >>> [other] = cs.continue_from(branch, "AS1", 3.4, parameter="gamma", points=4)
    >>> print(other.parameter, other.points[-1].value)
    gamma 3.4
    """
    if isinstance(source, Branch):
        own, point = source.axis.path, Origin.of(source.at(label))
        path = chosen_path(own.name, lambda: own, parameter, ties, own.scene)
    else:
        path, point = labelled_point(source, label, parameter, ties)
    axis = axis_from(point.orbit, path, to)
    with computing(points, max_seconds, axis) as problem:
        starts = list(_leaving(problem, point))
        ahead = [start for start in starts if start.state.u[-1] > 0]
        names = [label] if len(ahead) == 1 else [f"{label}.{i + 1}" for i in range(len(ahead))]
        both = zip(ahead, names, strict=True)
        found = [_followed(start, points, name) for start, name in both]
        if not starts:
            raise InvalidInput("label", label, f"a point from which a branch in {path.name} starts")
        if not found:
            side = f"{'below' if to > axis.begin else 'above'} {axis.begin}"
            raise InvalidInput("to", to, f"{side}: no branch starts at {label} that way")
        return tuple(found)
    return (Branch(axis, (), (), *OUT_OF_TIME, label),)


def _followed(start: Restart, points: int, origin: str) -> Branch:
    run = BranchRun(start.continuation, points, origin)
    return run.go(start.state.u, start.state.tangent, start.smooth)


def period_doubling_cascade(
    branch: Branch,
    depth: int,
    *,
    points: int = 100,
    max_seconds: float = math.inf,
) -> tuple[Branch, ...]:
    """Branches of doubled orbits that leave a branch, and those that leave them, to a depth.

    Each branch is continued to an end of the range of the first branch, in its units. A branch may
    end at another period doubling of the branch that it left. Its message then names this point,
    and no branch is continued from there. A period doubling beside which no doubled orbit is found
    gives a branch without points, of status "not-converged".

    Parameters
    ----------
    branch : Branch
        The first branch, as `continue_orbit` gives.
    depth : int, 0 to 16
        Number of period doublings in a row; 0 gives no branch.
    points : int, default 100, 1 to 5,000
        Least number of steps over the range.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.

    Returns
    -------
    tuple of Branch
        The branches of doubled orbits, without the first branch, level by level. `origin` of a
        branch is the path of labels to it, such as "PD1/PD1". After `max_seconds` the branch that
        is followed ends with status "time-limit", as does one without points if others are due.

    Raises
    ------
    InvalidInput
        For a depth, a number of points, or a time that is not allowed.

    See Also
    --------
    continue_from : branches from one point, with the branch itself.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.03, zeta=0.005))
    >>> branch = cs.continue_orbit(orbit, "alpha", 0.05, points=3)
    >>> print([f"{one.label} at {one.value:.6f}" for one in branch.bifurcations])
    ['PD1 at 0.042904']
    >>> [doubled] = cs.orbits.period_doubling_cascade(branch, 1, points=3)
    >>> print(doubled.origin, doubled.status, doubled.points[0].orbit.itinerary.period_number)
    PD1 reached 2
    """
    check_count("depth", depth, 0, _DEEPEST)
    found: list[Branch] = []
    with computing(points, max_seconds, branch.axis) as problem:
        level = [branch]
        for _ in range(depth):
            before = len(found)
            for one in level:
                found.extend(_doubled_of(problem, one, points))
            level = found[before:]
        return tuple(found)
    return (*found, Branch(branch.axis, (), (), *OUT_OF_TIME))


def _doubled_of(problem: Problem, branch: Branch, points: int) -> Iterator[Branch]:
    """Branches of doubled orbits that leave a branch, each once."""
    last = branch.bifurcations[-1:] if branch.status is Status.PERIOD_HALVED else ()
    reached: set[str] = set()
    for one in branch.bifurcations:
        if one.type != kinds.PERIOD_DOUBLING or one.label in reached or one in last:
            continue
        start = _doubled(problem, one.orbit)
        origin = f"{branch.origin}/{one.label}".lstrip("/")
        if start is None:
            lost = f"no doubled orbit is found beside {one.label}"
            yield Branch(problem.axes[0], (), (), Status.NOT_CONVERGED, lost, origin)
            continue
        new = _followed(start, points, origin)
        at = _arrival(new, branch) if new.status is Status.PERIOD_HALVED else None
        if at is not None:
            reached.add(at.label)
            name = f"branch {branch.origin}" if branch.origin else "the first branch"
            new = replace(new, message=f"{new.message}: {at.label} of {name}")
        yield new


def _arrival(new: Branch, branch: Branch) -> Bifurcation | None:
    """Period doubling of a branch at which another branch ends; None if it ends at none."""
    end = new.bifurcations[-1].orbit
    doublings = (one for one in branch.bifurcations if one.type == kinds.PERIOD_DOUBLING)
    return next((one for one in doublings if same(one.orbit, end)), None)


def _leaving(problem: Problem, point: Origin) -> Iterator[Restart]:
    """Admissible states beside a point, on all sides."""
    found = list(_sides(problem, point))
    if point.type == kinds.PERIOD_DOUBLING:
        found.append(_doubled(problem, point.orbit))
    half = first_half(point.orbit, problem.axes)
    if point.type == kinds.SYMMETRY_BREAKING and half is not None:
        found += [_doubled(problem, half, side) for side in (1, -1)]
    for start in found:
        if start is not None and not failure_of(start.state):
            yield start._replace(state=start.continuation.symmetric(start.state))


def _sides(problem: Problem, point: Origin) -> Iterator[Restart | None]:
    """States on both sides of a point, of one itinerary or two; None on a side without a state."""
    orbit, segment = point.orbit, point.segment
    if segment is None:
        orbit = first_half(orbit, problem.axes) or orbit
        for side in range(2):
            one = Continuation(problem, orbit)
            u = one.unknowns(orbit)
            start = one.neighbour(u, one.directions(u)[side])
            yield start and start._replace(smooth=())
        if point.itinerary_before is not None and point.type == kinds.HIGHER.type:
            for way in (1.0, -1.0):
                found = Rejoining(problem, point.itinerary_before, orbit, way, 1.0).junction()
                if found is not None:
                    one = Continuation(problem, found.after)
                    u = one.unknowns(found.after)
                    yield Restart(one, one.state(u, way * np.eye(len(u))[-1]))
        return
    if point.symmetry == KEPT:
        orbit, half_segment = halved_at(orbit, segment) or (orbit, segment)
        segment = segment if half_segment is None else half_segment
    one = Continuation(problem, orbit)
    yield one.neighbour(one.unknowns(orbit), one.direction(segment))
    with suppress(InvalidInput, Stop):
        yield Continuation(problem, orbit).cross(vanishing(orbit, segment))


def _doubled(problem: Problem, orbit: Orbit, side: int = 1) -> Restart | None:
    """State on the branch of doubled orbits beside a period doubling; None if none is found.

    For half an orbit at a symmetry breaking: the state on the branch of one `side`. Two curves of
    solutions of the doubled equations cross there; on one the halves move apart while the parameter
    is constant to first order.
    """
    whole, mirrored = kinds.doubled(orbit), orbit.itinerary.mirrored
    one = Continuation(problem, whole)
    along = np.append(np.linalg.svd(whole.system.by_z)[2][-1], 0.0) * side
    for distance in _DOUBLED_DISTANCES:
        solution = one.corrected(one.unknowns(whole) + distance * along, along)
        if solution is None:
            continue
        state = one.state(solution.u, along, solution)
        if halves_apart(state.orbit, distance / 2, mirrored) and not failure_of(state):
            return Restart(one, state)
    return None


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

    All other parameters are constant: ties of the branch do not hold. The curve is followed in both
    directions until a parameter leaves its range. No step is longer than 1/`points` of either
    range. Where another inequality of the itinerary fails, the point is located exactly. The curve
    continues in the itinerary beyond if that has such a bifurcation, else it ends there.

    Parameters
    ----------
    bifurcation : Bifurcation
        Bifurcation at which the curve starts, as `branch.at("PD1")` gives; dimensionless. Its
        parameter is one of the scene's. A corner of higher codimension without a `segment` gives a
        curve without points.
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
        both ends. At the bifurcation the second parameter increases along the points. After
        `max_seconds` an end has status "time-limit".

    Raises
    ------
    InvalidInput
        For a parameter that is none of the scene's, also that of the bifurcation, and a second one
        that is the first. For ranges that are not ascending, exceed the parameters' own, or do not
        contain the bifurcation. For a symmetry breaking, if the motions do not keep their mirror
        images on the curve.

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
    axes = _curve_axes(orbit, (first, second), ranges)
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
    with computing(points, max_seconds, *axes) as problem:
        try:
            both = [Continuation(problem, orbit, segment, critical) for _ in range(2)]
            return _both_halves(kind, orbit, both, points)
        except Stop as stop:
            ending = stop.ending, stop.detail
    return Curve(kind, (first, second), (), (), (ending, ending))


def _curve_axes(orbit: Orbit, names: tuple[str, str], ranges: Ranges) -> tuple[PathAxis, ...]:
    """Axes of two parameters with a point within their ranges; raises InvalidInput."""
    axes = []
    for name, (low, high) in zip(names, check(orbit.parameters, names, ranges), strict=True):
        value = float(orbit.value(name))
        if not low <= value <= high:
            raise InvalidInput(name, (low, high), f"an ascending range that contains {value!r}")
        axes.append(PathAxis(ParameterPath(name, scene=orbit.scene), low, high))
    return tuple(axes)


def _both_halves(kind: str, orbit: Orbit, both: Sequence[Continuation], points: int) -> Curve:
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
) -> list[Range]:
    """Ranges of two parameters of a scene.

    Raises InvalidInput unless these are two, and their ranges are ascending and allowed.
    """
    (first, second), known = names, base.scene.facts.PARAMETERS
    check_one_of("first", first, known)
    check_one_of("second", second, [name for name in known if name != first])
    if not isinstance(ranges, Sequence | np.ndarray) or len(ranges) != 2:
        allowed = f"two ranges, such as ((0.1, 2.0), (3.0, 3.3)) of {first} and {second}"
        raise InvalidInput("ranges", ranges, allowed)
    pairs = [checked_ends("ranges", pair) for pair in ranges]
    for name, pair in zip(names, pairs, strict=True):
        for edge in pair:
            base.replace(**{name: edge})
    return pairs
