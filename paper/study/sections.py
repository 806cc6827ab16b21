"""Windows around surfaces and lines, where bundles of trajectories start (Figs. 3 to 5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from capsule_sym import InvalidInput, Parameters
from capsule_sym._figures.arcs import Arc
from capsule_sym._figures.interface import Array, corners
from capsule_sym._map.interface import NumpyBackend

SCHEMATIC = Parameters(alpha=0.4, delta=0.4, zeta=0.3, beta=0.6)
"""Parameters at which the lines of Fig. 2 lie well apart; in the case study they are nearly
upright.
"""

_ON_EDGE = 9  # trajectories that start on one edge of a window
SIGNS = {"S1": 0, "S5": 0, "L1": 1, "L2": -1, "L3": 1, "L4": -1}
"""Pieces whose section shows the interaction force, with the multiple of f_b subtracted from it."""


class Section(NamedTuple):
    """Window around a point of a surface or line: its middle, and its half-widths.

    The middle is a state (x_r, v_r, v_c) at a phase (a time). The abscissa is x_r - delta across P2
    = delta, the interaction force less +-f_b across L1 to L4, and x_r - x_r0 elsewhere. The
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
        """Name of the piece, with its part if it has one, such as L2^(1)."""
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
    """State of a line L1 to L8 at a relative velocity v_r."""
    p, constants = parameters, NumpyBackend().constants
    if line in ("L1", "L2"):
        return constants(2, p).position_at(SIGNS[line] * p.f_b, v_r), v_r, 0.0
    if line in ("L3", "L4"):
        return constants(5, p).position_at(SIGNS[line] * p.f_b, v_r), v_r, 0.0
    return p.delta, v_r, 0.0


def abscissa(section: Section, arc: Arc, parameters: Parameters) -> Array:
    """Abscissa of an arc in a section."""
    sign = SIGNS.get(section.piece)
    if sign is None:
        return arc.x_r - parameters.delta
    if sign == 0:
        return arc.x_r - section.state[0]
    constants = NumpyBackend().constants(arc.field, parameters)
    gap = arc.x_r - constants.own_stop()
    force: Array = constants.pull(arc.x_r, gap, arc.v_r, np.cos(2 * np.pi * arc.time))
    return force - sign * parameters.f_b


def sections(parameters: Parameters) -> tuple[tuple[Section, ...], ...]:
    """Sections of Figs. 3, 4 and 5: of surfaces, of L1 to L4 and of L5 to L8.

    A line that does not exist at the parameters has no section. Raises InvalidInput without
    damping, where the corner points O1 and O2 are at infinity.
    """
    p, size = parameters, parameters.f_b
    if p.zeta == 0.0:
        raise InvalidInput("zeta", p.zeta, "above 0 for the switching surfaces' corner points")
    upper, lower = corners(p)
    long = upper - lower

    def on(line: str, v_r: float, up: float, part: int = 0) -> Section:
        return Section(line, line_point(p, line, v_r), 0.0, 0.1 * size, up * size, part)

    def between(line: str, v_r: float, share: float) -> float:
        """x_r at a share of the way from a line to the end of the gap."""
        x_r, _, _ = line_point(p, line, v_r)
        return float(x_r + share * (p.delta - x_r))

    fast, back = upper + 0.75 * long, upper - 0.75 * long
    areas = (
        Section("S1", (between("L1", fast, 1 / 3), fast, 0.0), 0.0, 0.1 * size, 0.02 * size),
        Section("S5", (between("L3", back, 0.36), back, 0.0), 0.0, 0.1 * size, 0.03 * size),
        Section("S7", (p.delta, size, 0.5 * size), 0.0, 0.1 * size, 0.02 * size),
    )
    (low2, high2), (low3, high3) = (_middle_part(p, line) for line in ("L2", "L3"))
    edges = [on("L1", upper + 0.3 * long, 0.02)]
    if low2 > lower:
        edges.append(on("L2", lower + 0.42 * (low2 - lower), 0.03, 1))
    edges.append(on("L2", max(high2, lower) + 0.41 * long, 0.03, 3))
    edges.append(on("L3", min(low3, upper) - 0.37 * long, 0.03, 1))
    if high3 < upper:
        edges.append(on("L3", (high3 + upper) / 2, 0.01, 3))
    edges.append(on("L4", lower - 0.5 * long, 0.02))
    gaps = [on("L5", max(upper, 0.0) + 0.24 * long, 0.02)]
    if upper > 0.0:
        gaps.append(on("L6", upper / 2, 0.05))
    middle = (0.48 * min(upper, 0.0) + 0.52 * lower) if lower < 0.0 else lower
    gaps += [on("L7", middle, 0.03), on("L8", lower - 0.5 * long, 0.02)]
    return areas, tuple(edges), tuple(gaps)


def _middle_part(parameters: Parameters, line: str) -> tuple[float, float]:
    """Ends in v_r of the middle part of L2 or L3, where the forcing decides the direction."""
    p, field, side = parameters, {"L2": 2, "L3": 5}[line], -SIGNS[line]
    c = NumpyBackend().constants(field, p)
    turn = -c.force_change(0.0, side * p.f_b)
    reach = c.force_change(0.0, p.alpha)
    slope = c.force_change(1.0, 0.0)
    return float((turn - reach) / slope), float((turn + reach) / slope)
