"""Witnesses that the local maps of Table 3 occur, each checked in exact rational arithmetic.

A witness gives rational parameters and a rational state at the END of the map, with the values
of alpha cos(omega tau) and alpha sin(omega tau) there, which determine alpha. The field is followed backwards by its Taylor polynomial with a rigorous bound on the
remainder: the trajectory stays in the cell of the field until it meets, transversally, the
surface on which the map began. Every comparison is one of rational numbers, so a witness that is
accepted is a proof that its map is possible. That no other map is, follows from `switching`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from importlib.resources import files
from math import ceil, comb

import sympy as sp

from capsule_sym.symbolic.geometry import SCENARIOS
from capsule_sym.symbolic.model import SEGMENTS, Segment
from capsule_sym.symbolic.proof import force
from capsule_sym.symbolic.switching import LocalMap, guards, time_derivative
from capsule_sym.symbolic.symbols import (
    STATE,
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    tau,
    zeta,
)

Polynomial = list[Fraction]
"""Coefficients of powers of the time before the end, from order 0."""

_DEGREE = 16
_DEEPEST = 12
_ENTRY_PLANE = {1: "Σ8", 3: "Σ10", 4: "Σ7", 6: "Σ9"}


@dataclass(frozen=True)
class Witness:
    """A trajectory of one field that ends in the state `end` (x_r, v_r, v_c); f_b and omega are 1.

    `forcing` holds alpha cos and alpha sin of the phase at the end; `bracket` two times before
    the end, between which the map began. Dimensionless.
    """

    local_map: LocalMap
    delta: Fraction
    zeta: Fraction
    beta: Fraction
    gamma: Fraction
    end: tuple[Fraction, Fraction, Fraction]
    forcing: tuple[Fraction, Fraction]
    bracket: tuple[Fraction, Fraction]

    @property
    def parameters(self) -> dict[sp.Symbol, sp.Rational]:
        values = {delta: self.delta, zeta: self.zeta, beta: self.beta, gamma: self.gamma}
        exact = {symbol: sp.Rational(value) for symbol, value in values.items()}
        amplitude = sp.sqrt(sum(sp.Rational(part) ** 2 for part in self.forcing))
        return exact | {alpha: amplitude, omega: sp.Integer(1), f_b: sp.Integer(1)}

    @property
    def regime(self) -> tuple[str, bool]:
        """The scenario of delta, and whether there is damping."""
        name = next(n for n, r in SCENARIOS.items() if r.subs(self.parameters) == sp.true)
        return name, self.zeta > 0


_QUADRATURE = sp.Symbol("w", real=True)  # alpha sin(omega tau)
_EXTENDED = (*STATE, force, _QUADRATURE)


def _affine(expression: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> list[Fraction]:
    """Coefficients of state, force and quadrature, then the constant, in an affine function."""
    plain = sp.expand(expression).subs(alpha * sp.cos(omega * tau), force).subs(values)
    slopes = [plain.coeff(symbol) for symbol in _EXTENDED]
    constant = plain.subs(dict.fromkeys(_EXTENDED, 0))
    return [Fraction(int(c.p), int(c.q)) for c in (*slopes, constant)]


class _Backward:
    """The state before the end as Taylor polynomials of elapsed time, with their remainder."""

    def __init__(self, witness: Witness, field: Segment) -> None:
        self.values = witness.parameters
        rates = (*field.field, -_QUADRATURE, force)
        rows = [_affine(rate, self.values) for rate in rates]
        terms: list[list[Fraction]] = [[*witness.end, *witness.forcing]]
        for order in range(_DEGREE + 1):
            rise = [
                sum((a * x for a, x in zip(row, terms[-1], strict=False)), Fraction(0))
                + (row[-1] if order == 0 else 0)
                for row in rows
            ]
            terms.append([-rate / (order + 1) for rate in rise])
        *self.terms, tail = terms
        self.tail = max(map(abs, tail))
        self.norm = max(sum(map(abs, row[:-1]), Fraction(0)) for row in rows)

    def along(self, expression: sp.Expr) -> tuple[Polynomial, Fraction]:
        """Taylor polynomial of an affine function of the state, and its sensitivity."""
        *slopes, constant = _affine(expression, self.values)
        series = [
            sum((a * x for a, x in zip(slopes, term, strict=True)), Fraction(0))
            for term in self.terms
        ]
        series[0] += constant
        return series, sum(map(abs, slopes), Fraction(0))

    def remainder(self, sensitivity: Fraction, order: int, time: Fraction) -> Fraction:
        """Bound on the neglected terms, divided by time**order, for all shorter times."""
        growth = Fraction(3) ** ceil(self.norm * time)
        return sensitivity * self.tail * time ** (_DEGREE + 1 - order) * growth


def _bernstein(polynomial: Polynomial, start: Fraction, end: Fraction) -> list[Fraction]:
    degree = len(polynomial) - 1
    shifted = [
        sum(
            (polynomial[k] * comb(k, j) * start ** (k - j) for k in range(j, degree + 1)),
            Fraction(0),
        )
        * (end - start) ** j
        for j in range(degree + 1)
    ]
    return [
        sum((Fraction(comb(i, j), comb(degree, j)) * shifted[j] for j in range(i + 1)), Fraction(0))
        for i in range(degree + 1)
    ]


def _exceeds(
    polynomial: Polynomial, bound: Fraction, start: Fraction, end: Fraction, depth: int = 0
) -> bool:
    """Whether a polynomial is proved larger than a bound on an interval."""
    coefficients = _bernstein(polynomial, start, end)
    if min(coefficients) > bound:
        return True
    if min(coefficients[0], coefficients[-1]) <= bound or depth == _DEEPEST:
        return False
    middle = (start + end) / 2
    return all(
        _exceeds(polynomial, bound, a, b, depth + 1) for a, b in ((start, middle), (middle, end))
    )


def _first_order(series: Polynomial) -> int:
    return next((order for order, term in enumerate(series) if term != 0), len(series) - 1)


def _positive_before_end(flow: _Backward, guard: sp.Expr, time: Fraction) -> bool:
    """Whether a guard is positive from `time` before the end until just before it."""
    series, sensitivity = flow.along(guard)
    order = _first_order(series)
    bound = flow.remainder(sensitivity, order, time)
    return _exceeds(series[order:], bound, Fraction(0), time)


def _positive_within(flow: _Backward, function: sp.Expr, bracket: tuple[Fraction, Fraction]) -> bool:
    series, sensitivity = flow.along(function)
    return _exceeds(series, flow.remainder(sensitivity, 0, bracket[1]), *bracket)


def _negative_at(flow: _Backward, function: sp.Expr, time: Fraction) -> bool:
    series, sensitivity = flow.along(function)
    value = sum((c * time**k for k, c in enumerate(series)), Fraction(0))
    return value < -flow.remainder(sensitivity, 0, time)


def _departs(witness: Witness, field: Segment) -> bool:
    """Whether the trajectory of a field through the end leaves it into the field's cell."""
    if field.stick and witness.end[2] != 0:
        return False
    flow = _Backward(witness, field)
    series = [flow.along(guard)[0] for guard in guards(field)]
    return all(one[_first_order(one)] * (-1) ** _first_order(one) > 0 for one in series)


def target(witness: Witness) -> str:
    """The plane on which the witness ends, by the field that takes over."""
    (following,) = [field for field in SEGMENTS if _departs(witness, field)]
    return f"Σ{following.index}" if witness.end[2] == 0 else _ENTRY_PLANE[following.index]


def source(witness: Witness) -> str | None:
    """The plane on which the witness is proved to begin; None where that is not proved."""
    field = SEGMENTS[witness.local_map.field - 1]
    flow = _Backward(witness, field)
    late, early = witness.bracket
    if not all(_positive_before_end(flow, guard, late) for guard in guards(field)):
        return None
    if field.stick:
        return f"Σ{field.index}"
    side, speed = guards(field)
    planes = {speed: f"Σ{field.index}", side: _ENTRY_PLANE[field.index]}
    for crossed, other in ((speed, side), (side, speed)):
        if (
            _negative_at(flow, crossed, early)
            and _positive_within(flow, time_derivative(crossed, field), witness.bracket)
            and _positive_within(flow, other, witness.bracket)
        ):
            return planes[crossed]
    return None


def proves(witness: Witness) -> bool:
    """Whether the witness proves that its local map occurs."""
    wanted = witness.local_map
    return target(witness) == wanted.target and source(witness) == wanted.source


@lru_cache(maxsize=None)
def witnesses() -> tuple[Witness, ...]:
    """The stored witnesses: at least one for every local map in every regime that allows it."""
    text = (files(__package__) / "witnesses.json").read_text(encoding="utf-8")
    return tuple(
        Witness(
            LocalMap(f"Σ{record['map'][0]}", record["map"][1], f"Σ{record['map'][2]}"),
            *(Fraction(record[name]) for name in ("delta", "zeta", "beta", "gamma")),
            end=tuple(map(Fraction, record["end"])),
            forcing=tuple(map(Fraction, record["forcing"])),
            bracket=tuple(map(Fraction, record["bracket"])),
        )
        for record in json.loads(text)
    )
