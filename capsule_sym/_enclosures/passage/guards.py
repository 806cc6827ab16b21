"""Proof that every guard is positive along a segment.

On a piece of a segment a guard is its Taylor polynomial in time with a bound on the remainder. It
is positive if the polynomial's coefficients in Bernstein's basis are. If exact facts make a guard
vanish at an end of its segment, that root is divided out.
"""

from __future__ import annotations

from collections.abc import Container
from functools import lru_cache
from math import ceil, comb, exp, frexp, ldexp

from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    bits,
    largest,
    precision,
    upper,
)
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.passage.exchanges import ranges
from capsule_sym._enclosures.passage.switches import Orders
from capsule_sym._native import check_time

_ORDER = 16
_STEP_BITS = 128  # bits of the flow over a piece, enough for the guards' margins
_LONGEST = 0.8  # a piece, in units of time
_DEEPEST = 30  # halvings of a piece
_ANEW = 32  # pieces after which the state is computed from the segment's end: errors of steps grow


@lru_cache(maxsize=4096)
def _to_bernstein(degree: int, length: float, precision: int) -> Matrix:
    """The matrix from the coefficients of 1, t, t^2 ... to those in Bernstein's basis."""
    all_powers = range(degree + 1)
    scaled = [arb(length) ** k / comb(degree, k) for k in all_powers]
    return arb_mat([[scaled[k] * comb(j, k) for k in all_powers] for j in all_powers])


class Line:
    """The guards of a field forwards or backwards in time, as Taylor coefficients."""

    def __init__(self, field: Field, sense: int) -> None:
        self.index, self.sense = field.index, sense
        self._field, self._norm = field, field.norm
        rows = [
            (field.guards * (term * sense**k)).tolist()
            for k, term in enumerate(field.terms(_ORDER + 1))
        ]
        *held, self._last = rows
        self._coefficients = [arb_mat([row[g] for row in held]) for g in range(len(self._last))]
        self.guards = len(self._last)
        self._steps: dict[float, Matrix] = {}

    def step(self, length: float) -> Matrix:
        """The flow over a piece."""
        if length not in self._steps:
            with precision(min(bits(), _STEP_BITS)):
                self._steps[length] = self._field.flow(arb(self.sense * length))
        return self._steps[length]

    def polynomial(
        self, guard: int, order: int, state: Matrix, length: float, derivative: bool = False
    ) -> tuple[Matrix, Ball]:
        """A guard over time^order on a piece, in Bernstein's basis (many, columns of the state).

        Returns it with a bound on neglected terms. With `derivative` it is its derivative by time.
        """
        found = (self._coefficients[guard] * state).tolist()[order:]
        if derivative:
            found = [[x * k for x in row] for k, row in enumerate(found)][1:]
        shaped = _to_bernstein(len(found) - 1, length, bits()) * arb_mat(found)
        reach = sum((abs(x) for x in self._last[guard]), arb(0)) * largest(state)
        # |y(t)| <= |y(0)| exp(norm t), and the next Taylor term takes y somewhere on the piece.
        # Of the remainder R of g, (R/t^order)' = R'/t^order - order R/t^(order + 1).
        grown = exp(self._norm * length) * (_ORDER + 1 + order if derivative else 1) * 1.0000001
        power = _ORDER + 1 - order - derivative
        return shaped, reach * grown * arb(length) ** power

    def positive(
        self,
        guard: int,
        order: int,
        state: Matrix,
        length: float,
        sign: int = 1,
        derivative: bool = False,
    ) -> bool | None:
        """True if a guard over time^order (or its derivative) is proved to have a sign on a piece.

        False if it is not, and None if the proof fails at the start itself, where shorter pieces
        would not help.
        """
        shaped, rest = self.polynomial(guard, order, state, length, derivative)
        values = (shaped * ranges(state.ncols())).tolist()
        if not sign * values[0][0] > 0:
            return None
        return all(sign * row[0] > rest for row in values)


class Signs:
    """Proofs that guards are positive, with the data computed once for each field."""

    def __init__(self) -> None:
        self._lines: dict[tuple[int, int], tuple[Field, Line]] = {}

    def line(self, field: Field, sense: int) -> Line:
        """The guards of a field, forwards (+1) or backwards (-1)."""
        kept = self._lines.get((field.index, sense))
        if kept is None or kept[0] is not field:
            kept = field, Line(field, sense)
            self._lines[field.index, sense] = kept
        return kept[1]

    def segment(
        self,
        field: Field,
        start: Matrix,
        end: Matrix,
        h: Ball,
        orders: Orders,
        name: str,
        apart: Container[int] = (),
    ) -> None:
        """Prove every guard of a segment but those `apart` positive, or raise Unproved.

        `start` and `end` are affine forms: columns middle, directions and rest.
        """
        longest = upper(h)
        if not h > 0:
            raise Unproved("guards", f"the duration of {name} is not proved positive")
        first, last = orders
        for guard, (before, after) in enumerate(zip(first, last, strict=True)):
            if guard in apart:
                continue
            if not self._guard(field, guard, before, after, start, end, longest):
                what = _NAMES[field.stick][guard]
                raise Unproved("guards", f"{what} is not proved positive along {name}")

    def _guard(
        self,
        field: Field,
        guard: int,
        before: int,
        after: int,
        start: Matrix,
        end: Matrix,
        longest: float,
    ) -> bool:
        ahead = self.line(field, 1)
        if after and longest <= _LONGEST:
            falls = after == 1 and ahead.positive(guard, before, start, longest, -1, True)
            if falls or (
                before == 0 and self.pieces(field, -1, guard, after, end, longest, longest)
            ):
                return True
        if not after:
            return self.pieces(field, 1, guard, before, start, longest, longest)
        count = max(2, ceil(longest / _LONGEST))
        part = _dyadic(longest / count)
        return self.pieces(field, -1, guard, after, end, part, part) and self.pieces(
            field, 1, guard, before, start, longest - part * (1 - 1e-12), part
        )

    def rising(
        self, field: Field, sense: int, guard: int, order: int, state: Matrix, reach: float
    ) -> bool:
        """True if a guard is proved positive from an end on over a time, by its derivatives there.

        Those below `order` are not negative there, and neither is that of `order`: on a first
        piece (guard - terms below order)/time^order increases.
        """
        length = _dyadic(min(reach, _LONGEST))
        for _ in range(_DEEPEST):
            if self.line(field, sense).positive(guard, order, state, length, 1, True):
                there = field.flow(arb(sense * length)) * state
                return self.pieces(field, sense, guard, 0, there, reach - length, reach)
            length /= 2
        return False

    def pieces(
        self,
        field: Field,
        sense: int,
        guard: int,
        order: int,
        state: Matrix,
        reach: float,
        part: float,
    ) -> bool:
        """True if a guard is proved positive from an end of a segment on over a time `reach`.

        `part` is the longest piece, and `order` the number of known zeros at that end.
        """
        line = self.line(field, sense)
        part = _dyadic(min(part, _LONGEST))
        done, pieces, depth, length = 0.0, 0, 0, part
        here = state
        while done < reach:
            check_time()
            length = min(length, _dyadic(reach - done))
            held = line.positive(guard, order if done == 0 else 0, here, length)
            if held is None:
                return False
            if held:
                done += length
                pieces += 1
                anew = pieces % _ANEW == 0
                here = field.flow(arb(sense * done)) * state if anew else line.step(length) * here
                if depth:
                    depth, length = depth - 1, length * 2
                continue
            depth += 1
            length /= 2
            if depth > _DEEPEST or done + length == done:  # below what the time resolves
                return False
        return True


def _dyadic(length: float) -> float:
    """A slightly longer length with few digits, so that results for it can be reused."""
    fraction, power = frexp(length)
    return ldexp(ceil(fraction * 64) / 64, power)


_NAMES = {
    False: ("the gap", "the drift"),
    True: ("the gap", "the upper force margin", "the lower force margin"),
}
