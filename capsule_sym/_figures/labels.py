"""Names beside points of a drawing: on no line, no marker and no other name, and uncut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from capsule_sym._arrays import Matrix
from capsule_sym._figures.notebook import StyledFigure
from capsule_sym._figures.style import figure_of

CENTRED: dict[str, Any] = {"ha": "center", "va": "center_baseline", "size": "small", "zorder": 30}
"""Looks of a name within an area."""

LETTER = 5.0
"""Points from the middle of a name to the rim of an area that can hold it."""

_RIM = 3.5  # points from a named point to its name, so that a marker there stays free
_LED = 8.0  # points from which on a line leads to a name
_OFF = 2.0  # points between a name and the line that leads to it
_LOOKS: dict[str, Any] = {
    **{"margin": 0.003, "min_distance": 0.003, "max_distance": 0.6, "nbr_candidates": 1000},
    **{"textsize": "small", "zorder": 30, "linecolor": "black", "linewidth": 0.3},
}


def fix_layout(axes: Axes) -> float:
    """Lays a page out, for good if it is one of ours; returns its pixels in a point."""
    whole = figure_of(axes)
    whole.draw_without_rendering()
    if whole is axes.figure and isinstance(whole, StyledFigure):
        whole.set_layout_engine("none")
    return whole.dpi / 72


def drawn_lines(axes: Axes) -> list[Matrix]:
    """Lines of a drawing, in pixels."""
    found: list[Any] = []
    for line in axes.lines:
        if line.get_linestyle() != "None":
            found += line.get_path().to_polygons(line.get_transform(), closed_only=False)
    return [part for part in found if len(part) > 1]


def areas_of(axes: Axes) -> list[Any]:
    """Areas of a drawing, in pixels, one for each of its collections that has any."""
    import shapely

    turn = axes.transData.transform
    each = (
        [shapely.Polygon(turn(one.vertices)) for one in a.get_paths()] for a in axes.collections
    )
    # A part of a pixel more, so that neighbours are one area.
    return [shapely.unary_union([part.buffer(0.1) for part in parts]) for parts in each if parts]


def widest(axes: Axes, areas: Sequence[Any]) -> list[tuple[tuple[float, float], float]]:
    """Place inside each area, in pixels, that is farthest from its rim and lines, and how far."""
    import shapely

    lines = shapely.MultiLineString(drawn_lines(axes)).buffer(fix_layout(axes))
    free = (area.difference(lines) or area for area in areas)
    circles = map(shapely.maximum_inscribed_circle, free)
    back = axes.transData.inverted().transform
    return [((x, y), one.length) for one in circles for x, y in [back(one.coords[0])]]


def name_points(
    axes: Axes, points: Sequence[tuple[Any, str, str]], fills: Sequence[str] = ()
) -> None:
    """Name points of a drawing that is complete but for these names: place, text and colour.

    Where a point has no room beside it, a thin line leads to its name. With `fills` each name
    stands in a box of its own colour, and a line leads to it in any case.
    """
    import textalloc

    if not points:
        return
    places, texts, colours = zip(*points, strict=True)
    pixel, back = fix_layout(axes), axes.transData.inverted().transform
    axes.autoscale(False)  # lines that lead to names change no view
    boxes = [text.get_window_extent() for text in axes.texts]
    taken = [((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2) for box in boxes]
    radii = [max(box.width, box.height) / 2 for box in boxes]
    for line in axes.lines:
        if line.get_marker() != "None":
            marks = line.get_transform().transform(line.get_xydata())
            taken += marks.tolist()
            radii += [pixel * (line.get_markersize() / 2 + 1)] * len(marks)
    lines = [np.transpose(back(line)) for line in drawn_lines(axes)]
    given: dict[str, Any] = {}
    if taken:
        x, y = back(taken).T
        given |= {"x_scatter": x, "y_scatter": y, "scatter_sizes": radii}
    if lines:
        given |= {"x_lines": [x for x, _ in lines], "y_lines": [y for _, y in lines]}
    allocate: Any = textalloc.allocate  # its types are stricter than what it takes
    *_, names, leaders = allocate(
        axes,
        *np.transpose(places),
        texts,
        text_scatter_sizes=[pixel * _RIM] * len(texts),
        textcolor=colours,
        **given,
        **_LOOKS,
    )
    for k, (name, leader) in enumerate(zip(names, leaders, strict=True)):
        if fills:
            name.set_bbox({"facecolor": fills[k], "linewidth": 0.4, "pad": 0.8})
        elif leader:
            near, point = axes.transData.transform(leader.get_xydata())
            away = np.hypot(*(point - near)) / pixel
            if away < _LED:
                leader.remove()
            else:
                leader.set_data(*back([near + _OFF / away * (point - near), point]).T)
