"""Proofs of the saltation matrix at a switch, by implicit differentiation.

A motion follows one field to a guard, and another from there. The instant of the switch solves
guard = 0 along the first field. This equation is differentiated, and so is the state reached at a
fixed time, at the instant itself: there the fields alone determine both flows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import sympy as sp

from capsule_sym._symbolic.model.model import ANY_LEVEL, SEGMENTS, Linear
from capsule_sym._symbolic.model.symbols import MODEL, PULSES, STATE, h, omega, tau, v_c, x_r
from capsule_sym._symbolic.proofs.statement import Statement, vanishes

Matrix = sp.ImmutableMatrix
_IDENTITY = Matrix.eye(3)


@dataclass(frozen=True)
class Switch:
    """A switch of a motion from one field to another where a guard vanishes."""

    before: Linear
    after: Linear
    guard: sp.Expr

    def derivative(self, column: sp.Symbol) -> sp.Matrix:
        """Derivative of the state just after the switch, at a fixed time.

        `column` is a component of the state before it, or a parameter.
        """
        reached = sp.Matrix(STATE) + h * sp.Matrix(self.before.field)
        along = {**dict(zip(STATE, reached, strict=True)), tau: tau + h}
        then = sp.Matrix(self.after.field).subs(along, simultaneous=True)
        end = reached - h * then  # back to the time of the start
        crossing = self.guard.subs(along, simultaneous=True)
        instant = -crossing.diff(column) / crossing.diff(h)
        total = end.diff(column) + end.diff(h) * instant
        return total.subs(h, 0)

    @property
    def on_guard(self) -> dict[sp.Symbol, sp.Expr]:
        """Value of v_c, or of x_r for a guard without v_c, at which the guard vanishes."""
        symbol = v_c if self.guard.has(v_c) else x_r
        return {symbol: sp.solve(self.guard, symbol)[0]}


def carries(switch: Switch, claim: sp.Matrix) -> bool:
    """Check that a matrix maps deviations of the state across a switch."""
    columns = [switch.derivative(symbol) for symbol in STATE]
    found = sp.Matrix.hstack(*columns) - claim
    return all(vanishes(entry.subs(switch.on_guard)) for entry in found)


def at_landing(switch: Switch) -> sp.Matrix:
    """Saltation matrix where v_c vanishes: the deviation of v_r gains what that of v_c loses."""
    ratio = switch.after.field[2] / switch.before.field[2]
    return Matrix([[1, 0, 0], [0, 1, 1 - ratio], [0, 0, ratio]])


def moves(switch: Switch, share: sp.Symbol, claim: tuple[sp.Expr, ...]) -> bool:
    """Check the state's derivatives by the share of a period at the high level of pulses.

    Those by the state before the edge have to be the identity.
    """
    by_share = switch.derivative(share)
    pairs = zip(by_share, claim, strict=True)
    unmoved = all(switch.derivative(one) == _IDENTITY.col(k) for k, one in enumerate(STATE))
    return unmoved and all(vanishes(a - b) for a, b in pairs)


def switches() -> Iterator[Switch]:
    """All switches at any one level: at a stop, at the end of a drift, and at the end of rest."""
    beside = {(one.region.name, one.drift): one for one in ANY_LEVEL}
    inner, *outer = (region.name for region in MODEL.regions)
    for field in ANY_LEVEL:
        gaps = len(field.region.where)
        reached = outer if field.region.name == inner else [inner]
        ways = [0, -field.drift] if field.drift else [1, -1]
        for guard, name in zip(field.guards[:gaps], reached, strict=True):
            yield Switch(field, beside[name, field.drift], guard)
        guards = field.guards[gaps:] * (2 if field.drift else 1)
        for guard, way in zip(guards, ways, strict=True):
            yield Switch(field, beside[field.region.name, way], guard)


def _switch(switch: Switch) -> Statement:
    landing = switch.guard.has(v_c)
    claim = at_landing(switch) if landing else _IDENTITY
    before, after = switch.before, switch.after
    told = "gives v_r what v_c loses" if landing else "leaves deviations as they are"
    # A wrong ratio at a landing; elsewhere a matrix that would be right if the fields differed.
    wrong = _IDENTITY if landing else _IDENTITY + Matrix(3, 3, [0, 0, 0, 0, 0, 1, 0, 0, 0])
    return Statement(
        f"saltation.{before.name}.{after.name}",
        f"{before.name} to {after.name}",
        f"the switch from {before.name} to {after.name} {told}",
        carries,
        {"switch": switch, "claim": claim},
        {"claim": wrong},
        formula=lambda: rf"S={sp.latex(claim)}",
    )


def _edges(share: sp.Symbol) -> Iterator[Statement]:
    """Fall and rise of pulses: their instant is known, and its derivative by the share."""
    period = 2 * sp.pi / omega
    guards = {0: share * period - tau, 1: period - tau}
    for field in SEGMENTS:
        other = SEGMENTS[(field.index - 1 + len(ANY_LEVEL)) % len(SEGMENTS)]
        switch = Switch(field, other, guards[field.level])
        jump = (a - b for a, b in zip(field.field, other.field, strict=True))
        claim = tuple(one * (period if field.level == 0 else 0) for one in jump)
        yield Statement(
            f"saltation.edge.{field.name}",
            f"{field.name} to {other.name}",
            f"the edge from {field.name} to {other.name} leaves deviations as they are, and "
            + ("moves with the share" if field.level == 0 else "ends the period"),
            moves,
            {"switch": switch, "share": share, "claim": claim},
            {"claim": (claim[0], claim[1] + 1, claim[2])},
        )


@cache
def items() -> tuple[Statement, ...]:
    """All statements about switches."""
    edges = _edges(PULSES.share) if PULSES else ()
    return (*map(_switch, switches()), *edges)
