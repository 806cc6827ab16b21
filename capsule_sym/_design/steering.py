"""Steering forward and backward by the drive alone: the two best drives, and a path between them.

A path of parameters along which the orbit is continued is straight or has corners. It can be used
if every orbit on it is stable: the capsule then stays on it if the drive changes slowly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._design.optimise import checked_survey, program_of, system_of
from capsule_sym._design.optimiser import Optimiser
from capsule_sym._design.optimum import Optimum, OptimumStatus
from capsule_sym._design.quantities import System, dimensionless
from capsule_sym._design.reachable import Reachable
from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import checked_seconds
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, plain
from capsule_sym._native import Watch, check_time, core_of
from capsule_sym._orbits.continuation.branches.branch import Branch, BranchPoint
from capsule_sym._orbits.continuation.branches.continuing import continue_straight
from capsule_sym._orbits.continuation.settings import check_points
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneParameters
from capsule_sym._systems import drives

_DRIVES = 1000, 10_000  # approximate sizes of the grids
_TRIED = 12  # paths tried on each grid
_ARRIVED = 1e-6  # of a stretch, from its end: a best drive may be on a border
_NEAR = 1e-4  # distance of such a motion from that of the stretch
Vector = NDArray[np.float64]
Drive = dict[str, float]


class SteeringStatus(StrEnum):
    """Status of steering: connected, or the reason why not."""

    #: A path of stable orbits leads from one drive to the other.
    CONNECTED = "connected"
    #: On every path tried a stable orbit ends, or another orbit is reached.
    BROKEN = "broken"
    #: Within the bounds the capsule moves in one direction only.
    ONE_WAY = "one-way"
    #: One of the two optima was not found.
    NO_OPTIMUM = "no-optimum"
    #: The time limit was reached: the result has what was found so far.
    TIME_LIMIT = "time-limit"


@dataclass(frozen=True)
class Break:
    """Place where a path of stable orbits breaks: its corners, the drive there, and the reason."""

    by: tuple[Drive, ...]
    at: Drive
    why: str


@dataclass(frozen=True, eq=False)
class Steering(Result, Labelled):
    """Best drives forward and backward, and the path between them.

    In SI units if the system is a device, else dimensionless.
    """

    forward: Optimum
    backward: Optimum
    path: tuple[Drive, ...]
    """Drives that the path joins by straight lines; empty without a path."""
    breaks: tuple[Break, ...]
    """Breaks of the paths tried before, or of all paths."""
    branches: tuple[Branch, ...]
    """Orbits along the stretches of the path; without a path those of the straight line."""
    status: SteeringStatus
    """Status of the search."""
    message: str
    """Status as a sentence."""
    dimension = "point"
    _good = (SteeringStatus.CONNECTED,)
    _recorded = "forward backward path breaks"

    def __repr__(self) -> str:
        ways = f"{self.forward.value:.6g} forward, {self.backward.value:.6g} backward"
        return f"<Steering: velocity {ways}, {self.status}>"

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The n orbits along the path, (n,): stretch, drive, velocity, multiplier, itinerary."""
        rows = [
            (number, self._drive(point.orbit), point)
            for number, branch in enumerate(self.branches, 1)
            for point in branch.points
        ]
        system = self.forward.system
        unit = 1.0 if isinstance(system, SceneParameters) else system.velocity(1.0)
        velocities = [float(point.orbit.average_velocity) * unit for _, _, point in rows]
        texts = [str(point.orbit.itinerary) for _, _, point in rows]
        return {
            "stretch": np.array([number for number, _, _ in rows], dtype=int),
            **{name: np.array([drive[name] for _, drive, _ in rows]) for name in self.names},
            "velocity": np.array(velocities),
            "largest_multiplier": np.array([_largest(point) for _, _, point in rows]),
            "itinerary": np.array(texts, dtype=np.str_),
        }

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the varied parameters of the drive."""
        return tuple(self.forward.over)

    @property
    def statistics(self) -> dict[str, int]:
        """Points of the branches, and evaluations of the two optima."""
        evaluations = sum(
            one.statistics.get("evaluations", 0) for one in (self.forward, self.backward)
        )
        return {"points": len(self.columns["stretch"]), "evaluations": evaluations}

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts."""
        return super().to_dict() | {"points": plain(self.columns), "statistics": self.statistics}

    def _drive(self, orbit: Orbit) -> Drive:
        return drive_at(self.forward.system, self.names, orbit.parameters)


def steer(
    base: System | None = None,
    over: Mapping[str, Sequence[float]] | None = None,
    *,
    subject_to: Sequence[object] = (),
    margin: float | None = None,
    samples: int = 2048,
    seed: int = 0,
    follow: int = 6,
    points: int = 20,
    max_seconds: float = math.inf,
    progress: Callable[[str], object] | None = None,
) -> Steering:
    """Drives of greatest velocity forward and backward, and a path of stable orbits between them.

    `over` has the bounds of the drive: of alpha and omega, or of P_d and Omega of a device in SI
    units. By default the amplitude varies from 0.1 to 2 times the friction bound, and the frequency
    from 0.5 to 1.5 times the natural one. The straight path is tried first, then paths with a
    corner, then paths over a grid of drives, from neighbour to neighbour where the stable motion
    continues. A broken path has the drive at which it breaks, and the reason. `subject_to`,
    `margin`, `samples`, `seed` and `follow` are those of `optimise`. Each stretch of a path is
    continued in at least `points` steps. After `max_seconds` the result has the drives and the
    breaks found so far. `progress` is called with a text.

    Raises InvalidInput as `optimise` does, and for a parameter that is not of the drive.
    """
    system = system_of(base)
    bounds = usual_drive(system) if over is None else over
    check_points(points)
    allowed = drives(system)
    for name in bounds if isinstance(bounds, Mapping) else ():
        if name not in allowed:
            raise InvalidInput("over", name, f"of {' and '.join(allowed)}")
    survey = checked_survey(samples, seed, follow)
    given = subject_to, margin, ((0.0, 0.0, 0.0),), None, progress
    forward, backward = (
        Optimiser(program_of("velocity", bounds, system, way, *given)) for way in (True, False)
    )
    search = _Search(bounds, points)
    with Watch(checked_seconds(max_seconds)):
        forward.run(survey)
        backward.run(survey)
        if progress is not None:
            progress("the way between the drives")
        ends = forward.result, backward.result
        if _unlike(*ends) is None:
            search.run(*ends)
        search.done = True
    return _steered(forward.result, backward.result, search)


def usual_drive(system: System) -> dict[str, tuple[float, float]]:
    """Default bounds of a drive."""
    shares = (0.1, 2.0), (0.5, 1.5)
    named = zip(drives(system).items(), shares, strict=False)
    return {name: (low * unit, high * unit) for (name, unit), (low, high) in named}


class _Way:
    """Path with corners, or straight: its branches so far, and its break."""

    def __init__(self, corners: Sequence[Drive]) -> None:
        self.corners = tuple(corners)
        self.branches: list[Branch] = []
        self.broken: Break | None = None
        self.whole = 0
        """Number of its complete stretches."""


class _Search:
    """Paths tried between two optima: straight, with a corner, and on a grid."""

    def __init__(self, bounds: Mapping[str, Sequence[float]], points: int) -> None:
        self.bounds, self.points = bounds, points
        self.ways: list[_Way] = []
        self.known: dict[tuple[tuple[float, ...], ...], Branch | None] = {}
        """Branches by the drives that lead to their ends."""
        self.told = ""
        """Text of what was tried beside these paths."""
        self.done = False

    def run(self, forward: Optimum, backward: Optimum) -> None:
        """Try paths until one is complete."""
        for corner in _corners(forward, backward):
            if self.follow(forward, backward, corner).broken is None:
                return
        if len(self.bounds) == 1 or core_of(forward.orbits[0].scene) is None:
            return
        ends, orbits = (forward.over, backward.over), (forward.orbits[0], backward.orbits[0])
        for count in _DRIVES:
            reach = Reachable(forward.system, self.bounds, ends, orbits, count)
            self.told = f"; stable orbits lead from the drive forward to {reach.told()}"
            if self.goes(reach, forward, backward):
                return

    def goes(self, reach: Reachable, forward: Optimum, backward: Optimum) -> bool:
        """True if one of the paths on a grid is complete."""
        for _ in range(_TRIED):
            way, joined = reach.way()
            way = reach.straightened(way)
            # If none leads there, the nearest motion reached shows the obstacle.
            corners = [reach.drive(i) for i in way[1 : -1 if joined else None]]
            found = self.follow(forward, backward, corners)
            if found.broken is None or not joined:
                return found.broken is None
            reach.refuse(*way[min(found.whole, len(way) - 2) :][:2])
        return False

    def follow(self, forward: Optimum, backward: Optimum, corners: Sequence[Drive]) -> _Way:
        """Continue the orbits along a path between two optima, as far as they are stable."""
        way, orbit, system = _Way(corners), forward.orbits[0], forward.system
        self.ways.append(way)
        passed: tuple[tuple[float, ...], ...] = ()
        for target in (*way.corners, backward.over):
            there = dimensionless(system.replace(**dict[str, Any](target)))
            passed = (*passed, tuple(target.values()))
            if passed not in self.known:
                self.known[passed] = continue_straight(orbit, there, points=self.points)
                check_time()
            branch = self.known[passed]
            if branch is not None:  # else the corner is the start of the stretch
                stable = _stable(branch)
                way.branches.append(stable)
                if not stable.points or stable.points[-1].value < 1 - _ARRIVED:
                    where, why = _broken(branch, stable)
                    way.broken = Break(way.corners, drive_at(system, [*forward.over], where), why)
                    return way
                orbit = stable.points[-1].orbit
            way.whole += 1
        if not _alike(orbit, backward.orbits[0]):
            why = f"the path ends on another orbit than the best one, {orbit.itinerary}"
            way.broken = Break(way.corners, dict(backward.over), why)
        return way


def _steered(forward: Optimum, backward: Optimum, search: _Search) -> Steering:
    """Result of the paths tried."""
    ways = search.ways
    breaks = tuple(way.broken for way in ways if way.broken is not None)
    path: tuple[Drive, ...] = ()
    shown = next((way for way in ways if way.branches), None)
    if (unlike := _unlike(forward, backward)) is not None:
        status, message = unlike
    elif not search.done:
        status = SteeringStatus.TIME_LIMIT
        message = f"time limit reached: {len(breaks)} of the paths tried are broken"
    elif ways[-1].broken is None:
        shown = ways[-1]
        path = (forward.over, *shown.corners, backward.over)
        status = SteeringStatus.CONNECTED
        message = "a path of stable orbits leads from one drive to the other"
    else:
        status = SteeringStatus.BROKEN
        message = f"each of {len(ways)} paths is broken, the first by: {breaks[0].why}{search.told}"
    branches = tuple(shown.branches) if shown else ()
    return Steering(forward, backward, path, breaks, branches, status, message)


def _unlike(forward: Optimum, backward: Optimum) -> tuple[SteeringStatus, str] | None:
    """Reason why two optima are no pair of drives to steer between."""
    for one in (forward, backward):
        # The best place found is a drive too, even if it is not a proved optimum.
        if not (one.success or (one.status is OptimumStatus.NOT_CONVERGED and one.orbits)):
            late = one.status is OptimumStatus.TIME_LIMIT
            status = SteeringStatus.TIME_LIMIT if late else SteeringStatus.NO_OPTIMUM
            return status, one.message
    if forward.value <= 0 or backward.value >= 0:
        way = "forward" if forward.value > 0 else "backward"
        return SteeringStatus.ONE_WAY, f"within the bounds the capsule only moves {way}"
    return None


def _corners(forward: Optimum, backward: Optimum) -> Iterator[tuple[Drive, ...]]:
    """Corners of a path: none, then one with a value of either end."""
    yield ()
    if len(forward.over) > 1:
        first, *_ = forward.over
        yield (backward.over | {first: forward.over[first]},)
        yield (forward.over | {first: backward.over[first]},)


def _stable(branch: Branch) -> Branch:
    """Stable part of a stretch; its end may itself be on a border."""
    points = list[BranchPoint]()
    for point in branch.points:
        if not _largest(point) < 1:
            break
        points.append(point)
        if point.value >= 1 - _ARRIVED:
            break
    return replace(branch, points=tuple(points))


def _broken(branch: Branch, stable: Branch) -> tuple[SceneParameters, str]:
    """Parameters and reason of the end of a stable stretch."""
    passed = max(stable.points or branch.points[:1], key=lambda point: point.value)
    for one in branch.bifurcations:
        if one.value >= passed.value - _ARRIVED:
            line = f" on {one.line}" if one.line else ""
            return one.orbit.parameters, f"{one.type}{line} of {one.itinerary_before}"
    return passed.orbit.parameters, f"the branch ends: {branch.message}"


def _alike(orbit: Orbit, other: Orbit) -> bool:
    """True if orbits at nearly the same parameters, perhaps on borders, are the same motion."""
    if orbit.itinerary.period_number != other.itinerary.period_number:
        return False
    apart = abs(stroboscopic(orbit) - stroboscopic(other)[:1]).max(axis=1)
    return bool(apart.min() <= _NEAR)


def _largest(point: BranchPoint) -> float:
    return float(max(map(abs, point.multipliers), default=0.0))


def drive_at(system: System, names: Sequence[str], parameters: SceneParameters) -> Drive:
    """Drive of a system with these dimensionless parameters."""
    if isinstance(system, SceneParameters):
        return {name: getattr(parameters, name) for name in names}
    ties = {name: system.tie(name) for name in names}
    return {name: getattr(parameters, tied) / factor for name, (tied, factor) in ties.items()}
