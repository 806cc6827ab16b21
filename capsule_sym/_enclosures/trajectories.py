"""A motion from a start in balls: every switch enclosed, every guard positive between switches.

The switches are taken from a run in double precision as guesses; that they are the first ones, and
all of them, is proved segment by segment. A start may be a box of states: then all of them switch
in the same order, and the derivative of the end by the start is enclosed too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capsule_sym._enclosures.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    ball,
    floats,
    largest,
    matrix,
    precision,
    spread,
    symmetric,
    thin,
    upper,
)
from capsule_sym._enclosures.equations import GUARD_ROWS
from capsule_sym._enclosures.fields import ONE, SIZE, C, Field, U, V, W, X
from capsule_sym._enclosures.guards import Known, Watch
from capsule_sym._map.expansion import Guard
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.itinerary import guard_between

_REFINEMENTS = 12
_BITS, _BITS_A_SEGMENT = 128, 4  # roundings grow from segment to segment


@dataclass(frozen=True)
class Step:
    """A segment as guessed: its field, duration, and the guard that ends it (None: time does)."""

    field: int
    duration: float
    guard: Guard | None


@dataclass(frozen=True)
class Passage:
    """Where a motion is after its steps: state (3, 1), derivative by the start, and switches.

    `times` encloses the instants of the switches, from the start, `states` (3, 1) the start and
    the states there.
    """

    state: Matrix
    by: Matrix
    times: tuple[Ball, ...]
    states: tuple[Matrix, ...]


class System:
    """The six fields at one set of parameters."""

    def __init__(self, values: Mapping[str, Ball]) -> None:
        self.values = dict(values)
        self._fields = {index: Field(index, values) for index in range(1, 7)}
        self._watch = Watch()

    def field(self, index: int) -> Field:
        """A field."""
        return self._fields[index]

    def passage(
        self, state: Matrix, steps: Sequence[Step], total: Ball, angle: Ball | int = 0
    ) -> Passage:
        """The motion from states (3, 1) at a forcing angle through given segments, over a time.

        The last segment has no guard and ends when the time is over. Raises Unproved where a
        segment is not proved to be what comes next.
        """
        known, elapsed = Known(), arb(0)
        by = matrix(3, 3, ((i, i, 1) for i in range(3)))
        here = state
        times: list[Ball] = []
        states = [state]
        for number, step in enumerate(steps, 1):
            check_time()
            field = self._fields[step.field]
            if field.stick and not here[C, 0].is_zero():
                raise Unproved(
                    "first switch", f"segment {number}, F{step.field}, does not begin at rest"
                )
            start = self._extended(here, ball(angle) + self.values["omega"] * elapsed)
            name = f"segment {number}, F{step.field}"
            if step.guard is None:
                h = total - elapsed
                if not h > 0:
                    raise Unproved("first switch", f"the time is over before {name}")
                end = field.flow(h) * start
                orders = known.orders(step.field), (0,) * field.guards.nrows()
                self._watch.segment(field, _form(start), _form(end), h, orders, name)
                by = three(field.flow(h)) * by
                if field.stick:
                    end[C, 0] = arb(0)
                return Passage(_head(end), by, tuple(times), tuple(states))
            h = self._switch(field, start, step, name)
            end = field.flow(h) * start
            pin(field, step.guard, end)
            passed = after(step.guard)
            orders = known.orders(step.field), passed.orders(step.field)
            self._watch.segment(field, _form(start), _form(end), h, orders, name)
            following = self._fields[steps[number].field]
            by = saltation(field, following, step.guard, end) * three(field.flow(h)) * by
            elapsed += h
            times.append(elapsed)
            here, known = _head(end), passed
            states.append(here)
        raise Unproved("first switch", "the last segment has a guard")

    def _extended(self, state: Matrix, angle: Ball) -> Matrix:
        sine, cosine = angle.sin_cos()
        alpha = self.values["alpha"]
        found = matrix(SIZE, 1, ((i, 0, state[i, 0]) for i in range(3)))
        found[U, 0], found[W, 0], found[ONE, 0] = alpha * cosine, alpha * sine, arb(1)
        return found

    def _switch(self, field: Field, start: Matrix, step: Step, name: str) -> Ball:
        """The duration at which a guard vanishes, by Newton's method with all of a box's states."""
        assert step.guard is not None
        row = matrix(1, SIZE)
        for k in range(SIZE):
            row[0, k] = field.guards[GUARD_ROWS[step.guard], k]
        middle = matrix(SIZE, 1, ((i, 0, arb(start[i, 0].mid())) for i in range(SIZE)))
        h = arb(step.duration)
        for _ in range(_REFINEMENTS):
            moved = field.flow(h) * middle
            move = (row * moved)[0, 0] / (row * (field.A * moved))[0, 0]
            if not upper(move) < 1:
                raise Unproved("first switch", f"{name} has no switch near the guess")
            h = arb((h - move).mid())
            if upper(move) < 1e-6 and upper(move) ** 2 < max(1e-30 * spread(move), 1e-300):
                break
            if upper(move) <= 2 * spread(move):
                break
        off = (row * (field.flow(h) * start))[0, 0]
        slope = (row * (field.A * (field.flow(h) * start)))[0, 0]
        if not slope < 0:
            raise Unproved("first switch", f"the guard of {name} is not seen to fall")
        radius = 1.25 * upper(off / slope) + 1e-300
        for _ in range(_REFINEMENTS):
            around = h + symmetric(radius)
            slope = (row * (field.A * (field.flow(around) * start)))[0, 0]
            shift = off / slope
            if slope < 0 and upper(shift) < radius:
                return h - shift
            radius *= 2
        raise Unproved("first switch", f"the switch of {name} is not enclosed")


def pin(field: Field, guard: Guard, end: Matrix) -> None:
    """Put in what is exact at a switch; v_c = 0 for all but the gap of a drift.

    Columns of `end` are a state, and directions from it.
    """
    g_x, g_v, g_1 = (field.guards[GUARD_ROWS[guard], k] for k in (X, V, ONE))
    for j in range(end.ncols()):
        if guard is not Guard.DRIFT:
            end[X, j] = -(g_v * end[V, j] + (0 if j else g_1)) / g_x
        if guard is not Guard.GAP or field.stick:
            end[C, j] = arb(0)


def saltation(field: Field, following: Field, guard: Guard, end: Matrix) -> Matrix:
    """How the derivative by the start, at a fixed time, changes at a switch (saltation matrix)."""
    jump = matrix(3, 3, ((i, i, 1) for i in range(3)))
    if guard is Guard.DRIFT:  # the fields agree where the gap closes and where stick ends
        before, later = field.A * end, following.A * end
        lost = arb(1) if following.stick else 1 - later[C, 0] / before[C, 0]
        # The inner mass does not feel friction: v_r gains what v_c loses.
        jump[V, C], jump[C, C] = lost, 1 - lost
    return jump


def after(guard: Guard) -> Known:
    """What is exact just after a switch."""
    if guard is Guard.GAP:
        return Known(gap=1)
    return Known(rest=True, side={Guard.UPPER: 1, Guard.LOWER: -1}.get(guard, 0))


def _head(state: Matrix) -> Matrix:
    return matrix(3, 1, ((i, 0, state[i, 0]) for i in range(3)))


def three(flow: Matrix) -> Matrix:
    """The part of a flow by which the state depends on its start."""
    return matrix(3, 3, ((i, j, flow[i, j]) for i in range(3) for j in range(3)))


def _form(state: Matrix) -> Matrix:
    """A column of balls as middle and rest."""
    found = matrix(SIZE, 2)
    for i in range(SIZE):
        found[i, 0] = arb(state[i, 0].mid())
        found[i, 1] = symmetric(state[i, 0].rad())
    return found


def exactly(value: float) -> str:
    """The decimal that a double prints as, without an exponent."""
    return format(Decimal(repr(float(value))), "f")


def enclose_run(trajectory: Trajectory, exact: Mapping[str, str] | None = None) -> Passage:
    """A run in double precision enclosed: its segments are those of the motion, its end in a box.

    The start and the parameters are the decimals that the run's doubles print as, or those in
    `exact` by name. Raises Unproved with the segment that is not.
    """
    segments = trajectory.segments
    if not segments or not trajectory.success:
        raise Unproved(
            "first switch", "the run has no segment" if trajectory.success else trajectory.message
        )
    with precision(_BITS + _BITS_A_SEGMENT * len(segments)):
        values = {
            name: ball((exact or {}).get(name, exactly(value)))
            for name, value in trajectory.parameters.to_dict().items()
        }
        period = 2 * arb.pi() / values["omega"]
        begin, end = trajectory.origin[0], segments[-1].end
        phases = [ball(exactly(one.phase)) for one in (begin, end)]
        total = (end.period - begin.period) * period + phases[1] - phases[0]
        start = map(exactly, trajectory.origin[1])
        state = matrix(3, 1, ((i, 0, ball(x)) for i, x in enumerate(start)))
        steps = [
            Step(one.field, float(one.duration), guard_between(one.field, after.field))
            for one, after in pairwise(segments)
        ]
        steps.append(Step(segments[-1].field, float(segments[-1].duration), None))
        return System(values).passage(state, steps, total, values["omega"] * phases[0])


@dataclass(frozen=True)
class Attraction:
    """A box that one turn carries into itself and contracts, entered by a motion.

    `middle` (3, 1), `sides` (3, 3) and `radius` are the box; every turn shrinks the distance to the
    periodic motion in it at least by `factor`.
    """

    middle: Matrix
    sides: Matrix
    radius: float
    factor: float


def contraction(
    system: System, state: Matrix, steps: Sequence[Step], period: Ball, radius: float
) -> Attraction:
    """A box about a state that holds it and that the map of `steps` contracts; raises Unproved."""
    if steps[0].field != steps[-1].field:
        raise Unproved("attraction", "the turn begins at a switch")
    size = 2 if system.field(steps[0].field).stick else 3
    middle = matrix(3, 1, ((i, 0, arb(state[i, 0].mid())) for i in range(3)))
    there = system.passage(middle, steps, period)
    sides = sides_of(there.by, size)
    inverse = inverse_of(sides)
    wide = matrix(3, 1, ((i, 0, middle[i, 0]) for i in range(3)))
    for i in range(size):
        wide[i, 0] += symmetric(float(np.sum(abs(sides[i]))) * radius * (1 + 1e-12))
    passed = system.passage(wide, steps, period)
    turned = inverse * corner(passed.by, size) * thin(sides)
    factor = largest(turned)

    def share(found: Matrix) -> float:
        offset = matrix(size, 1, ((i, 0, found[i, 0] - middle[i, 0]) for i in range(size)))
        along = inverse * offset
        return largest(along) / radius * (1 + 1e-12)

    if not (share(there.state) + factor * (1 + 1e-12) < 1 and share(state) < 1):
        detail = f"{share(there.state):.2g} + {factor:.2g} of a box of {radius}"
        raise Unproved("attraction", f"{detail} is not within it")
    return Attraction(middle, thin(sides), radius, factor)


def sides_of(by: Matrix, size: int) -> NDArray[np.float64]:
    """Sides of a box, as columns: about the directions in which a turn stretches or shrinks."""
    values, vectors = np.linalg.eig(floats(by)[:size, :size])
    return np.where(values.imag >= 0, vectors.real, vectors.imag)


def inverse_of(sides: NDArray[np.float64]) -> Matrix:
    """What takes a state to its place along sides; raises Unproved where they span no box."""
    try:
        return thin(sides).inv()
    except ZeroDivisionError:
        raise Unproved("attraction", "the sides of the box are not seen to span it") from None


def corner(found: Matrix, size: int) -> Matrix:
    """The first rows and columns."""
    return matrix(size, size, ((i, j, found[i, j]) for i in range(size) for j in range(size)))
