"""Witnesses that the local maps of Table 3 occur, each checked in exact rational arithmetic.

A witness gives rational parameters and a rational state at the END of the map, with the values
of alpha cos(omega tau) and alpha sin(omega tau) there, which determine alpha. The field is
followed backwards in a rigorous enclosure: the trajectory stays in the cell of the field until it
meets, transversally, the surface on which the map began. All comparisons are of rational numbers,
so an accepted witness proves that its map is possible.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    SEGMENTS,
    Linear,
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    time_derivative,
    zeta,
)
from paper.derived.enclosure import RationalFlow, first_order
from paper.derived.local_maps import SCENARIOS, LocalMap

ENTRY_PLANE = {1: "Σ8", 3: "Σ10", 4: "Σ7", 6: "Σ9"}
"""Plane on which a moving capsule's impact begins a field."""


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
    def parameters(self) -> dict[sp.Symbol, sp.Expr]:
        """Parameters as exact numbers."""
        values = {delta: self.delta, zeta: self.zeta, beta: self.beta, gamma: self.gamma}
        exact = {symbol: sp.Rational(value) for symbol, value in values.items()}
        amplitude = sp.sqrt(sum(sp.Rational(part) ** 2 for part in self.forcing))
        return exact | {alpha: amplitude, omega: sp.Integer(1), f_b: sp.Integer(1)}

    @property
    def regime(self) -> tuple[str, bool]:
        """Scenario of delta, and True with damping."""
        name = next(n for n, r in SCENARIOS.items() if r.subs(self.parameters) == sp.true)
        return name, self.zeta > 0


def _flow(witness: Witness, field: Linear) -> RationalFlow:
    start = (*witness.end, *witness.forcing)
    return RationalFlow(field, witness.parameters, start, sense=-1)


def _departs(witness: Witness, field: Linear) -> bool:
    """True if the trajectory of a field through the end leaves it into the field's cell."""
    if field.stick and witness.end[2] != 0:
        return False
    flow = _flow(witness, field)
    series = [flow.series(guard) for guard in field.guards]
    return all(one[first_order(one)] * (-1) ** first_order(one) > 0 for one in series)


def target(witness: Witness) -> str:
    """Plane on which the witness ends, from the successor field."""
    (following,) = [field for field in SEGMENTS if _departs(witness, field)]
    return f"Σ{following.index}" if witness.end[2] == 0 else ENTRY_PLANE[following.index]


def source(witness: Witness) -> str | None:
    """Plane on which the witness is proved to begin; None if that is not proved."""
    field = SEGMENTS[witness.local_map.field - 1]
    flow = _flow(witness, field)
    late, early = witness.bracket
    if not all(flow.positive_until(guard, late) for guard in field.guards):
        return None
    if field.stick:
        return f"Σ{field.index}"
    side, speed = field.guards
    planes = {speed: f"Σ{field.index}", side: ENTRY_PLANE[field.index]}
    for crossed, other in ((speed, side), (side, speed)):
        if (
            flow.negative_at(crossed, early)
            and flow.positive_within(time_derivative(crossed, field), witness.bracket)
            and flow.positive_within(other, witness.bracket)
        ):
            return planes[crossed]
    return None


def witness_text(witness: Witness) -> dict[str, str]:
    """Witness in exact numbers, as text."""
    cosine, sine = witness.forcing
    return {
        **{str(symbol): str(value) for symbol, value in witness.parameters.items()},
        "end (x_r, v_r, v_c)": ", ".join(map(str, witness.end)),
        "alpha cos(omega tau)": str(cosine),
        "alpha sin(omega tau)": str(sine),
        "duration": "between {} and {}".format(*witness.bracket),
    }


def proves(witness: Witness) -> bool:
    """Check that the witness proves that its local map occurs."""
    wanted = witness.local_map
    return target(witness) == wanted.target and source(witness) == wanted.source


@cache
def witnesses() -> tuple[Witness, ...]:
    """Stored witnesses: at least one for every local map in every regime that allows it."""
    text = (files(__package__) / "witnesses.json").read_text(encoding="utf-8")
    return tuple(map(_witness, json.loads(text)))


def _witness(record: Mapping[str, Any]) -> Witness:
    target, field, source = record["map"]
    exact: dict[str, Any] = {n: Fraction(record[n]) for n in ("delta", "zeta", "beta", "gamma")}
    exact |= {n: tuple(map(Fraction, record[n])) for n in ("end", "forcing", "bracket")}
    return Witness(LocalMap(f"Σ{target}", field, f"Σ{source}"), **exact)
