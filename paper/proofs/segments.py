"""Passages of all motions over an interval of alpha, and of omega, carried together in doubles.

A bundle is the set of G (1, s, e_1, e_2, ...): s in [-1, 1] is the place of alpha in its interval,
and every e is in [-1, 1]. So the common part of the states of one alpha stays common, where a box
would lose it. Rounding errors are another column. With an interval of omega a bundle is carried at
the switch of each motion, its third column is the direction of omega, and its last row the
displacement of the capsule since the section.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
from flint import arb_mat
from numpy.typing import NDArray

from capsule_sym._enclosures.interface import (
    ROWS,
    SIZE,
    Ball,
    Duration,
    Field,
    Leg,
    Line,
    Matrix,
    Passed,
    arb,
    around,
    bits,
    chosen,
    extended,
    floats,
    generated,
    hull,
    ranges,
    saltation,
    symmetric,
    thin,
    three,
    unit,
    upper,
)
from capsule_sym._enclosures.interface import Passage as Boxes
from capsule_sym._map.interface import Guard
from capsule_sym.generated.capsule.facts import FIELDS
from paper.proofs.frequencies import Driven
from paper.proofs.margins import QuickWatch

Bundle = NDArray[np.float64]
"""Shape (7, n): the middle, the direction of alpha, and the other directions."""

_MOST, _KEPT = 48, 28  # columns beyond which the shortest are put into a box, and how many stay
_BITS = 53.0
_UP = 1 + 1e-12
_FIXED: Sequence[str] = generated.PARAMETERS
_kept: dict[Any, tuple[Mapping[int, Field], QuickWatch]] = {}


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


class Passage(Boxes):
    """The six fields at parameters that are narrow balls, for intervals of alpha and omega."""

    def __init__(
        self, values: Mapping[str, Ball], alphas: Interval, omegas: Interval | None = None
    ) -> None:
        self.values, self.alphas, self.omegas = {**values, "alpha": alphas.hull}, alphas, omegas
        self.directions = 2
        if omegas is None:
            self._fields, self._watch = _fields(self.values)
        else:
            self.directions, self.rows = 3, ROWS + 1
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

    def section(self, states: Matrix, angle: Ball) -> Bundle:
        """A bundle of states (3, n) at a forcing angle, in doubles."""
        return rounded(self.start(states, angle), self.directions)

    def moved(self, bundle: Bundle, steps: Sequence[Leg], total: Duration, angle: Ball) -> Bundle:
        """A bundle at the next section, a time `total` later.

        The steps lead there from the bundle's section; the last has no guard. `angle` is the
        forcing angle at the end. Raises Unproved unless all states take exactly these steps.
        """
        *_, last = self.segments(thin(bundle), steps, total)
        return self.section(last.ended, angle)

    def period(
        self, bundle: Bundle, steps: Sequence[Leg], total: Duration, angle: Ball
    ) -> tuple[Bundle, Matrix]:
        """A bundle at the next section, as `moved` gives it, and the derivative by the state."""
        ended, by = carried(self, thin(bundle), steps, total)
        return self.section(ended, angle), by

    def boxed(self, whole: Matrix) -> tuple[Matrix, Matrix]:
        """Bundle of balls in doubles that contains another one, and its form with a box."""
        bundle = rounded(whole, self.directions)
        rest = np.sum(abs(bundle[:SIZE, self.directions :]), axis=1) * _UP
        rows = zip(bundle[:SIZE, : self.directions].tolist(), rest.tolist(), strict=True)
        return thin(bundle), arb_mat([[*row, symmetric(radius)] for row, radius in rows])

    def form(self, states: Matrix) -> Matrix:
        """States as middle, direction of alpha, that of omega, and rest."""
        return states * _parts(states.ncols(), self.directions)

    def _amplitudes(self) -> Sequence[Ball]:
        return arb(self.alphas.middle), arb(self.alphas.radius)

    def _carried(self, passed: Passed, reached: Matrix) -> tuple[Matrix, Matrix, Matrix, Ball]:
        if self.omegas is None:
            here, _ = self.boxed(passed.left())
            return here, passed.ended, reached, passed.switch.d
        here, form = self.boxed(passed.ended)
        return here, here, form, arb(0)

    def _moved(self, field: Field, h: Ball, bundle: Matrix) -> Matrix:
        if isinstance(field, Driven):
            return field.moved(h, bundle, hull(bundle), bundle * chosen(bundle.ncols()))
        return super()._moved(field, h, bundle)

    def _near(self, field: Field) -> tuple[Field, float]:
        return field.near if isinstance(field, Driven) else field, _BITS


def carried(
    passage: Boxes, start: Matrix, steps: Sequence[Leg], total: Duration
) -> tuple[Matrix, Matrix]:
    """A bundle after its steps, and the derivative (3, 3) by the state, over all of it."""
    together = getattr(passage, "omegas", None) is None
    by, ended = unit(3), start
    for one in passage.segments(start, steps, total):
        by, ended = _derivative(one, together) * by, one.ended
    return ended, by


def _derivative(passed: Passed, together: bool) -> Matrix:
    """Derivative by the state from where a segment is begun to where the next one is.

    Segments begin at one time `together`, or at the switch of each motion.
    """
    field, _, ended, switch, guard, following = passed
    if following is None:
        return three(field.flow(switch.h + switch.d))
    assert guard is not None
    if together:
        jump = crossing(field, following, guard, ended, switch.d)
        return jump * three(field.flow(switch.h))
    jump = saltation(field, following, guard, hull(extended(ended)))
    return jump * three(field.flow(switch.h + switch.d))


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


def crossing(before: Field, following: Field, guard: Guard, ended: Matrix, d: Ball) -> Matrix:
    """Derivative of `exchanged` by the state, e^(-B d) S e^(A d) with the saltation matrix S.

    It is S + e^(-B u) (S A - B S) e^(A u) d for a time u between 0 and d.
    """
    jump, reach = saltation(before, following, guard, hull(extended(ended))), upper(d)
    bent = jump * three(before.A) - three(following.A) * jump
    return jump + three(around(following, reach)) * bent * three(around(before, reach)) * d


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
