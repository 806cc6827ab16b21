"""Problem, axes, states and steps of a continuation, events on its way, and its endings."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from capsule_sym._map.backend import Backend
from capsule_sym._orbits.continuation.parameter_paths import Axis
from capsule_sym._orbits.continuation.points.extended import EventSolution
from capsule_sym._orbits.continuation.settings import DEFAULT, ContinuationSettings
from capsule_sym._orbits.shooting.admissibility import Inequality
from capsule_sym._orbits.shooting.changes import Change
from capsule_sym._orbits.shooting.equations import Vector
from capsule_sym._orbits.shooting.orbit import Orbit


class Ending(StrEnum):
    """Reasons for the end of a branch or a curve."""

    #: The parameter has reached the value that was asked for, or the border of its range.
    REACHED = "reached"
    #: It came back to where it began.
    RETURNED = "returned"
    #: The parameter came back to the value where it began, on another orbit.
    TURNED_BACK = "turned-back"
    #: The two halves of a period-doubled orbit became one: a branch of half the period is reached.
    PERIOD_HALVED = "period-halved"
    #: The orbit became its own mirror image: a branch of such orbits is reached.
    SYMMETRIC = "symmetric"
    #: Newton's method finds no further point, however short the step.
    NOT_CONVERGED = "not-converged"
    #: An inequality of the itinerary fails, and no orbit that the map follows goes on from there.
    NO_ADMISSIBLE_ORBIT = "no-admissible-orbit"
    #: The mean force of drive and load reaches friction: beyond, no motion is periodic.
    DRAGGED = "dragged"
    #: The curve ends in a point of codimension two, which it has on its list.
    CODIMENSION_TWO = "codimension-two"
    #: As many points as allowed.
    TOO_MANY_POINTS = "too-many-points"
    #: The time is over.
    TIME_LIMIT = "time-limit"


OUT_OF_TIME = Ending.TIME_LIMIT, "the time was over, or the work was interrupted"


class Stop(Exception):
    """The path ends, and why."""

    def __init__(self, ending: Ending, detail: str) -> None:
        super().__init__(detail)
        self.ending, self.detail = ending, detail


class Problem(NamedTuple):
    """The number system, axes and settings that all families of a continuation share."""

    numbers: Backend
    axes: tuple[Axis, ...]
    settings: ContinuationSettings = DEFAULT

    def values(self, orbit: Orbit) -> tuple[float, ...]:
        """The values of what varies."""
        return tuple(axis.value(orbit.values) for axis in self.axes)

    def where(self, orbit: Orbit) -> str:
        """The free parameters' values and the itinerary, for a message."""
        named = zip(self.axes, self.values(orbit), strict=True)
        values = ", ".join(f"{axis.name} = {value!r}" for axis, value in named)
        return f"{values}, itinerary {orbit.itinerary}"


class State(NamedTuple):
    """A point of the path: unknowns u, the orbit, its inequalities, tangent and tests."""

    u: Vector
    orbit: Orbit
    held: list[Inequality]
    tangent: Vector
    tests: dict[str, float]

    @property
    def admissible(self) -> bool:
        """True if all inequalities hold."""
        return all(one.value > 0 for one in self.held)


class SmoothEvent(NamedTuple):
    """A test function that vanishes on the way between two states, and after which share of it.

    Where the search has failed, `solved` is False and the orbit that of the first state.
    """

    type: str
    ends: tuple[State, State]
    share: float
    solution: EventSolution
    solved: bool = True


class Event(NamedTuple):
    """A failed inequality, the orbit with a segment of duration 0 that stands for it, its share."""

    failed: Inequality
    segment: int
    change: Change
    solution: EventSolution
    share: float


class Step(NamedTuple):
    """The state after a step, what is on the way, in order, and how long to try the next step."""

    state: State
    smooth: list[SmoothEvent]
    event: Event | None
    at_border: bool
    next: float
