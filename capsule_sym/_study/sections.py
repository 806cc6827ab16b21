"""Windows around surfaces and lines, where bundles of trajectories start (Figs. 3 to 5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import NumpyBackend
from capsule_sym._parameters import Parameters
from capsule_sym._study.arcs import Arc, Array, interaction
from capsule_sym.generated import formulas

SCHEMATIC = Parameters(alpha=0.4, delta=0.4, zeta=0.3, beta=0.6)
"""Parameters at which the lines of Fig. 2 lie well apart; the case study's are nearly upright."""

_ON_EDGE = 9  # trajectories that start on an edge of a window
SIGNS = {"S1": 0, "S5": 0, "L1": 1, "L2": -1, "L3": 1, "L4": -1}
"""Pieces whose section shows the interaction force, and how many f_b it is measured from."""


class Section(NamedTuple):
    """A window around a point of a surface or line: its middle, and its half-widths.

    The middle is a state (x_r, v_r, v_c) at a phase (a time). The abscissa is x_r - delta across
    P2 = delta, the interaction force less +-f_b across L1 to L4, and x_r - x_r0 elsewhere; the
    ordinate is v_c.
    """

    piece: str
    state: tuple[float, float, float]
    phase: float
    across: float
    up: float
    part: int = 0

    @property
    def name(self) -> str:
        """The piece, with its part such as L2^(1) if it has one."""
        return f"{self.piece}^({self.part})" if self.part else self.piece

    def starts(self, parameters: Parameters) -> Array:
        """States on the rim of the window, shape (n, 3)."""
        x_r, v_r, v_c = self.state
        stiffness = 1 + parameters.beta if self.piece in ("L3", "L4") else 1.0
        along = np.linspace(-1, 1, _ON_EDGE)
        rim = [(u, w) for u in (-1.0, 1.0) for w in along]
        rim += [(u, w) for w in (-1.0, 1.0) for u in along[1:-1]]
        return np.array(
            [(x_r + u * self.across / stiffness, v_r, v_c + w * self.up) for u, w in rim]
        )


def line_point(parameters: Parameters, line: str, v_r: float) -> tuple[float, float, float]:
    """The state of a line L1 to L8 at a relative velocity v_r."""
    p, constants = parameters, NumpyBackend().constants
    if line in ("L1", "L2"):
        return formulas.position_at(constants(2, p), SIGNS[line] * p.f_b, v_r), v_r, 0.0
    if line in ("L3", "L4"):
        return formulas.position_at(constants(5, p), SIGNS[line] * p.f_b, v_r), v_r, 0.0
    return p.delta, v_r, 0.0


def abscissa(section: Section, arc: Arc, parameters: Parameters) -> Array:
    """The abscissa of an arc in a section."""
    sign = SIGNS.get(section.piece)
    if sign is None:
        return arc.x_r - parameters.delta
    if sign == 0:
        return arc.x_r - section.state[0]
    return interaction(arc, parameters) - sign * parameters.f_b


FIG3 = (
    Section("S1", (-0.6, 3.5, 0.0), 0.0, 0.1, 0.02),
    Section("S5", (1.0, -1.5, 0.0), 0.0, 0.1, 0.03),
    Section("S7", (SCHEMATIC.delta, 1.0, 0.5), 0.0, 0.1, 0.02),
)
FIG4 = (
    Section("L1", line_point(SCHEMATIC, "L1", 2.0), 0.0, 0.1, 0.02),
    Section("L2", line_point(SCHEMATIC, "L2", -1.7), 0.0, 0.1, 0.03, part=1),
    Section("L2", line_point(SCHEMATIC, "L2", 1.0), 0.0, 0.1, 0.03, part=3),
    Section("L3", line_point(SCHEMATIC, "L3", -1.0), 0.0, 0.1, 0.03, part=1),
    Section("L3", line_point(SCHEMATIC, "L3", 0.75), 0.0, 0.1, 0.01, part=3),
    Section("L4", line_point(SCHEMATIC, "L4", -4.0), 0.0, 0.1, 0.02),
)
FIG5 = (
    Section("L5", line_point(SCHEMATIC, "L5", 1.8), 0.0, 0.1, 0.02),
    Section("L6", line_point(SCHEMATIC, "L6", 0.5), 0.0, 0.1, 0.05),
    Section("L7", line_point(SCHEMATIC, "L7", -1.2), 0.0, 0.1, 0.03),
    Section("L8", line_point(SCHEMATIC, "L8", -4.0), 0.0, 0.1, 0.02),
)


def derivatives(
    parameters: Parameters, field: int, place: tuple[float, float], cosine: float
) -> tuple[float, float, float]:
    """(x_r', v_r', v_c') of a field on P1 = 0 at (x_r, v_r) and cos(omega tau), Eqs. (7)-(12)."""
    c, (x_r, v_r) = NumpyBackend().constants(field, parameters), place
    gap = x_r - parameters.delta
    driven = formulas.v_c_rate(c, formulas.margin_at(c, x_r, gap, v_r)) if c.drift else 0.0
    return v_r, formulas.v_rate(c, x_r, gap, v_r, cosine), driven
