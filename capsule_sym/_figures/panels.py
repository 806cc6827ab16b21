"""Fig. 7: displacements and phase portraits of steady motions, panel by panel."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase
from typing import TYPE_CHECKING

from capsule_sym._figures.portraits import (
    boundary_handles,
    field_handles,
    plot_displacements,
    plot_phase_portrait,
)
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    Colours,
    canvas,
    describe,
    figure_of,
    figure_style,
    itinerary,
    size_of,
)
from capsule_sym._map import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

_ACROSS = 2  # panels side by side, each a pair of axes
_ROW, _HEAD, _FOOT = 1.1, 0.5, 0.35  # heights in inches: a row, the legend, the lowest labels


def plot_fig7(
    motions: Sequence[Trajectory],
    *,
    colours: Colours = "safe",
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """Displacements of mass and capsule, and phase portraits, one panel a motion (Fig. 7).

    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    rows = -(-len(motions) // _ACROSS)
    with figure_style():
        page = canvas(figure, width, _HEAD + rows * _ROW + _FOOT)
        _, height = size_of(page)
        places = {
            **{"left": 0.055, "right": 0.985, "wspace": 0.3, "hspace": 0.42},
            **{"bottom": (_FOOT + 0.05) / height, "top": 1 - _HEAD / height},
        }
        laid = figure_of(page).get_layout_engine() is not None
        kept = {} if laid else places
        grid = page.subplots(rows, 2 * _ACROSS, squeeze=False, gridspec_kw=kept)
        for index, left in enumerate(grid[:, ::2].flat):
            right = grid[:, 1::2].flat[index]
            if index >= len(motions):
                left.set_axis_off()
                right.set_axis_off()
                continue
            _panel(motions[index], left, right, ascii_lowercase[index], colours)
        for axes in grid[:-1].flat:
            axes.set_xlabel("")
        handles = field_handles(page, colours) + boundary_handles(page)
        page.legend(handles=handles, loc="outside upper center", ncols=7, columnspacing=1.2)
        system = motions[0].parameters
        return describe(page, "Displacements and phase portraits", parameters=system)


def _panel(motion: Trajectory, left: Axes, right: Axes, letter: str, colours: Colours) -> None:
    plot_displacements(motion, left, colours=colours)
    left.set_ylabel("$x_m$, $x_c$")
    plot_phase_portrait(motion, right, colours=colours)
    right.set_xlabel("$x_r$")
    right.set_ylabel("$v_r$", labelpad=0)
    left.set_title(rf"({letter})  $\alpha$ = {motion.parameters.alpha:g}", loc="left")
    steady = motion.steady()
    if steady:
        right.set_title(itinerary(steady.itinerary), loc="left")
    for axes in (left, right):
        axes.locator_params(axis="y", nbins=4)
        axes.locator_params(axis="x", nbins=5)
