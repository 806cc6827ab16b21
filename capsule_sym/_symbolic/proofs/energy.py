"""Proofs of the energy balance of a scene's fields.

Energy is the kinetic energy of mass and capsule and the elastic energy of the springs. Its rate in
each field is the power of drive and load, less the power lost to damper and friction, by the
formulas that metrics integrate.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache, partial

import sympy as sp

from capsule_sym._symbolic.model.flow import cos_theta, drift
from capsule_sym._symbolic.model.formulas import formulas, way
from capsule_sym._symbolic.model.model import (
    SEGMENTS,
    Linear,
    high,
)
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    STATE,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
)
from capsule_sym._symbolic.proofs.statement import Statement, vanishes


def energy(field: Linear) -> sp.Expr:
    """Kinetic energy of both bodies, and energy of the springs that act."""
    kinetic = ((v_r + v_c) ** 2 + gamma * v_c**2) / 2
    return kinetic + (x_r**2 + field.region.stiffness * (x_r - field.stop) ** 2) / 2


@cache
def _formulas() -> Mapping[str, sp.Expr]:
    return formulas()


def power(field: Linear) -> sp.Expr:
    """Power of drive and load in a field, less that of damper and friction."""
    known = _formulas()
    drive = known["drive_power"].subs({cos_theta: sp.cos(omega * tau), high: 1 - field.level})
    friction = known["loss_at"].subs({way: field.drift, drift: field.drift})
    load = known["load_force"] * v_r - known["lift_force"] * v_c
    return drive + load - known["damper_power"] - friction * v_c


def balances(field: Linear, claim: sp.Expr) -> bool:
    """Check that a power is the rate of energy along a field; in stick only where v_c = 0."""
    stored = energy(field)
    rate = sum(stored.diff(s) * along for s, along in zip(STATE, field.field, strict=True))
    return vanishes((rate - claim).subs(v_c, 0) if field.stick else rate - claim)


def continues(side: int, claim: sp.Expr) -> bool:
    """Check that an energy without contact equals, at a stop, that of contact with the stop."""
    touching = next(one for one in SEGMENTS if one.contact == side)
    return vanishes((claim - energy(touching)).subs(x_r, MODEL.stops[side - 1]))


def _balance(claim: sp.Expr) -> str:
    return rf"\dot E={sp.latex(claim)}"


def _energies() -> Iterator[Statement]:
    for field in SEGMENTS:
        claim = power(field)
        yield Statement(
            f"energy.{field.name}",
            f"field {field.name}",
            f"in {field.name} energy changes by the power of drive and load, less damper's and "
            "friction's",
            balances,
            {"field": field, "claim": claim},
            {"claim": claim + v_r**2},
            formula=partial(_balance, claim),
        )
    for side in range(1, len(MODEL.stops) + 1):
        free = energy(SEGMENTS[0])
        yield Statement(
            f"energy.stop{side}",
            "energy",
            f"at x_r = {MODEL.stops[side - 1]} energy is the same without contact and with it",
            continues,
            {"side": side, "claim": free},
            {"claim": free + x_r**2 + 1},
        )


@cache
def items() -> tuple[Statement, ...]:
    """All statements about energy."""
    return tuple(_energies())
