"""A page of any width: new or given, as many panels side by side as fit, and keys with room."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import proj3d
from numpy.typing import NDArray

from capsule_sym._figures.notebook import NotebookFigure
from capsule_sym._figures.style import figure_of

NARROW = 5.0
"""Inches of a page that has no room for panels of many texts side by side, nor for words."""

_RIM = 0.03  # inches that stay free beside a key, and between it and the panels
_LABEL = 22  # letters that fit beside a row
_SPARE = 3.0  # dots that stay free around a view
_FITTED = 6  # layouts of a view in perspective: its texts do not grow with it


def across(width: float, least: float, most: int) -> int:
    """Number of panels side by side, each of a least width in inches."""
    return max(1, min(most, int(width / least)))


def label_row(axes: Any, text: str) -> None:
    """The label upwards beside one of several rows: a long one has its unit or symbol below."""
    shown = re.sub(r"\\[a-z]+|[${}_]", "", text)
    axes.set_ylabel(re.sub(r" (?=[($])", "\n", text, count=1) if len(shown) > _LABEL else text)


def add_key(
    page: Figure | SubFigure, handles: Sequence[Any], *, below: bool = False, **looks: Any
) -> None:
    """A legend above or below all panels, in as many columns as fit; `looks` are its options.

    A page of ours grows by its height; on a user's the panels make room.
    """
    if not handles:
        return
    room = page.bbox.width - 2 * _RIM * figure_of(page).dpi
    count = len(handles)
    legend, (wide, high) = _legend(page, handles, count, below, looks)
    while wide > room and count > 1:
        # Columns are of one width at most: so many fit for certain, and one more is tried.
        count = max(1, min(count - 1, int(count * room / wide) + 1))
        count = -(-len(handles) // -(-len(handles) // count))  # as even as so many rows can be
        legend.remove()
        legend, (wide, high) = _legend(page, handles, count, below, looks)
    if wide > room:
        texts = legend.get_texts()
        letters = max(len(text.get_text()) for text in texts)
        for text in texts:
            text.set_text(textwrap.fill(text.get_text(), max(1, int(letters * room / wide) - 6)))
        wide, high = _size(legend)
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


def _legend(
    page: Figure | SubFigure,
    handles: Sequence[Any],
    columns: int,
    below: bool,
    looks: dict[str, Any],
) -> tuple[Legend, tuple[float, float]]:
    legend = page.legend(
        handles=handles,
        loc="outside lower center" if below else "outside upper center",
        ncols=columns,
        columnspacing=1.2,
        **looks,
    )
    return legend, _size(legend)


def _size(legend: Legend) -> tuple[float, float]:
    """Width and height in dots."""
    whole: Figure = legend.get_figure(root=True)  # type: ignore[assignment]
    box = legend.get_window_extent(FigureCanvasAgg(whole).get_renderer())  # type: ignore[no-untyped-call]
    return box.width, box.height


def _make_room(page: Figure | SubFigure, inches: float, below: bool) -> None:
    whole = figure_of(page)
    high = page.bbox.height / whole.dpi
    if isinstance(page, NotebookFigure):
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


def new_figure(width: float, height: float, **options: Any) -> Figure:
    """An empty figure, sizes in inches, that no global list of figures keeps."""
    return NotebookFigure(figsize=(width, height), **options)


def canvas(figure: Figure | SubFigure | None, width: float, height: float, **options: Any) -> Any:
    """Figure, or part of one, for a composed picture: the given one, or a new one.

    Sizes are in inches, and as `options` they are those of a new figure.
    """
    return new_figure(width, height, **options) if figure is None else figure


def axes_for(axes: Any, width: float, height: float, **grid: Any) -> tuple[Figure, Any]:
    """The axes to draw into and their figure: those given, or a grid of a new one, in inches."""
    if axes is not None:
        return figure_of(axes[0] if hasattr(axes, "__len__") else axes), axes
    figure = new_figure(width, height, layout="constrained")
    return figure, figure.subplots(**grid)


def size_of(figure: Figure | SubFigure) -> tuple[float, float]:
    """Width and height in inches of a figure, or of a part of one as it is now."""
    dots = figure_of(figure).dpi
    return figure.bbox.width / dots, figure.bbox.height / dots
