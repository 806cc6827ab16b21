"""A page of any width: new or given, as many panels side by side as fit, and keys with room."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.notebook import StyledFigure, new_figure
from capsule_sym._figures.style import figure_of

NARROW = 5.0
"""Inches of a page that has no room for panels of many texts side by side, nor for words."""

_RIM = 0.03  # inches that stay free beside a key, and between it and the panels


def across(width: float, least: float, most: int) -> int:
    """Number of panels side by side, each of a least width in inches."""
    return int(max(1, min(most, width / least)))


def add_key(
    page: Figure | SubFigure, handles: Sequence[Any], *, below: bool = False, **looks: Any
) -> None:
    """A legend above or below all panels, in as many columns as fit; `looks` are its options.

    A page of ours grows by its height; on a user's the panels make room.
    """
    if not handles:
        return
    room = page.bbox.width - 2 * _RIM * figure_of(page).dpi
    looks |= {"handles": handles, "columnspacing": 1.2}
    looks["loc"] = "outside lower center" if below else "outside upper center"
    for rows in range(1, len(handles) + 1):
        columns = -(-len(handles) // rows)
        legend = page.legend(ncols=columns, **looks)
        wide, high = legend.get_window_extent().size
        if wide <= room or columns == 1:
            break
        legend.remove()
    if wide > room:
        texts = legend.get_texts()
        letters = max(len(text.get_text()) for text in texts)
        for text in texts:
            text.set_text(textwrap.fill(text.get_text(), max(1, int(letters * room / wide) - 6)))
        wide, high = legend.get_window_extent().size
    _make_room(page, high / figure_of(page).dpi + _RIM, below)


def handles_of(panels: Iterable[Any]) -> list[Any]:
    """Entries of the key of panels: one for each label, as first drawn."""
    found: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values())


def add_words(page: Figure | SubFigure, words: Iterable[str], *, below: bool = True) -> None:
    """A key of words alone, such as what the labels in the panels stand for."""
    handles = [Line2D([], [], linestyle="", label=one) for one in words]
    add_key(page, handles, below=below, handlelength=0, handletextpad=0)


def _make_room(page: Figure | SubFigure, inches: float, below: bool) -> None:
    whole = figure_of(page)
    high = page.bbox.height / whole.dpi
    if isinstance(page, StyledFigure):
        page.set_figheight(high + inches)
        share = high / (high + inches)
    else:
        share = max(0.1, 1 - inches / high)
    if isinstance(whole.get_layout_engine(), ConstrainedLayoutEngine):
        return
    for axes in page.axes:
        at = axes.get_position(original=True)
        axes.set_position(
            (at.x0, share * at.y0 + (1 - share if below else 0.0), at.width, share * at.height)
        )


def canvas(figure: Figure | SubFigure | None, width: float, height: float, **options: Any) -> Any:
    """The given figure or part of one, or a new figure of this size in inches, with `options`."""
    return new_figure(width, height, **options) if figure is None else figure


def axes_for(axes: Any, width: float, height: float, **grid: Any) -> tuple[Figure, Any]:
    """Figure and axes to draw into: those given, or a `grid` in a new figure, sizes in inches.

    Several given axes are a list, in their order. Raises InvalidInput for another number of axes
    than the grid has.
    """
    if axes is None:
        figure = new_figure(width, height, layout="constrained")
        return figure, figure.subplots(**grid)
    given = list(np.ravel([*axes.values()] if isinstance(axes, Mapping) else axes))
    count = grid.get("nrows", 1) * grid.get("ncols", 1)
    if len(given) != count or not all(isinstance(one, Axes) for one in given):
        raise InvalidInput("axes", axes, f"{count} axes of Matplotlib")
    return figure_of(given[0]), given if count > 1 else given[0]
