"""Figures where a person looks for them: in pyplot, and once in a notebook."""

from __future__ import annotations

import math
import threading
from contextlib import suppress
from io import BytesIO
from typing import Any

from matplotlib._pylab_helpers import Gcf
from matplotlib.figure import Figure

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.sizes import UNLISTED
from capsule_sym._figures.style import figure_style, on_page

_WRITERS = {"agg", "cairo", "pdf", "pgf", "ps", "svg"}  # backends that open no window
_MOST = 10  # figures that are open at a time then; matplotlib warns from 20 on


class StyledFigure(Figure):
    """A figure in the style of the package, on whichever page or screen it is drawn."""

    def draw(self, renderer: Any) -> None:
        """Draw in the style."""
        with figure_style():
            super().draw(renderer)

    def savefig(self, *given: Any, **named: Any) -> None:
        """Write in the style."""
        with figure_style():
            super().savefig(*given, **named)

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Picture as PNG, with two dots for each of `on_page`, and its size in dots of a page."""
        self.savefig(drawn := BytesIO(), format="png", dpi=2 * 96)
        return drawn.getvalue(), dict(zip(("width", "height"), on_page(self), strict=True))

    def _ipython_display_(self) -> None:
        """Show the picture as the value of a notebook's cell, and not at the cell's end again."""
        import matplotlib.pyplot as plt
        from IPython.display import display  # type: ignore[import-not-found]

        plt.close(self)
        data, size = self._repr_png_()
        display({"image/png": data}, metadata={"image/png": size}, raw=True)


def new_figure(width: float, height: float, **options: Any) -> Figure:
    """An empty figure, sizes in inches; in the main thread, outside of commands, pyplot's current.

    If its backend opens no window and ten are open, the oldest is closed. Raises InvalidInput for a
    width that is not above 0 and finite.
    """
    if not 0 < width < math.inf:
        raise InvalidInput("width", width, "a number of inches > 0")
    made: dict[str, Any] = {"figsize": (width, height), **options}
    if not UNLISTED.get() and threading.current_thread() is threading.main_thread():
        # A window that no screen can show is a matter of `show`: the file can be written.
        with suppress(ImportError):
            import matplotlib.pyplot as plt

            every = [manager.canvas.figure for manager in Gcf.get_all_fig_managers()]
            ours = [one for one in every if isinstance(one, StyledFigure)]
            # A loop that writes files does not collect figures, which no window shows.
            if plt.get_backend().lower() in _WRITERS and len(ours) >= _MOST:
                plt.close(ours[0])
            return plt.figure(FigureClass=StyledFigure, **made)
    return StyledFigure(**made)
