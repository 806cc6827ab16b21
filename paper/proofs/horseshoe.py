"""Horseshoe: parallelograms that one excitation period stretches over each other, proved.

The map takes (x_r, v_r) at the begin of a period to those at the next one; the capsule is at rest
at both. A parallelogram is centre + u unstable + s stable with u, s in [-1, 1]. It covers another
one if, in the coordinates (u, s) of the other, its image has no point with |u| <= 1 <= |s|, and its
edges u = -1 and u = 1 are mapped to opposite sides, u < -1 and u > 1 (Zgliczynski and Gidea,
Covering relations for multidimensional dynamical systems, J. Differ. Equ. 202, 2004). Every path
of coverings is then the path of a motion, and every closed one that of a periodic motion.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from capsule_sym._enclosures.interface import (
    Leg,
    Matrix,
    Unproved,
    arb,
    at_rest,
    ball,
    matrix,
    precision,
    symmetric,
    thin,
    unit,
)
from capsule_sym._orbits.interface import guard_between
from paper.proofs.segments import Interval, Passage

_BITS = 80
_DEEPEST = 16  # halvings of a set
_WHOLE, _LEFT, _RIGHT = ((Fraction(a), Fraction(b)) for a, b in ((-1, 1), (-1, -1), (1, 1)))
Part: TypeAlias = tuple[tuple[Fraction, Fraction], tuple[Fraction, Fraction]]
_FILE = Path(__file__).with_name("horseshoe.json")


@dataclass(frozen=True)
class Horseshoe:
    """Proved coverings, as (from, to) of the sets, and a lower bound of the topological entropy.

    `entropy` is that of the map of one excitation period.
    """

    coverings: tuple[tuple[int, int], ...]
    entropy: float
    parts: int


@cache
def kept() -> dict[str, Any]:
    """The certificate of the horseshoe: parameters, sets, itineraries, and coverings."""
    found: dict[str, Any] = json.loads(_FILE.read_text(encoding="utf-8"))
    return found


def prove_horseshoe(given: Mapping[str, Any], sources: Sequence[int] | None = None) -> Horseshoe:
    """Prove every covering of a certificate, or those of some sets; raises Unproved.

    The entropy is that of all coverings, and proved once all of these are.
    """
    with precision(_BITS):
        sets = [_Set(one) for one in given["sets"]]
        _prove_disjoint(sets)
        period = _Period({name: ball(text) for name, text in given["parameters"].items()})
        sides = {(row["from"], row["to"]): row["side"] for row in given["coverings"]}
        if not {*sides.values()} <= {-1, 1}:
            raise Unproved("covering", "a side is neither -1 nor 1")
        parts = 0
        for number, one in enumerate(sets):
            if sources is not None and number not in sources:
                continue
            targets = [(sets[to], side) for (source, to), side in sides.items() if source == number]
            for u in (_WHOLE, _LEFT, _RIGHT) if targets else ():
                parts += _prove_part(period, one, (u, _WHOLE), targets)
        proved = (pair for pair in sides if sources is None or pair[0] in sources)
        return Horseshoe(tuple(proved), _entropy(tuple(sides), given["weights"]), parts)


class _Set:
    """A parallelogram, and the segments of a motion from its centre over one period."""

    def __init__(self, given: Mapping[str, Any]) -> None:
        columns = [given[name] for name in ("centre", "unstable", "stable")]
        self.columns = [[ball(text) for text in column] for column in columns]
        self.fields = given["fields"]
        self.durations = [float(text) for text in given["durations"]]
        u, s = self.columns[1:]
        self.lengths = [Fraction(math.hypot(*map(float, column))) for column in (u, s)]
        determinant = u[0] * s[1] - u[1] * s[0]
        if not abs(determinant) > 0:
            raise Unproved("covering", "a set has no area")
        self._inverse = matrix(2, 2, ((0, 0, s[1]), (0, 1, -s[0]), (1, 0, -u[1]), (1, 1, u[0])))
        self._inverse /= determinant

    def coordinates(self, states: Matrix) -> Matrix:
        """Coordinates (u, s) of states, middle and directions (2, n)."""
        centre = matrix(2, states.ncols(), ((i, 0, x) for i, x in enumerate(self.columns[0])))
        return self._inverse * (states - centre)

    def part(self, sides: Part) -> Matrix:
        """The states (3, 4) with u and s in intervals: middle, alpha's direction, and two more."""
        x, *directions = self.columns
        columns = [x, [arb(0), arb(0)]]
        for (low, high), way in zip(sides, directions, strict=True):
            columns[0] = [
                a + ball((low + high) / 2) * b for a, b in zip(columns[0], way, strict=True)
            ]
            columns.append([ball((high - low) / 2) * b for b in way])
        return matrix(3, 4, ((i, j, y) for j, one in enumerate(columns) for i, y in enumerate(one)))

    def apart(self, other: _Set) -> bool:
        """True if one of this set's directions is proved to separate it from another one."""
        whole = unit(2, 3) * other.part((_WHOLE, _WHOLE))
        return any(abs(_range(row)) > 1 for row in self.coordinates(whole).tolist())


class _Period:
    """The map of one excitation period, from phase 0, with the capsule at rest."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._passage = Passage(values, Interval(values["alpha"]))
        self._turn = 2 * arb.pi() / values["omega"]

    def image(self, one: _Set, part: Part) -> Matrix:
        """Image of a part of a set: middle and directions (2, n); raises Unproved."""
        if not (at_rest(one.fields[0]) and at_rest(one.fields[-1])):
            raise Unproved("covering", "the capsule is not at rest where a period begins and ends")
        start = self._passage.section(one.part(part), arb(0))
        after = zip(one.fields, one.fields[1:], one.durations, strict=False)
        steps = [Leg(field, h, guard_between(field, then)) for field, then, h in after]
        rest = float(self._turn) - sum(one.durations)
        steps.append(Leg(one.fields[-1], rest, None))
        ended = self._passage.moved(start, steps, self._turn, arb(0))
        return thin(ended[:2])


def _range(row: Sequence[Any]) -> Any:
    """Ball of a coordinate: its middle, and directions with factors in [-1, 1]."""
    return row[0] + symmetric(sum((abs(x) for x in row[1:]), arb(0)).upper())


def _prove_disjoint(sets: Sequence[_Set]) -> None:
    """Prove that no two sets have a point in common: a path then has one motion's symbols only."""
    for k, one in enumerate(sets):
        for other in sets[:k]:
            if not (one.apart(other) or other.apart(one)):
                raise Unproved("covering", "two sets are not proved disjoint")


def _prove_part(
    period: _Period, one: _Set, part: Part, targets: Sequence[tuple[_Set, int]], depth: int = 0
) -> int:
    """Prove what coverings require of the image of a part, or of its halves; return how many."""
    try:
        image = period.image(one, part)
        for target, side in targets:
            _prove_image(image, part, target, side)
    except Unproved:
        if depth == _DEEPEST:
            raise
        halves = _halved(one, part)
        return sum(_prove_part(period, one, half, targets, depth + 1) for half in halves)
    return 1


def _halved(one: _Set, part: Part) -> tuple[Part, Part]:
    """Halves of a part, across its longer direction."""
    (u, s), (along, across) = part, one.lengths
    if (u[1] - u[0]) * along > (s[1] - s[0]) * across:
        middle = (u[0] + u[1]) / 2
        return ((u[0], middle), s), ((middle, u[1]), s)
    middle = (s[0] + s[1]) / 2
    return (u, (s[0], middle)), (u, (middle, s[1]))


def _prove_image(image: Matrix, part: Part, target: _Set, side: int) -> None:
    """Prove what a covering requires of the image of a part, and more if the part is of an edge."""
    u, s = (_range(row) for row in target.coordinates(image).tolist())
    (low, high), _ = part
    if low == high and not low.numerator * side * u > 1:
        raise Unproved("covering", "an edge is not mapped beyond the set that is covered")
    if not (abs(s) < 1 or abs(u) > 1):
        raise Unproved("covering", "an image leaves the set that is covered by its long edges")


def _entropy(coverings: Sequence[tuple[int, int]], weights: Sequence[int]) -> float:
    """Lower bound of the logarithm of the spectral radius of the matrix of coverings.

    It is at least the least quotient of A w and w, for weights w > 0 (Collatz and Wielandt).
    """
    if not min(weights) > 0:
        raise Unproved("entropy", "a weight is not positive")
    reached = [sum(weights[j] for i, j in coverings if i == k) for k in range(len(weights))]
    growth = min(Fraction(a, w) for a, w in zip(reached, weights, strict=True))
    return float(ball(growth).log().lower()) * (1 - 2.0**-50) if growth > 1 else 0.0
