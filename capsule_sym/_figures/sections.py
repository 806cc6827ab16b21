"""How trajectories pass a surface or a line: bundles of them in plane sections (Figs. 3 to 5).

A bundle starts on the rim of a small window around a point and is drawn while it is inside:
where the paper sketches one trajectory, all its neighbours are drawn, from the exact map.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from capsule_sym._figures.style import Colours, field_colour
from capsule_sym._map import Trajectory
from capsule_sym._study.arcs import Array, opening
from capsule_sym._study.sections import SIGNS, Section, abscissa

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CROSSINGS = 12  # half-widths that a trajectory goes at most, at its first velocity
_RIM = 1.0001  # a start on the rim is inside
_LEAST = 3  # points before and after an arrow head


def draw_section(
    section: Section, bundle: Iterable[Trajectory], axes: Axes, colours: Colours = "safe"
) -> None:
    """A bundle of trajectories that starts on the rim of a section's window."""
    _, v_r, middle = section.state
    for trajectory in bundle:
        for arc in opening(trajectory, _CROSSINGS * section.across / abs(v_r)):
            x, y = abscissa(section, arc, trajectory.parameters), arc.v_c
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
    axes.set_xticks([-section.across / 2, 0, section.across / 2])
    axes.set_xlabel(_label(section))
    axes.set_ylabel("$v_c$")


def _label(section: Section) -> str:
    sign = SIGNS.get(section.piece)
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
