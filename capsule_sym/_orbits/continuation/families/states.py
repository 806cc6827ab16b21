"""Problem, axes, states, steps, events and endings of a continuation."""

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
    """Reason for the end of a branch or a curve."""

    #: The parameter has reached the target value, or the border of its range.
    REACHED = "reached"
    #: The path returned to its start.
    RETURNED = "returned"
    #: The parameter returned to its start value, on another orbit.
    TURNED_BACK = "turned-back"
    #: The two halves of a period-doubled orbit became equal: a branch of half the period.
    PERIOD_HALVED = "period-halved"
    #: The orbit became its own mirror image: a branch of symmetric orbits.
    SYMMETRIC = "symmetric"
    #: Newton's method found no further point, even at the shortest step.
    NOT_CONVERGED = "not-converged"
    #: An inequality of the itinerary fails, and no admissible orbit continues the branch.
    NO_ADMISSIBLE_ORBIT = "no-admissible-orbit"
    #: The mean force of drive and load reaches friction: beyond, no motion is periodic.
    DRAGGED = "dragged"
    #: The curve ends in a codimension-two point, which is in its list.
    CODIMENSION_TWO = "codimension-two"
    #: The largest number of points was reached.
    TOO_MANY_POINTS = "too-many-points"
    #: The time limit was reached.
    TIME_LIMIT = "time-limit"


OUT_OF_TIME = Ending.TIME_LIMIT, "time limit reached, or interrupted"


class Stop(Exception):
    """Raised where the path ends, with the reason."""

    def __init__(self, ending: Ending, detail: str) -> None:
        super().__init__(detail)
        self.ending, self.detail = ending, detail


class Problem(NamedTuple):
    """Number system, axes and settings that all families of a continuation share."""

    numbers: Backend
    axes: tuple[Axis, ...]
    settings: ContinuationSettings = DEFAULT

    def values(self, orbit: Orbit) -> tuple[float, ...]:
        """Values of the varied parameters."""
        return tuple(axis.value(orbit.values) for axis in self.axes)

    def where(self, orbit: Orbit) -> str:
        """The free parameters' values and the itinerary, for a message."""
        named = zip(self.axes, self.values(orbit), strict=True)
        values = ", ".join(f"{axis.name} = {value!r}" for axis, value in named)
        return f"{values}, itinerary {orbit.itinerary}"


class State(NamedTuple):
    """Point of the path: unknowns u, the orbit, its inequalities, tangent and test functions."""

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
    """Test function that vanishes between two states, and the share of the step at its zero.

    If the search has failed, `solved` is False and the orbit is that of the first state.
    """

    type: str
    ends: tuple[State, State]
    share: float
    solution: EventSolution
    solved: bool = True


class Event(NamedTuple):
    """Failed inequality, the orbit at which it is 0 with a segment of duration 0, and its share."""

    failed: Inequality
    segment: int
    change: Change
    solution: EventSolution
    share: float


class Step(NamedTuple):
    """State after a step, the events on it in order, and the length of the next step to try."""

    state: State
    smooth: list[SmoothEvent]
    event: Event | None
    at_border: bool
    next: float
