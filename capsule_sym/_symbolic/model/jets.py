"""Time derivatives of the state and of the guards of a segment, to any order, from its field.

Once x_r, v_r and the forcing angle are known, every further derivative follows from the equation
of motion, x^(n+2) = -2 sigma x^(n+1) - K x^(n) + alpha (d/dtau)^n cos for n > 0, and the pull Q on
the capsule, linear in x_r, v_r and a drive that reacts, gives those of
v_c' = (Q - friction)/gamma. A drive that reacts has the factor m in x^(n+2).
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from capsule_sym._symbolic.model.basis import K, sigma
from capsule_sym._symbolic.model.flow import (
    DAMPER,
    SHARE,
    SPRING,
    STIFFNESS,
    cos_theta,
    friction,
    m,
    push,
    sin_theta,
)
from capsule_sym._symbolic.model.model import DRIVE, LEVEL, LOAD, PULL, REACTS, STEADY
from capsule_sym._symbolic.model.symbols import PULSED, alpha, gamma, omega, stop, v_r, x_r

gap = sp.Symbol("gap", real=True)  # x_r - stop


def with_gap(expression: sp.Expr) -> sp.Expr:
    """Expression with `gap` for x_r - stop, which is small and exact near the impact surface."""
    return expression.subs(x_r - stop, gap)


def position_symbol(order: int) -> sp.Symbol:
    """Symbol of the derivative of x_r of this order."""
    return (x_r, v_r)[order] if order < 2 else sp.Symbol(f"x{order}", real=True)


def force_symbol(order: int) -> sp.Symbol:
    """Symbol of the derivative of the pull Q of this order."""
    return sp.Symbol(f"p{order}", real=True)


def _drive(order: int) -> sp.Symbol:
    """Amplitude alpha omega^order of the drive's derivative of this order."""
    return alpha if order == 0 else sp.Symbol(f"drive{order}", nonnegative=True)


def drive(order: int) -> sp.Expr:
    """Derivative of this order of a cosine drive; 0 for pulses, whose level is a constant apart."""
    if PULSED:
        return sp.S.Zero
    angle = sp.Symbol("angle")
    value = sp.diff(sp.cos(angle), angle, order) * _drive(order)
    return value.subs({sp.cos(angle): cos_theta, sp.sin(angle): sin_theta})


def forcing(order: int) -> sp.Expr:
    """Derivative of this order of the part of `drive` in the relative acceleration."""
    return SHARE * drive(order)


def reaction(order: int) -> sp.Expr:
    """Derivative of this order of what the pull Q subtracts of `drive`; 0 without reaction."""
    return drive(order) if REACTS else sp.S.Zero


def at_angle(expression: sp.Expr) -> sp.Expr:
    """Expression with a cosine drive in terms of cos_theta, or the level of pulses."""
    return expression.subs(DRIVE, drive(0) + LEVEL)


def jet(order: int) -> list[tuple[sp.Symbol, sp.Expr]]:
    """Assignments, in order, of x^(2) ... x^(order + 1) and of Q, Q', ... Q^(order).

    The amplitudes of the drive's derivatives come first, under their own symbols.
    """
    x = position_symbol
    steps = [(_drive(n), omega * _drive(n - 1)) for n in range(1, order + REACTS)]
    steps += [(x(2), push - m * with_gap(SPRING) - 2 * sigma * v_r + forcing(0))]
    steps += [(x(n + 2), -2 * sigma * x(n + 1) - K * x(n) + forcing(n)) for n in range(1, order)]
    steps += [(force_symbol(0), at_angle(with_gap(PULL)))]
    for n in range(1, order + 1):
        steps += [(force_symbol(n), STIFFNESS * x(n) + DAMPER * x(n + 1) - reaction(n))]
    return steps


def magnitudes(steps: list[tuple[sp.Symbol, sp.Expr]]) -> list[tuple[sp.Symbol, sp.Expr]]:
    """Assignments of a jet with every term replaced by a bound on its absolute value.

    Each quantity `y` becomes its magnitude `abs_y`; a recurrence of n steps commits a rounding
    error of at most a small multiple of n units of its magnitude (running error analysis).
    """
    bound = {cos_theta: sp.S.One, sin_theta: sp.S.One}
    derived = [target for target, _ in steps if not target.name.startswith("drive")]
    for name in [x_r, v_r, gap, *derived]:
        bound[name] = sp.Symbol(f"abs_{name}", nonnegative=True)
    return [(bound.get(target, target), size_of(one, bound)) for target, one in steps]


def size_of(expression: sp.Expr, bound: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Sum of the magnitudes of the terms of an expression, by bounds on its symbols.

    The magnitude of `push` is that of its terms, which may cancel.
    """
    pushes = sp.Abs(push)
    if STEADY != 0:
        terms = map(sp.Abs, sp.Add.make_args(sp.expand(LOAD + SHARE * LEVEL)))
        pushes = sp.Abs(friction) / gamma + sp.Add(*terms)
    terms = sp.Add.make_args(sp.expand_mul(expression))
    return sp.Add(*(abs(term.subs(bound)) for term in terms)).xreplace({sp.Abs(push): pushes})
