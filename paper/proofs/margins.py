"""Guards proved positive in doubles along the middle of a segment, on all pieces of it at once.

On pieces of one length a guard's coefficients in Bernstein's basis are linear in the start state of
the segment. Their matrices are computed once in balls and stored as doubles with bounds, so that a
segment needs only a product of matrices. Balls treat its ends, where a guard may vanish exactly,
and the pieces that doubles cannot decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._enclosures.interface import (
    SIZE,
    Ball,
    Field,
    Line,
    Matrix,
    Signs,
    floats,
    matrix,
    thin,
    upper,
)

_LENGTH = 0.25  # of a piece
_ENDS = 3  # pieces at an end for balls, if a guard vanishes there
_LEAST = 1.0  # duration of a segment below which balls are used
_ROUNDING = 2.0**-45  # bound on the error of products of six terms, over their size
_TINY = 1e-290  # bound on the error of underflow


class QuickWatch(Signs):
    """The guards of all fields, first tried in doubles."""

    def __init__(self) -> None:
        super().__init__()
        self._tables: dict[int, tuple[Line, _Table]] = {}
        self._start: tuple[Matrix, _Start] | None = None

    def _table(self, field: Field) -> _Table:
        line = self.line(field, 1)
        kept = self._tables.get(field.index)
        if kept is None or kept[0] is not line:
            kept = line, _Table(line, field.guards.nrows())
            self._tables[field.index] = kept
        return kept[1]

    def _begun(self, form: Matrix) -> _Start:
        if self._start is None or self._start[0] is not form:
            self._start = form, _Start.of(form)
        return self._start[1]

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
        balls = field, guard, before, after, start, end, longest
        if not _LEAST < longest < np.inf:
            return super()._guard(*balls)
        part = _ENDS * _LENGTH
        first, reach = _ENDS if before else 0, longest - part * (1 - 1e-12) if after else longest
        return (
            self._table(field).positive(
                guard, self._begun(start), first, ceil(reach / _LENGTH * (1 + 1e-12))
            )
            and (not before or self.pieces(field, 1, guard, before, start, part, part))
            and (not after or self.pieces(field, -1, guard, after, end, part, part))
        ) or super()._guard(*balls)


class _Start(NamedTuple):
    """Start of a segment: every state is within `around` of `place`."""

    place: NDArray[np.float64]
    around: NDArray[np.float64]

    @classmethod
    def of(cls, form: Matrix) -> _Start:
        """All states of a form: a middle, directions and rest (6, many)."""
        place = floats(form)[:, 0]
        rows = zip(form.tolist(), place, strict=True)
        off = [upper(sum((abs(x) for x in row[1:]), abs(row[0] - near))) for row, near in rows]
        return cls(place, np.array(off))


class _Table:
    """The guards of a field on the first pieces of a segment, for all of its starts.

    Coefficient k of a guard on piece j is `middle[guard][j][k]` times the start, up to `error`
    times the start's absolute values, and `rest` times the largest of these.
    """

    def __init__(self, line: Line, guards: int) -> None:
        self._line, self._guards = line, range(guards)
        self._flow = matrix(SIZE, SIZE, ((i, i, 1) for i in range(SIZE)))
        self._found: list[list[tuple[Matrix, Ball]]] = []
        self._bounds: list[tuple[NDArray[np.float64], ...]] = []

    def positive(self, guard: int, start: _Start, first: int, end: int) -> bool:
        """True if a guard is proved positive from a piece on up to another one."""
        if len(self._found) < end:
            self._grow(end)
        middle, absolute, error, rest = (one[first:end] for one in self._bounds[guard])
        place, around = start
        size = abs(place)
        # |M y - middle place| <= absolute around + error (size + around) for |y - place| <= around.
        off = absolute @ (around + _ROUNDING * size) + error @ (size + around)
        off += rest[:, None] * np.max(size + around)
        return bool(np.all(middle @ place > off * (1 + _ROUNDING) + _TINY))

    def _grow(self, end: int) -> None:
        while len(self._found) < end:
            guards = [self._line.polynomial(g, 0, self._flow, _LENGTH) for g in self._guards]
            self._found.append(guards)
            self._flow = self._line.step(_LENGTH) * self._flow
        self._bounds = [_bounds([one[g] for one in self._found]) for g in self._guards]


def _bounds(found: Sequence[tuple[Matrix, Ball]]) -> tuple[NDArray[np.float64], ...]:
    """Matrices of balls on all pieces as doubles, their absolute values, and their remainders."""
    middle = np.array([floats(shaped) for shaped, _ in found])
    error = np.array(
        [
            [[upper(x) for x in row] for row in (shaped - thin(near)).tolist()]
            for (shaped, _), near in zip(found, middle, strict=True)
        ]
    )
    return middle, abs(middle), error, np.array([upper(rest) for _, rest in found])
