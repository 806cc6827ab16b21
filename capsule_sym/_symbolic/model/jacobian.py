"""Derivatives of a segment's flow with respect to start, duration and every parameter.

Columns, in order: x_r, v_r, v_c and the forcing angle theta at the start, the duration h, then
the parameters. The angle at the start is held while omega varies; with the start's time tau_0 held
instead, add tau_0 times the column of theta to that of omega.
"""

from __future__ import annotations

from functools import lru_cache

import sympy as sp

from capsule_sym._symbolic.model import basis
from capsule_sym._symbolic.model.basis import K, sigma
from capsule_sym._symbolic.model.flow import (
    SPRING,
    cos_theta,
    derive,
    friction,
    general_constants,
    m,
    push,
    sin_theta,
    spring,
)
from capsule_sym._symbolic.model.jets import gap
from capsule_sym._symbolic.model.model import kappa
from capsule_sym._symbolic.model.symbols import (
    PARAMETERS,
    front,
    h,
    omega,
    stop,
    theta,
    v_c,
    v_r,
    x_r,
)

COLUMNS = (x_r, v_r, v_c, theta, h, *PARAMETERS)

_ANGLE_RULES = {cos_theta: -sin_theta, sin_theta: cos_theta}


def _total(expression: sp.Expr, column: sp.Symbol, stick: bool) -> sp.Expr:
    """Total derivative through response functions, segment constants and the start."""
    rates = {name: sp.diff(one, column) for name, one in general_constants(stick).items()}
    moving = {variable: rates[variable] for variable in (K, sigma)}
    moving |= {variable: sp.Integer(1) for variable in (h, omega) if variable is column}
    parts = [(name, rates[name]) for name in (m, kappa, push, friction, K, sigma)]
    parts += [(spring, sp.diff(SPRING, column)), (spring, (x_r - stop) * rates[kappa])]
    parts += [(spring, sp.diff(SPRING, stop) * rates[stop])] if stop is not front else []
    parts += _ANGLE_RULES.items() if column is theta else []
    total = sp.diff(expression, column) + sum(sp.diff(expression, a) * b for a, b in parts)
    for name in sorted(expression.free_symbols & basis.IMAGES.keys(), key=str):
        for variable, rate in moving.items():
            total += sp.diff(expression, name) * basis.RULES[variable][name] * rate
    return total


@lru_cache(maxsize=2)
def rows(stick: bool) -> tuple[tuple[sp.Expr, ...], ...]:
    """Rows x_r, v_r (and, in drift, v_c and x_c's advance) of the flow's Jacobian, by `COLUMNS`."""
    flow = derive()
    state = [x_r + flow.position, flow.velocity]
    if not stick:
        state += [v_c + flow.drift_long, flow.advance]
    else:
        still = {name: general_constants(stick)[name] for name in (push, friction)}
        state = [expression.subs(still) for expression in state]
    return tuple(
        tuple(_total(expression, column, stick).subs(x_r - stop, gap) for column in COLUMNS)
        for expression in state
    )
