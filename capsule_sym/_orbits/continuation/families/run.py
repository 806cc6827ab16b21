"""A path that is followed step by step to its end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from capsule_sym._native import TimeUp
from capsule_sym._orbits.continuation.families.states import (
    OUT_OF_TIME,
    Ending,
    Event,
    Neighbour,
    SmoothEvent,
    State,
    Step,
    Stop,
)
from capsule_sym._orbits.continuation.families.stepping import Continuation
from capsule_sym._orbits.continuation.points.extended import EventSolution

_UNIT = 2.0**-53
_ROUNDINGS = 8


class Run(ABC):
    """A run of a continuation, with at least so many steps to each range of what varies."""

    last: State | None = None
    """The last state that was added."""

    def __init__(self, continuation: Continuation, points: int, most: int) -> None:
        self.continuation, self.problem = continuation, continuation.problem
        self.largest, self.most = 1 / points, most

    def follow(self, begin: Callable[[], State]) -> tuple[Ending, str]:
        """Follow the path from a state to its end, and say why it ends."""
        length = self.problem.settings.first_step
        try:
            first = begin()
            self.add(first)
            self.last = first
            for _ in range(self.most - 1):
                before = self.last
                self.last, length = self._step(before, length)
                if self.closes(before, self.last):
                    return Ending.RETURNED, self.problem.where(self.last.orbit)
        except Stop as stop:
            return stop.ending, stop.detail
        except TimeUp:
            return OUT_OF_TIME
        return Ending.TOO_MANY_POINTS, f"{self.most} points"

    def _step(self, state: State, length: float) -> tuple[State, float]:
        step = self.continuation.advance(state, length, self.largest)
        for one in step.smooth:
            self.record_smooth(one, state, step.state)
        self.check(state, step)
        if step.event is not None:
            beyond = self.cross(state, step.state, step.event)
            self.add(beyond)
            return beyond, step.next
        self.add(step.state)
        if step.at_border:
            self.reach_border(step.state)
        return step.state, step.next

    def record_between(self, neighbour: Neighbour) -> None:
        """Record the smooth bifurcations between a point and a state beside it."""
        for one in neighbour.smooth:
            self.record_smooth(one, neighbour.point, neighbour.state)

    def errors(self, found: EventSolution) -> list[float]:
        """Uncertainties of what varies at a smooth bifurcation, with the rounding of its value."""
        values = self.problem.values(found.orbit)
        both = zip(found.uncertainties, values, strict=True)
        return [float(error) + _ROUNDINGS * _UNIT * abs(value) for error, value in both]

    @abstractmethod
    def add(self, state: State) -> None:
        """Add a point. Raises Stop where it is not admissible."""

    @abstractmethod
    def record_smooth(self, one: SmoothEvent, old: State, new: State) -> None:
        """Record a smooth bifurcation between two states."""

    @abstractmethod
    def cross(self, old: State, new: State, event: Event) -> State:
        """Record a border collision, and give the state beyond. Raises Stop if there is none."""

    @abstractmethod
    def check(self, old: State, step: Step) -> None:
        """Raises Stop where the path ends on the way of a step."""

    def closes(self, old: State, new: State) -> bool:
        """Whether the path passes its first point between two states."""
        return False

    def reach_border(self, state: State) -> None:
        """Raises Stop at the border of the range."""
        raise Stop(Ending.REACHED, self.problem.where(state.orbit))
