"""Fig. 7: displacements and phase portraits of steady motions, panel by panel."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase
from typing import TYPE_CHECKING

from capsule_sym._figures.layout import across, add_key
from capsule_sym._figures.pages import canvas
from capsule_sym._figures.portraits import (
    boundary_handles,
    field_handles,
    plot_displacements,
    plot_phase_portrait,
    unsettled_handles,
)
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import Colours, describe, figure_style, itinerary
from capsule_sym._map import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

_PAIR = 3.0  # least width of a panel, a pair of axes, in inches
_ROW, _FOOT = 1.1, 0.2  # heights in inches: a row, the lowest labels


@figure_style()
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
    pairs = across(width, _PAIR, 2)
    rows = -(-len(motions) // pairs)
    page = canvas(figure, width, rows * _ROW + _FOOT, layout="constrained")
    grid = page.subplots(rows, 2 * pairs, squeeze=False)
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
    add_key(page, handles + unsettled_handles(motions))
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
    right.set_title(itinerary(steady.itinerary) if steady else "not periodic", loc="left")
    for axes in (left, right):
        axes.locator_params(axis="y", nbins=4)
        axes.locator_params(axis="x", nbins=5)
