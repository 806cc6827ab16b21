"""Where gap and force turn round along a leg: all their extrema inside it.

Their rates are entire functions of time. On panels short beside their exponential type they are
interpolated at Chebyshev nodes with an error below rounding, and the interpolants' real roots are
all the extrema.
"""

from __future__ import annotations

import math
from enum import Enum
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from capsule_sym.map.backend import Number, backend
from capsule_sym.orbits.closed import ClosedForms
from capsule_sym.orbits.equations import Span

_NODES = 21
_REACH = 4.0  # longest panel, over the leg's fastest rate: the interpolant's error is below 1e-18
_ROUNDING = 1e-14  # of the interpolant's coefficients, beside the largest
_SLACK = 1e-9  # how far beyond its panel, or off the real line, rounding may put a root
_STEPS = 4  # of Newton's method, from double precision to 50 digits


class Quantity(Enum):
    """What turns round."""

    GAP = "gap"  # x_r - delta
    FORCE = "force"  # the interaction force P


class Turn(NamedTuple):
    """An extremum inside a leg: the time since the leg's start, and the value there.

    `kind` is +1 at a minimum and -1 at a maximum.
    """

    kind: int
    time: Number
    value: Number


def turns(forms: ClosedForms, span: Span, quantity: Quantity) -> list[Turn]:
    """The extrema of a quantity inside a leg, in the order of time."""
    with backend("numpy") as numbers:
        exact = forms.numbers.name == "mpmath"
        rounded = ClosedForms(numbers, [float(v) for v in forms.values]) if exact else forms
        times = _Leg(rounded, span).roots(quantity)
    return [_turn(forms, span, quantity, time) for time in times]


class _Leg:
    """A leg in double precision."""

    def __init__(self, forms: ClosedForms, span: Span) -> None:
        self.forms, self.field, self.c = forms, span.leg.field, forms.constants(span.leg.field)
        self.closed = forms.numbers.kernels.Start(*map(float, span.closed))
        self.angle, self.h = float(span.angle), float(span.h)

    def roots(self, quantity: Quantity) -> list[float]:
        """The times inside the leg at which the quantity's rate vanishes."""
        nodes, transform = _chebyshev()
        panels = math.ceil(self.c.rate * abs(self.h) / _REACH)
        width = self.h / panels
        found: list[float] = []
        for panel in range(panels):
            rate = self.rate(quantity, (panel + (1 + nodes) / 2) * width)
            for root in _roots(transform @ rate):
                time = (panel + (1 + root) / 2) * width
                if 0 < time < self.h and (not found or time - found[-1] > _SLACK * width):
                    found.append(time)
        return found

    def rate(self, quantity: Quantity, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """The quantity's rate at times after the start."""
        c, closed = self.c, self.closed
        runs = [self.forms.run(self.field, c, closed, time)[0] for time in times.tolist()]
        rows: NDArray[np.float64] = np.array([values[:2] for values in runs])
        position, v_r = rows[:, 0], rows[:, 1]
        if quantity is Quantity.GAP:
            return v_r
        spring = closed.x_r + position + c.kappa * (closed.gap + position)
        cosine = np.cos(self.angle + c.omega * times)
        acceleration = c.alpha * cosine - c.m * spring + c.push - 2 * c.sigma * v_r
        rate: NDArray[np.float64] = (1 + c.kappa) * v_r + 2 * c.zeta * acceleration
        return rate


@lru_cache(maxsize=1)
def _chebyshev() -> tuple[NDArray[Any], NDArray[Any]]:
    """Nodes on (-1, 1), ascending, and the matrix from values there to coefficients."""
    nodes = chebyshev.chebpts1(_NODES)
    return nodes, np.linalg.inv(chebyshev.chebvander(nodes, _NODES - 1))


def _roots(coefficients: NDArray[np.float64]) -> list[float]:
    """The real roots of a Chebyshev series on [-1, 1], ascending."""
    sizes = abs(coefficients)
    if sizes[0] > sizes[1:].sum():
        return []
    known = np.flatnonzero(sizes > _ROUNDING * sizes.max())
    roots = chebyshev.chebroots(coefficients[: known[-1] + 1])
    real = roots.real[(abs(roots.imag) < _SLACK) & (abs(roots.real) < 1 + _SLACK)]
    return sorted(real.tolist())


def _turn(forms: ClosedForms, span: Span, quantity: Quantity, time: float) -> Turn:
    """The extremum near a time, in the number system of the forms."""
    at: Any = forms.numbers.number(time)
    value, rate, curvature = _look(forms, span, quantity, at)
    for _ in range(_STEPS if forms.numbers.name == "mpmath" else 0):
        # A flat extremum is left where it was found.
        if abs(rate) < _SLACK * abs(curvature):
            at = at - rate / curvature
            value, rate, curvature = _look(forms, span, quantity, at)
    return Turn(1 if curvature > 0 else -1, at, value)


def _look(
    forms: ClosedForms, span: Span, quantity: Quantity, time: Number
) -> tuple[Number, Number, Number]:
    """A quantity and its first and second rate at a time after the leg's start."""
    numbers, c, closed = forms.numbers, span.c, span.closed
    position, v_r, *_ = forms.run(span.leg.field, c, closed, time)[0]
    gap, cos_sin = closed.gap + position, numbers.cos_sin(span.angle + c.omega * time)
    jet = numbers.kernels.jet(c, closed.x_r + position, gap, v_r, *cos_sin)
    force, rate, curvature = jet[numbers.kernels.JET_ORDER :][:3]
    if quantity is Quantity.GAP:
        return gap, v_r, jet[0]
    return force, rate, curvature
