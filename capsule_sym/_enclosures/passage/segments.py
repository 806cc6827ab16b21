"""Propagation of states through given segments, with each switch proved to be the first event.

A bundle is the set of G (1, e_1, e_2, ...) with every e in [-1, 1]. Rows are the extended state and
the time since the start. From segment to segment a bundle is carried at one time for all motions:
at the switch of the middle, in the next field, as if this field had begun or the last one ended
then. Only the difference of both fields acts on the time between; at a switch at which they agree,
it acts in second order. Guards are proved on the segments themselves, between the switches of each
motion. After each step the bundle is one ball, with as many digits as a single motion needs;
subclasses represent wider sets in other ways.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest
from typing import NamedTuple, TypeAlias

from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    bits,
    precision,
    upper,
)
from capsule_sym._enclosures.numbers.fields import ONE, C, Field, U, V, W, X
from capsule_sym._enclosures.passage.exchanges import (
    ROWS,
    TIME,
    MovedSwitch,
    around,
    chosen,
    exchanged,
    extended,
    hull,
    rested,
    shifted,
)
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym._enclosures.passage.switches import Known, after, guard_row, pin
from capsule_sym._map.expansion import Guard
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.itinerary import guard_between
from capsule_sym.generated.capsule.facts import FIELDS

Duration: TypeAlias = "Ball | list[Ball]"
"""Time of a passage, or its parts by the columns of a bundle."""

_REFINEMENTS = 12
_FIRST_BITS = 128  # of the first step of Newton's method; each further one has twice as many
_NOTHING = Known()


@dataclass(frozen=True)
class Leg:
    """Guess of a segment: its field, duration, and the guard that ends it (None: time does)."""

    field: int
    duration: float
    guard: Guard | None


class Passed(NamedTuple):
    """A segment after its proof.

    Its field, its duration, the states at its end, each at the time of its own switch, and how
    these are left: the switch, the guard and the next field, or None at the end of the passage.
    """

    field: Field
    h: Ball
    ended: Matrix
    switch: MovedSwitch
    guard: Guard | None
    following: Field | None

    def left(self) -> Matrix:
        """The states at one time, from which the next field leads to each at its own switch."""
        assert self.following is not None
        assert self.guard is not None
        return exchanged(self.field, self.following, self.guard, *self.switch[1:])


class Passage:
    """Passages through the six fields of the paper's scene, at parameters that are narrow balls."""

    rows = ROWS

    def __init__(self, values: Mapping[str, Ball]) -> None:
        self.values = values
        self._fields: Mapping[int, Field] = {index: Field(index, values) for index in FIELDS}
        self._watch = Signs()

    def start(self, states: Matrix, angle: Ball) -> Matrix:
        """States (3, n) at a forcing angle common to all, at time 0."""
        sine, cosine = angle.sin_cos()
        found = arb_mat([*states.tolist()[:3], *[[0] * states.ncols()] * (self.rows - 3)])
        for column, amplitude in enumerate(self._amplitudes()):
            found[U, column], found[W, column] = amplitude * cosine, amplitude * sine
        found[ONE, 0] = arb(1)
        return found

    def segments(
        self, start: Matrix, steps: Sequence[Leg], total: Duration, known: Known = _NOTHING
    ) -> Iterator[Passed]:
        """Each segment after its proof, up to a time `total`, at which the last one ends.

        `known` are exact facts at the start. Raises Unproved if it is not proved that all states
        take these steps.
        """
        here, begun, late = start, start, arb(0)
        form = self.form(extended(start))
        if [step.guard is None for step in steps] != [False] * (len(steps) - 1) + [True]:
            raise Unproved("first switch", "it is not the last segment alone that has no guard")
        if any(guard_between(a.field, b.field) is not a.guard for a, b in pairwise(steps)):
            raise Unproved("first switch", "a guard does not lead to the next field")
        for number, (step, then) in enumerate(zip_longest(steps, steps[1:]), 1):
            check_time()
            field = self._fields[step.field]
            name = f"segment {number}, F{step.field}"
            if field.stick and not all(begun[C, j].is_zero() for j in range(begun.ncols())):
                raise Unproved("first switch", f"{name} does not begin at rest")
            if step.guard is None:
                switch, facts = self._until(field, here, total), Known()
            else:
                switch, facts = self._switch(field, here, step, name), after(step.guard)
            ended = shifted(field, *switch[1:])
            if step.guard is not None:
                _pin(field, step.guard, ended)
            if field.stick:
                rested(ended)
            reached, h = self.form(extended(ended)), switch.h + switch.d - late
            orders = known.orders(step.field), facts.orders(step.field)
            self._watch.segment(field, form, reached, h, orders, name)
            following = None if then is None else self._fields[then.field]
            passed = Passed(field, h, ended, switch, step.guard, following)
            yield passed
            if following is None:
                return
            here, begun, form, late = self._carried(passed, reached)
            known = facts

    # A subclass for wider sets overrides these methods.

    def form(self, states: Matrix) -> Matrix:
        """States as middle, directions and rest, for the proof of guards."""
        return hull(states)

    def _amplitudes(self) -> Sequence[Ball]:
        """Alpha, by the columns of a bundle."""
        return (self.values["alpha"],)

    def _carried(self, passed: Passed, reached: Matrix) -> tuple[Matrix, Matrix, Matrix, Ball]:
        """Bundle from which the next segment is computed, and that in which it begins.

        With them the latter's form, and the time from the former to it.
        """
        return hull(passed.left()), passed.ended, reached, passed.switch.d

    def _moved(self, field: Field, h: Ball, bundle: Matrix) -> Matrix:
        """A bundle an exact time later: the flow of the extended state and of the time."""
        rows = [[*row, 0] for row in field.flow(h).tolist()]
        return arb_mat([*rows, [*[0] * ONE, h, 1]]) * bundle

    def _near(self, field: Field) -> tuple[Field, float]:
        """Field and number of bits by which a switching time is refined, half in the last step."""
        return field, float(bits())

    def _until(self, field: Field, bundle: Matrix, total: Duration) -> MovedSwitch:
        """End of a segment at a time since the start, as a switch."""
        parts = total if isinstance(total, list) else [total]
        middle = arb((parts[0] - bundle[TIME, 0]).mid())
        moved = self._moved(field, middle, bundle)
        late = arb_mat([[-x for x in moved.tolist()[TIME]]])
        for k, part in enumerate(parts):
            late[0, k] += part
        return MovedSwitch(middle, moved, late, arb(0), hull(late)[0, 0])

    def _switch(self, field: Field, bundle: Matrix, step: Leg, name: str) -> MovedSwitch:
        """Switch at the zero of a segment's guard; raises Unproved if it is not enclosed."""
        assert step.guard is not None
        row = guard_row(field, step.guard)
        rate = row * field.A
        h, start = arb(step.duration), extended(bundle) * chosen(bundle.ncols())
        near_by, digits = self._near(field)
        near = max(2.0 ** (-digits / 2), 1e-300)
        start, most = start.mid(), bits()
        for step_number in range(_REFINEMENTS):
            used = min(most, _FIRST_BITS << step_number)
            with precision(used):
                there = near_by.flow(h) * start
                move = (row * there)[0, 0] / (rate * there)[0, 0]
                if not upper(move) < 1:
                    raise Unproved("first switch", f"{name} has no switch near the guess")
                h = arb((h - move).mid())
            if used == most and upper(move) < near:
                break
        moved = self._moved(field, h, bundle)
        states = extended(moved)
        off, whole = row * states, hull(states)
        slope, reach = (rate * whole)[0, 0], 0.0
        for _ in range(_REFINEMENTS):
            if not slope < 0:
                break
            # The mean value theorem; as the guard decreases on all of the reach, it has one zero
            # there.
            d = -hull(off)[0, 0] / slope
            if upper(d) < reach:
                chord = arb((rate * states)[0, 0].mid())
                return MovedSwitch(h, moved, off / -chord, (1 - slope / chord) * d, d)
            reach = 1.25 * upper(d) + 1e-300
            slope = (rate * (around(field, reach) * whole))[0, 0]
        raise Unproved("first switch", f"the switch of {name} is not enclosed")


def _pin(field: Field, guard: Guard, ended: Matrix) -> None:
    """Put in the exact facts at a switch; v_c = 0 for all but the gap of a drift."""
    slope, constant = (0, 0) if guard is Guard.DRIFT else pin(field, guard)
    for j in range(ended.ncols()):
        if guard is not Guard.DRIFT:
            ended[X, j] = slope * ended[V, j] + (0 if j else constant)
        if guard is not Guard.GAP:
            ended[C, j] = arb(0)
