"""Fields in the order of time, against the excitation amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from capsule_sym._figures.arcs import Motion, cycle, is_periodic
from capsule_sym._figures.branches import Record, axis_label, in_units, name_bifurcations, units_of
from capsule_sym._figures.labels import CENTRED, fix_layout
from capsule_sym._figures.layout import add_key, axes_for
from capsule_sym._figures.portraits import field_handles
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    SEAMLESS,
    Colours,
    blank,
    column_edges,
    describe,
    field_colour,
    readable,
    styled,
)
from capsule_sym._figures.units import Units
from capsule_sym._parameters import SceneDevice


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
        handles: list[Any] = [*field_handles(figure, colours, motions[0].parameters.scene)]
        if not all(map(is_periodic, motions)):
            handles.append(blank("not settled"))
        add_key(figure, handles)
        name_bifurcations(record, axes, units)
        _name_fields(motions, axes, colours, units)
    return describe(figure, "Which field acts when", parameters=motions[0].parameters)


_TALL = 0.06  # share of a column from which on a segment can hold its name


def _name_fields(motions: Sequence[Motion], axes: Axes, colours: Colours, units: Units) -> None:
    """The name of each field in its area, where it has most room within it and between lines."""
    places: dict[int, list[tuple[float, float, float]]] = {}
    scene, (_, top) = motions[0].parameters.scene, axes.get_ylim()
    fix_layout(axes)
    scale = units.scale("alpha")
    open_ = [scale * one.parameters.alpha for one in motions if not is_periodic(one)]
    rims = [
        *axes.get_xlim(),
        *open_,
        *(float(np.asarray(one.get_xdata())[0]) for one in axes.lines),
    ]
    wide, tall = axes.transData.transform((1, 1)) - axes.transData.transform((0, 0))
    for motion in filter(is_periodic, motions):
        drawn = cycle(motion)
        for arc in drawn:
            low, high = arc.time[0] - drawn[0].time[0], arc.time[-1] - drawn[0].time[0]
            at = scale * motion.parameters.alpha
            if high - low >= _TALL * top:
                places.setdefault(arc.field, []).append((high - low, at, (low + high) / 2))
    for field, found in places.items():
        _, place = max(
            (min(tall * long, 2 * wide * min(abs(at - rim) for rim in rims)), (at, middle))
            for long, at, middle in found
        )
        colour = field_colour(field, colours, scene)
        patch = {"facecolor": colour, "edgecolor": "none", "pad": 0.8}  # a line may cross the area
        axes.text(*place, f"$F_{{{field}}}$", color=readable(colour), bbox=patch, **CENTRED)


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
