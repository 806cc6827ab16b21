"""The first root of a function known only through its expansion: excluded, isolated, or open.

Everything is decided on polynomials that bound the function from below and above, by the signs of
their Bernstein coefficients: where all are positive on an interval, so is the polynomial. Nothing
is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import comb

from capsule_sym.map.backend import Number
from capsule_sym.map.expansion import Expansion, factorials

_DEPTH = 6  # an interval is halved this often before its end is left to a new expansion
_NARROW = 2.0**-20  # relative width of a bracket handed to Brent's method
_TINY = 1e-290


@dataclass(frozen=True)
class Search:
    """What is proved of a guard on an interval that begins where the expansion stands.

    The guard is positive on (0, `clear`). With a bracket (low, high) it has exactly one root
    there, is positive before and negative after; low is then `clear`.
    """

    clear: Number
    bracket: tuple[Number, Number] | None = None


@dataclass(frozen=True)
class _Bounds:
    """Coefficients of bounds from below and above, and of one from above on the derivative."""

    lower: list[Number]
    upper: list[Number]
    slope: list[Number]


def _bounds(e: Expansion, zeros: int, unit: Number) -> _Bounds:
    """Bounds on g(d)/d^zeros, where the first `zeros` derivatives of g vanish at the start."""
    n = len(e.values)
    inverse = [1 / _like(factorial, unit) for factorial in factorials(n + 1)]
    # The roundings made from here on (scaling, Bernstein form) are covered by a few units more.
    slack = 8 * n * unit
    value = [e.values[i] * inverse[i] for i in range(zeros, n)]
    error = [(e.errors[i] + slack * abs(e.values[i])) * inverse[i] for i in range(zeros, n)]
    rest, growth = e.rest * inverse[n] * (1 + slack), e.growth * inverse[n] * (1 + slack)
    lower = [a - b for a, b in zip(value, error, strict=True)] + [-rest, -growth]
    upper = [a + b for a, b in zip(value, error, strict=True)] + [rest, growth]
    # |(R/d^m)'| <= |R'|/d^m + m |R|/d^(m+1), with R' bounded like R by one power less.
    slope = [(i + 1) * upper[i + 1] for i in range(n - zeros - 1)]
    slope += [(n + zeros) * rest, (n + zeros) * growth]
    return _Bounds(lower, upper, slope)


def _like(value: int, unit: Number) -> Number:
    return type(unit)(value)


@lru_cache(maxsize=16)
def _binomials(degree: int) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(comb(j, i) for i in range(j + 1)) for j in range(degree + 1))


def _bernstein(coefficients: list[Number], width: Number) -> list[Number]:
    """Bernstein coefficients on [0, width] of a polynomial given by its powers."""
    degree = len(coefficients) - 1
    rows = _binomials(degree)
    scaled, power = [], width * 0 + 1
    for i, a in enumerate(coefficients):
        scaled.append(a * power / rows[degree][i])
        power = power * width
    return [sum(c * s for c, s in zip(row, scaled, strict=False)) for row in rows]


def _halves(b: list[Number]) -> tuple[list[Number], list[Number]]:
    """Bernstein coefficients on the two halves of the interval (de Casteljau)."""
    left, right = [b[0]], [b[-1]]
    while len(b) > 1:
        b = [(p + q) / 2 for p, q in pairwise(b)]
        left.append(b[0])
        right.append(b[-1])
    return left, right[::-1]


def search(expansion: Expansion, zeros: int, reach: Number, unit: Number) -> Search:
    """What the expansion proves about the first root in (0, reach].

    `zeros` derivatives of the guard, from the guard itself on, vanish at the start; that root is
    divided out.
    """
    bounds = _bounds(expansion, zeros, unit)
    forms = [_bernstein(p, reach) for p in (bounds.lower, bounds.upper, bounds.slope)]
    zero = reach * 0
    pending = [(forms, zero, reach, 0)]
    while pending:
        (lower, upper, slope), start, end, depth = pending.pop()
        if min(lower) > _doubt(lower, unit):
            continue
        if max(slope) < -_doubt(slope, unit) and upper[-1] < -_doubt(upper, unit):
            return _narrowed(bounds, start, end)
        if depth == _DEPTH:
            return Search(start)
        middle = (start + end) / 2
        parts = [_halves(form) for form in (lower, upper, slope)]
        pending.append(([part[1] for part in parts], middle, end, depth + 1))
        pending.append(([part[0] for part in parts], start, middle, depth + 1))
    return Search(reach)


def _doubt(form: list[Number], unit: Number) -> Number:
    """Bound on the rounding errors of Bernstein coefficients, the few subdivisions included."""
    return 16 * unit * max(max(form), -min(form))


def _value(coefficients: list[Number], d: Number) -> Number:
    total = d * 0
    for a in reversed(coefficients):
        total = total * d + a
    return total


def _narrowed(bounds: _Bounds, start: Number, end: Number) -> Search:
    """The same bracket as small as the bounds allow; the guard decreases all over it."""
    low, _ = _bisect(bounds.lower, start, end)
    _, high = _bisect(bounds.upper, low, end)
    return Search(low, (low, high))


def _bisect(coefficients: list[Number], low: Number, high: Number) -> tuple[Number, Number]:
    """Ends of a small interval at which a polynomial is positive (or the start) and negative."""
    while high - low > high * _NARROW:
        middle = (low + high) / 2
        if _value(coefficients, middle) > 0:
            low = middle
        else:
            high = middle
        if high < _TINY:
            break
    return low, high


def positive_at(expansion: Expansion, d: Number, unit: Number) -> bool:
    """Whether the guard is certainly positive a duration d after the expansion's instant."""
    return bool(_value(_bounds(expansion, 0, unit).lower, d) > 0)
