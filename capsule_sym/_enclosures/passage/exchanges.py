"""States at a switch: each motion at its own time, and all of them at one time in the next field.

A bundle is a matrix of balls as in `segments`. A motion that switches a time d after the others'
time h is e^(A d) y there, with y its state at h. It continues in the next field, as the motion with
rates B, that is e^(-B d) e^(A d) y at h.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import NamedTuple

from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    arb,
    bits,
    matrix,
    precision,
    symmetric,
    unit,
    upper,
)
from capsule_sym._enclosures.numbers.fields import SIZE, C, Field
from capsule_sym._map.expansion import Guard

TIME, ROWS = SIZE, SIZE + 1
_SLOPE_BITS = 80  # of slopes along a reach, which multiply what is small already


class MovedSwitch(NamedTuple):
    """Bundle `moved` after a time h, and the time d from then to the switch of each motion.

    It is `late` (1, s, e) up to `missed`, and within the ball d.
    """

    h: Ball
    moved: Matrix
    late: Matrix
    missed: Ball
    d: Ball


def shifted(field: Field, moved: Matrix, late: Matrix, missed: Ball, d: Ball) -> Matrix:
    """States a time d later: d is `late` (1, s, e) with an error `missed`, and in the ball `d`.

    y(d) = y + A y_0 d + A (y - y_0) d + A^2 e^(A d') y d^2/2, with y_0 the middle.
    """
    states = extended(moved)
    whole, middle = hull(states), states * chosen(states.ncols())
    rates = [*(x for (x,) in (field.A * middle).tolist()), arb(1)]
    rest = field.A * (whole - middle) * d
    bent = field.A * (around(field, upper(d)) * whole)
    rest += field.A * bent * (d * d / 2)
    lost = {i: x for i, (x,) in enumerate(rest.tolist())}
    if moved.nrows() > ROWS:
        rates.append(middle[C, 0])
        lost[ROWS] = (whole - middle)[C, 0] * d + bent[C, 0] * (d * d / 2)
    return _added(moved, rates, late, missed, lost)


def _added(
    moved: Matrix, rates: Sequence[Ball], late: Matrix, missed: Ball, lost: Mapping[int, Ball]
) -> Matrix:
    """A bundle with rates times a time (1, s, e), its error, and a box of other errors."""
    rows = (moved + matrix(len(rates), 1, ((i, 0, x) for i, x in enumerate(rates))) * late).tolist()
    error = arb(missed.abs_upper())
    for i, row in enumerate(rows):
        box = (arb(x.abs_upper()) if k == i else arb(0) for k, x in lost.items())
        row += [rates[i] * error, *box]
    return arb_mat(rows)


def exchanged(
    before: Field,
    following: Field,
    guard: Guard,
    moved: Matrix,
    late: Matrix,
    missed: Ball,
    d: Ball,
) -> Matrix:
    """States at one time, from which the next field leads to each state at its own switch.

    With A and B the rates before and after it, and D = A - B, this is e^(-B d) e^(A d) y. It is
    y + D y d + e^(-B u) (D A - B D) e^(A u) y d^2/2 for a time u between 0 and d. Where the rates
    agree at the switch, D e^(A d) y = 0, and it is y up to e^(-B u) D A e^(A w) y d^2/2.
    """
    states = extended(moved)
    whole, middle = hull(states), states * chosen(states.ncols())
    change, reach = before.A - following.A, upper(d)
    rates, rest, bent = [arb(0)] * SIZE, matrix(SIZE, 1), change * before.A
    if guard is Guard.DRIFT:
        rates = [x for (x,) in (change * middle).tolist()]
        rest = change * (whole - middle) * d
        bent -= following.A * change
    bent = bent * (around(before, reach) * whole)
    rest += around(following, reach) * bent * symmetric((d * d / 2).abs_upper())
    lost = {i: x for i, (x,) in enumerate(rest.tolist())}
    found = _added(moved, [*rates, arb(0)], late, missed, lost)
    return rested(found) if following.stick else found


def rested(states: Matrix) -> Matrix:
    """Put in that the capsule is at rest."""
    for j in range(states.ncols()):
        states[C, j] = arb(0)
    return states


def around(field: Field, reach: float) -> Matrix:
    """Flow over all times up to a reach forwards and backwards."""
    with precision(min(bits(), _SLOPE_BITS)):
        return field.flow(symmetric(reach))


def extended(moved: Matrix) -> Matrix:
    """The rows of the extended state."""
    return _head(moved.nrows()) * moved


@cache
def _head(rows: int) -> Matrix:
    return unit(SIZE, rows)


@cache
def ranges(count: int) -> Matrix:
    """Range of (1, s, e), as a column."""
    return arb_mat([[symmetric(1) if j else arb(1)] for j in range(count)])


@cache
def chosen(count: int) -> Matrix:
    """Column that selects the middle of a bundle."""
    return arb_mat([[arb(0 if j else 1)] for j in range(count)])


def hull(states: Matrix) -> Matrix:
    """The column of balls that holds all states of a bundle."""
    return states * ranges(states.ncols())
