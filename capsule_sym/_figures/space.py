"""The state space (x_r, v_r, v_c) in perspective: surfaces, lines, and trajectories among them.

The planes P1 = v_c = 0 and P2 = x_r = delta cut the view into four cells. The drawing is
ordered by hand, from the cell farthest from the eye to the nearest, so that a trajectory that
dips below a surface is seen through it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from capsule_sym._figures.arcs import Arc
from capsule_sym._figures.boundaries import Array, Limits, lines, surfaces
from capsule_sym._figures.style import LOOKS, Colours, field_colour
from capsule_sym._parameters import Parameters

EYE = (24.0, -64.0)  # elevation and azimuth in degrees
_TINT = 0.16
_ROOM = 0.06  # of a box, left free around what it holds
_WALL = "#9aa7b5"


class Box(NamedTuple):
    """The part of the state space that is drawn."""

    x_r: Limits
    v_r: Limits
    v_c: Limits

    def around(self, point: Iterable[float], fraction: float) -> Box:
        """A box of the same shape and a fraction of the size, centred on a state."""
        return Box(
            *(
                (v - fraction * (high - low) / 2, v + fraction * (high - low) / 2)
                for v, (low, high) in zip(point, self, strict=True)
            )
        )


def box_of(drawn: Iterable[Arc]) -> Box:
    """The smallest box that holds arcs and the plane P1 = 0, and some room around them."""
    states = np.concatenate([np.column_stack(arc.states) for arc in drawn])
    low, high = states.min(axis=0), states.max(axis=0)
    low[2], high[2] = min(low[2], 0.0), max(high[2], 0.0)
    spare = _ROOM * (high - low)
    spare[spare == 0] = 0.1
    return Box(*zip((low - spare).tolist(), (high + spare).tolist(), strict=True))


def add_space(figure: Figure, place: Any, box: Box, eye: tuple[float, float] = EYE) -> Any:
    """Axes of the state space at a place of the figure (a subplot specification)."""
    axes: Any = figure.add_subplot(place, projection="3d", computed_zorder=False)
    axes.view_init(*eye)
    axes.set(xlim=box.x_r, ylim=box.v_r, zlim=box.v_c)
    axes.set_xlabel("$x_r$", labelpad=-6.5)
    axes.set_ylabel("$v_r$", labelpad=-8)
    axes.set_zlabel("$v_c$", labelpad=-5)
    axes.tick_params(pad=-3)
    axes.tick_params(axis="z", pad=0)
    axes.set_box_aspect((1.6, 1.1, 0.8))
    axes.patch.set_visible(False)  # it would cover the texts of the view beside it
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set_visible(False)
        axis._axinfo["grid"].update(linewidth=0.0)
        axis.set_major_locator(MaxNLocator(4))
    return axes


def draw_space(parameters: Parameters, axes: Any, box: Box, colours: Colours = "safe") -> None:
    """The surfaces S1-S10 and the lines L1-L9 that meet the box."""
    order = _order(axes)
    if box.v_c[0] <= 0 <= box.v_c[1]:
        for name, polygon in surfaces(parameters, box.x_r, box.v_r).items():
            tint = field_colour(int(name[1:]), colours)
            axes.add_collection3d(
                Poly3DCollection(
                    [np.column_stack([polygon, np.zeros(len(polygon))])],
                    facecolor=tint,
                    alpha=_TINT,
                    edgecolor="none",
                    zorder=order["P1"],
                    label=name,
                )
            )
        for name, line in lines(parameters, box.x_r, box.v_r).items():
            style, colour = LOOKS[name]
            axes.plot(*line.T, 0, style, color=colour, lw=0.8, zorder=order["P1"] + 1, label=name)
    for name, wall in walls(parameters.delta, box).items():
        level = order["upper"] if name in ("S7", "S8") else order["lower"]
        axes.add_collection3d(
            Poly3DCollection(
                [wall], facecolor=_WALL, alpha=_TINT, edgecolor="none", zorder=level, label=name
            )
        )
    if box.x_r[0] <= parameters.delta <= box.x_r[1] and box.v_r[0] <= 0 <= box.v_r[1]:
        for v_c, side in (((box.v_c[0], 0), "lower"), ((0, box.v_c[1]), "upper")):
            if v_c[0] < v_c[1]:
                x_r = [parameters.delta] * 2
                level = order[side] + 1
                axes.plot(x_r, [0, 0], v_c, color="0.3", lw=0.8, ls="-.", zorder=level, label="L9")


def walls(delta: float, box: Box) -> dict[str, Array]:
    """The parts of S7-S10 in the box as rectangles (4, 3) of (x_r, v_r, v_c), absent if empty."""
    if not box.x_r[0] <= delta <= box.x_r[1]:
        return {}
    found = {}
    for name, v_r, v_c in (
        ("S7", (max(0.0, box.v_r[0]), box.v_r[1]), (max(0.0, box.v_c[0]), box.v_c[1])),
        ("S8", (box.v_r[0], min(0.0, box.v_r[1])), (max(0.0, box.v_c[0]), box.v_c[1])),
        ("S9", (max(0.0, box.v_r[0]), box.v_r[1]), (box.v_c[0], min(0.0, box.v_c[1]))),
        ("S10", (box.v_r[0], min(0.0, box.v_r[1])), (box.v_c[0], min(0.0, box.v_c[1]))),
    ):
        if v_r[0] < v_r[1] and v_c[0] < v_c[1]:
            found[name] = np.column_stack([[delta] * 4, (*v_r, *v_r[::-1]), np.repeat(v_c, 2)])
    return found


def draw_arcs(
    drawn: Iterable[Arc], axes: Any, colours: Colours = "safe", style: Any = "-", width: float = 1.2
) -> None:
    """Trajectories as arcs in the colours of their fields, cut at the walls of the box."""
    order = _order(axes)
    for arc in drawn:
        axes.plot(
            *arc.states,
            linestyle=style,
            color=field_colour(arc.field, colours),
            lw=width,
            zorder=order[arc.field],
            axlim_clip=True,
            label=f"F{arc.field}",
        )


def _order(axes: Any) -> dict[Any, int]:
    """Drawing order of the half-planes and the cells of F1-F6 as seen from above."""
    right = math.cos(math.radians(axes.azim)) > 0  # the eye is where x_r > delta
    far_low, near_low, far_high, near_high = (3, 6, 1, 4) if right else (6, 3, 4, 1)
    order: dict[Any, int] = {far_low: 1, "lower": 2, near_low: 4, "P1": 5, 2: 7, 5: 7}
    return order | {far_high: 8, "upper": 9, near_high: 11}
