"""Motions in time and in the phase plane.

Segments are in the colours of their fields.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from capsule_sym._figures.arcs import Motion, arcs, cycle, is_periodic, phase_zero
from capsule_sym._figures.boundaries import lines, rest_ends, stops_of
from capsule_sym._figures.layout import across, add_key, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    GREY,
    LABELS,
    LOOKS,
    RED,
    describe,
    field_colour,
    mathematical,
    styled,
)
from capsule_sym._figures.units import Units
from capsule_sym._parameters import CAPSULE, Parameters, Scene, SceneDevice, SceneParameters

_MARGIN = 0.08  # of the range of a curve, left free around it


def plot_displacements(
    result: Motion,
    axes: Axes,
    *,
    periods: int = 3,
    device: SceneDevice | None = None,
) -> None:
    """Displacements of mass (dashed) and capsule (solid) against time (Fig. 7, left).

    Draws the last `periods` of a run or one period of an orbit. Time is in excitation periods, of a
    device in seconds with a prefix. It counts from a phase 0 of the forcing, x_c from the
    beginning.

    Parameters
    ----------
    result : Trajectory or Orbit
        The motion.
    axes : Axes of Matplotlib
        Place to draw into.
    periods : int, default 3, 1 to the run's whole periods
        Number of the run's last excitation periods. It has no effect on an orbit.
    device : PhysicalParameters, optional
        Device whose motion it is; the figure is then in SI units.

    Returns
    -------
    None
        The panel is drawn into `axes`.

    Raises
    ------
    InvalidInput
        For a value outside its range, for a run whose segments were not kept, and for a device of
        another scene, frequency, mass ratio, friction bound or load than that of the motion, or of
        other gaps in a scene with two stops.

    See Also
    --------
    plot_motion : this panel and the phase portrait.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import capsule_sym as cs
    >>> axes = Figure().subplots()
    >>> cs.figures.plot_displacements(cs.solve_orbit(cs.Parameters(alpha=0.9)), axes)
    >>> print(axes.get_ylabel(), *axes.get_xlim())
    displacements $x_m$, $x_c$ 0.0 1.0
    """
    units = Units.of_motion(device, result.parameters)
    shown = arcs(result, periods)
    drawn, begin = [units.arc(arc) for arc in shown], phase_zero(shown) * units.scale("time")
    origin = drawn[0].x_c[0]
    for arc in drawn:
        colour = field_colour(arc.field, arc.scene)
        x_c = arc.x_c - origin
        looks: dict[str, Any] = {"color": colour, "label": f"_F{arc.field}"}
        axes.plot(arc.time - begin, x_c + arc.x_r, "--", dashes=(2.5, 1.2), **looks)
        axes.plot(arc.time - begin, x_c, "-", **looks)
    axes.set_xlim(0, drawn[-1].time[-1] - begin)
    shade_pulses(axes, result.parameters, begin, units)
    axes.set_xlabel(units.label("time"))
    axes.set_ylabel(units.label("x_c", LABELS["x"]))


PULSE = "drive at its high level"


def shade_pulses(axes: Axes, parameters: SceneParameters, begin: float, units: Units) -> None:
    """Grey bands over time where pulses are high, on axes that begin at an instant."""
    if not parameters.scene.facts.PULSED:
        return
    share = parameters.to_dict()["D"]
    _, end = axes.get_xlim()
    period = units.scale("time")
    for turn in range(math.floor(begin / period), math.ceil((begin + end) / period)):
        rise = turn * period - begin
        low, high = max(rise, 0.0), min(rise + share * period, end)
        if low < high:
            axes.axvspan(low, high, color="0.92", linewidth=0, zorder=0, label=PULSE)


def plot_phase_portrait(
    result: Motion,
    axes: Axes,
    *,
    periods: int | None = None,
    device: SceneDevice | None = None,
) -> None:
    """The orbit in (x_r, v_r) with the boundary lines that cross the view (Fig. 7, right).

    The orbit is thin where a run does not end in a steady motion.

    Parameters
    ----------
    result : Trajectory or Orbit
        The motion.
    axes : Axes of Matplotlib
        Place to draw into.
    periods : int, optional, 1 to the run's whole periods
        Number of the run's last excitation periods. The default is those of its steady motion, or
        at most 16 if there is none. It has no effect on an orbit.
    device : PhysicalParameters, optional
        Device whose motion it is; the figure is then in SI units.

    Returns
    -------
    None
        The panel is drawn into `axes`.

    Raises
    ------
    InvalidInput
        For a value outside its range, for a run whose segments were not kept, and for a device of
        another scene, frequency, mass ratio, friction bound or load than that of the motion, or of
        other gaps in a scene with two stops.

    See Also
    --------
    plot_motion : this panel and the displacements.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import capsule_sym as cs
    >>> axes = Figure().subplots()
    >>> cs.figures.plot_phase_portrait(cs.solve_orbit(cs.Parameters(alpha=0.9)), axes)
    >>> print(axes.get_xlabel(), axes.get_ylabel(), sep="; ")
    relative displacement $x_r$; relative velocity $v_r$
    """
    units = Units.of_motion(device, result.parameters)
    shown = cycle(result) if periods is None else arcs(result, periods)
    drawn = [units.arc(arc) for arc in shown]
    for arc in drawn:
        looks: dict[str, Any] = {"label": f"_F{arc.field}", "zorder": 3}
        looks["linewidth"] = 1.1 if is_periodic(result) else 0.4
        colour = field_colour(arc.field, arc.scene)
        axes.plot(arc.x_r, arc.v_r, "-", color=colour, **looks)
    axes.margins(_MARGIN)
    draw_lines(result.parameters, axes, units)
    axes.set_xlabel(units.label("x_r"))
    axes.set_ylabel(units.label("v_r"))


@styled
def plot_motion(
    result: Motion,
    *,
    periods: int = 3,
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """Displacements and phase portrait of a motion, side by side or one above the other.

    Below a width of 4.8 in they are one above the other. The first panel has a run's last periods,
    or an orbit. The portrait is that of the steady motion at the run's end; without one the legend
    states it.

    Parameters
    ----------
    result : Trajectory or Orbit
        The motion.
    periods : int, default 3, 1 to the run's whole periods
        Number of the run's last excitation periods in the first panel. It has no effect on an
        orbit.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : two Axes of Matplotlib, optional
        Axes to draw into, without the legend, in place of a new figure: `axes` for the
        displacements and for the portrait.
    device : PhysicalParameters, optional
        Device whose motion it is; the figure is then in SI units.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For a value outside its range, such as the default of `periods` for a run of fewer, for an
        orbit that was not found, for another number of axes, for a run whose segments were not
        kept, and for a device of another scene, frequency, mass ratio, friction bound or load than
        that of the motion, or of other gaps in a scene with two stops.

    See Also
    --------
    plot_displacements, plot_phase_portrait : one panel alone.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> figure = cs.figures.plot_motion(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    >>> print([axes.get_ylabel() for axes in figure.axes])
    ['displacements $x_m$, $x_c$', 'relative velocity $v_r$']
    >>> print([text.get_text() for text in figure.legends[0].get_texts()][:4])
    ['$F_{1}$ NC-FD', '$F_{2}$ NC-S', '$F_{4}$ C-FD', '$F_{5}$ C-S']
    """
    side = across(width, 2.4, 2)
    figure, (left, right) = axes_for(axes, width, 2.3 * (3 - side), nrows=3 - side, ncols=side)
    plot_displacements(result, left, periods=periods, device=device)
    plot_phase_portrait(result, right, device=device)
    if axes is None:
        scene = result.parameters.scene
        handles = field_handles(figure, scene) + boundary_handles(figure)
        add_key(figure, handles + unsettled_handles([result]))
    return describe(figure, "Displacements and phase portrait", parameters=result.parameters)


def field_handles(figure: Figure, scene: Scene = CAPSULE) -> list[Any]:
    """Legend entries for the drawn segments: fields with their modes of operation.

    Artists of a segment are labelled by its field, such as F1 or _F1.
    """
    drawn = labels_of(figure)
    return [
        Line2D([], [], color=field_colour(field, scene), label=f"$F_{{{field}}}$ {mode}")
        for field, mode in enumerate(scene.facts.MODES, start=1)
        if drawn & {f"F{field}", f"_F{field}"}
    ]


def unsettled_handles(motions: Sequence[Motion]) -> list[Any]:
    """Legend entry for motions that are not periodic; none where all are."""
    if all(map(is_periodic, motions)):
        return []
    return [
        Line2D([], [], color="0.4", linewidth=0.4, label="not settled: last periods of the run")
    ]


def labels_of(figure: Figure) -> set[str]:
    """The labels of all that is drawn in a figure's axes."""
    return {str(artist.get_label()) for axes in figure.axes for artist in axes.get_children()}


def boundary_handles(figure: Figure) -> list[Any]:
    """Legend entries for mass and capsule, and for the boundary lines that are drawn."""
    looks: list[tuple[str, Any, str, float]] = [
        ("$x_m$", "--", "0.4", 1.1),
        ("$x_c$", "-", "0.4", 1.1),
    ]
    drawn = labels_of(figure)
    for look in dict.fromkeys(LOOKS.values()):
        names = [mathematical(name) for name in LOOKS if LOOKS[name] == look and name in drawn]
        if names:
            looks.append((r" $\cup$ ".join(names), *look, 0.6))
    handles = [
        Line2D([], [], linestyle=style, color=colour, linewidth=width, label=label)
        for label, style, colour, width in looks
    ]
    own = (*_BORDERS, PULSE)
    return handles + [one for one in handles_of(figure.axes) if one.get_label() in own]


def draw_lines(parameters: SceneParameters, axes: Axes, units: Units) -> None:
    """Draw the lines of P1 = 0 over the present view of axes in (x_r, v_r), and name them.

    Those of another scene than the paper's have no numbers: its stops, and where rest ends.
    """
    view, scales = (axes.get_xlim(), axes.get_ylim()), (units.scale("x_r"), units.scale("v_r"))
    (left, right), v_r = (
        (low / scale, high / scale) for (low, high), scale in zip(view, scales, strict=True)
    )
    if isinstance(parameters, Parameters):
        found = [*lines(parameters, (left, right), v_r).items()]
    else:
        every = borders(parameters, *v_r)
        found = [one for one in every if max(one[1][:, 0]) > left and min(one[1][:, 0]) < right]
    for name, line in found:
        style, colour = (LOOKS | _BORDERS)[name]
        looks: dict[str, Any] = {"color": colour, "linewidth": 0.6, "zorder": 1, "label": name}
        axes.plot(*(line * scales).T, style, **looks)
    axes.set(xlim=view[0], ylim=view[1])


_STOP, _FORWARD, _BACKWARD = "stop", "rest ends forward", "rest ends backward"
_BORDERS = {_STOP: ("-", "black"), _FORWARD: ("--", RED), _BACKWARD: ("--", GREY)}
"""Look of the borders of a scene, by what they are."""


def borders(
    parameters: SceneParameters, low: float, high: float
) -> list[tuple[str, NDArray[np.float64]]]:
    """The stops over a range of v_r, and where rest ends, unless that moves with the drive.

    Each is what it is, and its ends (2, 2) in (x_r, v_r).
    """
    found = [(_STOP, np.array([(at, low), (at, high)])) for at in stops_of(parameters)]
    if not parameters.scene.facts.REACTS:
        ends = rest_ends(parameters, low, high)
        found += [(_FORWARD if way > 0 else _BACKWARD, line) for _, way, line in ends]
    return found
