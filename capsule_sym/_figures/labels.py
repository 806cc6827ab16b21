"""Names beside points of a drawing: on no line, no marker and no other name, and uncut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from capsule_sym._figures.notebook import StyledFigure
from capsule_sym._figures.style import figure_of

_RIM = 3.5  # points from a named point to its name, so that a marker there stays free
_LED = 8.0  # points from which on a line leads to a name
_NEAR = 1.5  # times as far as its own point: a nearer one could be taken for that of the name
_LOOKS: dict[str, Any] = {
    **{"margin": 0.003, "min_distance": 0.003, "max_distance": 0.6, "nbr_candidates": 1000},
    **{"textsize": "small", "zorder": 30, "linecolor": "black", "linewidth": 0.3},
}


def name_points(axes: Axes, points: Sequence[tuple[Any, str, str]]) -> None:
    """Name points of a drawing that is complete but for these names: place, text and colour.

    Where a point has no room beside it, a thin line leads to its name. In a part of a figure each
    name is above its point, to the right. Else views of the axes, and the layout of a page of ours,
    are fixed from then on.
    """
    import textalloc

    if not points:
        return
    if axes.figure is not figure_of(axes):  # which textalloc does not draw into
        for place, text, colour in points:
            beside: dict[str, Any] = {"xytext": (3, 3), "textcoords": "offset points"}
            axes.annotate(text, place, color=colour, fontsize="small", **beside)
        return
    places, texts, colours = zip(*points, strict=True)
    whole, x, y = figure_of(axes), *np.transpose(places)
    whole.draw_without_rendering()  # lays the page out, for good if it is one of ours
    if isinstance(whole, StyledFigure):
        whole.set_layout_engine("none")
    axes.autoscale(False)  # lines that lead to names change no view
    pixel = whole.dpi / 72
    rims = [_RIM * pixel] * len(texts)
    lines = [
        np.asarray(line.get_xydata()).T for line in axes.lines if line.get_linestyle() != "None"
    ]
    shown = [line for line in lines if line.shape[1] > 1]
    allocate: Any = textalloc.allocate  # its types are stricter than what it takes
    # tqdm would start a thread and take locks for a bar that is not shown, and drawing may hang.
    for module in (textalloc, textalloc.non_overlapping_boxes):
        vars(module)["tqdm"] = lambda steps, **_: steps
    *_, leaders = allocate(
        axes,
        x,
        y,
        texts,
        x_scatter=x,
        y_scatter=y,
        scatter_sizes=rims,
        text_scatter_sizes=rims,
        x_lines=[along for along, _ in shown],
        y_lines=[up for _, up in shown],
        textcolor=colours,
        **_LOOKS,
    )
    circles = axes.transData.transform(np.column_stack([x, y]))
    for leader in filter(None, leaders):
        near, point = axes.transData.transform(leader.get_xydata())
        own, away = np.hypot(*(point - near)), np.hypot(*(circles - near).T)
        # Without a line a name is read as that of the nearest point.
        if own < _LED * pixel and np.sum(away < _NEAR * own) < 2:
            leader.remove()
