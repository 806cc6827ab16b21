"""Motions against the excitation amplitude: Fig. 6, and which field acts when."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from capsule_sym._figures.arcs import Motion, cycle, is_periodic
from capsule_sym._figures.branches import (
    Record,
    axis_label,
    in_units,
    name_bifurcations,
    units_of,
)
from capsule_sym._figures.labels import Names
from capsule_sym._figures.layout import NARROW, add_key, axes_for, canvas, fit_view
from capsule_sym._figures.portraits import field_handles, unsettled_handles
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    NOT_PERIODIC,
    SEAMLESS,
    Colours,
    blank,
    column_edges,
    describe,
    field_colour,
    labels_of,
    readable,
    styled,
)
from capsule_sym._figures.units import Units
from capsule_sym._parameters import SceneDevice


@styled
def plot_fig6(
    motions: Sequence[Motion],
    heavy: Sequence[Motion] = (),
    *,
    colours: Colours = "safe",
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
            colour = field_colour(arc.field, colours, arc.scene) if settled else "0.6"
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
    handles = field_handles(page, colours, system.scene) + unsettled_handles(motions)
    if heavy:
        handles.append(Line2D([], [], color="0.4", linewidth=1.4, label="exact bifurcation"))
    add_key(page, handles)
    return describe(page, "Phase trajectories over the amplitude", parameters=system)


@styled
def plot_itineraries(
    motions: Sequence[Motion],
    record: Record,
    *,
    colours: Colours = "safe",
    width: float = PAGE,
    axes: Axes | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """Field by phase against alpha, with the exact bifurcations of a branch named.

    Drawn into `axes` if they are given, then without labels of bifurcations. With a `device` over
    its amplitude.
    """
    alone = axes is None
    figure, axes = axes_for(axes, width, 2.9)
    units = units_of(record, device)
    for motion in motions:
        Units.of_motion(device, motion.parameters)
    record = in_units(record, units)
    draw_itineraries(motions, axes, colours, units)
    axes.set_xlabel(axis_label(record, units))
    for one in record["bifurcations"]:
        axes.axvline(one["value"], color="white", linewidth=0.6)
    if alone:
        names = Names(figure)
        _name_fields(motions, axes, names, colours, units)
        handles: list[Any] = [*field_handles(figure, colours, motions[0].parameters.scene)]
        if not all(map(is_periodic, motions)):
            handles.append(blank(NOT_PERIODIC))
        add_key(figure, handles)
        name_bifurcations(record, axes, units)
        names.settle()
    return describe(figure, "Which field acts when", parameters=motions[0].parameters)


_TALL = 0.06  # share of a column from which on a segment can hold its name


def _name_fields(
    motions: Sequence[Motion], axes: Axes, names: Names, colours: Colours, units: Units
) -> None:
    """The name of each field in its area, where its segments are longest."""
    places: dict[int, list[tuple[float, float, float]]] = {}
    scene, (_, top) = motions[0].parameters.scene, axes.get_ylim()
    for motion in filter(is_periodic, motions):
        drawn = cycle(motion)
        for arc in drawn:
            low, high = arc.time[0] - drawn[0].time[0], arc.time[-1] - drawn[0].time[0]
            if high - low >= _TALL * top:
                at = units.scale("alpha") * motion.parameters.alpha
                places.setdefault(arc.field, []).append((high - low, at, (low + high) / 2))
    for field, found in sorted(places.items()):
        best = sorted(found, reverse=True)[:: max(1, len(found) // 40)]
        ink = readable(field_colour(field, colours, scene))
        names.on(axes, [one[1:] for one in best], f"$F_{{{field}}}$", color=ink)


def draw_itineraries(
    motions: Sequence[Motion], axes: Axes, colours: Colours = "safe", units: Units | None = None
) -> None:
    """A column for each motion: the phase of the excitation upwards, alpha to the right.

    All are drawn over the excitation periods of the longest motion; the column of a run that does
    not end in a steady motion stays white.
    """
    motions = sorted(motions, key=lambda m: m.parameters.alpha)
    units = units or Units()
    alphas = units.scale("alpha") * np.array([m.parameters.alpha for m in motions])
    edges = column_edges(alphas)
    scene = motions[0].parameters.scene
    bars: dict[int, list[list[tuple[float, float]]]] = {field: [] for field in scene.facts.FIELDS}
    cycles = [cycle(motion) if is_periodic(motion) else [] for motion in motions]
    longest = max((round(one[-1].time[-1] - one[0].time[0]) for one in cycles if one), default=1)
    for drawn, left, right in zip(cycles, edges[:-1], edges[1:], strict=True):
        for arc in drawn:
            first, period_number = drawn[0].time[0], round(drawn[-1].time[-1] - drawn[0].time[0])
            # Beside motions of more periods it is drawn over as many.
            for turn in range(0, longest, period_number):
                low, high = (min(turn + t - first, longest) for t in (arc.time[0], arc.time[-1]))
                bars[arc.field].append([(left, low), (right, low), (right, high), (left, high)])
    for field, corners in bars.items():
        if not corners:
            continue
        colour = field_colour(field, colours, scene)
        axes.add_collection(PolyCollection(corners, color=colour, label=f"F{field}", **SEAMLESS))
    axes.set(xlim=(alphas[0], alphas[-1]), ylim=(0, longest))
    axes.set_xlabel(units.label("alpha"))
    axes.set_ylabel(r"phase $\omega\tau/2\pi$")
