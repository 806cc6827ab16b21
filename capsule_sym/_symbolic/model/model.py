"""The six linear segments of the capsule system, Eqs. (7)-(12), built from their physics.

A segment is a choice of two things: whether the second spring is in contact, and what friction
does (drives against forward drift, against backward drift, or holds the capsule). Newton's
equations of the two bodies then give the field; nothing is typed six times.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from capsule_sym._symbolic.model.symbols import (
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
    zeta,
)

kappa = sp.Symbol("kappa", nonnegative=True)  # stiffness of the second spring while it acts

P = x_r + 2 * zeta * v_r + kappa * (x_r - delta)
"""Force of the inner mass on the capsule: the one place of the tree where its terms stand."""

# Auxiliary functions of Section 2.
P1 = v_c
P2 = x_r
P3 = P.subs(kappa, 0)
P4 = P.subs(kappa, beta)

_FRICTION_NAMES = {+1: "FD", 0: "S", -1: "BD"}


@dataclass(frozen=True)
class Segment:
    """One linear segment: whether the second spring acts, and the direction of drift.

    `drift` is +1 for forward drift, -1 for backward drift and 0 for stick.
    """

    index: int
    contact: bool
    drift: int

    @property
    def name(self) -> str:
        """Name of the field in the paper's notation, `F1` to `F6`."""
        return f"F{self.index}"

    @property
    def mode(self) -> str:
        """Mode of operation in the paper's notation, such as `NC-FD`."""
        return f"{'C' if self.contact else 'NC'}-{_FRICTION_NAMES[self.drift]}"

    @property
    def stick(self) -> bool:
        """Whether friction holds the capsule at rest."""
        return self.drift == 0

    @property
    def interaction(self) -> sp.Expr:
        """Force of the inner mass on the capsule: P3 without contact, P4 with it."""
        return P4 if self.contact else P3

    @property
    def friction(self) -> sp.Expr:
        """Force of the ground on the capsule: the Coulomb bound in drift, the reaction in stick."""
        return -self.interaction if self.stick else -self.drift * f_b

    @cached_property
    def field(self) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
        """Time derivatives of (x_r, v_r, v_c) at time tau, Eqs. (7)-(12)."""
        mass_acceleration = alpha * sp.cos(omega * tau) - self.interaction
        capsule_acceleration = sp.expand((self.interaction + self.friction) / gamma)
        return v_r, sp.expand(mass_acceleration - capsule_acceleration), capsule_acceleration


SEGMENTS: tuple[Segment, ...] = tuple(
    Segment(index, contact, drift)
    for index, (contact, drift) in enumerate(
        ((contact, drift) for contact in (False, True) for drift in (+1, 0, -1)), start=1
    )
)
"""The six segments, F1 to F6 in order."""


def segment(index: int) -> Segment:
    """The segment of field `F{index}`, index 1 to 6."""
    return SEGMENTS[index - 1]
