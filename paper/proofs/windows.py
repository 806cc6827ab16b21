"""Passages in which a guard may touch 0 or stay positive: proved for both cases at once.

In a short window the nominal states are those of one field, as if the guard stayed positive. Their
change by the other field is bounded and becomes part of the bundle. With k = 1 or 1 + beta, P the
force on the capsule, w = v_r + v_c the velocity of the mass, and e the difference from the nominal
state:

- friction: the capsule may slip. Then x_r' = w - v_c, w' = alpha cos - P, and |v_c|' gamma is
  |P| - f_b while v_c is not 0. So e' = A e - (1, -2 zeta) v_c with the rates A of stick, and v_c is
  bounded by integrals of the nominal |P| - f_b, up to a slack for e.
- contact: the spring acts or not, as a force of at most beta times the penetration.

Two motions differ at the end by a matrix times their difference at the start. It is near that of
the nominal flow: friction is monotone, so that |d v_c|' <= |k d x_r + 2 zeta d w|/gamma, and with
contact the rates differ by a matrix of norm at most beta (1 + 1/gamma).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from capsule_sym._enclosures.interface import (
    ROWS,
    SIZE,
    Ball,
    C,
    Field,
    Line,
    Matrix,
    Unproved,
    V,
    X,
    arb,
    greatest,
    matrix,
    symmetric,
    three,
    unit,
)
from capsule_sym._map.interface import Guard
from capsule_sym.generated.capsule.facts import FIELDS

PIECES = 32
"""Number of pieces of a window."""
TOUCHED_ROWS = {Guard.GAP: 0, Guard.UPPER: 1, Guard.LOWER: 2}
"""Rows of the guards that may touch 0, among those of a field."""
_TINY = 1e-20  # a first bound on a change of force
_TRIALS = 12  # of a bound on the force that a slip changes
_kept: WeakKeyDictionary[Line, dict[float, list[list[tuple[Matrix, Ball]]]]] = WeakKeyDictionary()


class Window(NamedTuple):
    """Times since the section between which a guard of a segment may touch 0."""

    begin: float
    length: float
    guard: Guard


class Piece(NamedTuple):
    """Bounds on a guard on a piece of time, and its mean there."""

    low: Ball
    high: Ball
    mean: Ball


class Touch:
    """Bounds on what a touch of a guard changes in a window."""

    def __init__(self, field: Field, values: Mapping[str, Ball], window: Window) -> None:
        self.field, self.row = field, TOUCHED_ROWS[window.guard]
        self.name = f"a touch of {window.guard.name} in F{field.index}"
        self.friction = window.guard is not Guard.GAP
        self.length = arb(window.length)
        if self.friction and not field.stick:
            raise Unproved("guards", f"{self.name}: the window begins before its segment")
        self._beta, self.gamma = values["beta"], values["gamma"]
        self._spring = 1 + self._beta  # or 1 without contact
        self._damping = 2 * values["zeta"]
        self._share = 1 if field.stick else 1 + 1 / self.gamma
        if not (self.gamma > 0 and self._beta > 0 and 0 < self._damping < 1):
            raise Unproved("guards", f"{self.name}: parameters outside of the bounds")

    def pieces(self, line: Line, bundle: Matrix) -> tuple[list[list[Piece]], Matrix]:
        """Each guard of the nominal states on each piece, and these states at the end."""
        start = unit(SIZE, ROWS) * bundle
        places = ((k, 0, symmetric(1) if k else 1) for k in range(start.ncols()))
        spread = matrix(start.ncols(), 1, places)
        largest = greatest(sum((abs(x) for x in row), arb(0)) for row in start.tolist())
        if not largest < np.inf:
            raise Unproved("guards", f"{self.name}: the states are unbounded")
        found: list[list[Piece]] = []
        for along in _along(line, float(self.length.mid()) / PIECES):
            pieces = []
            for shaped, rest in along:
                error = symmetric((rest * largest).abs_upper())
                values = [x + error for (x,) in (shaped * start * spread).tolist()]
                low, high = min(x.lower() for x in values), max(x.upper() for x in values)
                pieces.append(Piece(low, high, sum(values, arb(0)) / len(values)))
            found.append(pieces)
        ended = self.field.flow(self.length) * start
        if self.field.stick:
            for j in range(ended.ncols()):
                ended[C, j] = arb(0)
        return found, ended

    def change(self, pieces: Sequence[Piece]) -> tuple[list[Ball], Ball]:
        """Change of a state at the end, and a bound on that of other guards on the way."""
        return self._slipped(pieces) if self.friction else self._pressed(pieces)

    def _pressed(self, pieces: Sequence[Piece]) -> tuple[list[Ball], Ball]:
        """Change by contact: R' <= beta g times the penetration, with R^2 = K e_x^2 + e_v^2.

        Without contact in the nominal field the spring only pushes the mass back, for less than
        half of a swing: then no motion is deeper than the nominal one.
        """
        place, brief = arb(_TINY), self._share * self.length**2 < 9
        deeper = 0 if brief and FIELDS[self.field.index][0] == 0 else 1
        for _ in range(_TRIALS):
            depths = [
                (-place - one.high).max(arb(0)).union((deeper * place - one.low).max(arb(0)))
                for one in pieces
            ]
            pressed = self._beta * sum(depths, arb(0)) * self.length / PIECES
            speed = self._share * pressed
            moved = self.length * speed
            if moved < place:
                break
            place = arb((moved * 1.2 + _TINY).upper())
        else:
            raise Unproved("guards", f"{self.name}: no bound on its force")
        deepest = symmetric(greatest(depths))
        force = self._spring * moved + self._damping * speed
        slack = force + self._beta * deepest + (self.length * force + pressed) / self.gamma
        slips = arb(0) if self.field.stick else self._beta / self.gamma
        # The force acts backwards on the mass, and forwards on the capsule.
        entries = (V, 0, -self._share * self._beta), (C, 0, slips)
        return self._pushed(depths, entries), arb(slack.abs_upper())

    def _pushed(
        self, sizes: Sequence[Ball], entries: Sequence[tuple[int, int, Ball]]
    ) -> list[Ball]:
        """Change of a state at the end by rates of a size on each piece."""
        part = self.length / PIECES
        step = self.field.flow(part)
        over = self.field.flow(part / 2 + symmetric(part.upper() / 2)) * part
        impulse, total = over * matrix(SIZE, 1, entries), matrix(SIZE, 1)
        for size in sizes:
            total = step * total + impulse * size
        return [total[X, 0], total[V, 0], arb(0) if self.field.stick else total[C, 0]]

    def _slipped(self, pieces: Sequence[Piece]) -> tuple[list[Ball], Ball]:
        slack = arb(_TINY)
        for _ in range(_TRIALS):
            slip, between, stopped = self._slips(pieces, slack)
            place, speed = self._moved(slip)
            changed = self._spring * place + self._damping * (speed + slip)
            if changed < slack:
                break
            slack = arb((changed * 1.2 + _TINY).upper())
        else:
            raise Unproved("guards", f"{self.name}: no bound on its force")
        if not stopped:
            raise Unproved("guards", f"{self.name}: not proved to end")
        sign = arb(1 if self.row == 1 else -1)
        changes = self._pushed(between, ((X, 0, -sign), (V, 0, sign * self._damping)))
        return changes, slack + place

    def _slips(self, pieces: Sequence[Piece], slack: Ball) -> tuple[Ball, list[Ball], bool]:
        """Bounds on |v_c|, all the time and on each piece, and if the capsule is at rest at last.

        While |v_c| > 0 its rate is |P| - f_b over gamma, and at rest |P| <= f_b.
        """
        part = self.length / PIECES / self.gamma
        least = most = greatest = arb(0)
        sizes = []
        for one in pieces:
            rise, fall = (slack - one.low).max(arb(0)), (-slack - one.high).min(arb(0))
            along = most + rise * part
            sizes.append((least + fall * part).max(arb(0)).union(along))
            greatest = greatest.max(along)
            least = (least + ((-slack - one.mean) * part).lower()).max(arb(0))
            most = (rise * part).max(most + ((slack - one.mean) * part).upper())
        return greatest, sizes, bool(most <= 0)

    def _moved(self, slip: Ball) -> tuple[Ball, Ball]:
        """Bounds on the changes of x_r and w while |v_c| <= slip.

        With R^2 = k e_x^2 + e_w^2 it is R' <= |v_c| (k + 4 zeta^2)^(1/2).
        """
        grown = slip * self.length
        squared = self._damping**2
        return grown * (1 + squared).sqrt(), grown * (self._spring + squared).sqrt()

    def by(self) -> Matrix:
        """Matrix that holds the quotients of differences at the end and at the start."""
        length = self.length
        if self.friction:
            # R^2 = k d_x^2 + d_w^2 grows with R' <= q |d v_c|, gamma |d v_c|' <= q R.
            rate, root = (self._spring + self._damping**2).sqrt(), self.gamma.sqrt()
            slips = (rate * length / root).sinh() / root * self._spring.sqrt()
            place, speed = self._moved(slips)
            slip = arb(0)
        else:
            # R' <= beta g |d_x|, in the motion's and in the nominal rates.
            pushed = self._beta * length * (self._share * self._beta * length).exp()
            speed = self._share * pushed
            place = length * speed
            slip = (length * (self._spring * place + self._damping * speed) + pushed) / self.gamma
        rows = ((X, place), (V, speed), *(() if self.field.stick else ((C, slip),)))
        boxes = ((i, j, symmetric(one.abs_upper())) for i, one in rows for j in (X, V))
        return three(self.field.flow(length)) + matrix(3, 3, boxes)


def _along(line: Line, length: float) -> list[list[tuple[Matrix, Ball]]]:
    """Each guard on each piece, in Bernstein's basis, from the state at the start of the window.

    With it a bound on neglected terms, for states of size 1.
    """
    kept = _kept.setdefault(line, {})
    if length not in kept:
        flow = unit(SIZE)
        kept[length] = [[] for _ in range(line.guards)]
        for _ in range(PIECES):
            for guard, along in enumerate(kept[length]):
                along.append(line.polynomial(guard, 0, flow, length))
            flow = line.step(length) * flow
    return kept[length]
