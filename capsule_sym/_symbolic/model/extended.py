"""Fields as affine ones: rates and guards in the state, the force and its quadrature.

The state is followed together with the force alpha cos(omega tau) and its quadrature
alpha sin(omega tau), which makes every field affine and autonomous. Pulses need neither.
"""

from __future__ import annotations

from functools import cache

import sympy as sp

from capsule_sym._symbolic.model.model import Linear
from capsule_sym._symbolic.model.symbols import PULSED, STATE, alpha, force, omega, tau

quadrature = sp.Symbol("w", real=True)  # alpha sin(omega tau)
EXTENDED = STATE if PULSED else (*STATE, force, quadrature)
"""The state with the force and its quadrature: autonomous and linear along every field.

Pulses are constant along a field: their levels are among its constants.
"""


@cache
def coefficients(function: sp.Expr) -> tuple[sp.Expr, ...]:
    """Coefficients of `EXTENDED`, then the constant, in an affine function."""
    plain = sp.expand(sp.expand(function).subs(alpha * sp.cos(omega * tau), force))
    constant = plain.xreplace(dict.fromkeys(EXTENDED, sp.S.Zero))
    return (*(plain.coeff(symbol) for symbol in EXTENDED), constant)


def extended_rates(field: Linear) -> tuple[sp.Expr, ...]:
    """Time derivatives of `EXTENDED` along a field."""
    return field.field if PULSED else (*field.field, -omega * quadrature, omega * force)
