"""The linear segments of the declared model, Eqs. (7)-(12) of the capsule, built from its physics.

A segment is a choice of the stop that the mass is in contact with, if any, of the mode of friction
(forward drift, backward drift, or rest) and, with pulses, of their level. Newton's equations of the
two bodies then give the field.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import sympy as sp

from capsule_sym._symbolic.model.parts import Mode, SpringRange, excess
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    PULSED,
    PULSES,
    force,
    gamma,
    stop,
    v_c,
    v_r,
    x_r,
)

kappa = MODEL.stiffness  # of a stop's spring while it acts
P = MODEL.force
"""Force of the inner mass on the capsule, by springs and damper."""
DRIVE = MODEL.drive_force
"""Force of the drive on the mass."""
REACTS = MODEL.reacts
"""True if the drive pushes the capsule back."""
PULL = MODEL.capsule_force
"""Pull Q on the capsule, which friction works against: P, less the drive where that reacts."""

# Auxiliary functions of Section 2.
P1 = v_c
P2 = x_r
P3, P4 = (P.subs({kappa: one.stiffness, stop: MODEL.stops[0]}) for one in MODEL.regions[:2])
Q3 = PULL.subs({kappa: MODEL.regions[0].stiffness, stop: MODEL.stops[0]})

FORWARD, BACKWARD = MODEL.bounds[1], MODEL.bounds[-1]
"""Friction bounds: at rest -BACKWARD < Q < FORWARD."""
LOAD = MODEL.load
"""Constant force on the mass besides drive and interaction."""
WEIGHT = MODEL.weight
"""Constant force on the capsule backward, which the friction bounds contain."""

high = sp.Symbol("high", nonnegative=True)  # 1 while pulses are at their high level, else 0
LEVELS: tuple[sp.Expr, ...] = (PULSES.amplitude, PULSES.low) if PULSES else (sp.S.Zero,)
"""Levels of pulses, the high one first; 0 if no part of the drive is constant in a field."""
ANY = -1  # level of a segment in which pulses are the symbol `force`
LEVEL = LEVELS[0] * high + LEVELS[1] * (1 - high) if PULSED else sp.S.Zero
"""Level of pulses in a segment: each is multiplied by 0 or 1, which is exact."""
STEADY = LOAD + LEVEL
"""Constant force on the mass in a segment besides interaction: load, and level of pulses."""


def friction_of(way: sp.Expr) -> sp.Expr:
    """Friction in drift in a direction: Q where that drift begins, and 0 at rest (direction 0).

    If the bounds differ, each is multiplied by 0, 1 or -1, which is exact.
    """
    if FORWARD == BACKWARD:
        return way * FORWARD
    return FORWARD * way * (way + 1) / 2 - BACKWARD * way * (way - 1) / 2


def bound_of(way: sp.Expr) -> sp.Expr:
    """Friction bound of drift in a direction (1, -1), above 0."""
    if FORWARD == BACKWARD:
        return FORWARD
    return FORWARD * (1 + way) / 2 + BACKWARD * (1 - way) / 2


@dataclass(frozen=True)
class Linear:
    """One linear segment: the stop whose spring acts, the direction of drift, and a level.

    `drift` is +1 for forward drift, -1 for backward drift and 0 for stick.
    """

    index: int
    region: SpringRange
    way: Mode
    level: int = 0
    """Number of the drive's level from 0; ANY for the symbol `force` in place of pulses."""

    @property
    def contact(self) -> int:
        """The stop whose spring acts: 1 in front, 2 behind, 0 for none."""
        return MODEL.regions.index(self.region)

    @property
    def stop(self) -> sp.Expr:
        """x_r where the segment's spring begins to act; without contact that of the front stop."""
        return MODEL.stops[max(self.contact - 1, 0)]

    @property
    def drift(self) -> int:
        """The direction of drift."""
        return self.way.way

    @property
    def name(self) -> str:
        """Name of the field in the paper's notation, such as `F1`."""
        return f"F{self.index}"

    @property
    def mode(self) -> str:
        """Mode of operation in the paper's notation: `NC-FD`, with pulses `NC-FD-H` or `-L`."""
        levels = {0: "-H", 1: "-L"} if PULSED else {}
        return f"{self.region.name}-{self.way.name}{levels.get(self.level, '')}"

    @property
    def stick(self) -> bool:
        """True if friction holds the capsule at rest."""
        return self.drift == 0

    def here(self, expression: sp.Expr) -> sp.Expr:
        """An expression with this segment's stiffness and place of its stop, and its level."""
        found = expression.subs({kappa: self.region.stiffness, stop: self.stop})
        return found.subs(force, LEVELS[self.level]) if PULSED and self.level != ANY else found

    @property
    def interaction(self) -> sp.Expr:
        """Force of the inner mass on the capsule: P3 without contact, P4 in contact in front."""
        return self.here(P)

    @property
    def pull(self) -> sp.Expr:
        """The pull on the capsule, in this segment."""
        return self.here(PULL)

    @property
    def friction(self) -> sp.Expr:
        """Friction on the capsule, with its sign: the bound in drift, minus the pull in stick.

        On a slope it contains the capsule's weight, as the bounds do.
        """
        return -self.pull if self.stick else self.way.friction

    @cached_property
    def guards(self) -> tuple[sp.Expr, ...]:
        """Functions that are positive in the field's cell, each 0 on a part of its boundary.

        Those of contact come first. The cell of a field of rest also needs v_c = 0.
        """
        return tuple(self.here(excess(one)) for one in (*self.region.where, *self.way.where))

    @cached_property
    def field(self) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
        """Time derivatives of (x_r, v_r, v_c) at time tau, Eqs. (7)-(12)."""
        capsule_acceleration = sp.expand((self.pull + self.friction) / gamma)
        mass_acceleration = self.here(MODEL.mass_force)
        return v_r, sp.expand(mass_acceleration - capsule_acceleration), capsule_acceleration


_KINDS = tuple(product(MODEL.regions, MODEL.modes))
SEGMENTS: tuple[Linear, ...] = tuple(
    Linear(index, region, mode, level)
    for index, (level, (region, mode)) in enumerate(product(range(len(LEVELS)), _KINDS), start=1)
)
"""The segments, F1 and so on; with pulses those of the high level, then of the low one."""
ANY_LEVEL = tuple(Linear(index, *kind, ANY) for index, kind in enumerate(_KINDS, start=1))
"""Segments for any level of the drive, by which signs of guards are derived."""


def segment(index: int) -> Linear:
    """Segment number `index` of `ANY_LEVEL`, from 1 on."""
    return ANY_LEVEL[index - 1]
