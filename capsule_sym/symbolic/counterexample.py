"""From rest, an impact before any forward drift, at delta = f_b: against a claim of Section 3.1.

Without damping, with delta = f_b = 1 and omega = 3/2, stick from (0, 0, 0) at tau = 0 is
x_r = (4 alpha / 5) (cos tau - cos 3 tau/2), a polynomial in the cosine of tau/2. The amplitude is
chosen so that x_r comes to -f_b where that cosine is 27/365 and its sine 364/365: the state
there is rational, and the backward drift that follows is enclosed rigorously up to its impact.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from capsule_sym.symbolic.enclosure import Bracket, Flow, exceeds
from capsule_sym.symbolic.model import SEGMENTS
from capsule_sym.symbolic.symbols import (
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
    zeta,
)

_COSINE, _SINE = Fraction(27, 365), Fraction(364, 365)  # of tau/2 where stick ends
_STICK = [Fraction(-1), Fraction(3), Fraction(2), Fraction(-4)]  # of cos tau - cos 3 tau/2


def _at(polynomial: list[Fraction], value: Fraction) -> Fraction:
    return sum((c * value**k for k, c in enumerate(polynomial)), Fraction(0))


_DEPTH = -_at(_STICK, _COSINE)
AMPLITUDE = Fraction(5, 4) / _DEPTH

_FIXED = {zeta: 0, delta: 1, f_b: 1, omega: Fraction(3, 2), alpha: AMPLITUDE}


@dataclass(frozen=True)
class Claim:
    """Mass ratio, and times after the start of drift between which the impact falls."""

    gamma: Fraction
    bracket: Bracket


CLAIM = Claim(Fraction(33, 10), (Fraction(226, 100), Fraction(227, 100)))


def values(claim: Claim) -> dict[sp.Symbol, sp.Rational]:
    """The parameters, exactly."""
    fixed = {symbol: sp.Rational(value) for symbol, value in _FIXED.items()}
    return fixed | {gamma: sp.Rational(claim.gamma), beta: sp.Rational(3, 2)}


def _stick_solves() -> bool:
    """Whether the motion in stick has field F2 and begins at rest."""
    wave = sp.Rational(4, 5) * alpha * (sp.cos(tau) - sp.cos(3 * tau / 2))
    known = {zeta: 0, omega: sp.Rational(3, 2), x_r: wave, v_r: wave.diff(tau)}
    motion = wave.diff(tau, 2) - SEGMENTS[1].field[1].subs(known)
    begins = (wave.subs(tau, 0), wave.diff(tau).subs(tau, 0))
    c = sp.Symbol("c")
    shape = sp.Poly(sp.chebyshevt(2, c) - sp.chebyshevt(3, c), c).all_coeffs()[::-1]
    return sp.expand(motion) == 0 and begins == (0, 0) and shape == list(map(sp.Rational, _STICK))


def _stick_holds() -> bool:
    """Whether |P3| < f_b from the start until the cosine of tau/2 is 27/365."""
    upper = [_DEPTH - _STICK[0], *(-c for c in _STICK[1:])]
    lower = [_DEPTH + _STICK[0], *_STICK[1:]]
    quotient: list[Fraction] = []
    for coefficient in reversed(lower):  # division by (cosine - 27/365), its zero at the end
        quotient.insert(0, coefficient + (quotient[0] * _COSINE if quotient else 0))
    rest, *quotient = quotient
    return (
        rest == 0
        and exceeds(upper, Fraction(0), _COSINE, Fraction(1))
        and exceeds(quotient, Fraction(0), _COSINE, Fraction(1))
    )


def end_of_stick() -> tuple[Fraction, Fraction, Fraction, Fraction, Fraction]:
    """State, force and quadrature where backward drift begins."""
    double = 2 * _SINE * _COSINE
    triple_sine, triple_cosine = 3 * _SINE - 4 * _SINE**3, 4 * _COSINE**3 - 3 * _COSINE
    speed = Fraction(4, 5) * AMPLITUDE * (-double + Fraction(3, 2) * triple_sine)
    return Fraction(-1), speed, Fraction(0), AMPLITUDE * triple_cosine, AMPLITUDE * triple_sine


def impact_before_forward_drift(claim: Claim) -> bool:
    """Whether the capsule sticks, drifts backwards, and so meets P2 = delta from rest."""
    start = end_of_stick()
    flow = Flow(SEGMENTS[2], values(claim), start, sense=1, degree=36)
    early, late = claim.bracket
    side, speed = delta - x_r, -v_c
    return (
        _stick_solves()
        and _stick_holds()
        and start[1] < 0  # P3 falls through -f_b: stick ends in backward drift
        and flow.positive_until(side, early)
        and flow.positive_until(speed, late)
        and flow.negative_at(side, late)
    )


def witness() -> dict[str, str]:
    """The counterexample in exact numbers."""
    names = ("x_r", "v_r", "v_c", "alpha cos(omega tau)", "alpha sin(omega tau)")
    early, late = CLAIM.bracket
    return {
        **{str(symbol): str(value) for symbol, value in values(CLAIM).items()},
        "start": "(0, 0, 0) at tau = 0, in stick",
        "stick ends": ", ".join(f"{n} = {v}" for n, v in zip(names, end_of_stick(), strict=True)),
        "impact": f"x_r = delta with v_c < 0, between {early} and {late} later",
    }
