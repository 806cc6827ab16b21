"""The closed-form flow of a segment in interval arithmetic, at rational parameters.

The flow is linear in the state with its forcing (`enclosure.EXTENDED`) and in 1. Its coefficients
are rational combinations of six functions of the duration h: exp(-sigma h) cos(nu h),
exp(-sigma h) sin(nu h)/nu, cos(omega h), sin(omega h), 1 and h. Those are enclosed in intervals
with outward rounding, so that every comparison that succeeds is a proof.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import Any, TypeAlias

import sympy as sp
from mpmath.ctx_iv import MPIntervalContext
from mpmath.libmp.libmpi import mpi_add, mpi_cos_sin, mpi_exp, mpi_mul

from capsule_sym.symbolic import basis, flow
from capsule_sym.symbolic.enclosure import EXTENDED, affine, extended_rates, quadrature
from capsule_sym.symbolic.model import Segment
from capsule_sym.symbolic.switching import guards
from capsule_sym.symbolic.symbols import alpha, force, h, omega, v_c, x_r

Interval: TypeAlias = Any
"""An interval of mpmath's; a comparison is true when it holds for all members."""
Vector: TypeAlias = Sequence[Interval]
"""A value for each of `EXTENDED`: x_r, v_r, v_c, alpha cos(omega tau), alpha sin(omega tau)."""
Row: TypeAlias = Sequence[tuple[int, Interval]]
"""The coefficients of a linear function that are not zero, with their places in a vector."""
Values: TypeAlias = Mapping[sp.Symbol, sp.Rational]

PRECISION = 768
"""Bits of every interval; a motion of 50 periods loses most of them."""
_CONTEXT = MPIntervalContext()
_CONTEXT.prec = PRECISION
ZERO, ONE = _CONTEXT.mpf(0), _CONTEXT.mpf(1)

_expcos, _expsin, _cosine, _sine = sp.symbols("expcos expsin cos sin", real=True)
_SHAPES = (_expcos, _expsin, _cosine, _sine, h)


def exact(value: Fraction | int) -> Interval:
    """The narrowest interval around a rational number."""
    value = Fraction(value)
    return _CONTEXT.mpf(value.numerator) / value.denominator


def hull(low: Interval, high: Interval) -> Interval:
    """The interval from the lower end of one to the upper end of another."""
    return _CONTEXT.mpf([low.a, high.b])


def meet(one: Interval, other: Interval) -> Interval:
    """The common part of two intervals that overlap."""
    return _CONTEXT.mpf([max(one.a, other.a), min(one.b, other.b)])


def middle(x: Interval) -> Fraction:
    """The middle of an interval, up to rounding, as a rational number."""
    sign, mantissa, exponent, _ = x.mid._mpi_[0]
    signed = -int(mantissa) if sign else int(mantissa)
    return Fraction(signed) * Fraction(2) ** int(exponent)


def period(values: Values) -> Interval:
    """One period of the excitation, 2 pi/omega."""
    return 2 * _CONTEXT.pi / exact(rational(values[omega]))


def upper(x: Interval) -> Fraction:
    """The upper end of an interval."""
    return middle(x.b)


def rational(value: sp.Rational) -> Fraction:
    """A number of SymPy's as a fraction."""
    return Fraction(int(value.p), int(value.q))


def _row(coefficients: Sequence[Fraction]) -> Row:
    return [(place, exact(value)) for place, value in enumerate(coefficients) if value]


@cache
def _slack(bits: int) -> Interval:
    """More than a function of mpmath's can be off after it has rounded it outwards."""
    return _CONTEXT.mpf([-1, 1]) / 2 ** (bits - 12)


def _sum_of_products(pairs: Iterable[tuple[Interval, Interval]]) -> Interval:
    total = ZERO._mpi_
    for one, other in pairs:  # the arithmetic of _CONTEXT without its conversions
        total = mpi_add(total, mpi_mul(one._mpi_, other._mpi_, PRECISION), PRECISION)
    return _CONTEXT.make_mpf(total)


def apply(row: Row, vector: Vector) -> Interval:
    """A linear function of a vector; of a vector with 1 at its end, an affine one."""
    length = len(vector)
    return _sum_of_products((value, vector[place]) for place, value in row if place < length)


def dot(first: Vector, second: Vector) -> Interval:
    """The sum of products of two vectors, as far as the shorter one goes."""
    return _sum_of_products(zip(first, second, strict=False))


def _composed(
    bound: Sequence[Fraction], shaped: Sequence[Sequence[Sequence[Fraction]]]
) -> list[Row]:
    """An affine function of the state after h, for each shape as a function of the start."""
    *slopes, constant = bound
    rows = [
        [
            sum((a * x for a, x in zip(slopes, column, strict=True)), Fraction(0))
            for column in zip(*ends, strict=True)
        ]
        for ends in zip(*shaped, strict=True)
    ]
    rows[-1][-1] += constant
    return [_row(row) for row in rows]


@cache
def _ends(stick: bool) -> tuple[sp.Expr, ...]:
    """`EXTENDED` after a duration h, in the six shapes."""
    derived = flow.derive()
    free = {basis.G: _expsin, basis.Gd: _expcos - basis.sigma * _expsin}
    step = {basis.H: basis.OSCILLATING[basis.H].subs(free)}
    wave = {basis.cosine: _cosine, basis.sine: _sine / omega}
    bend = {basis.versine: basis.RELATIONS[basis.versine].subs(wave)}
    given = {**free, **step, **wave, **bend}
    forced = {name: form.subs(given) for name, form in basis.detached().items()}
    start = {flow.spring: flow.SPRING, flow.margin: flow.MARGIN}
    forcing = {flow.cos_theta: force / alpha, flow.sin_theta: quadrature / alpha}
    norm = (basis.K - omega**2) ** 2 + 4 * basis.sigma**2 * omega**2
    ends = (x_r + derived.position, derived.velocity, v_c if stick else v_c + derived.drift_long)
    return (
        *(e.subs(start).subs({**forced, **given}).subs(forcing).subs(basis.Z2, norm) for e in ends),
        force * _cosine - quadrature * _sine,
        quadrature * _cosine + force * _sine,
    )


class Motion:
    """The flow of one field at rational parameters, with the functions that bound its cell.

    Raises ValueError where the field's relative motion does not oscillate.
    """

    def __init__(self, field: Segment, values: Values) -> None:
        constants = {name: form.subs(values) for name, form in flow.constants(field).items()}
        decay, stiffness = constants[basis.sigma], constants[basis.K]
        if not stiffness > decay**2:
            raise ValueError(f"{field.name} is overdamped at {values}")
        self._decay = exact(rational(decay))
        self._turn_squared = exact(rational(stiffness - decay**2))
        self._turn = _CONTEXT.sqrt(self._turn_squared)
        self._omega = exact(rational(values[omega]))
        ends = [sp.expand(end.subs(constants).subs(values)) for end in _ends(field.stick)]
        plain = dict.fromkeys(_SHAPES, sp.S.Zero)
        parts = [[*map(end.coeff, _SHAPES), end.xreplace(plain)] for end in ends]
        shaped = [[affine(part, values) for part in row] for row in parts]
        self._ends = [[_row(entry) for entry in zip(*row, strict=True)] for row in shaped]
        self._rates = [_row(affine(rate, values)) for rate in extended_rates(field)]
        bounds = [affine(guard, values) for guard in guards(field)]
        self.field = field
        self.guards = [_row(bound) for bound in bounds]
        self.force = _row(affine(field.interaction, values))
        self._guards_in_time = [_composed(bound, shaped) for bound in bounds]

    def weights(self, duration: Interval, bits: int = PRECISION) -> Vector:
        """The six shapes at a duration, computed with so many bits."""
        slack = _slack(bits)
        fade = _CONTEXT.make_mpf(mpi_exp((-self._decay * duration)._mpi_, bits)) * (1 + slack)
        turned = mpi_cos_sin((self._turn * duration)._mpi_, bits)
        forced = mpi_cos_sin((self._omega * duration)._mpi_, bits)
        turn, swing, cosine, sine = (_CONTEXT.make_mpf(x) + slack for x in (*turned, *forced))
        return (fade * turn, fade * swing / self._turn, cosine, sine, duration, ONE)

    def after(self, start: Vector, duration: Interval) -> Vector:
        """`EXTENDED` after a duration; a start with 1 at its end is a state, else a change."""
        weights = self.weights(duration)
        moved = [
            _sum_of_products(
                (apply(entry, weights), x) for entry, x in zip(row, start, strict=False) if entry
            )
            for row in self._ends
        ]
        return [*moved, *start[len(EXTENDED) :]]

    def guard_in_time(self, place: int, start: Vector, orders: int) -> list[Vector]:
        """A function that bounds the cell and its time derivatives, as factors of the shapes."""
        found: list[Vector] = [[apply(row, start) for row in self._guards_in_time[place]]]
        for _ in range(orders):
            damped, swung, cosine, sine, linear, _ = found[-1]
            found.append(
                [
                    swung - self._decay * damped,
                    -self._turn_squared * damped - self._decay * swung,
                    self._omega * sine,
                    -self._omega * cosine,
                    ZERO,
                    linear,
                ]
            )
        return found

    def rate(self, vector: Vector) -> Vector:
        """The time derivative of `EXTENDED`, or of one of its time derivatives or changes."""
        return [apply(row, vector) for row in self._rates]
