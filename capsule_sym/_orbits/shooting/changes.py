"""How a word changes where one of its inequalities fails: a leg of duration 0 comes or goes.

Close to a tangency, a landing on the edge of stick, or a corner, the flow leaves no choice: the leg
that comes in is given by the guard that fails, and the word that holds it contains the event as
the orbit on which that leg has the duration 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import LANDING, MINIMUM, Inequality
from capsule_sym._orbits.shooting.equations import Shot, Vector
from capsule_sym._orbits.shooting.word import Word, contact, drift


class Change(NamedTuple):
    """Another word for the same orbit, its unknowns, and where the legs have gone.

    `kept` gives for every leg of the word before its index in `word`; None if it is no leg of
    its own any more.
    """

    word: Word
    z: Vector
    kept: tuple[int | None, ...]


def around(word: Word, leg: int) -> tuple[int, int, int]:
    """Fields of the legs before, at and after an index."""
    return word.neighbour(leg - 1), word.fields[leg], word.neighbour(leg + 1)


def _field(in_contact: int, drifting: int) -> int:
    """The number of the field with this contact (0, 1) and drift (1, 0, -1)."""
    return 2 - drifting + 3 * in_contact


def inserted(
    numbers: Backend, word: Word, z: Vector, shot: Shot, failed: Inequality
) -> tuple[Change, int]:
    """The word with the leg that comes in where a MINIMUM or LANDING is 0, and that leg.

    `z` may be an estimate; `shot` is near it. Raises InvalidInput where the fields are no word.
    """
    fields, i, zero = word.fields, failed.leg, numbers.number(0)
    f, following = fields[i], word.neighbour(i + 1)
    if failed.kind == LANDING:
        comes = _field(contact(f), 0 if drift(following) else -drift(f))
        longer = _word((*fields[: i + 1], comes, *fields[i + 1 :]), word)
        kept = tuple(k + (k > i) for k in range(len(word)))
        return Change(longer, np.array([*z[: 5 + i], zero, *z[5 + i :]]), kept), i + 1
    comes = _comes(f, failed.guard)
    if word.legs[0].guard is None:
        x_r, v_r = _inside(numbers, shot, 0, failed.time)
        angle = shot.spans[0].angle + shot.spans[0].c.omega * failed.time
        start = np.array([x_r, v_r, z[2], angle, zero, z[4]])
        return Change(_word((comes, f), word), start, (1,)), 0
    longer = _word((*fields[:i], f, comes, f, *fields[i + 1 :]), word)
    rest = z[4 + i] - failed.time
    durations = [*z[4 : 4 + i], failed.time, zero, rest, *z[5 + i :]]
    kept = tuple(k + 2 * (k > i) for k in range(len(word)))
    return Change(longer, np.array([*z[:4], *durations]), kept), i + 1


def _comes(field: int, guard: Guard | None) -> int:
    """The field that a leg of F`field` touches where this guard has a minimum of 0."""
    if guard is Guard.GAP:
        return _field(1 - contact(field), drift(field))
    if guard is Guard.DRIFT:
        return _field(contact(field), 0)
    return _field(contact(field), 1 if guard is Guard.UPPER else -1)


def exchanged(word: Word, z: Vector, leg: int) -> Change | None:
    """The word in which contact and drift change in the other order about a leg of duration 0.

    None unless both change there.
    """
    before, during, after = around(word, leg)
    if contact(before) == contact(after) or drift(before) == drift(after):
        return None
    gap_first = contact(during) != contact(before)
    first, second = (before, after) if gap_first else (after, before)
    comes = _field(contact(first), drift(second))
    fields = word.fields
    other = _word((*fields[:leg], comes, *fields[leg + 1 :]), word)
    return Change(other, z, tuple(range(len(word))))


def shortened(
    numbers: Backend, word: Word, z: Vector, shot: Shot, leg: int
) -> tuple[Change, Inequality]:
    """The word without a leg of duration 0, and the inequality that is 0 on this orbit.

    Raises InvalidInput where what is left is no word.
    """
    n, (before, _, after) = len(word), around(word, leg)
    merged = before == after
    if n == 2 and merged:
        return _alone(numbers, word, shot, leg)
    turned = rotated(word, z, shot, leg - 1)
    fields, z = turned.word.fields, turned.z
    gone = 2 if merged else 1
    if merged:
        durations = [z[4] + z[5] + z[6], *z[7:]]
        kind, guard = MINIMUM, turned.word.legs[0].guard
    else:
        durations = [z[4], *z[6:]]
        kind, guard = LANDING, None
    places = [None, None, None, *range(1, n - 2)] if merged else [0, None, *range(1, n - 1)]
    kept = tuple(places[k] for k in turned.kept if k is not None)
    shorter = _word((fields[0], *fields[1 + gone :]), word)
    inequality = Inequality(kind, 0, guard, numbers.number(0), z[4])
    return Change(shorter, np.array([*z[:4], *durations]), kept), inequality


def _alone(numbers: Backend, word: Word, shot: Shot, leg: int) -> tuple[Change, Inequality]:
    """The word of the one other leg, begun at the forcing angle 0."""
    span, guard = shot.spans[1 - leg], word.legs[1 - leg].guard
    _, angle = numbers.turns(span.angle % numbers.full_turn)
    wait = (numbers.full_turn - angle) / span.c.omega
    x_r, v_r = _inside(numbers, shot, 1 - leg, wait)
    zero = numbers.number(0)
    alone = _word((span.leg.field,), word)
    change = Change(alone, np.array([x_r, v_r, zero, zero, span.h]), (None, None))
    # Of what touches the guard before and after, the word has the part from the angle 0 on.
    turns = math.floor((span.h - wait) / span.h)
    if word.mirrored and turns % 2:
        guard = word.legs[1 - leg].image.guard
    return change, Inequality(MINIMUM, 0, guard, zero, span.h - wait - turns * span.h)


def rotated(word: Word, z: Vector, shot: Shot, leg: int) -> Change:
    """The same orbit begun at another leg."""
    n = len(word)
    leg %= n
    span = shot.spans[leg]
    start = np.array([*span.start, span.angle, *z[4 + leg :], *z[4 : 4 + leg]])
    return Change(word.rotated(leg), start, tuple((k - leg) % n for k in range(n)))


def _inside(numbers: Backend, shot: Shot, leg: int, h: Number) -> tuple[Number, Number]:
    """x_r and v_r at a duration h after a leg's start."""
    span = shot.spans[leg]
    values = numbers.kernels.flow(span.c, span.closed, h)
    return span.closed.x_r + numbers.number(values[0]), numbers.number(values[1])


def _word(fields: tuple[int, ...], like: Word) -> Word:
    return Word.of(fields, like.multiple, like.mirrored)
