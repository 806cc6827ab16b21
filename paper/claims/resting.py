"""Orbit of a capsule that never moves, and the alpha at which it first touches the spring."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from capsule_sym._symbolic.theory import (
    P2,
    P3,
    SEGMENTS,
    Statement,
    alpha,
    delta,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
)

_RATE = SEGMENTS[1].field[1]
_AHEAD = -sp.diff(_RATE, x_r) - omega**2  # in phase with the force, times the response
_BEHIND = -sp.diff(_RATE, v_r) * omega
GRAZE = delta * sp.sqrt(_AHEAD**2 + _BEHIND**2)
"""Amplitude alpha at which the resting orbit grazes on L9."""
_FORCE = delta**2 * (1 + _BEHIND**2)
_ANGLE = omega * tau


def _orbit() -> dict[sp.Symbol, sp.Expr]:
    """State of the stick field's periodic response, as a function of tau."""
    wave = _AHEAD * sp.cos(_ANGLE) + _BEHIND * sp.sin(_ANGLE)
    place = alpha * wave / (_AHEAD**2 + _BEHIND**2)
    return {x_r: place, v_r: sp.diff(place, tau), v_c: sp.S.Zero}


def _amplitude_squared(wave: sp.Expr) -> sp.Expr:
    """Square of the largest value of a cos(omega tau) + b sin(omega tau)."""
    expanded = sp.expand(wave)
    a, b = (expanded.coeff(function(_ANGLE)) for function in (sp.cos, sp.sin))
    if sp.simplify(expanded - a * sp.cos(_ANGLE) - b * sp.sin(_ANGLE)) != 0:
        raise ValueError(f"{wave} is no such wave")
    return a**2 + b**2


def _zero(expression: sp.Expr) -> bool:
    return bool(sp.simplify(expression) == 0)


def grazes_at(value: sp.Expr, force_squared: sp.Expr) -> bool:
    """Check that at a value of alpha the response rises to P2 = delta, and P3 to its value."""
    orbit, field = _orbit(), SEGMENTS[1].field
    follows = all(
        _zero(sp.diff(orbit[symbol], tau) - rate.subs(orbit))
        for symbol, rate in zip((x_r, v_r, v_c), field, strict=True)
    )
    reach, force = (_amplitude_squared(p.subs(orbit)) for p in (P2, P3))
    return (
        follows
        and _zero(reach.subs(alpha, value) - delta**2)
        and _zero(sp.diff(reach, alpha) * alpha - 2 * reach)  # it grows with alpha
        and _zero(force.subs(alpha, value) - force_squared)
    )


def resting_orbit() -> Iterator[Statement]:
    """Amplitude at which the resting orbit first touches the spring."""
    yield Statement(
        "grazing.L9.closed",
        "Section 4",
        "for delta > 0, delta sqrt(1 + 4 zeta^2 omega^2) < f_b, and zeta > 0 or omega other than 1,"
        " the resting orbit grazes on L9 at "
        "alpha = delta sqrt((1 - omega^2)^2 + 4 zeta^2 omega^2), "
        "and is free of contact below",
        grazes_at,
        {"value": GRAZE, "force_squared": _FORCE},
        {"value": delta * sp.sqrt((1 + omega**2) ** 2 + _BEHIND**2)},
        formula=rf"\alpha={sp.latex(GRAZE)},\quad {sp.latex(_FORCE)}<f_{{b}}^2",
        proof="the response of F2 put into its field; the largest x_r over a period is delta there "
        "and grows with alpha, and the largest P3 is below f_b",
    )
