"""Witnesses that the local maps of Table 3 occur, each checked in exact rational arithmetic.

A witness gives rational parameters and a rational state at the END of the map, with the values
of alpha cos(omega tau) and alpha sin(omega tau) there, which determine alpha. The field is followed backwards by its Taylor polynomial with a rigorous bound on the
remainder: the trajectory stays in the cell of the field until it meets, transversally, the
surface on which the map began. Every comparison is one of rational numbers, so a witness that is
accepted is a proof that its map is possible. That no other map is, follows from `switching`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from importlib.resources import files

import sympy as sp

from capsule_sym.symbolic.enclosure import Flow, first_order
from capsule_sym.symbolic.geometry import SCENARIOS
from capsule_sym.symbolic.model import SEGMENTS, Segment
from capsule_sym.symbolic.switching import LocalMap, guards, time_derivative
from capsule_sym.symbolic.symbols import (
    STATE,
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    zeta,
)

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


def _flow(witness: Witness, field: Segment) -> Flow:
    start = (*witness.end, *witness.forcing)
    return Flow(field, witness.parameters, start, sense=-1)


def _departs(witness: Witness, field: Segment) -> bool:
    """Whether the trajectory of a field through the end leaves it into the field's cell."""
    if field.stick and witness.end[2] != 0:
        return False
    flow = _flow(witness, field)
    series = [flow.series(guard) for guard in guards(field)]
    return all(one[first_order(one)] * (-1) ** first_order(one) > 0 for one in series)


def target(witness: Witness) -> str:
    """The plane on which the witness ends, by the field that takes over."""
    (following,) = [field for field in SEGMENTS if _departs(witness, field)]
    return f"Σ{following.index}" if witness.end[2] == 0 else _ENTRY_PLANE[following.index]


def source(witness: Witness) -> str | None:
    """The plane on which the witness is proved to begin; None where that is not proved."""
    field = SEGMENTS[witness.local_map.field - 1]
    flow = _flow(witness, field)
    late, early = witness.bracket
    if not all(flow.positive_until(guard, late) for guard in guards(field)):
        return None
    if field.stick:
        return f"Σ{field.index}"
    side, speed = guards(field)
    planes = {speed: f"Σ{field.index}", side: _ENTRY_PLANE[field.index]}
    for crossed, other in ((speed, side), (side, speed)):
        if (
            flow.negative_at(crossed, early)
            and flow.positive_within(time_derivative(crossed, field), witness.bracket)
            and flow.positive_within(other, witness.bracket)
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
