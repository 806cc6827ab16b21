"""Figs. 6 and 7: motions one behind the other by amplitude, and panel by panel."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from capsule_sym._figures.arcs import Motion, cycle, is_periodic
from capsule_sym._figures.interface import (
    NARROW,
    PAGE,
    across,
    add_key,
    boundary_handles,
    canvas,
    describe,
    field_colour,
    field_handles,
    labels_of,
    styled,
    unsettled_handles,
)
from capsule_sym.figures import plot_displacements, plot_phase_portrait
from capsule_sym.results import Trajectory
from paper.figures.space import fit_view


@styled
def plot_fig6(
    motions: Sequence[Motion],
    heavy: Sequence[Motion] = (),
    *,
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """Motions in (x_r, v_r), one behind the other by alpha; the `heavy` in wide lines (Fig. 6).

    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    page = canvas(figure, width, (0.6 if width > NARROW else 0.75) * width)
    axes: Any = page.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", computed_zorder=False)
    axes.view_init(20, -62)
    axes.set_box_aspect((1.0, 1.9, 0.8), zoom=1.2)
    # The least alpha is nearest to the eye, and so is drawn last.
    widths = [(motion, 0.5) for motion in motions] + [(motion, 1.4) for motion in heavy]
    widths.sort(key=lambda pair: -pair[0].parameters.alpha)
    for level, (motion, wide) in enumerate(widths):
        alpha, settled = motion.parameters.alpha, is_periodic(motion)
        for arc in cycle(motion):
            colour = field_colour(arc.field, arc.scene) if settled else "0.6"
            depth = np.full_like(arc.x_r, alpha)
            axes.plot(
                arc.x_r,
                depth,
                arc.v_r,
                color=colour,
                lw=wide,
                zorder=level,
                label=f"_F{arc.field}" if settled else "_not periodic",
            )
    # Words would take a column from the motions.
    named = (
        labels_of(motions[0].parameters.scene)
        if width > NARROW
        else {"x_r": "$x_r$", "alpha": r"$\alpha$", "v_r": "$v_r$"}
    )
    axes.set_xlabel(named["x_r"], labelpad=-4)
    axes.set_ylabel(named["alpha"], labelpad=6 if width > NARROW else -4)
    axes.set_zlabel(named["v_r"], labelpad=-6)
    axes.tick_params(pad=-2)
    axes.locator_params(nbins=9 if width > NARROW else 5)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set_visible(False)
        axis._axinfo["grid"].update(linewidth=0.2, color="0.85")
    fit_view(axes)
    system = motions[0].parameters
    handles = field_handles(page, system.scene) + unsettled_handles(motions)
    if heavy:
        handles.append(Line2D([], [], color="0.4", linewidth=1.4, label="exact bifurcation"))
    add_key(page, handles)
    return describe(page, "Phase trajectories over the amplitude", parameters=system)


_PAIR = 3.0  # least width of a panel, a pair of axes, in inches
_ROW, _FOOT = 1.1, 0.2  # heights in inches: a row, the lowest labels


@styled
def plot_fig7(
    motions: Sequence[Trajectory],
    *,
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """Displacements of mass and capsule, and the phase portrait, of each motion (Fig. 7).

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
        _panel(motions[index], left, right, ascii_lowercase[index])
    for axes in grid[:-1].flat:
        axes.set_xlabel("")
    handles = field_handles(page) + boundary_handles(page)
    add_key(page, handles + unsettled_handles(motions))
    system = motions[0].parameters
    return describe(page, "Displacements and phase portraits", parameters=system)


def _panel(motion: Trajectory, left: Axes, right: Axes, letter: str) -> None:
    plot_displacements(motion, left)
    left.set_ylabel("$x_m$, $x_c$")
    plot_phase_portrait(motion, right)
    right.set_xlabel("$x_r$")
    right.set_ylabel("$v_r$", labelpad=0)
    left.set_title(rf"({letter})  $\alpha$ = {motion.parameters.alpha:g}", loc="left")
    steady = motion.steady()
    right.set_title(" ".join(steady.itinerary) if steady else "not settled", loc="left")
    for axes in (left, right):
        axes.locator_params(axis="y", nbins=4)
        axes.locator_params(axis="x", nbins=5)
