"""A figure that a notebook shows, with or without Matplotlib's own support for notebooks."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

from capsule_sym._figures.style import figure_style

_DENSE = 2  # dots of the picture in each of the page, for screens that have so many
_PAGE_DOTS = 96  # dots of a page in each inch


def on_page(figure: Figure) -> tuple[int, int]:
    """Width and height of a figure in dots of a page."""
    across, down = (round(_PAGE_DOTS * float(inches)) for inches in figure.get_size_inches())
    return across, down


class NotebookFigure(Figure):
    """A figure, and its picture where it is the value of a notebook's cell."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The picture, and the size at which it is shown."""
        picture = io.BytesIO()
        with figure_style():
            self.savefig(picture, format="png", dpi=_DENSE * _PAGE_DOTS)
        across, down = on_page(self)
        return picture.getvalue(), {"width": across, "height": down}
