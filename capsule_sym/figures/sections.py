"""How trajectories pass a surface or a line: bundles of them in plane sections (Figs. 3 to 5).

A bundle starts on the rim of a small window around a point and is drawn while it is inside:
where the paper sketches one trajectory, all its neighbours are drawn, from the exact map.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from capsule_sym.figures.arcs import Arc, Array, opening
from capsule_sym.figures.guards import interaction
from capsule_sym.figures.style import Colours, field_colour, mathematical
from capsule_sym.generated import formulas
from capsule_sym.map import Trajectory
from capsule_sym.map.backend import NumpyBackend
from capsule_sym.parameters import Parameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ON_EDGE = 9  # trajectories that start on an edge of a window
_CROSSINGS = 12  # half-widths that a trajectory goes at most, at its first velocity
_RIM = 1.0001  # a start on the rim is inside
_LEAST = 3  # points before and after an arrow head
_SIGNS = {"S1": 0, "S5": 0, "L1": 1, "L2": -1, "L3": 1, "L4": -1}
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
        """The piece in mathematical type, with its part such as L2^(1) if it has one."""
        return mathematical(f"{self.piece}^({self.part})" if self.part else self.piece)

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
        return formulas.position_at(constants(2, p), _SIGNS[line] * p.f_b, v_r), v_r, 0.0
    if line in ("L3", "L4"):
        return formulas.position_at(constants(5, p), _SIGNS[line] * p.f_b, v_r), v_r, 0.0
    return p.delta, v_r, 0.0


def draw_section(
    section: Section, bundle: Iterable[Trajectory], axes: Axes, colours: Colours = "safe"
) -> None:
    """A bundle of trajectories that starts on the rim of a section's window."""
    _, v_r, middle = section.state
    for trajectory in bundle:
        for arc in opening(trajectory, _CROSSINGS * section.across / abs(v_r)):
            x, y = _abscissa(section, arc, trajectory.parameters), arc.v_c
            outside = (abs(x) > _RIM * section.across) | (abs(y - middle) > _RIM * section.up)
            inside = int(np.argmax(outside)) + 1 if outside.any() else len(x)
            colour = field_colour(arc.field, colours)
            axes.plot(x[:inside], y[:inside], color=colour, linewidth=0.8, label=f"F{arc.field}")
            _arrow(axes, x[:inside], y[:inside], colour)
            if outside.any():
                break
    if section.piece not in ("S1", "S5"):
        axes.axvline(0, color="black", linewidth=0.6, zorder=1)
    if abs(middle) < section.up:
        axes.axhline(0, color="black", linewidth=0.6, zorder=1)
    axes.set_xlim(-section.across, section.across)
    axes.set_ylim(middle - section.up, middle + section.up)
    axes.set_xlabel(_label(section))
    axes.set_ylabel("$v_c$")


def _abscissa(section: Section, arc: Arc, parameters: Parameters) -> Array:
    sign = _SIGNS.get(section.piece)
    if sign is None:
        return arc.x_r - parameters.delta
    if sign == 0:
        return arc.x_r - section.state[0]
    return interaction(arc, parameters) - sign * parameters.f_b


def _label(section: Section) -> str:
    sign = _SIGNS.get(section.piece)
    if sign is None:
        return r"$x_r-\delta$"
    if sign == 0:
        return "$x_r-x_{r0}$"
    force = 3 if section.piece in ("L1", "L2") else 4
    return rf"$P_{force}{'-' if sign > 0 else '+'}f_b$"


def _arrow(axes: Axes, x: Array, y: Array, colour: str) -> None:
    """An arrow head halfway along a curve that is long enough."""
    at = len(x) // 2
    if at < _LEAST:
        return
    axes.annotate(
        "",
        (x[at + 1], y[at + 1]),
        xytext=(x[at - 1], y[at - 1]),
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0, "mutation_scale": 6},
    )
