"""What is drawn into: a new figure, part of one, or axes that are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from capsule_sym._figures.style import figure_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure


def new_figure(width: float, height: float, **options: Any) -> Figure:
    """An empty figure, sizes in inches, that no global list of figures keeps."""
    from capsule_sym._figures.notebook import NotebookFigure

    return NotebookFigure(figsize=(width, height), **options)


def canvas(figure: Figure | SubFigure | None, width: float, height: float, **options: Any) -> Any:
    """What a composed picture is drawn into: the figure or part of one that is given, or a new one.

    Sizes are in inches, and as `options` they are those of a new figure.
    """
    return new_figure(width, height, **options) if figure is None else figure


def axes_for(
    axes: Any,
    width: float,
    height: float,
    margins: tuple[float, float, float, float] | None = None,
    **grid: Any,
) -> tuple[Figure, Any]:
    """The axes to draw into, with their figure: those that are given, or a grid of a new figure's.

    Sizes are in inches. `margins` are where the axes begin from the left in inches, and where they
    end on the right and begin and end upwards in shares of the figure; else they fit their texts.
    """
    if axes is not None:
        return figure_of(axes[0] if hasattr(axes, "__len__") else axes), axes
    figure = new_figure(width, height, layout=None if margins else "constrained")
    if margins:
        left, right, bottom, top = margins
        figure.subplots_adjust(left=left / width, right=right, bottom=bottom, top=top)
    return figure, figure.subplots(**grid)


def size_of(figure: Figure | SubFigure) -> tuple[float, float]:
    """Width and height in inches of a figure, or of a part of one as it is now."""
    dots = figure_of(figure).dpi
    return figure.bbox.width / dots, figure.bbox.height / dots
