"""A motion's guards over time: gap, capsule velocity and interaction force, and its itinerary."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from capsule_sym._figures.layout import add_key
from capsule_sym._figures.pages import axes_for
from capsule_sym._figures.portraits import field_handles, unsettled_handles
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import Colours, describe, field_colour, figure_style, readable
from capsule_sym._figures.units import Units
from capsule_sym._parameters import PhysicalParameters
from capsule_sym._study.arcs import Arc, Motion, arcs, interaction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NAMED = 0.04  # of the bar: a piece into which the name of its segment fits


@figure_style()
def plot_margins(
    result: Motion,
    *,
    periods: int = 1,
    colours: Colours = "safe",
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: PhysicalParameters | None = None,
) -> Figure:
    """How far every guard is from firing, over a run's last periods or an orbit, by acting field.

    A switch happens where the gap x_r - delta or the capsule's velocity reaches 0, or where the
    interaction force of a sticking capsule reaches the friction bound; where a quantity is no
    guard of the acting field its curve is thin. Drawn into four `axes` if they are given: that of
    the itinerary, of gap, velocity and force; in SI units with the `device` whose motion it is.
    """
    parameters = result.parameters
    units = Units.of_motion(device, parameters)
    pushes = [
        interaction(arc, parameters) * units.scale("peak_force") for arc in arcs(result, periods)
    ]
    drawn = [units.arc(arc) for arc in arcs(result, periods)]
    begin = drawn[0].time[0]
    rows = {"height_ratios": (0.18, 1, 1, 1)}
    figure, (bar, gap, velocity, force) = axes_for(
        axes, width, 4.4, nrows=4, sharex=True, gridspec_kw=rows
    )
    itinerary_bar(drawn, bar, colours)
    for arc, push in zip(drawn, pushes, strict=True):
        colour, time, stick = field_colour(arc.field, colours), arc.time - begin, arc.stick
        gap.plot(time, arc.x_r - parameters.delta * units.scale("x_r"), color=colour)
        velocity.plot(time, arc.v_c, color=colour, linewidth=0.5 if stick else 1.1)
        force.plot(time, push, color=colour, linewidth=1.1 if stick else 0.5)
    bound = parameters.f_b * units.scale("peak_force")
    for row, level in ((gap, 0.0), (velocity, 0.0), (force, bound), (force, -bound)):
        row.axhline(level, color="0.35", linewidth=0.6, linestyle="--", zorder=1)
    gap.set_ylabel(units.label("x_r", r"gap $x_r-\delta$"))
    velocity.set_ylabel(units.label("v_c"))
    force.set_ylabel(units.label("peak_force", "force $P_3$, $P_4$"))
    force.set_xlabel(units.label("time"))
    force.set_xlim(0, drawn[-1].time[-1] - begin)
    if axes is None:
        add_key(figure, field_handles(figure, colours) + unsettled_handles([result]))
    return describe(figure, "Guards over time", parameters=parameters)


def itinerary_bar(drawn: Sequence[Arc], axes: Axes, colours: Colours = "safe") -> None:
    """The itinerary as one bar over time from the first arc, a piece for each segment."""
    begin = drawn[0].time[0]
    for arc in drawn:
        left, width = arc.time[0] - begin, arc.time[-1] - arc.time[0]
        colour = field_colour(arc.field, colours)
        axes.broken_barh([(left, width)], (0, 1), facecolor=colour, label=f"F{arc.field}")
        if width > _NAMED * (drawn[-1].time[-1] - begin):
            middle, name = left + width / 2, f"$F_{arc.field}$"
            ink = readable(colour) if colour.startswith("#") else "white"
            axes.text(middle, 0.46, name, color=ink, ha="center", va="center", fontsize=6)
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.spines[:].set_visible(False)
