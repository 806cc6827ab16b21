"""The state space (x_r, v_r, v_c) in perspective: surfaces, lines, and trajectories among them.

A box, a pair of limits for each of (x_r, v_r, v_c), bounds the part that is drawn. S1-S6 and L1-L8
lie on the plane P1 = v_c = 0, S7-S10 and L9 on P2 = x_r = delta, Eqs. (13)-(14).

The planes P1 = v_c = 0 and P2 = x_r = delta cut the view into four cells. The drawing is
ordered by hand, from the cell farthest from the eye to the nearest, so that a trajectory that
dips below a surface is seen through it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from capsule_sym import Parameters
from capsule_sym._figures.arcs import Arc
from capsule_sym._figures.interface import (
    LOOKS,
    Array,
    Limits,
    field_colour,
    figure_of,
    lines,
)
from capsule_sym._map.interface import NumpyBackend

EYE = (24.0, -64.0)  # elevation and azimuth in degrees
_TINT = 0.16
_ROOM = 0.06  # of a box, left free around what it holds
_WALL = "#9aa7b5"
_SPARE = 3.0  # dots that stay free around a view
_FITTED = 6  # layouts of a view in perspective: its texts do not grow with it


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


def draw_space(parameters: Parameters, axes: Any, box: Box) -> None:
    """The surfaces S1-S10 and the lines L1-L9 that meet the box."""
    order = _order(axes)
    if box.v_c[0] <= 0 <= box.v_c[1]:
        for name, polygon in surfaces(parameters, box.x_r, box.v_r).items():
            tint = field_colour(int(name[1:]))
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


def draw_arcs(drawn: Iterable[Arc], axes: Any, style: Any = "-", width: float = 1.2) -> None:
    """Trajectories as arcs in the colours of their fields, cut at the walls of the box."""
    order = _order(axes)
    for arc in drawn:
        axes.plot(
            *arc.states,
            linestyle=style,
            color=field_colour(arc.field),
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


def surfaces(parameters: Parameters, x_r: Limits, v_r: Limits) -> dict[str, Array]:
    """Parts of S1-S6 in a rectangle of the plane P1 = 0, as polygons (n, 2) of (x_r, v_r).

    A surface that does not meet the rectangle is absent.
    """
    p, delta = parameters, parameters.delta
    rectangle = np.column_stack([(*x_r, *x_r[::-1]), np.repeat(v_r, 2)])
    free = _clip(rectangle, (-1.0, 0.0, delta))
    pressed = _clip(rectangle, (1.0, 0.0, -delta))
    found: dict[str, Array] = {}
    for first, half, stick in ((1, free, 2), (4, pressed, 5)):
        c = NumpyBackend().constants(stick, p)
        at_origin = c.force(0.0, -delta, 0.0)
        force = np.array([c.force_change(1.0, 0.0), c.force_change(0.0, 1.0), at_origin])
        above, below = (force + np.array([0.0, 0.0, bound]) for bound in (-p.f_b, p.f_b))
        parts = (_clip(half, above), _clip(_clip(half, -above), below), _clip(half, -below))
        found |= {f"S{first + i}": part for i, part in enumerate(parts) if len(part) > 2}
    return found


def _clip(polygon: Array, half_plane: Sequence[float] | Array) -> Array:
    """Part of a convex polygon where a x + b y + c >= 0, by Sutherland and Hodgman."""
    a, b, c = half_plane
    if not len(polygon):
        return polygon
    values = polygon @ (a, b) + c
    kept = []
    for i, (point, value) in enumerate(zip(polygon, values, strict=True)):
        before, previous = polygon[i - 1], values[i - 1]
        if (value >= 0) != (previous >= 0):
            kept.append(before + (point - before) * previous / (previous - value))
        if value >= 0:
            kept.append(point)
    return np.array(kept).reshape(-1, 2)


def fit_view(axes: Any, title: Text | None = None) -> None:
    """Lay a view in perspective so that its texts fill the place it has, and its title the corner.

    Matplotlib gives it a square, of which it fills a part, or more than it.
    """
    page = axes.get_figure(root=False)
    whole = figure_of(page)
    renderer = FigureCanvasAgg(whole).get_renderer()  # type: ignore[no-untyped-call]
    place: Bbox = axes.get_position(original=True)
    size = np.array([page.bbox.width, page.bbox.height])
    low, high = (size * corner for corner in (place.min, place.max))
    head = 0.0
    if title is not None:
        title.set_in_layout(False)
        head = title.get_window_extent(renderer).height
    low, high = low + _SPARE, high - _SPARE
    room = high - low - (0.0, head)
    origin = np.array([page.bbox.x0, page.bbox.y0])
    side: NDArray[np.float64] = np.full(2, min(room))
    middle = low + room / 2
    for _ in range(_FITTED):
        axes.set_position((*((middle - side / 2) / size), *(side / size)))
        axes.apply_aspect()
        axes.M = axes.get_proj()
        drawn = _extent(axes, renderer)
        # Texts do not grow with it, so that it takes a few steps.
        side = side * min(room / np.array([drawn.width, drawn.height]))
        centre = np.array([drawn.x0 + drawn.x1, drawn.y0 + drawn.y1]) / 2
        middle = middle + low + room / 2 - (centre - origin)
    if title is not None:
        corner = origin + np.array([low[0], high[1] - head])
        x, y = title.get_transform().inverted().transform(corner)
        title.set_position((x, y))


def _extent(axes: Any, renderer: Any) -> Bbox:
    """Extent of a view in perspective, in dots: the corners of its box, and axes with texts."""
    corners = np.array(list(product(axes.get_xlim(), axes.get_ylim(), axes.get_zlim())))
    x, y, _ = proj3d.proj_transform(*corners.T, axes.get_proj())
    at = axes.transData.transform(np.column_stack([x, y]))
    beside = [axis.get_tightbbox(renderer) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    return Bbox.union([Bbox([at.min(axis=0), at.max(axis=0)]), *filter(None, beside)])


def size_of(figure: Figure | SubFigure) -> tuple[float, float]:
    """Width and height in inches of a figure, or of a part of one as it is now."""
    dots = figure_of(figure).dpi
    return figure.bbox.width / dots, figure.bbox.height / dots
