"""Checks of the six fields: Eq. (6) read literally, Eqs. (7)-(12) and their domains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp

from capsule_sym._symbolic.theory import (
    SEGMENTS,
    Linear,
    Relation,
    delta,
    f_b,
    gamma,
    implies,
    v_c,
    v_r,
    x_r,
)
from paper.claims.formula import NAMES, formula, same
from paper.claims.relations import Texts, derived, scope

_SWITCHES = {name: sp.Symbol(name) for name in ("H1", "H2", "H3")}
COASTING = ("v_c > 0", "x_r < delta", "P3 < f_b", "P3 > -f_b")
"""States of a moving capsule in which Eq. (6), read literally, lets it coast."""


def _step(argument: sp.Expr, region: tuple[Relation, ...]) -> sp.Expr | None:
    """Heaviside step of a function in a region; None if the region does not decide it."""
    magnitudes = argument.atoms(sp.Abs)
    branches = [argument]
    for magnitude in magnitudes:
        (inner,) = magnitude.args
        branches = [b.xreplace({magnitude: s * inner}) for b in branches for s in (1, -1)]
    if any(implies(region, sp.Gt(branch, 0)) for branch in branches):
        return sp.S.One  # |P| is the greater of P and -P
    if all(implies(region, sp.Lt(branch, 0)) for branch in branches):
        return sp.S.Zero
    return None


def literal(texts: Mapping[str, str], region: Texts, drift: int) -> tuple[sp.Expr, ...]:
    """Eq. (6) in a region as rates of (x_r, v_r, v_c), `drift` standing for sign(v_c)."""
    place = {sp.sign(v_c): sp.Integer(drift)}
    for name, symbol in _SWITCHES.items():
        step = _step(formula(texts[name]), scope(region))
        if step is not None:
            place[symbol] = step
    names = {**NAMES, **_SWITCHES, "v_m": v_r + v_c}
    rates = {name: formula(texts[name], names).xreplace(place) for name in texts if name[0] != "H"}
    return rates["x_m"] - rates["x_c"], rates["v_m"] - rates["v_c"], rates["v_c"]


def literal_field(
    field: int, texts: Mapping[str, str], regions: Sequence[Texts], drift: int | None = None
) -> bool:
    """Check that Eq. (6), read literally, is a field in each of the regions.

    Without a given drift, sign(v_c) is that of the field's drift.
    """
    segment = SEGMENTS[field - 1]
    sign = segment.drift if drift is None else drift
    return all(all(map(same, literal(texts, one, sign), segment.field)) for one in regions)


def printed_field(printed: Sequence[str], mode: str, field: int) -> bool:
    """Check that a printed field and its mode are those of the model."""
    segment = SEGMENTS[field - 1]
    rates = map(formula, printed)
    return mode == segment.mode and all(
        same(a, b) for a, b in zip(rates, segment.field, strict=True)
    )


def slope_jumps(line: Sequence[str], size: str) -> bool:
    """Check that on the line F1 = F4, and d(F4 - F1)/dx_r = (0, -size, size/(gamma + 1))."""
    jump = derived(size)
    place = {x_r: delta, v_r: 0} if list(line) == ["L9"] else {}
    free, pressed = SEGMENTS[0].field, SEGMENTS[3].field
    gaps = [sp.expand((b - a).subs(place)) for a, b in zip(free, pressed, strict=True)]
    steps = [sp.diff(b - a, x_r) for a, b in zip(free, pressed, strict=True)]
    wanted = (sp.S.Zero, -jump, jump / (gamma + 1))
    return not any(gaps) and all(map(same, steps, wanted))


def _side(segment: Linear, closed: bool) -> Relation:
    """Side of the gap of a field; `closed` counts P2 = delta as contact."""
    if segment.contact:
        return (sp.Ge if closed else sp.Gt)(x_r, delta)
    return sp.Lt(x_r, delta)


def domain(field: int) -> tuple[tuple[Relation, ...], ...]:
    """Domain of a field: its cell with P2 = delta counted as contact, and P1 = 0 where it moves.

    At rest a drift acts where it accelerates the capsule in its own direction, else stick does.
    """
    segment = SEGMENTS[field - 1]
    side, rest, force = _side(segment, True), sp.Eq(v_c, 0), segment.interaction
    if segment.stick:
        return ((rest, side, sp.Le(force, f_b), sp.Ge(force, -f_b)),)
    drift = segment.drift
    return (sp.Gt(drift * v_c, 0), side), (rest, side, sp.Gt(drift * segment.field[2], 0))


def acting(segment: Linear) -> tuple[tuple[Relation, ...], ...]:
    """States where a field acts, with the force beyond the bound (drift) or within it (stick)."""
    side, force = _side(segment, False), segment.interaction
    if segment.stick:
        return ((sp.Eq(v_c, 0), side, sp.Lt(force, f_b), sp.Gt(force, -f_b)),)
    moving = sp.Gt(v_c, 0) if segment.drift > 0 else sp.Lt(v_c, 0)
    return (moving, side, sp.Gt(force, f_b)), (moving, side, sp.Lt(force, -f_b))
