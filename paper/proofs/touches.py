"""Passages of bundles in which a guard may touch 0 or stay positive.

The change by a touch is bounded in a window about it. Windows are guesses from double precision.
They begin at one time for all motions, or when the drift of each one ends: at that instant all are
at rest, and some drift back for a moment. Bounds on a touch do not depend on when it begins, so
each motion keeps its own time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice, pairwise
from math import ceil
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from capsule_sym._enclosures.interface import (
    ROWS,
    SIZE,
    TIME,
    Ball,
    C,
    Duration,
    Field,
    Leg,
    Matrix,
    Unproved,
    arb,
    floats,
    matrix,
    thin,
    unit,
)
from capsule_sym._map.interface import Guard
from paper.proofs.segments import Bundle, Passage
from paper.proofs.windows import TOUCHED_ROWS, Touch, Window

_GRID = 2.0**-7  # of time, on which windows are looked for
_LENGTHS = 2.0**-5  # of windows, multiples of it
_FAR = 2048  # points of that grid
_WIDER = 1.25  # growth in a period after which a touch is tried instead
_BRIEF = 0.8  # duration of a segment that is left out
_LONGEST = 1.5  # window


_tables: WeakKeyDictionary[Field, NDArray[np.float64]] = WeakKeyDictionary()
_NONE = Unproved("guards", "no touch")


class Soft:
    """Passages of bundles, in which touches of guards are allowed."""

    def __init__(self, passage: Passage) -> None:
        self.passage = passage

    def period(
        self, bundle: Bundle, steps: Sequence[Leg], total: Duration, angles: tuple[Ball, Ball]
    ) -> tuple[Bundle, Matrix]:
        """A bundle at the next section, and a matrix that holds the quotients of differences.

        `angles` are the forcing angles at its section and the next. Raises Unproved.
        """
        try:
            return self.hard(bundle, steps, total, angles)
        except Unproved as error:
            return self._softly(bundle, steps, total, angles, error)

    def hard(
        self, bundle: Bundle, steps: Sequence[Leg], total: Duration, angles: tuple[Ball, Ball]
    ) -> tuple[Bundle, Matrix]:
        """The same without touches."""
        return self.passage.period(bundle, steps, total, angles[1])

    def moved(
        self, bundle: Bundle, steps: Sequence[Leg], total: Duration, angles: tuple[Ball, Ball]
    ) -> Bundle:
        """A bundle at the next section."""
        try:
            found = self.passage.moved(bundle, steps, total, angles[1])
        except Unproved as error:
            try:
                return self._softly(bundle, steps, total, angles, error)[0]
            except Unproved as failed:
                return self._landed(bundle, steps, total, angles[1], failed)
        if len(merged(steps)) < len(steps) and _rest(found) > _WIDER * _rest(bundle):
            try:
                other = self._softly(bundle, steps, total, angles, _NONE)[0]
            except Unproved:
                return found
            return min(found, other, key=_rest)
        return found

    def _softly(
        self,
        bundle: Bundle,
        steps: Sequence[Leg],
        total: Duration,
        angles: tuple[Ball, Ball],
        error: Unproved,
    ) -> tuple[Bundle, Matrix]:
        """A bundle through guesses of its windows; raises the error that led here."""
        if isinstance(total, list):  # over omega; a window has the same times for all motions
            raise error
        for nominal in (merged(steps), list(steps)):
            windows = self._windows(bundle, nominal)
            if windows:
                try:
                    return self._through(bundle, nominal, windows, total, angles)
                except Unproved as other:
                    error = other
            if len(nominal) == len(steps):
                break
        raise error

    def _through(
        self,
        bundle: Bundle,
        steps: Sequence[Leg],
        windows: Sequence[Window],
        total: Ball,
        angles: tuple[Ball, Ball],
    ) -> tuple[Bundle, Matrix]:
        """A bundle through its windows, one after the other, and the matrix of differences."""
        by, now, omega = unit(3), 0.0, self.passage.values["omega"]
        left = list(steps)
        for window in windows:
            ahead, left = _cut(left, window.begin - now)
            angle = angles[0] + omega * arb(window.begin)
            bundle, one = self.passage.period(bundle, ahead, arb(window.begin - now), angle)
            by = one * by
            now = window.begin + window.length
            _, left = _cut(left, window.length)
            field = self.passage.field(ahead[-1].field)
            bundle, one = self._window(field, bundle, window, angles[0] + omega * arb(now))
            by = one * by
        bundle, one = self.passage.period(bundle, left, total - arb(now), angles[1])
        return bundle, one * by

    def _window(
        self, field: Field, bundle: Bundle, window: Window, angle: Ball
    ) -> tuple[Bundle, Matrix]:
        """A bundle after a window, and the matrix of differences."""
        ended, touch = self._touched(field, thin(bundle), window)
        return self.passage.section(ended, angle), touch.by()

    def _touched(self, field: Field, bundle: Matrix, window: Window) -> tuple[Matrix, Touch]:
        """A bundle of balls after a window that begins at the time of each of its motions."""
        touch = Touch(field, self.passage.values, window)
        if touch.friction and not all(bundle[C, j].is_zero() for j in range(bundle.ncols())):
            raise Unproved("guards", f"{touch.name}: the window does not begin at rest")
        pieces, ended = touch.pieces(self.passage.line(field), bundle)
        change, slack = touch.change(pieces[touch.row])
        for row, along in enumerate(pieces):
            if row != touch.row and not all(one.low > slack for one in along):
                raise Unproved("guards", f"another guard touches 0 in {touch.name}")
        box = matrix(ROWS, ended.ncols() + 3)
        for j in range(ended.ncols()):
            for i in range(SIZE):
                box[i, j] = ended[i, j]
            box[TIME, j] = bundle[TIME, j]
        box[TIME, 0] += touch.length
        for i in range(3):
            box[i, 0] += change[i].mid()
            box[i, ended.ncols() + i] = change[i].rad()
        return box, touch

    def _landed(
        self,
        bundle: Bundle,
        steps: Sequence[Leg],
        total: Duration,
        angle: Ball,
        error: Unproved,
    ) -> Bundle:
        """A bundle of which some motions drift back for a moment when a drift ends.

        The window begins when the drift of each motion ends. Raises Unproved.
        """
        guess = None if isinstance(total, list) else self._landing(bundle, steps)
        if guess is None:
            raise error
        nominal, last, guard = guess
        segments = self.passage.segments(thin(bundle), nominal, total)
        *_, landed = islice(segments, last + 1)
        here, _ = self.passage.boxed(landed.ended)
        after = nominal[last + 1]
        field = self.passage.field(after.field)
        along = self._table(after.field)[: int(after.duration / _GRID)] @ floats(here)[:SIZE, 0]
        margins = along @ floats(field.guards)[TOUCHED_ROWS[guard]]
        reach = float(np.max(np.sum(abs(floats(here)[:3, 1:]), axis=1)))
        end = _end_of_touch(margins, 5 * reach + 1e-9)
        if end is None:
            raise error
        length = _LENGTHS * ceil(_GRID * end / _LENGTHS)
        here, _ = self._touched(field, here, Window(0.0, length, guard))
        rest = [replace(after, duration=after.duration - length), *nominal[last + 2 :]]
        *_, passed = self.passage.segments(here, rest, total)
        return self.passage.section(passed.ended, angle)

    def _landing(self, bundle: Bundle, steps: Sequence[Leg]) -> tuple[list[Leg], int, Guard] | None:
        """Guess of the end of a drift at which the force is nearest to that of friction.

        The steps without a brief drift after it, the number of its step, and the guard.
        """
        state, found = bundle[:SIZE, 0], list[tuple[float, int, int, Guard]]()
        for k, step in enumerate(steps[:-1]):
            state = expm(floats(self.passage.field(step.field).A) * step.duration) @ state
            then = k + 1 if self.passage.field(steps[k + 1].field).stick else k + 2
            again = k > 0 and steps[k - 1].guard is Guard.DRIFT
            if step.guard is not Guard.DRIFT or again or then == len(steps):
                continue
            field = self.passage.field(steps[then].field)
            if field.stick and {one.guard for one in steps[k:then]} == {Guard.DRIFT}:
                upper, lower = floats(field.guards)[1:3] @ state
                guard = Guard.UPPER if upper < lower else Guard.LOWER
                found.append((abs(min(upper, lower)), k, then, guard))
        if not found:
            return None
        _, k, then, guard = min(found)
        whole = sum(step.duration for step in steps[k + 1 : then + 1])
        return [*steps[: k + 1], replace(steps[then], duration=whole), *steps[then + 1 :]], k, guard

    def _windows(self, bundle: Bundle, steps: Sequence[Leg]) -> list[Window]:
        """Guesses of the windows of a bundle: where a guard of the middle is almost 0."""
        state, time, found = bundle[:SIZE, 0], 0.0, list[Window]()
        reach = float(np.max(np.sum(abs(bundle[:3, 1:]), axis=1)))
        for step in steps:
            field, table = self.passage.field(step.field), self._table(step.field)
            count = int(step.duration / _GRID)
            along = table[: count + 1] @ state
            guards = along @ floats(field.guards).T
            for row in range(guards.shape[1]):
                kind = _kind(field, row)
                if kind is not None:
                    found += _around(guards[:, row], 5 * reach + 1e-9, time, kind)
            time += step.duration
            left = step.duration - count * _GRID
            state = along[-1] + left * (floats(field.A) @ along[-1])
        found.sort()
        if any(a.begin + a.length > b.begin for a, b in pairwise(found)):
            return []
        return found

    def _table(self, index: int) -> NDArray[np.float64]:
        """Flow of a field at the points of the grid, in doubles."""
        field = self.passage.field(index)
        if field not in _tables:
            step = expm(floats(field.A) * _GRID)
            flows = [np.eye(SIZE)]
            for _ in range(_FAR):
                flows.append(step @ flows[-1])
            _tables[field] = np.array(flows)
        return _tables[field]


def _rest(bundle: Bundle) -> float:
    """Size of a bundle beside its line."""
    return float(np.max(np.sum(abs(bundle[:3, 2:]), axis=1)))


def merged(steps: Sequence[Leg]) -> list[Leg]:
    """Steps without the shortest brief segment between two of one field."""
    found = list(steps)
    middles = [
        k
        for k in range(1, len(steps) - 1)
        if steps[k - 1].field == steps[k + 1].field
        and steps[k].duration < _BRIEF
        and steps[k - 1].guard in TOUCHED_ROWS
    ]
    if middles:
        k = min(middles, key=lambda at: steps[at].duration)
        whole = sum(step.duration for step in steps[k - 1 : k + 2])
        found[k - 1 : k + 2] = [Leg(steps[k + 1].field, whole, steps[k + 1].guard)]
    return found


def _cut(steps: Sequence[Leg], at: float) -> tuple[list[Leg], list[Leg]]:
    """Steps up to a time and from then on."""
    ahead: list[Leg] = []
    for k, step in enumerate(steps):
        if step.duration > at:
            rest = replace(step, duration=step.duration - at)
            return [*ahead, Leg(step.field, at, None)], [rest, *steps[k + 1 :]]
        ahead.append(step)
        at -= step.duration
    raise Unproved("guards", "a touch at the end of a period")


def _kind(field: Field, row: int) -> Guard | None:
    """Guard in a row of a field's guards, if it may touch 0."""
    if row == 0:
        return Guard.GAP
    return (Guard.UPPER, Guard.LOWER)[row - 1] if field.stick else None


def _end_of_touch(values: NDArray[np.float64], near: float) -> int | None:
    """Place in the values of a guard, almost 0 or less at first, at which no motion slips."""
    beyond = 2.5 * near + 5 * max(0.0, -float(np.min(values, initial=0.0)))
    after = np.flatnonzero(values > beyond)
    return int(after[0]) + 1 if after.size else None


def _around(values: NDArray[np.float64], near: float, time: float, guard: Guard) -> list[Window]:
    """Window about the points at which a guard is almost 0; none at the ends of a segment."""
    inner = np.flatnonzero(values > near)
    if not inner.size:
        return []
    begun, ended = inner[[0, -1]]
    deepest = max(0.0, -float(np.min(values[begun:ended], initial=0.0)))
    low = begun + np.flatnonzero(values[begun:ended] < near)
    beyond = 2.5 * near + 5 * deepest  # where what slips has stopped
    after = ended - np.flatnonzero(values[low[-1] : ended][::-1] > beyond) if low.size else low
    if not low.size or not after.size:
        return []
    first, last = int(low[0]) - 1, int(after[-1])
    begin = _GRID * round((time + first * _GRID) / _GRID)
    length = _LENGTHS * ceil(_GRID * (last - first) / _LENGTHS)
    return [Window(begin, length, guard)] if begin > 0 and length < _LONGEST else []
