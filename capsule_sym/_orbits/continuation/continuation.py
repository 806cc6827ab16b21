"""Branches of periodic orbits in one parameter, through folds and through changes of itinerary."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import backend
from capsule_sym._map.checks import checked_seconds
from capsule_sym._map.labelled import Labelled
from capsule_sym._native import TimeUp, Watch
from capsule_sym._orbits.continuation.bifurcations import (
    INITIALS,
    Bifurcation,
    SmoothEvent,
    sorted_multipliers,
)
from capsule_sym._orbits.continuation.doubling import halved
from capsule_sym._orbits.continuation.events import PERIOD_DOUBLING, place
from capsule_sym._orbits.continuation.parameter_paths import Function, ParameterPath, parameter_path
from capsule_sym._orbits.continuation.states import (
    OUT_OF_TIME,
    Axis,
    Ending,
    Event,
    State,
    Stop,
    where,
)
from capsule_sym._orbits.continuation.stepping import (
    FIRST,
    NEIGHBOUR_STEP,
    Continuation,
    Neighbour,
    first_half,
)
from capsule_sym._orbits.shooting.admissibility import Inequality, is_admissible
from capsule_sym._orbits.shooting.equations import PARAMETERS, Vector
from capsule_sym._orbits.shooting.identity import same, same_start
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, columns_of
from capsule_sym._orbits.shooting.symmetry import BROKEN, KEPT, whole_orbit

_MOST_POINTS = 20_000
MOST_STEPS = 5_000  # that may be asked for


_Point = TypeVar("_Point")


@dataclass(frozen=True)
class BranchPoint:
    """An orbit of a branch, with the tightest of its itinerary's inequalities; dimensionless."""

    value: float
    orbit: Orbit
    admissibility: Inequality

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the orbit, the largest modulus first."""
        return sorted_multipliers(self.orbit)


def ends(points: Sequence[_Point]) -> dict[str, _Point]:
    """The ends of a branch, or its only point, by their labels."""
    return dict(zip(("EP1", "EP2"), points[:: max(1, len(points) - 1)], strict=False))


@dataclass(frozen=True)
class Branch(Labelled):
    """Orbits along a branch and its bifurcations, both in order, and why it ends.

    `axis` has what varies and between which values it is followed, `origin` is the label of the
    bifurcation at which it leaves another branch, such as "PD1", or "PD1/PD2" on a branch that
    itself leaves at PD1; empty for a branch of its own. All values are dimensionless, but of a
    parameter in SI units that others are tied to.
    """

    axis: Axis
    points: tuple[BranchPoint, ...]
    bifurcations: tuple[Bifurcation, ...]
    status: Ending
    message: str
    origin: str = ""
    dimension = "point"

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The points as columns, arrays of shape (n,).

        What varies has its own name; of each orbit there are itinerary, period number,
        progression, start, and the largest modulus of a Floquet multiplier.
        """
        largest = [max(map(abs, point.multipliers), default=0.0) for point in self.points]
        return {
            self.parameter: np.array([float(point.value) for point in self.points]),
            "largest_multiplier": np.array(largest, dtype=float),
            **columns_of([point.orbit for point in self.points]),
        }

    def attributes(self) -> dict[str, Any]:
        """Why the branch ends, and where it leaves another."""
        return {"status": str(self.status), "message": self.message, "origin": self.origin}

    @property
    def success(self) -> bool:
        """Whether the branch ends where it was to end."""
        return self.status is Ending.REACHED

    @property
    def statistics(self) -> dict[str, Any]:
        """How many points there are, and Newton's steps to all of them."""
        steps = sum(point.orbit.iterations for point in self.points)
        return {"points": len(self.points), "iterations": steps}

    @property
    def parameter(self) -> str:
        """What varies."""
        return self.axis.name

    def at(self, label: str) -> Bifurcation | BranchPoint:
        """The bifurcation of this label, such as "PD2"; "EP1" and "EP2" are the branch's ends.

        Raises InvalidInput for a label that the branch does not have.
        """
        named: dict[str, Bifurcation | BranchPoint] = {b.label: b for b in self.bifurcations}
        named |= ends(self.points)
        if label not in named:
            raise InvalidInput("label", label, f"one of {', '.join(named)}")
        return named[label]

    def __repr__(self) -> str:
        ends = " to ".join(f"{p.value:.6g}" for p in (self.points[:1] + self.points[-1:]))
        counts = f"{len(self.points)} points, {len(self.bifurcations)} bifurcations"
        return f"<Branch in {self.parameter} from {ends}: {counts}, ended {self.status}>"


def continue_orbit(
    orbit: Orbit,
    parameter: str,
    to: float,
    *,
    points: int = 100,
    ties: Mapping[str, Function | str] | None = None,
    max_seconds: float = math.inf,
) -> Branch:
    """The branch through an orbit, from its value of a parameter to another one (dimensionless).

    At least `points` steps are taken, more where the branch bends or an itinerary begins. The
    branch is followed through folds, whether stable or not, and from itinerary to itinerary, until
    the parameter leaves the range between the two values; an end before that says why, and comes
    after `max_seconds` at the latest. Other parameters may vary with it: `ties` has for each its
    function, or a text such as "0.5*omega**2"; then `parameter` may also be something else of which
    one of them is an affine function. Raises InvalidInput for what is no parameter and not tied to
    one, a value that a parameter cannot have, equal values, and an orbit whose parameters are not
    on the path.
    """
    axis = axis_from(orbit, parameter_path(parameter, ties), to)
    check_points(points)
    limit = Watch(checked_seconds(max_seconds))
    with backend("numpy") as numbers, np.errstate(all="ignore"):
        start = first_half(orbit, (axis,)) or orbit
        continuation = Continuation(numbers, start, (axis,))
        u = continuation.unknowns(start.z, start.values)
        along = np.zeros(len(u))
        along[-1] = 1.0
        with limit:
            found = Run(continuation, u, along, points).go()  # says itself that the time was over
    return found


def check_points(points: int) -> None:
    """Raises InvalidInput unless this is a number of steps that a path may be asked to take."""
    whole = isinstance(points, int) and not isinstance(points, bool)
    if not whole or not 1 <= points <= MOST_STEPS:
        raise InvalidInput("points", points, f"a whole number from 1 to {MOST_STEPS}")


def axis_from(orbit: Orbit, path: ParameterPath, to: float) -> Axis:
    """The axis from an orbit on a path to a value of what varies; raises InvalidInput."""
    if isinstance(to, bool) or not isinstance(to, int | float) or not math.isfinite(to):
        raise InvalidInput(path.name, to, "finite")
    if path.name in PARAMETERS:
        orbit.parameters.replace(**{path.name: to})
    begin, to = float(path.value(orbit.values)), float(to)
    if to == begin:
        raise InvalidInput("to", to, f"other than {begin}, where the branch begins")
    path.check(orbit.parameters, begin, to)
    if not path.holds([float(value) for value in orbit.values]):
        tied = [name for name, _ in path.ties]
        raise InvalidInput("ties", tied, f"such that they hold for the orbit at {begin}")
    return Axis(path, begin, to)


class Run:
    """One run along a branch, from unknowns u of a continuation on, to the side of `along`."""

    def __init__(
        self, continuation: Continuation, u: Vector, along: Vector, points: int, origin: str = ""
    ) -> None:
        self.continuation, self.start, self.along = continuation, u, along
        (self.axis,) = continuation.axes
        self.largest, self.origin = 1 / points, origin
        self.points: list[BranchPoint] = []
        self.bifurcations: list[Bifurcation] = []

    def go(self, neighbour: Neighbour | None = None) -> Branch:
        """Follow the branch to its end; it may begin beside a point, with what lies between."""
        ending, detail = Ending.TOO_MANY_POINTS, f"{_MOST_POINTS} points"
        try:
            state = self.continuation.state(self.start, self.along)
            self._pass(neighbour)
            self._add(state)
            step = FIRST
            while len(self.points) < _MOST_POINTS:
                state, step = self._step(state, step)
        except Stop as stop:
            ending, detail = stop.ending, stop.detail
        except TimeUp:
            ending, detail = OUT_OF_TIME
        points, found = tuple(self.points), labelled(self.bifurcations)
        return Branch(self.axis, points, found, ending, detail, self.origin)

    def _value(self, orbit: Orbit) -> float:
        return self.axis.value(orbit.values)

    def _add(self, state: State) -> None:
        tightest = self.continuation.tightest(state)
        if self.axis.path.ties:
            _ = state.orbit.parameters  # refuses what lies between the values that were tried
        self.points.append(
            BranchPoint(self._value(state.orbit), whole_orbit(state.orbit), tightest)
        )

    def _step(self, state: State, step: float) -> tuple[State, float]:
        new, smooth, event, at_border, step = self.continuation.advance(state, step, self.largest)
        for name, one in smooth:
            self._record_smooth(name, one, state, new)
        if event is not None:
            return self._cross(state, new, event), step
        self._halve(state, new)
        self._add(new)
        if at_border:
            ending = Ending.REACHED
            if new.u[-1] < 0.5 and self.start[-1] < NEIGHBOUR_STEP:
                # It runs the other way: to an orbit beyond a fold, however near, or along itself
                # with the halves of a doubled orbit exchanged.
                end, first = whole_orbit(new.orbit), self.points[0].orbit
                returned = same(end, first) and not same_start(end, first)
                ending = Ending.RETURNED if returned else Ending.TURNED_BACK
            raise Stop(ending, where(new.orbit, (self.axis,)))
        return new, step

    def _halve(self, old: State, new: State) -> None:
        """End the branch where the halves of a period-doubled orbit have become one."""
        found = halved(old.orbit, new.orbit, self.axis)
        if found is None:
            return
        self._record_smooth(PERIOD_DOUBLING, found, old, new, last=True)
        at = where(found.orbit, (self.axis,))
        raise Stop(
            Ending.PERIOD_HALVED, f"the two halves of {old.orbit.itinerary} become one at {at}"
        )

    def _record_smooth(
        self, name: str, one: SmoothEvent, old: State, new: State, last: bool = False
    ) -> None:
        orbit, interval = one.orbit, (self._value(old.orbit), self._value(new.orbit))
        # The share of a smooth bifurcation is one of the step, at the end that of the axis.
        width = abs(self.axis.end - self.axis.begin if last else interval[1] - interval[0])
        rounding = 8 * 2.0**-53 * max(map(abs, interval))
        self.bifurcations.append(
            Bifurcation(
                type=name,
                parameter=self.axis.name,
                value=self._value(orbit),
                uncertainty=max(one.uncertainties or (width * one.doubt,)) + rounding,
                residual=one.residual,
                iterations=one.iterations,
                status=one.status,
                line="",
                surfaces=(),
                segment=None,
                symmetry=KEPT if orbit.itinerary.mirrored else "",
                interval=interval,
                failed="",
                itinerary_before=old.orbit.itinerary.whole,
                itinerary_after=None if last else new.orbit.itinerary.whole,
                multipliers_before=sorted_multipliers(old.orbit),
                multipliers_after=() if last else sorted_multipliers(new.orbit),
                orbit=whole_orbit(orbit),
                path=self.axis.path,
            )
        )

    def _cross(self, old: State, new: State, event: Event) -> State:
        """Record an event, and give the state beyond it."""
        located, beyond, failure = event.located, None, "there is no orbit"
        try:
            beyond = self.continuation.cross(event)
        except InvalidInput as error:
            failure = str(error)
        if beyond is not None:
            failure = failure_of(beyond.state)
        neighbour = self.continuation.symmetric(beyond.state) if beyond and not failure else None
        what = place(located.itinerary, located.system, event.segment)
        at = whole_orbit(located.orbit("numpy"))
        self.bifurcations.append(
            Bifurcation(
                type=what.type if what else "corner of higher codimension",
                parameter=self.axis.name,
                value=self._value(at),
                uncertainty=float(located.uncertainties[0]),
                residual=float(located.residual),
                iterations=located.iterations,
                status=at.status,
                line=what.line if what else "",
                surfaces=what.surfaces if what else (),
                segment=event.segment,
                symmetry=_symmetry(old, located.itinerary, neighbour),
                interval=(self._value(old.orbit), self._value(new.orbit)),
                failed=event.failed.named(old.orbit.itinerary),
                itinerary_before=old.orbit.itinerary.whole,
                itinerary_after=neighbour.orbit.itinerary.whole if neighbour else None,
                multipliers_before=sorted_multipliers(old.orbit),
                multipliers_after=sorted_multipliers(neighbour.orbit) if neighbour else (),
                orbit=at,
                path=self.axis.path,
            )
        )
        if beyond is None or neighbour is None:
            failed, spot = event.failed.named(old.orbit.itinerary), where(at, (self.axis,))
            detail = f"{failed} fails at {spot}; beyond, {failure}"
            raise Stop(Ending.NO_ADMISSIBLE_ORBIT, detail)
        self._pass(beyond)
        self._add(neighbour)
        return neighbour

    def _pass(self, neighbour: Neighbour | None) -> None:
        """Record what lies between a point and a state beside it."""
        if neighbour is not None:
            for name, one in neighbour.smooth:
                self._record_smooth(name, one, neighbour.point, neighbour.state)


def _symmetry(old: State, itinerary: Itinerary, neighbour: State | None) -> str:
    """What becomes of the mirror symmetry at an event on the way from one state to another."""
    if itinerary.mirrored:
        return KEPT
    sides = [state.orbit.itinerary.mirrored for state in (old, neighbour) if state]
    return BROKEN if any(sides) else ""


def labelled(found: Sequence[Bifurcation]) -> tuple[Bifurcation, ...]:
    """Bifurcations with labels: the initials of their type, and their number among these."""
    counts = Counter[str]()
    result = []
    for one in found:
        initials = INITIALS.get(one.type, "XX")
        counts[initials] += 1
        result.append(replace(one, label=f"{initials}{counts[initials]}"))
    return tuple(result)


def failure_of(state: State) -> str:
    """Why a state beyond an event is no motion; empty if it is one."""
    itinerary = state.orbit.itinerary
    failed = [one.named(itinerary) for one in state.held if one.value <= 0]
    if failed:
        return f"{' and '.join(failed)} fails in {itinerary} at once"
    return "" if is_admissible(whole_orbit(state.orbit)) else f"the map does not follow {itinerary}"
