"""A motion in time and in the phase plane, its segments in the colours of their fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._figures.layout import across, add_key
from capsule_sym._figures.pages import axes_for
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    LABELS,
    LOOKS,
    Colours,
    describe,
    field_colour,
    figure_style,
    mathematical,
)
from capsule_sym._figures.units import Units
from capsule_sym._map.segments import MODES
from capsule_sym._parameters import Parameters, PhysicalParameters
from capsule_sym._study.arcs import Arc, Motion, arcs, cycle, is_periodic
from capsule_sym._study.boundaries import lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_MARGIN = 0.08  # of the range of a curve, left free around it


def plot_displacements(
    result: Motion,
    axes: Axes,
    *,
    periods: int = 3,
    colours: Colours = "safe",
    device: PhysicalParameters | None = None,
) -> None:
    """Displacements of mass (dashed) and capsule (solid) against time (Fig. 7, left).

    Draws the last `periods` of a run or one period of an orbit; time and x_c count from the
    beginning. In SI units with the `device` whose motion it is.
    """
    units = Units.of_motion(device, result.parameters)
    drawn = [units.arc(arc) for arc in arcs(result, periods)]
    begin, origin = drawn[0].time[0], drawn[0].x_c[0]
    for arc in drawn:
        colour = field_colour(arc.field, colours)
        x_c = arc.x_c - origin
        looks: dict[str, Any] = {"color": colour, "label": f"_F{arc.field}"}
        axes.plot(arc.time - begin, x_c + arc.x_r, "--", dashes=(2.5, 1.2), **looks)
        axes.plot(arc.time - begin, x_c, "-", **looks)
    axes.set_xlim(0, drawn[-1].time[-1] - begin)
    axes.set_xlabel(units.label("time"))
    axes.set_ylabel(units.label("x_c", LABELS["x"]))


def plot_phase_portrait(
    result: Motion,
    axes: Axes,
    *,
    periods: int | None = None,
    colours: Colours = "safe",
    device: PhysicalParameters | None = None,
) -> None:
    """The orbit in (x_r, v_r) with the boundary lines that cross the view (Fig. 7, right).

    Of a run its last `periods`; if not given, those of its steady motion. Thin where it does not
    end in one. In SI units with the `device` whose motion it is.
    """
    units = Units.of_motion(device, result.parameters)
    shown = cycle(result) if periods is None else arcs(result, periods)
    drawn = [units.arc(arc) for arc in shown]
    for arc in drawn:
        looks: dict[str, Any] = {"label": f"_F{arc.field}", "zorder": 3}
        looks["linewidth"] = 1.1 if is_periodic(result) else 0.4
        axes.plot(arc.x_r, arc.v_r, "-", color=field_colour(arc.field, colours), **looks)
    _frame(axes, drawn)
    draw_lines(result.parameters, axes, units)
    axes.set_xlabel(units.label("x_r"))
    axes.set_ylabel(units.label("v_r"))


def _frame(axes: Axes, drawn: list[Arc]) -> None:
    for values, limit in (
        (np.concatenate([arc.x_r for arc in drawn]), axes.set_xlim),
        (np.concatenate([arc.v_r for arc in drawn]), axes.set_ylim),
    ):
        low, high = float(values.min()), float(values.max())
        room = _MARGIN * (high - low) or 1.0
        limit(low - room, high + room)


@figure_style()
def plot_motion(
    result: Motion,
    *,
    periods: int = 3,
    colours: Colours = "safe",
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: PhysicalParameters | None = None,
) -> Figure:
    """Displacements and phase portrait side by side: a run's last periods, or an orbit.

    The portrait is that of the steady motion at the run's end; the legend says if it is none.
    Drawn into two `axes` if they are given, and in SI units with the `device` whose motion it is.
    """
    side = across(width, 2.4, 2)
    figure, (left, right) = axes_for(axes, width, 2.3 * (3 - side), nrows=3 - side, ncols=side)
    plot_displacements(result, left, periods=periods, colours=colours, device=device)
    plot_phase_portrait(result, right, colours=colours, device=device)
    if axes is None:
        handles = field_handles(figure, colours) + boundary_handles(figure)
        add_key(figure, handles + unsettled_handles([result]))
    return describe(figure, "Displacements and phase portrait", parameters=result.parameters)


def field_handles(figure: Figure, colours: Colours = "safe") -> list[Line2D]:
    """Legend entries for the segments that are drawn: of F1 to F6, with their modes of operation.

    What is drawn of a segment is labelled by its field, such as F1 or _F1.
    """
    from matplotlib.lines import Line2D

    drawn = labels_of(figure)
    return [
        Line2D([], [], color=field_colour(field, colours), label=f"$F_{field}$ {mode}")
        for field, mode in enumerate(MODES, start=1)
        if drawn & {f"F{field}", f"_F{field}"}
    ]


def unsettled_handles(motions: Sequence[Motion]) -> list[Line2D]:
    """Legend entry for motions that are not periodic; none where all are."""
    from matplotlib.lines import Line2D

    if all(map(is_periodic, motions)):
        return []
    return [
        Line2D([], [], color="0.4", linewidth=0.4, label="not periodic: last periods of the run")
    ]


def labels_of(figure: Figure) -> set[str]:
    """The labels of all that is drawn in a figure's axes."""
    return {str(artist.get_label()) for axes in figure.axes for artist in axes.get_children()}


def boundary_handles(figure: Figure) -> list[Line2D]:
    """Legend entries for mass and capsule, and for the boundary lines that are drawn."""
    from matplotlib.lines import Line2D

    looks: list[tuple[str, Any, str, float]] = [
        ("$x_m$", "--", "0.4", 1.1),
        ("$x_c$", "-", "0.4", 1.1),
    ]
    drawn = labels_of(figure)
    for look in dict.fromkeys(LOOKS.values()):
        names = [mathematical(name) for name in LOOKS if LOOKS[name] == look and name in drawn]
        if names:
            looks.append((r" $\cup$ ".join(names), *look, 0.6))
    return [
        Line2D([], [], linestyle=style, color=colour, linewidth=width, label=label)
        for label, style, colour, width in looks
    ]


def draw_lines(parameters: Parameters, axes: Axes, units: Units) -> None:
    """Draw the lines of P1 = 0 over the present view of axes in (x_r, v_r), and name them."""
    x_r, v_r = axes.get_xlim(), axes.get_ylim()
    long, fast = units.scale("x_r"), units.scale("v_r")
    view = (x_r[0] / long, x_r[1] / long), (v_r[0] / fast, v_r[1] / fast)
    for name, line in lines(parameters, *view).items():
        style, colour = LOOKS[name]
        axes.plot(
            *(line * (long, fast)).T, style, color=colour, linewidth=0.6, zorder=1, label=name
        )
    axes.set_xlim(x_r)
    axes.set_ylim(v_r)
