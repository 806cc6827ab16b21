"""Proofs of the energy balance and of the mirror image of a scene's fields.

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
    ANY_LEVEL,
    BACKWARD,
    FORWARD,
    LEVELS,
    LOAD,
    SEGMENTS,
    Linear,
    high,
)
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    PULSED,
    PULSES,
    STATE,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
)
from capsule_sym._symbolic.proofs.statement import Statement, vanishes

Exchange = Mapping[sp.Symbol, sp.Expr]


def energy(field: Linear) -> sp.Expr:
    """Kinetic energy of both bodies, and energy of the springs that act."""
    kinetic = ((v_r + v_c) ** 2 + gamma * v_c**2) / 2
    return kinetic + (x_r**2 + field.region.stiffness * (x_r - field.stop) ** 2) / 2


@cache
def _formulas() -> Mapping[str, sp.Expr]:
    return {one.name: one.results[0][1] for one in formulas()}


def power(field: Linear) -> sp.Expr:
    """Power of drive and load in a field, less that of damper and friction."""
    known = _formulas()
    drive = known["drive_power"].subs({cos_theta: sp.cos(omega * tau), high: 1 - field.level})
    friction = known["loss_at"].subs({way: field.drift, drift: field.drift})
    load = known["load_force"] * v_r - known["lift_force"] * v_c
    return drive + load - known["damper_power"] - friction * v_c


def balances(field: Linear, claim: sp.Expr) -> bool:
    """Check that a power is the rate of energy along a field, at rest of a capsule that rests."""
    stored = energy(field)
    rate = sum(stored.diff(s) * along for s, along in zip(STATE, field.field, strict=True))
    return vanishes((rate - claim).subs(v_c, 0) if field.stick else rate - claim)


def continues(side: int, claim: sp.Expr) -> bool:
    """Check that the energy without contact equals, at a stop, that of contact with it."""
    touching = next(one for one in SEGMENTS if one.contact == side)
    return vanishes((claim - energy(touching)).subs(x_r, MODEL.stops[side - 1]))


def exchange() -> Exchange | None:
    """Exchange of parameters by which a scene has a mirror image; None if there is none.

    It exchanges the friction bounds, the stops and the sign of a load. The drive is reversed half a
    period later, or its levels are exchanged.
    """
    pairs: list[tuple[sp.Expr, sp.Expr]] = [(FORWARD, BACKWARD)]
    if len(MODEL.stops) == 2:
        front, back = MODEL.stops
        pairs += [(front, -back), tuple(one.stiffness for one in MODEL.regions[1:])]
    found: dict[sp.Symbol, sp.Expr] = {}
    for one, other in pairs:
        if not (one.is_Symbol and other.is_Symbol):
            return None
        found |= {one: other, other: one}
    if PULSES:
        high_one, low_one = LEVELS
        found |= {high_one: -low_one, low_one: -high_one}
    found |= {one: -one for one in LOAD.free_symbols if one.is_nonnegative is None}
    turned = LOAD.subs(found, simultaneous=True)
    return found if vanishes(turned + LOAD) else None


def _image(field: Linear) -> Linear | None:
    """Field of the mirror image of a field's motion; None in contact if there is one stop."""
    sides = {0: 0} if len(MODEL.stops) == 1 else {0: 0, 1: 2, 2: 1}
    if field.contact not in sides:
        return None
    kind = 3 * sides[field.contact] + 1 + field.drift  # ways are 1, 0, -1
    level = 1 - field.level if PULSED else 0
    return SEGMENTS[len(ANY_LEVEL) * level + kind]


def mirrors(field: Linear, changes: Exchange, image: Linear) -> bool:
    """Check that the mirror image of a field's motion is one of the other, in a mirrored scene."""
    turned = {one: -one for one in STATE} | {sp.cos(omega * tau): -sp.cos(omega * tau)}

    def seen(expression: sp.Expr) -> sp.Expr:
        return expression.subs(changes, simultaneous=True).subs(turned, simultaneous=True)

    gaps = len(field.region.where) if len(MODEL.stops) == 1 else 0  # one stop has no image
    guards = {sp.expand(seen(one)) for one in image.guards[gaps:]}
    rates = zip(image.field, field.field, strict=True)
    return all(vanishes(seen(a) + b) for a, b in rates) and guards == {
        sp.expand(one) for one in field.guards[gaps:]
    }


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


def _mirrored(changes: Exchange) -> Iterator[Statement]:
    told = ", ".join(f"{one} by {to}" for one, to in changes.items() if one != to)
    for field in SEGMENTS:
        if (image := _image(field)) is None:
            continue
        yield Statement(
            f"mirror.{field.name}",
            f"{field.name} and {image.name}",
            f"the mirror image of {field.name} is {image.name}"
            + (f", with {told}" if told else ""),
            mirrors,
            {"field": field, "changes": changes, "image": image},
            {"image": SEGMENTS[image.index % len(SEGMENTS)]},
        )


@cache
def items() -> tuple[Statement, ...]:
    """All statements about energy and mirror images."""
    changes = exchange()
    return (*_energies(), *(_mirrored(changes) if changes is not None else ()))
