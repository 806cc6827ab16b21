"""First root of a function known by its expansion: excluded, isolated, or undecided.

All decisions use polynomials that bound the function from below and above, and the signs of their
Bernstein coefficients: if all are positive on an interval, so is the polynomial. Nothing is
sampled.

The polynomials are doubles in every number system of the expansion. More digits would not help:
where rounding hides a sign beside larger coefficients, a shorter interval shows it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import Any

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Number
from capsule_sym._map.expansion import Expansion, factorials

_DEPTH = 6  # halvings of an interval before its end needs a new expansion
_NARROW = 2.0**-20  # relative width of a bracket
_TINY = 1e-290
# Roundings counted for an expansion with more digits: far more than its conversion makes, so that
# its signs do not rest on an exact count.
_COARSE = 2.0**-40
_SMALL = 1e-250  # below this, underflow might count
_ROOM = 1e-100  # below this, coefficients of more digits are scaled up


@dataclass(frozen=True)
class Search:
    """Result for a guard on an interval that begins at the expansion's instant.

    The guard is positive on (0, `clear`). With a bracket (low, high) it has exactly one root there,
    positive before and negative after; low is then `clear`.
    """

    clear: Number
    bracket: tuple[float, float] | None = None


@dataclass(frozen=True)
class _Bounds:
    """Coefficients of lower and upper bounds, and of an upper bound of the derivative."""

    lower: list[float]
    upper: list[float]
    slope: list[float]
    unit: float


def _bounds(e: Expansion, zeros: int, unit: Number) -> _Bounds:
    """Bounds on g(d)/d^zeros, where the first `zeros` derivatives of g vanish at the start."""
    if not isinstance(unit, float):
        unit, e = _COARSE, _enlarged(e)
    n = len(e.values)
    inverse = [1 / factorial for factorial in factorials(n + 1)]
    # Roundings made from here on (scaling, Bernstein form) are covered by a few more units.
    slack = 8 * n * unit
    value = [float(e.values[i]) * inverse[i] for i in range(zeros, n)]
    error = [
        float(e.errors[i]) * (1 + slack) * inverse[i] + slack * abs(a)
        for i, a in enumerate(value, zeros)
    ]
    rest, growth = (float(size) * inverse[n] * (1 + slack) for size in (e.rest, e.growth))
    lower = [a - b for a, b in zip(value, error, strict=True)] + [-rest, -growth]
    upper = [a + b for a, b in zip(value, error, strict=True)] + [rest, growth]
    # |(R/d^m)'| <= |R'|/d^m + m |R|/d^(m+1), with R' bounded like R by one power less.
    slope = [(i + 1) * upper[i + 1] for i in range(n - zeros - 1)]
    slope += [(n + zeros) * rest, (n + zeros) * growth]
    return _Bounds(lower, upper, slope, unit)


def _enlarged(e: Expansion) -> Expansion:
    """Expansion of more digits times a power of two, such that doubles can hold it."""
    largest = max(*map(abs, e.values), e.rest, e.growth)
    scale = largest * 0 + 1
    while 0 < largest * scale < _ROOM:
        scale = scale * 2**512
    if scale == 1:
        return e
    values, errors = ([scale * one for one in many] for many in (e.values, e.errors))
    return Expansion(values, errors, scale * e.rest, scale * e.growth)


@lru_cache(maxsize=16)
def _matrices(size: int) -> tuple[Any, Any, Any, Any]:
    """Matrices from power to Bernstein coefficients, and from these to those of both halves."""
    pascal = np.array([[comb(j, i) for j in range(size)] for i in range(size)], dtype=float)
    left = pascal / 2.0 ** np.arange(size)
    return pascal[:, -1], pascal, left, left[::-1, ::-1]


@np.errstate(under="ignore")
def search(expansion: Expansion, zeros: int, reach: Number, unit: Number) -> Search:
    """Result of the expansion for the first root in (0, reach].

    `zeros` derivatives of the guard, starting with the guard itself, vanish at the start; that root
    is divided out.
    """
    bounds, end = _bounds(expansion, zeros, unit), float(reach)
    if end < reach:
        end = math.nextafter(end, math.inf)
    binomials, pascal, to_left, to_right = _matrices(len(bounds.lower))
    scaled = np.array([bounds.lower, bounds.upper, [*bounds.slope, 0.0]])
    scaled *= end ** np.arange(len(binomials))
    if not _SMALL < np.abs(scaled).max() < math.inf:
        return Search(reach * 0)
    pending = [((scaled / binomials) @ pascal, 0.0, end, 0)]
    while pending:
        forms, start, end, depth = pending.pop()
        low, high = forms.min(axis=1), forms.max(axis=1)
        # Rounding errors of Bernstein coefficients, including the few subdivisions.
        doubt = 16 * bounds.unit * np.maximum(high, -low)
        if low[0] > doubt[0]:
            continue
        if forms[1, -1] < -doubt[1] and high[2] < -doubt[2]:
            # The smallest bracket that the bounds allow; the guard decreases on all of it.
            low_end, _ = _bisect(bounds.lower, start, end)
            bracket = low_end, _bisect(bounds.upper, low_end, end)[1]
            # With more digits than a double the root may be just past the reach.
            return Search(reach * 0 + bracket[0], bracket if bracket[1] <= reach else None)
        if depth == _DEPTH:
            return Search(reach * 0 + start)
        middle = (start + end) / 2
        pending.append((forms @ to_right, middle, end, depth + 1))
        pending.append((forms @ to_left, start, middle, depth + 1))
    return Search(reach)


def positive_at(expansion: Expansion, d: Number, unit: Number) -> bool:
    """True if the guard is certainly positive a duration d after the expansion's instant."""
    return bool(_value(_bounds(expansion, 0, unit).lower, float(d)) > 0)


def _value(coefficients: list[Number], d: Number) -> Number:
    total = d * 0
    for a in reversed(coefficients):
        total = total * d + a
    return total


def _bisect(coefficients: list[float], low: float, high: float) -> tuple[float, float]:
    """Ends of a short interval at which a polynomial is positive (or the start) and negative."""
    while high - low > high * _NARROW:
        middle = (low + high) / 2
        if _value(coefficients, middle) > 0:
            low = middle
        else:
            high = middle
        if high < _TINY:
            break
    return low, high


def polish(
    about: Callable[[Number], Expansion], bracket: tuple[Number, Number], unit: Number
) -> Number:
    """Root in a bracket that holds exactly one, from the function's expansions within it.

    The expansion is repeated at its root until its error, apart from that of the value itself, is
    below rounding; this close to the root, once or twice is enough. The function decreases.
    """
    low, high = bracket
    h, last = (low + high) / 2, 4 * (high - low)
    while True:
        e = about(h)
        step = _descending_root(e.values, low - h, high - h, unit * h, unit)
        h, size = h + step, abs(step)
        inverse = factorials(len(e.errors) + 1)
        terms = [*e.errors[1:], e.rest + e.growth * size]
        added = sum(a * size**i / inverse[i] for i, a in enumerate(terms, 1))
        # Near a tangency the slope there is far below the slope at the previous step.
        slope = sum(a * step**i / inverse[i] for i, a in enumerate(e.values[1:]))
        if added <= unit * h * abs(slope) or 2 * size > last or h in bracket:
            return h
        last = size


def _descending_root(
    derivatives: list[Number], low: Number, high: Number, tolerance: Number, unit: Number
) -> Number:
    """Root of a polynomial, given by its derivatives at 0, that decreases from low to high.

    Uses Brent's method; returns an end of the bracket if the polynomial does not change sign.
    """
    inverse = factorials(len(derivatives))
    values = [a / b for a, b in zip(derivatives, inverse, strict=True)]

    def polynomial(d: Number) -> Number:
        return _value(values, d)

    if polynomial(low) <= 0:
        return low
    if polynomial(high) >= 0:
        return high
    # In a bracket from 0 the root may be as far from its middle as that is from 0. The least step
    # at 4 units changes every number.
    least = _TINY if isinstance(low + high, float) else 0
    return brent(polynomial, low, high, max(tolerance / 16, least), 4 * unit)


def brent(
    f: Callable[[Number], Number],
    a: Number,
    b: Number,
    absolute: Number,
    relative: float = 0.0,
) -> Number:
    """Root of f between a and b, where it changes sign, as in SciPy's `brentq`.

    Its error is at most twice the sum of the absolute tolerance and the relative one times the
    root. Inverse quadratic interpolation, the secant, or bisection where these gain too little (R.
    P. Brent, Algorithms for Minimization Without Derivatives, 1973, chapter 4), in any number
    system. Raises InvalidInput if an end, or the value of f there, is not a number.

    The caller ensures that the signs differ and that f(a) is not 0, which is not checked: otherwise
    the result may be no root.
    """
    before, here = a, b
    f_before, f_here = f(before), f(here)
    for name, value in (("a", a), ("b", b), ("f(a)", f_before), ("f(b)", f_here)):
        if value != value:
            raise InvalidInput(name, value, "a number")
    kept, f_kept = before, f_before
    step = last = here - before
    while f_here != 0:
        if (f_before < 0) != (f_here < 0):  # a product may underflow
            kept, f_kept = before, f_before
            step = last = here - before
        if abs(f_kept) < abs(f_here):
            before, here, kept = here, kept, here
            f_before, f_here, f_kept = f_here, f_kept, f_here
        middle, tolerance = (kept - here) / 2, absolute + relative * abs(here)
        if abs(middle) < tolerance:
            break
        if abs(last) > tolerance and abs(f_here) < abs(f_before):
            if before == kept:
                trial = -f_here * (here - before) / (f_here - f_before)
            else:
                to_before = (f_before - f_here) / (before - here)
                to_kept = (f_kept - f_here) / (kept - here)
                share = to_kept * to_before * (f_kept - f_before)
                trial = -f_here * (f_kept * to_kept - f_before * to_before)
                # If the quotient underflows, the bracket is halved.
                trial = trial / share if share else kept - here
            gained = 2 * abs(trial) < min(abs(last), 3 * abs(middle) - tolerance)
            last, step = (step, trial) if gained else (middle, middle)
        else:
            last = step = middle
        before, f_before = here, f_here
        here += step if abs(step) > tolerance else (tolerance if middle > 0 else -tolerance)
        f_here = f(here)
    return here
