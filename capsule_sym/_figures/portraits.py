"""A motion in time and in the phase plane, its segments in the colours of their fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._figures.style import (
    LABELS,
    LOOKS,
    PAGE,
    Colours,
    field_colour,
    new_figure,
    styled,
)
from capsule_sym._parameters import Parameters
from capsule_sym._study.arcs import Arc, Motion, arcs
from capsule_sym._study.boundaries import lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

MODES = ("NC-FD", "NC-S", "NC-BD", "C-FD", "C-S", "C-BD")
_MARGIN = 0.08  # of the range of a curve, left free around it


def displacements(
    result: Motion, axes: Axes, *, periods: int = 3, colours: Colours = "safe"
) -> None:
    """Displacements of mass (dashed) and capsule (solid) against time (Fig. 7, left).

    Draws the last `periods` of a run or one period of an orbit; time and x_c count from the
    beginning.
    """
    drawn = arcs(result, periods)
    begin, origin = drawn[0].time[0], drawn[0].x_c[0]
    for arc in drawn:
        colour = field_colour(arc.field, colours)
        x_c = arc.x_c - origin
        axes.plot(arc.time - begin, x_c + arc.x_r, "--", color=colour, dashes=(2.5, 1.2))
        axes.plot(arc.time - begin, x_c, "-", color=colour)
    axes.set_xlim(0, drawn[-1].time[-1] - begin)
    axes.set_xlabel(LABELS["time"])
    axes.set_ylabel(LABELS["x"])


def phase_portrait(
    result: Motion, axes: Axes, *, periods: int = 1, colours: Colours = "safe"
) -> None:
    """The orbit in (x_r, v_r) with the boundary lines that cross the view (Fig. 7, right)."""
    drawn = arcs(result, periods)
    for arc in drawn:
        axes.plot(arc.x_r, arc.v_r, "-", color=field_colour(arc.field, colours), zorder=3)
    _frame(axes, drawn)
    draw_lines(result.parameters, axes)
    axes.set_xlabel(LABELS["x_r"])
    axes.set_ylabel(LABELS["v_r"])


def _frame(axes: Axes, drawn: list[Arc]) -> None:
    for values, limit in (
        (np.concatenate([arc.x_r for arc in drawn]), axes.set_xlim),
        (np.concatenate([arc.v_r for arc in drawn]), axes.set_ylim),
    ):
        low, high = float(values.min()), float(values.max())
        room = _MARGIN * (high - low) or 1.0
        limit(low - room, high + room)


def motion(result: Motion, *, periods: int = 3, colours: Colours = "safe") -> Figure:
    """Displacements and phase portrait side by side: a run's last periods, or an orbit."""
    with styled():
        figure = new_figure(PAGE, 2.4, layout="constrained")
        left, right = figure.subplots(1, 2)
        displacements(result, left, periods=periods, colours=colours)
        phase_portrait(result, right, periods=periods, colours=colours)
        return figure


def field_handles(colours: Colours = "safe") -> list[Line2D]:
    """Legend entries for the segments: F1 to F6 with their modes of operation."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=field_colour(field, colours), label=f"$F_{field}$ {mode}")
        for field, mode in enumerate(MODES, start=1)
    ]


def boundary_handles() -> list[Line2D]:
    """Legend entries for what else is in Fig. 7: mass and capsule, and the boundary lines."""
    from matplotlib.lines import Line2D

    looks: tuple[tuple[str, Any, str, float], ...] = (
        ("$x_m$", "--", "0.4", 1.1),
        ("$x_c$", "-", "0.4", 1.1),
        ("$L_2$", *LOOKS["L2"], 0.6),
        ("$L_3$", *LOOKS["L3"], 0.6),
        (r"$L_6\cup L_7$", *LOOKS["L6"], 0.6),
    )
    return [
        Line2D([], [], linestyle=style, color=colour, linewidth=width, label=label)
        for label, style, colour, width in looks
    ]


def draw_lines(parameters: Parameters, axes: Axes) -> None:
    """Draw the lines of P1 = 0 over the present view of axes in (x_r, v_r), and name them."""
    x_r, v_r = axes.get_xlim(), axes.get_ylim()
    for name, line in lines(parameters, x_r, v_r).items():
        style, colour = LOOKS[name]
        axes.plot(*line.T, style, color=colour, linewidth=0.6, zorder=1, label=name)
    axes.set_xlim(x_r)
    axes.set_ylim(v_r)
