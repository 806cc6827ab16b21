"""Following a family of periodic orbits in its parameters, and from one itinerary to the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from capsule_sym._orbits.continuation.bifurcations import SmoothEvent
from capsule_sym._orbits.continuation.events import DEGENERATE, FOLD, BorderCollision
from capsule_sym._orbits.continuation.family import EXACT, Family
from capsule_sym._orbits.continuation.locating import first_event, hides, matching, smooth_between
from capsule_sym._orbits.continuation.path import (
    Solution,
    Vector,
    corrected,
    least_between,
    least_slope_between,
    tangent,
)
from capsule_sym._orbits.continuation.states import Axis, Ending, Event, State, Step, Stop, where
from capsule_sym._orbits.shooting.admissibility import DURATION, Inequality
from capsule_sym._orbits.shooting.changes import Change, remove_segment, swap_segment
from capsule_sym._orbits.shooting.itinerary import contact
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import half_orbit, halved_at

FIRST = 0.01  # length of a step at the begin and after an event
NEIGHBOUR_STEP = 1e-4  # distance from an event at which its two sides are looked at
_NEARER = (1.0, 0.1, 1e-2, 1e-3)  # shares of that, where another event is within it
_LEAST, _LONGEST = 1e-8, 0.2  # lengths of steps
_SHARE = 0.004  # of large unknowns that a longer step may be
_TURN = 0.95  # least cosine between tangents of neighbours
_AROUND = 1e-3  # distance from a point at which the curves that cross there are told apart
_CROSSING = 1e-9  # least singular value over the largest where two curves of solutions cross
_DIRECTIONS = 16
_FINEST = 1e-5  # a step not longer than this is not looked through for two bifurcations
_AHEAD = 0.25  # least share of a step that turns back to the border it comes from
_CLEAR = 0.1  # share of what is at a step's ends, above which a cubic stays clear of 0 between
_SMALL = 0.3  # a test function below this may vanish twice within a step


def first_half(orbit: Orbit, axes: tuple[Axis, ...]) -> Orbit | None:
    """The first half of an orbit that is its own mirror image; None of any other.

    Where beta varies the spring is stiffless at beta = 0 only.
    """
    varies = {name for axis in axes for name in (axis.name, *dict(axis.path.ties))}
    if "beta" in varies and any(map(contact, orbit.itinerary.fields)):
        return None
    return half_orbit(orbit)


def vanishing(orbit: Orbit, segment: int) -> Event:
    """What a continuation that comes with the segment of duration 0 crosses."""
    itinerary, zero = orbit.itinerary, 0 * orbit.z[0]
    same_itinerary = Change(itinerary, orbit.z, tuple(range(len(itinerary))))
    located = BorderCollision(
        itinerary, (segment,), orbit.z, orbit.values, orbit.system, orbit.residual, (), 0
    )
    failed = Inequality(DURATION, segment, None, zero, zero)
    return Event(failed, segment, same_itinerary, located, 0.0)


class Neighbour(NamedTuple):
    """A state a little further on from a point, the point itself, and what lies between, in order.

    No inequalities are asked of the point.
    """

    state: State
    point: State
    smooth: list[tuple[str, SmoothEvent]]


class Continuation(Family):
    """A family that is followed step by step, from one itinerary to the next."""

    unlocated: Sequence[str] = ()
    """The inequalities that fail in the last step tried, at no event that was located."""
    _falls = False
    """Whether the parameter grows ever more slowly along the path."""

    def advance(self, state: State, length: float, largest: float) -> Step:
        """A step of this length or a shorter one; no q changes by more than about `largest`.

        Raises Stop where even the shortest step is too long.
        """
        fastest = np.max(abs(state.tangent[-len(self.axes) :]))
        longest = max(_LONGEST, _SHARE * np.max(abs(state.u)))
        length = min(length, longest, largest / max(fastest, 1e-9))
        while length >= _LEAST:
            step = self._tried(state, length)
            if step is not None:
                before, after = (abs(one.tangent[-1]) for one in (state, step.state))
                self._falls = step.event is None and bool(after < before)
                return step
            length /= 2
        detail = f"no further point at {where(state.orbit, self.axes)}"
        if not self.unlocated:
            raise Stop(Ending.NOT_CONVERGED, detail)
        failing = f"{' and '.join(self.unlocated)} fails, at no regular event"
        raise Stop(Ending.NO_ADMISSIBLE_ORBIT, f"{detail}: {failing}")

    def _tried(self, state: State, length: float) -> Step | None:
        """A step of this length; None where that is too long."""
        guess = state.u + length * state.tangent
        try:
            solution = corrected(self.equations, guess, state.tangent)
            outside = None if solution is None else self._outside(solution.u)
            if solution is not None and outside is not None:
                solution = self._at_border(state, solution, *outside)
        except (ArithmeticError, ValueError):
            return None  # the guess is where parameters, or a path of them, have no values
        if solution is None:
            return None
        new = self.state(solution.u, state.tangent, solution)
        if new.tangent @ state.tangent < _TURN:
            return None
        if length > _FINEST and self._may_skip_two(state, new):
            return None
        failing = [one for one in new.held if one.value <= 0]
        event = first_event(self, state, new, failing)
        self.unlocated = ()
        if failing and (event is None or hides(self, state, new, event)):
            self.unlocated = [one.named(self.itinerary) for one in failing]
            return None
        smooth = smooth_between(self, state, new, event.share if event else 1.0)
        further = 2 * length if solution.steps <= 3 else length
        return Step(new, smooth, event, outside is not None, FIRST if event else further)

    def _may_skip_two(self, old: State, new: State) -> bool:
        """Whether a step may have passed two bifurcations of one type, which leave no sign.

        By the cubics through both ends: the parameter's, which turns back at folds, and those of
        the test functions where they are small.
        """
        change = new.u - old.u
        length = float(np.linalg.norm(change))
        if len(self.axes) == 1:
            slopes = np.array([old.tangent[-1], new.tangent[-1]]) * length
            slopes, chord = np.sign(slopes[0]) * slopes, np.sign(slopes[0]) * change[-1]
            # Beyond an event the parameter sets out slowly: only a slope that falls may dip.
            falls = self._falls or slopes[1] < slopes[0]
            clear = _CLEAR * max(slopes) if falls else 0.0
            if min(slopes) > 0 and least_slope_between(chord, slopes) < clear:
                return True
        for name in EXACT:
            if name not in self.watched or (name == FOLD and len(self.axes) == 1):
                continue
            ends = np.array([old.tests[name], new.tests[name]])
            if ends[0] * ends[1] > 0 and min(abs(ends)) < _SMALL:
                sides = [self._slope(name, state) * length for state in (old, new)]
                slopes, ends = np.sign(ends[0]) * np.array(sides), abs(ends)
                if slopes[0] < 0 < slopes[1] and least_between(ends, slopes) < _CLEAR * min(ends):
                    return True
        return False

    def _slope(self, name: str, state: State) -> float:
        """The derivative of a test function along the path."""
        return float(self.row(state.orbit, name) @ state.tangent)

    def _outside(self, u: Vector) -> tuple[int, float] | None:
        """Index and border of the first q that has left [0, 1]."""
        for k in range(len(u) - len(self.axes), len(u)):
            if not 0 <= u[k] <= 1:
                return k, float(u[k] > 1)
        return None

    def _at_border(self, state: State, beyond: Solution, k: int, edge: float) -> Solution | None:
        """Where a step leaves the range; None where the path turns back within it, too near."""
        step = beyond.u - state.u
        guess = state.u + (edge - state.u[k]) / step[k] * step
        guess[k] = edge
        normal = np.zeros(len(guess))
        normal[k] = 1.0
        found = corrected(self.equations, guess, normal)
        if found is None or (edge - 0.5) * state.tangent[k] > 0:
            return found
        ahead = (found.u - state.u) @ state.tangent
        return found if ahead > _AHEAD * np.linalg.norm(step) else None

    def cross(self, event: Event) -> Neighbour | None:
        """Go on in the itinerary beyond an event, to a little further on; None if there is nothing.

        Raises Stop where the itineraries on the two sides do not share the condition.
        """
        located, failed = event.located, event.failed
        z, segment = located.z, event.segment
        if (
            self.itinerary.mirrored
            and not located.itinerary.mirrored
            and (self.zero_segment is not None or self.critical)
        ):
            raise Stop(Ending.CODIMENSION_TWO, "beyond, the orbit is not its own mirror image")
        self._keep(event.change)
        self.itinerary = located.itinerary
        if failed.kind == DURATION:
            other = swap_segment(self.itinerary, z, segment)
            if other is None:
                change, inequality = remove_segment(
                    self.numbers, self.itinerary, z, located.system, segment
                )
                self._keep(change)
                self.itinerary = change.itinerary
                u = self.unknowns(change.z, located.values)
                both = [self.neighbour(u, side) for side in self.directions(u)]
                return max(both, key=lambda one: _margin(one, inequality))
            self.itinerary = other.itinerary
        u = self.unknowns(z, located.values)
        index = 4 + segment - (self.zero_segment is not None and self.zero_segment < segment)
        along = np.zeros(len(u))
        along[index] = 1.0
        return self.neighbour(u, along)

    def symmetric(self, state: State) -> State:
        """The state by the first half of its orbit, where that is its own mirror image."""
        if self.itinerary.mirrored or self.critical is not None:
            return state
        if self.zero_segment is None:
            half = first_half(state.orbit, self.axes)
        else:
            half, self.zero_segment = halved_at(state.orbit, self.zero_segment) or (
                None,
                self.zero_segment,
            )
        if half is None:
            return state
        self.itinerary, count = half.itinerary, len(self.axes)
        u = self.unknowns(half.z, half.values)
        along = np.array([*np.zeros(len(u) - count), *state.tangent[-count:]])
        return self.state(u, along)

    def _keep(self, change: Change) -> None:
        if self.zero_segment is None:
            return
        self.zero_segment = change.kept[self.zero_segment]
        if self.zero_segment is None:
            raise Stop(Ending.CODIMENSION_TWO, "the segment of duration 0 merges with another")

    def directions(self, u: Vector) -> list[Vector]:
        """The two directions of the curve of solutions at u."""
        rows = self.equations(u).by
        null = np.linalg.svd(rows)[2][-1]
        return [null, -null]

    def around(self, u: Vector) -> Iterator[State]:
        """The states a little further on from u, on all curves of solutions that pass it.

        Where two of them cross the equations' null vectors fill a plane, whose directions are
        tried; each curve may come several times.
        """
        _, sizes, right = np.linalg.svd(self.equations(u).by)
        along, across = right[-1], right[-2]
        angles = np.arange(2 if sizes[-1] > _CROSSING * sizes[0] else _DIRECTIONS)
        turns = angles * (2 * np.pi / len(angles))
        ways = [np.cos(turn) * along + np.sin(turn) * across for turn in turns]
        for way in ways:
            solution = corrected(self.equations, u + _AROUND * way, way)
            if solution is not None:
                yield self.state(solution.u, way, solution)

    def neighbour(self, u: Vector, along: Vector) -> Neighbour | None:
        """What is a little further on from u, in the direction that `along` points to.

        Nearer to u where another event is that near.
        """
        at = self.equations(u)
        try:
            direction = tangent(at.by, along)
        except np.linalg.LinAlgError:
            return None
        states = []
        for share in _NEARER:
            solution = corrected(self.equations, u + share * NEIGHBOUR_STEP * direction, direction)
            if solution is not None:
                states.append(self.state(solution.u, direction, solution))
                if all(one.value > 0 for one in states[-1].held):
                    break
        else:
            del states[1:]
        if not states:
            return None
        state, point = states[-1], State(u, at.made, [], direction, self.tests(at.made))
        found = smooth_between(self, point, state, 1.0)
        # Where the point is a degenerate one its own test function is rounding.
        smooth = [(name, one) for name, one in found if name != DEGENERATE]
        return Neighbour(state, point, smooth)


def _margin(neighbour: Neighbour | None, inequality: Inequality) -> tuple[bool, float]:
    """Whether all holds at a state, and by how much an inequality does; the greater the better."""
    if neighbour is None:
        return False, -float("inf")
    held = neighbour.state.held
    found = matching(held, inequality)
    return all(one.value > 0 for one in held), float(found.value) if found else float("inf")
