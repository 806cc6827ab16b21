"""Following a family of periodic orbits in its parameters, and from one itinerary to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation.bifurcations import (
    SMOOTH,
    SmoothEvent,
    evaluate_test_functions,
    gradient_of_test_function,
    noise,
    rotations,
    zero_of_test_function,
)
from capsule_sym._orbits.continuation.events import (
    CUSP,
    DEGENERATE,
    FOLD,
    GENERALIZED_DOUBLING,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    RESONANCE_1_1,
    RESONANCE_1_2,
    BorderCollision,
    Condition,
    Vanishing,
    solve_event,
)
from capsule_sym._orbits.continuation.normal_forms import cubic, degeneracy, quadratic
from capsule_sym._orbits.continuation.path import (
    Evaluation,
    Solution,
    Vector,
    corrected,
    least_between,
    least_slope_between,
    tangent,
)
from capsule_sym._orbits.continuation.states import Axis, Ending, Event, State, Step, Stop, where
from capsule_sym._orbits.shooting.admissibility import (
    DURATION,
    LANDING,
    MINIMUM,
    Inequality,
    inequalities,
)
from capsule_sym._orbits.shooting.changes import Change, exchanged, inserted, shortened
from capsule_sym._orbits.shooting.equations import PARAMETERS, shooting
from capsule_sym._orbits.shooting.itinerary import contact
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import half_orbit, halved_at, whole_orbit

FIRST = 0.01  # length of a step at the begin and after an event
BESIDE = 1e-4  # distance from an event at which its two sides are looked at
_LEAST, _LONGEST = 1e-8, 0.2  # lengths of steps
_TURN = 0.95  # least cosine between tangents of neighbours
_TOGETHER = 1e-7  # shares of a step that are one event
_AROUND = 1e-3  # distance from a point at which the curves that cross there are told apart
_CROSSING = 1e-9  # least singular value over the largest where two curves of solutions cross
_DIRECTIONS = 16
_FINEST = 1e-5  # a step not longer than this is not looked through for two bifurcations
_CLEAR = 0.1  # share of what is at a step's ends, above which a cubic stays clear of 0 between
_SMALL = 0.3  # a test function below this may vanish twice within a step
_BEFORE = 1e-3  # share of a step before an event at which all else is asked to hold
_DOUBT = 0.1  # of a step: by how much its ends may mislead about where an inequality fails
_EXACT = (*SMOOTH, RESONANCE_1_1, RESONANCE_1_2)  # functions of the monodromy matrix
# What else may vanish along a curve of a smooth bifurcation; a cusp is seen by the curve's tangent.
_WATCHED = {
    FOLD: (PERIOD_DOUBLING, RESONANCE_1_1),
    PERIOD_DOUBLING: (FOLD, RESONANCE_1_2, GENERALIZED_DOUBLING),
    NEIMARK_SACKER: (FOLD, PERIOD_DOUBLING),
}


def first_half(orbit: Orbit, axes: tuple[Axis, ...]) -> Orbit | None:
    """The first half of an orbit that is its own mirror image; None of any other.

    Where beta varies the spring is stiffless at beta = 0 only.
    """
    varies = {name for axis in axes for name in (axis.name, *dict(axis.path.ties))}
    if "beta" in varies and any(map(contact, orbit.itinerary.fields)):
        return None
    return half_orbit(orbit)


def vanishing(orbit: Orbit, segment: int) -> Event:
    """What a follower that comes with the segment of duration 0 crosses."""
    itinerary, zero = orbit.itinerary, 0 * orbit.z[0]
    same_itinerary = Change(itinerary, orbit.z, tuple(range(len(itinerary))))
    located = BorderCollision(
        itinerary, (segment,), orbit.z, orbit.values, orbit.shot, orbit.residual, (), 0
    )
    failed = Inequality(DURATION, segment, None, zero, zero)
    return Event(failed, segment, same_itinerary, located, 0.0)


class Follower:
    """Orbits of one itinerary with free parameters, and a condition for each but one of them.

    The condition is that the segment `born` has the duration 0, or that the test function
    `critical` of a smooth bifurcation vanishes. The unknowns u are z, without the duration of a
    segment `born`, and q of each axis.
    """

    def __init__(
        self,
        numbers: Backend,
        orbit: Orbit,
        axes: tuple[Axis, ...],
        born: int | None = None,
        critical: str | None = None,
    ) -> None:
        self.numbers, self.axes = numbers, axes
        self.itinerary, self.born, self.critical = orbit.itinerary, born, critical
        self.values = [float(value) for value in orbit.values]
        self.unlocated: list[str] = []
        self._falls = False  # whether the parameter grows ever more slowly along the path

    def unknowns(self, z: Vector, values: tuple[float, ...]) -> Vector:
        """The unknowns of an orbit."""
        z = np.array(z, dtype=float)
        kept = z if self.born is None else np.delete(z, 4 + self.born)
        return np.array([*kept, *(axis.share(values) for axis in self.axes)])

    def orbit(self, u: Vector) -> Orbit:
        """The orbit, or what is to become one, of these unknowns."""
        count = len(self.axes)
        z, values = u[:-count], list(self.values)
        if self.born is not None:
            z = np.insert(z, 4 + self.born, 0.0)
        for axis, q in zip(self.axes, u[-count:], strict=True):
            values = axis.placed(values, float(q))
        shot = shooting(self.numbers, values, self.itinerary, z)
        return Orbit(tuple(values), self.itinerary, z, shot, self.numbers.name)

    def equations(self, u: Vector) -> Evaluation:
        """The equations at u, and the orbit."""
        orbit = self.orbit(u)
        shot = orbit.shot
        by_z = shot.by_z if self.born is None else np.delete(shot.by_z, 4 + self.born, axis=1)
        by_q = [axis.along(shot.by_p, orbit.values) for axis in self.axes]
        by, residual = np.column_stack([by_z, *by_q]), shot.residual
        if self.critical is not None:
            row = self._row(orbit, self.critical)
            residual = np.append(residual, evaluate_test_functions(orbit)[self.critical])
            by = np.vstack([by, row])
        return Evaluation(residual, by, orbit)

    def _row(self, orbit: Orbit, name: str) -> Vector:
        """Gradient of a test function by the unknowns."""
        row = self._gradient(orbit, name)
        row[-len(self.axes) :] *= [axis.end - axis.begin for axis in self.axes]
        return row if self.born is None else np.delete(row, 4 + self.born)

    def _gradient(self, orbit: Orbit, name: str) -> Vector:
        """Gradient of a test function of the monodromy matrix by z and what varies."""
        unit = np.eye(len(PARAMETERS))
        along = [axis.path.along(unit, axis.value(orbit.values)) for axis in self.axes]
        return gradient_of_test_function(self.numbers, orbit, name, np.array(along))

    def state(self, u: Vector, along: Vector, solution: Solution | None = None) -> State:
        """The state at u, which a solution may be of, with its tangent in the direction `along`."""
        _, by, orbit = solution.at if solution else self.equations(u)
        orbit = replace(orbit, iterations=solution.steps if solution else 0)
        held = inequalities(self.numbers, orbit.itinerary, orbit.shot, self.born)
        try:
            direction = tangent(by, along)
        except np.linalg.LinAlgError:
            raise Stop(Ending.NOT_CONVERGED, f"no tangent at {where(orbit, self.axes)}") from None
        return State(u, orbit, held, direction, self.tests(orbit))

    @property
    def watched(self) -> tuple[str, ...]:
        """The test functions that are looked at along the path."""
        if self.critical is not None:
            return _WATCHED[self.critical]
        return SMOOTH if self.born is None else (*SMOOTH, DEGENERATE)

    def tests(self, orbit: Orbit) -> dict[str, float]:
        """The test functions at an orbit of the path."""
        found = evaluate_test_functions(orbit)
        others = (name for name in self.watched if name not in found)
        return found | {name: self._test(name, orbit) for name in others}

    def _test(self, name: str, orbit: Orbit) -> float:
        if name == DEGENERATE and self.born is not None:
            return degeneracy(self.numbers, orbit, self.born)
        if name == GENERALIZED_DOUBLING:
            there = cubic(self.numbers, orbit)
            return there.term / there.closing
        return evaluate_test_functions(orbit)[name]

    def _condition(self, name: str, like: Vector) -> Condition:
        def value(orbit: Orbit) -> Vanishing:
            if name in _EXACT:
                found, gradient = self._test(name, orbit), self._gradient(orbit, name)
                return Vanishing(found, noise(orbit), gradient)
            if name == CUSP:
                return Vanishing(quadratic(self.numbers, orbit, like).term, noise(orbit))
            return Vanishing(self._test(name, orbit), noise(orbit))

        return value

    def solved(
        self, orbit: Orbit, names: tuple[str, ...], segments: tuple[int, ...] = ()
    ) -> BorderCollision | None:
        """The orbit near a guess at which test functions vanish and segments have the duration 0.

        All as one system of equations; None where Newton's method finds none.
        """
        free = tuple(axis.path for axis in self.axes)
        like = np.linalg.svd(orbit.shot.by_z)[2][-1]
        conditions = [self._condition(name, like) for name in names]
        try:
            return solve_event(
                self.numbers, orbit.values, free, orbit.itinerary, orbit.z, segments, conditions
            )
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None

    def tightest(self, state: State) -> Inequality:
        """The inequality with the least value. Raises Stop where it fails."""
        least = min(state.held, key=lambda one: float(one.value))
        if least.value <= 0:
            detail = (
                f"{least.named(state.orbit.itinerary)} fails at {where(state.orbit, self.axes)}"
            )
            raise Stop(Ending.NO_ADMISSIBLE_ORBIT, detail)
        return least

    def advance(self, state: State, length: float, largest: float) -> Step:
        """A step of this length or a shorter one; no q changes by more than about `largest`.

        Raises Stop where even the shortest step is too long.
        """
        fastest = np.max(abs(state.tangent[-len(self.axes) :]))
        length = min(length, _LONGEST, largest / max(fastest, 1e-9))
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
        event = self._first(state, new, failing)
        self.unlocated = []
        if failing and (event is None or self._hides(state, new, event)):
            self.unlocated = [one.named(self.itinerary) for one in failing]
            return None
        smooth = self._smooth(state, new, event.share if event else 1.0)
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
        for name in _EXACT:
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
        return float(self._row(state.orbit, name) @ state.tangent)

    def _outside(self, u: Vector) -> tuple[int, float] | None:
        """Index and border of the first q that has left [0, 1]."""
        for k in range(len(u) - len(self.axes), len(u)):
            if not 0 <= u[k] <= 1:
                return k, float(u[k] > 1)
        return None

    def _at_border(self, state: State, beyond: Solution, k: int, edge: float) -> Solution | None:
        share = (edge - state.u[k]) / (beyond.u[k] - state.u[k])
        guess = state.u + share * (beyond.u - state.u)
        guess[k] = edge
        normal = np.zeros(len(guess))
        normal[k] = 1.0
        return corrected(self.equations, guess, normal)

    def _smooth(self, old: State, new: State, until: float) -> list[tuple[str, SmoothEvent]]:
        """The smooth bifurcations between two states of one itinerary, up to a share, in order."""
        change = new.u - old.u
        normal = change / np.linalg.norm(change)

        def between(share: float) -> Orbit | None:
            solution = corrected(self.equations, old.u + share * change, normal)
            return solution.at.made if solution else None

        names = [name for name in self.watched if old.tests[name] * new.tests[name] < 0]
        # The parameters turn back along a curve of folds.
        turns = self.critical == FOLD and float(old.tangent[-2:] @ new.tangent[-2:]) < 0
        found = []
        for name in (*names, *((CUSP,) if turns else ())):
            one = self._meeting(name, old, new, between)
            if one is None and name in SMOOTH:
                one = zero_of_test_function(name, between)
            if one is not None and one.share <= until:
                found.append((name, one))
        return sorted(found, key=lambda pair: pair[1].share)

    def _meeting(
        self, name: str, old: State, new: State, between: Callable[[float], Orbit | None]
    ) -> SmoothEvent | None:
        """Where a test function vanishes between two states of a curve, by its extended system.

        None where that has no solution between: what changes its sign at a pole has no zero.
        """
        if name == CUSP:
            first, last = (float(np.linalg.norm(state.tangent[-2:])) for state in (old, new))
        else:
            first, last = abs(old.tests[name]), abs(new.tests[name])
        guess = between(first / (first + last))
        conditions = tuple(one for one in (self.critical, name) if one is not None)
        born = () if self.born is None else (self.born,)
        found = self.solved(guess, conditions, born) if guess is not None else None
        if found is None:
            return None
        step = new.u - old.u
        share = float(step @ (self.unknowns(found.z, found.values) - old.u) / (step @ step))
        if not 0 <= share <= 1:
            return None
        orbit, errors = found.orbit(self.numbers.name), found.uncertainties
        residual, steps = float(found.residual), found.iterations
        if name == NEIMARK_SACKER and not rotations(orbit):
            return None
        return SmoothEvent(share, orbit, 0.0, residual, steps, orbit.status, errors)

    def _first(self, old: State, new: State, failing: list[Inequality]) -> Event | None:
        """The first event between two states; None if nothing fails or it is not located."""
        shares = [_failing_share(old.held, failed) for failed in failing]
        found = [self._locate(old, new, *one) for one in zip(failing, shares, strict=True)]
        events = [one for one in found if one is not None]
        if not events:
            return None
        nearest = min(one.share for one in events)
        for share, one in zip(shares, found, strict=True):
            if one is None and share < nearest - _DOUBT:
                return None
        together = [one for one in events if one.share - nearest < _TOGETHER]
        # A segment that shrinks to nothing may take other inequalities with it: it is the event.
        return min(together, key=lambda one: one.failed.kind != DURATION)

    def _hides(self, old: State, new: State, event: Event) -> bool:
        """Whether another inequality fails before the event, which beyond it is not asked for."""
        if event.failed.kind == MINIMUM:
            return False
        change = new.u - old.u
        u = old.u + max(event.share - _BEFORE, event.share / 2) * change
        solution = corrected(self.equations, u, change / np.linalg.norm(change))
        if solution is None:
            return True
        orbit = solution.at.made
        held = inequalities(self.numbers, orbit.itinerary, orbit.shot, self.born)
        return any(one.value <= 0 for one in held)

    def _locate(self, old: State, new: State, failed: Inequality, share: float) -> Event | None:
        orbit, there = self.orbit(old.u + share * (new.u - old.u)), new.orbit
        if failed.guard is Guard.GAP:
            # The second spring is on one side only: its touch has no mirror image.
            orbit, there = whole_orbit(orbit), whole_orbit(there)
        itinerary = orbit.itinerary
        if failed.kind == DURATION:
            change, segment = (
                Change(itinerary, orbit.z, tuple(range(len(itinerary)))),
                failed.segment,
            )
        else:
            try:
                change, segment = inserted(self.numbers, itinerary, orbit.z, there.shot, failed)
            except InvalidInput:
                return None
        segments: tuple[int, ...] = (segment,)
        if self.born is not None:
            before = change.kept[self.born]
            if before is None:
                return None
            segments = (before, segment)
        like = replace(orbit, itinerary=change.itinerary, z=change.z)
        names = () if self.critical is None else (self.critical,)
        located = self.solved(like, names, segments)
        if located is None:
            return None
        here = self._collapsed(old, failed, located)
        step = new.u - old.u
        if here is None:
            q = self.unknowns(old.orbit.z, located.values)[-1]
            along = float((q - old.u[-1]) / step[-1])
        else:
            along = float(step @ (here - old.u) / (step @ step))
        if not -1e-6 <= along <= 1 + 1e-6:
            return None
        return Event(failed, segment, change, located, along)

    def _collapsed(self, old: State, failed: Inequality, located: BorderCollision) -> Vector | None:
        """The unknowns, in the present itinerary, of an event in that with another segment."""
        z, segment = located.z, 4 + failed.segment
        if failed.kind == LANDING:
            z = np.delete(z, segment + 1)
        elif failed.kind == MINIMUM:
            if self.itinerary.segments[0].guard is None:
                return None
            z = np.array(
                [*z[:segment], z[segment] + z[segment + 1] + z[segment + 2], *z[segment + 3 :]]
            )
        return self.unknowns(z[: 4 + len(self.itinerary)], located.values)

    def cross(self, event: Event) -> State | None:
        """Go on in the itinerary beyond an event: a state a little further; None if there is none.

        Raises Stop where the itineraries on the two sides do not share the condition.
        """
        located, failed = event.located, event.failed
        z, segment = located.z, event.segment
        if (
            self.itinerary.mirrored
            and not located.itinerary.mirrored
            and (self.born is not None or self.critical)
        ):
            raise Stop(Ending.CODIMENSION_TWO, "beyond, the orbit is not its own mirror image")
        self._keep(event.change)
        self.itinerary = located.itinerary
        if failed.kind == DURATION:
            other = exchanged(self.itinerary, z, segment)
            if other is None:
                change, inequality = shortened(
                    self.numbers, self.itinerary, z, located.shot, segment
                )
                self._keep(change)
                self.itinerary = change.itinerary
                u = self.unknowns(change.z, located.values)
                both = [self.beside(u, side) for side in self.directions(u)]
                return max(both, key=lambda one: _margin(one, inequality))
            self.itinerary = other.itinerary
        u = self.unknowns(z, located.values)
        index = 4 + segment - (self.born is not None and self.born < segment)
        along = np.zeros(len(u))
        along[index] = 1.0
        return self.beside(u, along)

    def symmetric(self, state: State) -> State:
        """The state by the first half of its orbit, where that is its own mirror image."""
        if self.itinerary.mirrored or self.critical is not None:
            return state
        if self.born is None:
            half = first_half(state.orbit, self.axes)
        else:
            half, self.born = halved_at(state.orbit, self.born) or (None, self.born)
        if half is None:
            return state
        self.itinerary, count = half.itinerary, len(self.axes)
        u = self.unknowns(half.z, half.values)
        along = np.array([*np.zeros(len(u) - count), *state.tangent[-count:]])
        return self.state(u, along)

    def _keep(self, change: Change) -> None:
        if self.born is None:
            return
        self.born = change.kept[self.born]
        if self.born is None:
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

    def beside(self, u: Vector, along: Vector) -> State | None:
        """The state a little further on from u, in the direction that `along` points to."""
        try:
            direction = tangent(self.equations(u).by, along)
        except np.linalg.LinAlgError:
            return None
        solution = corrected(self.equations, u + BESIDE * direction, direction)
        return self.state(solution.u, direction, solution) if solution else None


def _failing_share(held: list[Inequality], failed: Inequality) -> float:
    """The share of a step after which an inequality fails, by its values at both ends."""
    before = _matching(held, failed)
    if before is None or before.value <= 0:
        return 1.0
    return float(before.value / (before.value - failed.value))


def _margin(state: State | None, inequality: Inequality) -> float:
    if state is None:
        return -float("inf")
    matching = _matching(state.held, inequality)
    return float(matching.value) if matching else float("inf")


def _matching(held: list[Inequality], wanted: Inequality) -> Inequality | None:
    """The inequality of the same kind, segment and guard, of several minima the nearest in time."""
    same = [
        i
        for i in held
        if (i.kind, i.segment, i.guard) == (wanted.kind, wanted.segment, wanted.guard)
    ]
    return min(same, key=lambda i: abs(float(i.time - wanted.time)), default=None)
