"""A branch of periodic orbits in one parameter, and its computation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import Ended, InvalidInput, Status, check_one_of, counted
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import brief
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.bifurcations import (
    Bifurcation,
    solution_fields,
    sorted_multipliers,
)
from capsule_sym._orbits.continuation.conditions import EventSolution, orbit_at
from capsule_sym._orbits.continuation.crossing import (
    NEIGHBOUR_STEP,
    Continuation,
    Rejoining,
    keeps_images,
)
from capsule_sym._orbits.continuation.parameter_paths import PathAxis
from capsule_sym._orbits.continuation.path import PathRun, Step
from capsule_sym._orbits.continuation.problem import Event, Family, SmoothEvent, Spot, Stop
from capsule_sym._orbits.shooting.admissibility import Inequality, is_admissible
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift
from capsule_sym._orbits.shooting.orbit import Orbit, columns_of
from capsule_sym._orbits.shooting.symmetry import (
    BROKEN,
    KEPT,
    half_itinerary,
    same,
    same_start,
    whole_orbit,
)

_MOST_POINTS = 20_000  # of a branch

_Point = TypeVar("_Point")


@dataclass(frozen=True)
class BranchPoint:
    """An orbit of a branch, with the tightest of its itinerary's inequalities.

    `value` is that of the varied parameter. Dimensionless, except a parameter in SI units.
    """

    value: float
    orbit: Orbit
    admissibility: Inequality

    def __repr__(self) -> str:
        return brief(self, self.orbit.summary, f"at {self.value:.6g}")

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Floquet multipliers of the orbit, the largest modulus first."""
        return sorted_multipliers(self.orbit)


def ends(points: Sequence[_Point]) -> dict[str, _Point]:
    """The ends of a branch, or its only point, by their labels."""
    return dict(zip(("EP1", "EP2"), points[:: max(1, len(points) - 1)], strict=False))


@dataclass(frozen=True)
class Branch(Ended, Labelled):
    """Orbits along a branch and its bifurcations, both in order, and the reason for its end.

    `axis` has the varied parameter and its range. `origin` is the label of the point at which the
    branch leaves another one, such as "PD1", "PD1.2" for the second of several, or "PD1/PD2" on a
    branch of a cascade of doublings; it is empty for other branches. All values are dimensionless,
    except a parameter in SI units to which others are tied.
    """

    axis: PathAxis
    points: tuple[BranchPoint, ...]
    bifurcations: tuple[Bifurcation, ...]
    status: Status
    message: str
    origin: str = ""

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Points as columns, arrays of shape (n,).

        The varied parameter has its own name. Each orbit has itinerary, period number, progression,
        average velocity, the state at the start of its first segment, which is not at phase 0,
        residual, status, and the largest modulus of its multipliers.
        """
        largest = [max(map(abs, point.multipliers), default=0.0) for point in self.points]
        return {
            self.parameter: np.array([float(point.value) for point in self.points]),
            "largest_multiplier": np.array(largest, dtype=float),
            **columns_of([point.orbit for point in self.points]),
        }

    @property
    def parameter(self) -> str:
        """Name of the varied parameter."""
        return self.axis.name

    @checked
    def at(self, label: str) -> Bifurcation | BranchPoint:
        """Bifurcation with this label, such as "PD2"; "EP1" and "EP2" are the ends of the branch.

        Raises InvalidInput for a label that the branch does not have.
        """
        named: dict[str, Bifurcation | BranchPoint] = {b.label: b for b in self.bifurcations}
        named |= ends(self.points)
        check_one_of("label", label, named)
        return named[label]

    def __repr__(self) -> str:
        ends = " to ".join(f"{p.value:.6g}" for p in (self.points[:1] + self.points[-1:]))
        points, found = (
            counted(len(self.points), "point"),
            counted(len(self.bifurcations), "bifurcation"),
        )
        text = f"{points}, {found}, {self.status}"
        return brief(self, text, f"in {self.parameter} from {ends}")


class BranchRun(PathRun):
    """Computation of one branch."""

    def __init__(self, continuation: Continuation, points: int, origin: str = "") -> None:
        super().__init__(continuation, points, _MOST_POINTS)
        self.origin, (self.axis,) = origin, continuation.axes
        self.points: list[BranchPoint] = []
        self.bifurcations: list[Bifurcation] = []

    def go(self, u: Vector, along: Vector, smooth: Sequence[SmoothEvent] = ()) -> Branch:
        """Continue the branch from unknowns u in the direction `along`, to its end.

        The branch may begin beside a point; `smooth` are the smooth bifurcations between.
        """

        def begin() -> Spot:
            state = self.continuation.state(u, along)
            for one in smooth:
                self.record_smooth(one)
            return state

        ending, detail = self.follow(begin)
        if ending in (Status.NOT_CONVERGED, Status.NO_ADMISSIBLE_ORBIT) and self.points:
            detail = f"{detail}; runs find no orbit next to it"
        points, found = tuple(self.points), labelled(self.bifurcations)
        return Branch(self.axis, points, found, ending, detail, self.origin)

    def _value(self, orbit: Orbit) -> float:
        return self.axis.value(orbit.values)

    def add(self, state: Spot) -> None:
        tightest = self.continuation.tightest(state)
        if self.axis.path.ties:
            _ = state.orbit.parameters  # raises InvalidInput for parameters that are not allowed
        orbit = whole_orbit(state.orbit)
        self.points.append(BranchPoint(self._value(orbit), orbit, tightest))
        self._check_drift(orbit)

    def reach_border(self, state: Spot) -> None:
        ending = Status.REACHED
        beside = NEIGHBOUR_STEP if self.origin else 0.0  # branches begin beside a labelled point
        if state.u[-1] < 0.5 and self.first.u[-1] <= beside:
            # The branch returns to the start: beyond a fold, or with the halves of a doubled orbit
            # exchanged.
            end, first = whole_orbit(state.orbit), self.points[0].orbit
            returned = same(end, first) and not same_start(end, first)
            ending = Status.RETURNED if returned else Status.TURNED_BACK
        raise Stop(ending, self.problem.where(state.orbit))

    def check(self, old: Spot, step: Step) -> None:
        """Raises Stop if the halves of an orbit have become equal, or mirror images.

        The bifurcation at which they do is recorded.
        """
        new, found = step.state, None
        if step.event is None:
            found = halved(self.continuation, old.orbit, new.orbit)
        if found is None:
            return
        kind, ending, what = kinds.PERIOD_DOUBLING, Status.PERIOD_HALVED, "one"
        if found.orbit.itinerary.mirrored:
            kind, ending, what = kinds.SYMMETRY_BREAKING, Status.SYMMETRIC, "mirror images"
        self._record(old, new, None, found, type=kind, uncertainty=max(self.errors(found)))
        halves, where = f"the two halves of {old.orbit.itinerary}", self.problem.where(found.orbit)
        raise Stop(ending, f"{halves} become {what} at {where}")

    def record_smooth(self, one: SmoothEvent) -> None:
        (old, new), error, kind = one.ends, max(self.errors(one.solution)), one.type
        if kind == kinds.PERIOD_DOUBLING and old.orbit.itinerary.mirrored:
            # The half orbit doubles: the whole stays closed, and is no longer its own mirror image.
            kind = kinds.SYMMETRY_BREAKING
        self._record(old, new, new, one.solution, one.solved, type=kind, uncertainty=error)

    def _record(
        self,
        old: Spot,
        new: Spot,
        beyond: Spot | None,
        found: EventSolution,
        solved: bool = True,
        **fields: Any,
    ) -> None:
        """Record a bifurcation between two states, with the state on its other side."""
        after = beyond.orbit if beyond else None
        located = Bifurcation(
            parameter=self.axis.name,
            path=self.axis.path,
            value=self._value(found.orbit),
            interval=(self._value(old.orbit), self._value(new.orbit)),
            itinerary_before=old.orbit.itinerary.whole,
            itinerary_after=after.itinerary.whole if after else None,
            multipliers_before=sorted_multipliers(old.orbit),
            multipliers_after=sorted_multipliers(after) if after else (),
            symmetry=_symmetry(old, found.orbit.itinerary, beyond),
            **solution_fields(found, solved),
            **fields,
        )
        self.bifurcations.append(located)

    def record_event(
        self, event: Event, old: Spot, new: Spot, beyond: Spot | None, failed: str
    ) -> Orbit:
        found, segment = event.solution, event.segment
        what = kinds.place(found.orbit, segment)._asdict()
        what |= {"segment": segment, "failed": failed, "uncertainty": float(found.uncertainties[0])}
        self._record(old, new, beyond, found, **what)
        self._check_drift(found.orbit, segment)
        return found.orbit

    def failure(self, state: Spot) -> str:
        return failure_of(state)

    def beyond(self, old: Spot, orbit: Orbit, along: Vector) -> tuple[Orbit, Spot] | None:
        *_, change = along
        way, steepness = float(np.sign(change)), float(np.linalg.norm(along) / abs(change))
        itinerary = old.orbit.itinerary
        found = Rejoining(self.problem, itinerary, orbit, way, steepness).junction()
        if found is None:
            return None
        continuation = self.continuation
        continuation.itinerary, continuation.segments = found.after.itinerary, ()
        u = continuation.unknowns(found.after)
        try:
            state = continuation.symmetric(continuation.state(u, way * np.eye(len(u))[-1]))
        except Stop:
            return None
        return found.before, state

    def pass_unlocated(self, state: Spot, failed: str) -> Spot | None:
        found = self.beyond(state, state.orbit, state.tangent)
        if found is None:
            return None
        before, new = found
        width = abs(self._value(new.orbit) - self._value(before))
        here = EventSolution(before, (), before.residual, (width,))
        named = {"type": kinds.HIGHER.type, "uncertainty": width, "failed": failed}
        self._record(state, new, new, here, False, **named)
        return new

    def _check_drift(self, orbit: Orbit, segment: int | None = None) -> None:
        """Raises Stop if the capsule drifts one way in all segments, `segment` left out."""
        itinerary = orbit.itinerary.whole
        fields = (field for k, field in enumerate(itinerary.fields) if k != segment)
        if {drift(field, itinerary.scene) for field in fields} in ({1}, {-1}):
            reached = (
                "the mean force of drive and load reaches friction, and beyond, drags the device"
            )
            raise Stop(Status.DRAGGED, f"{reached}: {self.problem.where(orbit)}")


def _symmetry(old: Spot, itinerary: Itinerary, beyond: Spot | None) -> str:
    """Mirror symmetry at an event between two states."""
    if itinerary.mirrored:
        return KEPT
    sides = [state.orbit.itinerary.mirrored for state in (old, beyond) if state]
    return BROKEN if any(sides) else ""


def labelled(found: Sequence[Bifurcation]) -> tuple[Bifurcation, ...]:
    """Bifurcations with labels: the initials of their type, and their number among these."""
    counts = Counter[str]()
    result = []
    for one in found:
        initials = kinds.INITIALS[one.type]
        counts[initials] += 1
        result.append(replace(one, label=f"{initials}{counts[initials]}"))
    return tuple(result)


def failure_of(state: Spot) -> str:
    """Reason why a state beyond an event is not admissible; empty if it is."""
    if state.failure:
        return state.failure
    try:
        followed = is_admissible(state.orbit)
    except InvalidInput as error:  # parameters that are not allowed
        return str(error)
    return "" if followed else f"the map has another itinerary than {state.orbit.itinerary}"


def halved(family: Family, old: Orbit, new: Orbit) -> EventSolution | None:
    """Period doubling between two orbits of one branch at which their halves exchange places.

    A period-doubled branch ends there: further on it would retrace itself. The solution's orbit has
    half the period. None if the two halves have different fields or do not exchange places, or if
    no doubling is near. If the halves are mirror images in their fields, they exchange places where
    the symmetry breaks; the orbit is then the first half.
    """
    itinerary, n = old.itinerary, len(old.itinerary) // 2
    mirrored = itinerary.period_number % 2
    alike = itinerary.fields[:n] == itinerary.fields[n:]
    if mirrored:
        alike = not itinerary.mirrored and half_itinerary(itinerary) is not None
    if n == 0 or not alike:
        return None
    before, after = _difference(old), _difference(new)
    if not before @ after < 0 or (mirrored and not keeps_images(old, family.axes)):
        return None
    # The equations of the doubled orbit are singular there; those of the half are not.
    share = before @ before / (before @ before - before @ after)
    middle = old.z + share * (new.z - old.z)
    start, first, second = np.split(middle, [kinds.DURATIONS, kinds.DURATIONS + n])
    z = np.array([*start, *(first + second) / 2])
    (axis,) = family.axes
    q, end = (axis.share(one.values) for one in (old, new))
    number = itinerary.period_number if mirrored else itinerary.period_number // 2
    once = Itinerary(itinerary.segments[:n], number, bool(mirrored), itinerary.scene)
    guess = orbit_at(family.numbers, axis.placed(old.values, q + float(share) * (end - q)), once, z)
    found = Family(family.problem, guess).solved(guess, (kinds.PERIOD_DOUBLING,))
    near = found is not None and abs(found.orbit.z - z).max() <= abs(new.z - old.z).max()
    return found if near else None


def _difference(orbit: Orbit) -> Vector:
    """Difference between the durations of the two halves, (n/2,)."""
    first, second = np.split(orbit.durations, 2)
    return np.asarray(first - second)


def halves_apart(orbit: Orbit, least: float, mirrored: bool = False) -> bool:
    """True if the start states or the durations of an orbit's halves differ by more than `least`.

    With `mirrored` the state of one half is replaced by its mirror image.
    """
    n = len(orbit.itinerary) // 2
    begin, middle = orbit.system.flows[0].start, orbit.system.flows[n].start
    change = begin + middle if mirrored else begin - middle
    return bool(np.max(np.abs([*change, *_difference(orbit)])) > least)
