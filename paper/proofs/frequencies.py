"""Fields for all frequencies of an interval, and the displacement of the capsule."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from flint import arb_mat

from capsule_sym._enclosures.interface import (
    ONE,
    SIZE,
    Ball,
    C,
    Exponential,
    Field,
    Matrix,
    U,
    V,
    W,
    arb,
    matrix,
    symmetric,
    unit,
    upper,
)

_PIECE = 0.125  # of time, on which the response to the drive is bounded
_FAR = 1e3  # times beyond which a bound is of no use


class Driven(Field):
    """Field for all omega within a radius of `middle`.

    Only the drive depends on omega. With u(t) = a cos(theta + omega t) and omega moved by d, u(t)
    changes by at most a |d| t, and by at most a (d t)^2/2 beside its derivative by omega. A unit of
    u for a time dt adds dt to v_r: `_responses` bounds the effect of that later.
    """

    def __init__(self, index: int, values: Mapping[str, Ball], middle: Ball, radius: Ball) -> None:
        super().__init__(index, values)
        self.near = Field(index, {**values, "omega": middle})
        self._radius, self._amplitude = radius, arb(values["alpha"].abs_upper())
        rates, slope = _travelling(self.near.A), matrix(_ALL, _ALL, ((U, W, -1), (W, U, 1)))
        self._both = Exponential(_doubled(rates, slope.tolist()))
        self._ahead, self._back = (_Response(self.near, sense) for sense in (1, -1))

    def _responses(self, h: Ball) -> list[Ball]:
        """Bounds on x_r, v_r and v_c at all times between 0 and h from a unit of v_r at 0."""
        ahead, back = (upper((h * sense).max(arb(0))) for sense in (1, -1))
        both = zip(self._ahead.bounds(ahead), self._back.bounds(back), strict=True)
        return [one.max(other) for one, other in both]

    def flow(self, h: Ball) -> Matrix:
        """exp(A h)."""
        found, longest = self.near.flow(h), upper(h)
        changes = [bound * longest**2 / 2 for bound in self._responses(h)]
        for i, change in enumerate([*changes, arb(longest), arb(longest)]):
            for j in (U, W):
                found[i, j] += symmetric((change * self._radius).abs_upper())
        return found

    def moved(self, h: Ball, bundle: Matrix, whole: Matrix, middle: Matrix) -> Matrix:
        """Bundle an exact time later; rows: the extended state, the time and the displacement.

        `whole` holds all states of the bundle, and `middle` is its first column. The
        remainder of second order in omega is a box, as more columns.
        """
        both = self._both.rest(h)
        flow, by = (_TOP * both * side for side in _SIDES)
        longest, responses = upper(h), self._responses(h)
        bent = [bound * longest**3 / 6 for bound in responses] + [arb(longest) ** 2 / 2] * 2
        bent += [arb(0), arb(0), responses[C] * longest**4 / 24]
        turned = by * middle * self._radius
        left = by * (whole - middle) * self._radius
        rows = (flow * bundle).tolist()
        for i, row in enumerate(rows):
            row[2] += turned[i, 0]
            box = [arb(0)] * _ALL
            box[i] = arb(left[i, 0].abs_upper()) + bent[i] * self._amplitude * self._radius**2
            row += box
        return arb_mat(rows)


class _Response:
    """Bounds on x_r, v_r and v_c after a unit of v_r, or before it, where they are larger."""

    def __init__(self, field: Field, sense: int) -> None:
        self._bounds = [[arb(0)] * 3]
        self._piece = field.flow(symmetric(_PIECE)) * matrix(SIZE, 1, [(V, 0, 1)])
        self._step = field.flow(arb(sense * _PIECE))

    def bounds(self, reach: float) -> list[Ball]:
        """Bounds at all times up to a reach."""
        if not reach < _FAR:
            return [arb(inf)] * 3
        while (len(self._bounds) - 1) * _PIECE < reach:
            states = zip(self._bounds[-1], self._piece.tolist(), strict=False)
            self._bounds.append([before.max(arb(x.abs_upper())) for before, (x,) in states])
            self._piece = self._step * self._piece
        return self._bounds[-1]


_ALL = SIZE + 2
_TOP = unit(_ALL, 2 * _ALL)
_SIDES = (
    unit(2 * _ALL, _ALL),
    matrix(2 * _ALL, _ALL, ((_ALL + k, k, 1) for k in range(_ALL))),
)


def _travelling(A: Matrix) -> list[list[Ball]]:
    """Rates of the extended state, of the time and of the displacement."""
    rows = [[*row, 0, 0] for row in A.tolist()]
    return [*rows, *([int(k == one) for k in range(_ALL)] for one in (ONE, C))]


def _doubled(A: list[list[Ball]], slope: list[list[Ball]]) -> Matrix:
    """Matrix whose exponential has that of A, and its derivative along a slope of A beside it."""
    rows = [[*row, *by] for row, by in zip(A, slope, strict=True)]
    return arb_mat([*rows, *([*[0] * len(A), *row] for row in A)])
