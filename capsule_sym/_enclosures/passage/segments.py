"""Propagation of states through given segments, with each switch proved to be the first event.

A bundle is the set of G (1, s, e_1, e_2, ...): s in [-1, 1] is the place of alpha in its interval,
and every e is in [-1, 1]. Rows are the extended state and the time since the last section. So the
common part of the states of one alpha stays common, where a box would lose it. From segment to
segment a bundle is carried at one time for all motions: at the switch of the middle, in the next
field, as if this field had begun or the last one ended then. Only the difference of both fields
acts on the time between; at a switch at which they agree, it acts in second order. Guards are
proved on the segments themselves, between the switches of each motion.

The step from switch to switch is the same for all numbers; the representation of a bundle between
two steps is the number's: in `DOUBLES` rounding errors are another column, in `BALLS` the bundle is
one ball, with as many digits as a single motion needs. With an interval of omega a bundle is
carried at the switch of each motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from itertools import pairwise, zip_longest
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from flint import arb_mat
from numpy.typing import NDArray

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    bits,
    floats,
    precision,
    symmetric,
    thin,
    unit,
    upper,
)
from capsule_sym._enclosures.numbers.fields import (
    ONE,
    SIZE,
    C,
    Field,
    U,
    V,
    W,
    X,
    generated,
)
from capsule_sym._enclosures.passage.exchanges import (
    ROWS,
    TIME,
    Switch,
    around,
    chosen,
    crossing,
    exchanged,
    extended,
    hull,
    ranges,
    rested,
    shifted,
)
from capsule_sym._enclosures.passage.frequencies import Driven
from capsule_sym._enclosures.passage.guards import Line
from capsule_sym._enclosures.passage.margins import QuickWatch
from capsule_sym._enclosures.passage.switches import (
    Known,
    after,
    guard_row,
    pin,
    saltation,
    three,
)
from capsule_sym._map.expansion import Guard
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.itinerary import guard_between
from capsule_sym.generated.capsule.facts import FIELDS

Bundle = NDArray[np.float64]
"""Shape (7, n): the middle, the direction of alpha, and the other directions."""
Duration: TypeAlias = "Ball | list[Ball]"
"""Time of a passage, or its middle and its change with alpha and omega."""

_MOST, _KEPT = 48, 28  # columns beyond which the shortest are put into a box, and how many stay
_REFINEMENTS = 12
_FIRST_BITS = 128  # of the first step of Newton's method; each further one has twice as many
_UP = 1 + 1e-12
_NOTHING = Known()
_FIXED: Sequence[str] = generated.PARAMETERS
_kept: dict[Any, tuple[Mapping[int, Field], QuickWatch]] = {}


@dataclass(frozen=True)
class Step:
    """Guess of a segment: its field, duration, and the guard that ends it (None: time does)."""

    field: int
    duration: float
    guard: Guard | None


@dataclass(frozen=True)
class Interval:
    """Values of alpha: all within `radius` of `middle`, an exact number or a ball."""

    middle: Any
    radius: float = 0.0

    @classmethod
    def about(cls, decimal: object) -> Interval:
        """Interval of doubles that contains a decimal: a double is off by half of the radius."""
        middle = float(Fraction(str(decimal)))
        return cls(middle, 2.0**-52 * middle)

    @property
    def hull(self) -> Ball:
        """Ball that contains all values."""
        return arb(self.middle) + symmetric(self.radius)


class Number(NamedTuple):
    """Representation of a bundle from switch to switch.

    `carried` maps a bundle of balls to one that contains it, and to its middle, direction of alpha
    and rest; `bits` are those to which Newton's method refines a switching time, half of them in
    its last step.
    """

    carried: Callable[[Matrix], tuple[Matrix, Matrix]]
    bits: Callable[[], float]


class Passage:
    """The six fields at parameters that are narrow balls, for an interval of alpha.

    With an interval of omega a bundle's third column is the direction of omega, and its last row
    the displacement of the capsule since the section.
    """

    def __init__(
        self,
        values: Mapping[str, Ball],
        alphas: Interval,
        number: Number | None = None,
        omegas: Interval | None = None,
    ) -> None:
        self.values, self.alphas, self.omegas = {**values, "alpha": alphas.hull}, alphas, omegas
        self.number = number or DOUBLES
        self.directions, self.rows = 2, ROWS
        if omegas is None:
            self._fields, self._watch = _fields(self.values)
        else:
            self.number, self.directions, self.rows = FREQUENCIES, 3, ROWS + 1
            self.values["omega"], near = omegas.hull, (arb(omegas.middle), arb(omegas.radius))
            self._fields = {index: Driven(index, self.values, *near) for index in FIELDS}
            self._watch = QuickWatch()

    def turn(self, share: Ball) -> Duration:
        """A share of the excitation's period, by the columns of a bundle."""
        around = 2 * arb.pi() * share
        if self.omegas is None:
            return around / self.values["omega"]
        middle, radius = arb(self.omegas.middle), arb(self.omegas.radius)
        # 1/(m + r) = 1/m - r/m^2 + r^2/(m^2 (m + r)).
        rest = around * radius**2 / (middle**2 * (middle - radius))
        first = around / middle + symmetric(rest.abs_upper())
        return [first, arb(0), -around * radius / middle**2]

    def field(self, index: int) -> Field:
        """One of the six fields."""
        return self._fields[index]

    def line(self, field: Field) -> Line:
        """The guards of a field along time."""
        return self._watch.line(field, 1)

    def start(self, states: Matrix, angle: Ball) -> Matrix:
        """States (3, n) at a forcing angle common to all, at time 0."""
        sine, cosine = angle.sin_cos()
        found = arb_mat([*states.tolist()[:3], *[[0] * states.ncols()] * (self.rows - 3)])
        for column, amplitude in enumerate((arb(self.alphas.middle), arb(self.alphas.radius))):
            found[U, column], found[W, column] = amplitude * cosine, amplitude * sine
        found[ONE, 0] = arb(1)
        return found

    def section(self, states: Matrix, angle: Ball) -> Bundle:
        """A bundle of states (3, n) at a forcing angle, in doubles."""
        return rounded(self.start(states, angle), self.directions)

    def moved(self, bundle: Bundle, steps: Sequence[Step], total: Duration, angle: Ball) -> Bundle:
        """A bundle at the next section, a time `total` later.

        The steps lead there from the bundle's section; the last has no guard. `angle` is the
        forcing angle at the end. Raises Unproved unless all states take exactly these steps.
        """
        *_, last = self.segments(thin(bundle), steps, total)
        return self.section(last.ended, angle)

    def period(
        self, bundle: Bundle, steps: Sequence[Step], total: Duration, angle: Ball
    ) -> tuple[Bundle, Matrix]:
        """A bundle at the next section, as `moved` gives it, and the derivative by the state."""
        ended, by = self.carried(thin(bundle), steps, total)
        return self.section(ended, angle), by

    def carried(
        self, start: Matrix, steps: Sequence[Step], total: Duration
    ) -> tuple[Matrix, Matrix]:
        """A bundle after its steps, and the derivative (3, 3) by the state, over all of it."""
        by, ended = unit(3), start
        for one in self.segments(start, steps, total, derive=True):
            by, ended = one.by * by, one.ended
        return ended, by

    def segments(
        self,
        start: Matrix,
        steps: Sequence[Step],
        total: Duration,
        known: Known = _NOTHING,
        derive: bool = False,
    ) -> Iterator[Passed]:
        """Each segment after its proof, with its derivative only where `derive` is true.

        `known` are exact facts at the start.
        """
        here, begun, late = start, start, arb(0)
        form = _form(extended(start), self.directions)
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
                switch, facts = _until(field, here, total), Known()
            else:
                switch = _switch(field, here, step, self.number.bits(), name)
                facts = after(step.guard)
            ended = shifted(field, *switch[1:])
            if step.guard is not None:
                _pin(field, step.guard, ended)
            if field.stick:
                rested(ended)
            reached, h = _form(extended(ended), self.directions), switch.h + switch.d - late
            orders = known.orders(step.field), facts.orders(step.field)
            self._watch.segment(field, form, reached, h, orders, name)
            if then is None or step.guard is None:
                yield Passed(field, h, ended, three(field.flow(switch.h + switch.d)))
                return
            following, known = self._fields[then.field], facts
            at = field, following, step.guard
            by = self._derivative(*at, switch, ended) if derive else None
            yield Passed(field, h, ended, by)
            if self.omegas is None:
                here, _ = self.number.carried(exchanged(*at, *switch[1:]))
                begun, form, late = ended, reached, switch.d
            else:
                here, form = self.number.carried(ended)
                begun = here

    def _derivative(
        self, field: Field, following: Field, guard: Guard, switch: Switch, ended: Matrix
    ) -> Matrix:
        """Derivative by the state from where a segment is begun to where the next one is."""
        if self.omegas is None:
            jump = crossing(field, following, guard, ended, switch.d)
            return jump * three(field.flow(switch.h))
        jump = saltation(field, following, guard, hull(extended(ended)))
        return jump * three(field.flow(switch.h + switch.d))


class Passed(NamedTuple):
    """A segment after its proof.

    Its field, its duration, and the states at its end, each at the time of its own switch; `by` is
    the derivative by the state up to where the next segment is begun.
    """

    field: Field
    h: Ball
    ended: Matrix
    by: Matrix | None


def _fields(values: Mapping[str, Ball]) -> tuple[Mapping[int, Field], QuickWatch]:
    """Fields, and the proof of their guards, which are the same for all alpha."""
    key = (
        bits(),
        *((x.mid().man_exp(), x.rad().man_exp()) for x in (values[name] for name in _FIXED)),
    )
    if key not in _kept:
        _kept.clear()
        _kept[key] = {index: Field(index, values) for index in FIELDS}, QuickWatch()
    return _kept[key]


def _until(field: Field, bundle: Matrix, total: Duration) -> Switch:
    """Duration and states of a segment up to a time since the section."""
    parts = total if isinstance(total, list) else [total]
    middle = arb((parts[0] - bundle[TIME, 0]).mid())
    moved = _moved(field, middle, bundle)
    late = arb_mat([[-x for x in moved.tolist()[TIME]]])
    for k, part in enumerate(parts):
        late[0, k] += part
    d = hull(late)[0, 0]
    return Switch(middle, moved, late, arb(0), d)


def _switch(field: Field, bundle: Matrix, step: Step, digits: float, name: str) -> Switch:
    """Zero of the guard of a segment."""
    assert step.guard is not None
    row = guard_row(field, step.guard)
    rate = row * field.A
    h, start = arb(step.duration), extended(bundle) * chosen(bundle.ncols())
    near_by = field.near if isinstance(field, Driven) else field
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
    moved = _moved(field, h, bundle)
    states = extended(moved)
    off, whole = row * states, hull(states)
    slope, reach = (rate * whole)[0, 0], 0.0
    for _ in range(_REFINEMENTS):
        if not slope < 0:
            break
        # The mean value theorem; as the guard decreases on all of the reach, it has one zero there.
        d = -hull(off)[0, 0] / slope
        if upper(d) < reach:
            chord = arb((rate * states)[0, 0].mid())
            return Switch(h, moved, off / -chord, (1 - slope / chord) * d, d)
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


def _moved(field: Field, h: Ball, bundle: Matrix) -> Matrix:
    """A bundle an exact time later: the flow of the extended state and of the time."""
    if isinstance(field, Driven):
        return field.moved(h, bundle, hull(bundle), bundle * chosen(bundle.ncols()))
    rows = [[*row, 0] for row in field.flow(h).tolist()]
    return arb_mat([*rows, [*[0] * ONE, h, 1]]) * bundle


@cache
def _parts(count: int, directions: int) -> Matrix:
    """Matrix that selects the middle, the directions, and a ball of the rest."""
    rest = symmetric(1)
    return arb_mat(
        [
            [*(int(j == k) for k in range(directions)), rest if j >= directions else 0]
            for j in range(count)
        ]
    )


def _form(states: Matrix, directions: int = 2) -> Matrix:
    """A bundle as middle, direction of alpha, and rest."""
    return states * _parts(states.ncols(), directions)


def rounded(whole: Matrix, directions: int = 2) -> Bundle:
    """Bundle in doubles that contains a bundle of balls; rounding is a box, as more columns."""
    kept = floats(whole)
    left = (whole - thin(kept)) * (ranges(whole.ncols()) * symmetric(1))
    lost = [0.0 if x.is_zero() else upper(x) for (x,) in left.tolist()]
    if kept.shape[1] > _MOST:
        lengths = np.sum(abs(kept[:, directions:]), axis=0)
        order = directions + np.argsort(-lengths, kind="stable")
        short = np.sum(abs(kept[:, order[_KEPT:]]), axis=1)
        kept = np.column_stack([kept[:, :directions], kept[:, order[:_KEPT]]])
        lost = [x + y for x, y in zip(lost, short.tolist(), strict=True)]
    box = np.diag(np.array(lost) * _UP)
    return np.column_stack([kept, box[:, np.any(box, axis=0)]])


def _in_doubles(whole: Matrix, directions: int = 2) -> tuple[Matrix, Matrix]:
    bundle = rounded(whole, directions)
    rest = np.sum(abs(bundle[:SIZE, directions:]), axis=1) * _UP
    rows = zip(bundle[:SIZE, :directions].tolist(), rest.tolist(), strict=True)
    return thin(bundle), arb_mat([[*row, symmetric(radius)] for row, radius in rows])


def _in_balls(whole: Matrix) -> tuple[Matrix, Matrix]:
    found = hull(whole)
    return found, extended(found)


DOUBLES = Number(_in_doubles, lambda: 53.0)
FREQUENCIES = Number(partial(_in_doubles, directions=3), lambda: 53.0)
BALLS = Number(_in_balls, lambda: float(bits()))
