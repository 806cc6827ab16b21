"""Where the work of a period goes: damper and friction, along a branch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._figures.branches import (
    Record,
    in_units,
    mark_bifurcations,
    name_bifurcations,
    shared,
    span,
    units_of,
)
from capsule_sym._figures.layout import add_key, axes_for
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import SEAMLESS, column_edges, describe, figure_style
from capsule_sym._parameters import PhysicalParameters

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DAMPER, FRICTION, WORK = "#56B4E9", "#E69F00", "black"


@figure_style()
def plot_energies(
    record: Record,
    *,
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: PhysicalParameters | None = None,
) -> Figure:
    """Energy per excitation period along a branch: what damper and friction take of the work.

    The two losses are stacked bars, the drive's work a line; they meet but for rounding. Below
    stands the share of the work that friction takes, which is what moves the capsule against it.
    Drawn into two `axes`, without the names, if they are given; in SI units with a `device`, as by
    `plot_bifurcations`.
    """
    units = units_of(record, device)
    record = in_units(record, units)
    points = [point for point in record["points"] if point["energy"]]
    values = np.array([point["value"] for point in points])
    work, damper, friction = (
        np.array([point["energy"][name] for point in points])
        for name in ("work", "damper_loss", "friction_loss")
    )
    rows = {"height_ratios": (1.6, 1)}
    figure, (upper, lower) = axes_for(axes, width, 3.4, nrows=2, sharex=True, gridspec_kw=rows)
    edges = column_edges(values)
    left, wide = edges[:-1], np.diff(edges)
    bars: dict[str, Any] = {"align": "edge", **SEAMLESS}
    upper.bar(left, damper, wide, color=DAMPER, label="lost in the damper", **bars)
    upper.bar(left, friction, wide, damper, color=FRICTION, label="lost to friction", **bars)
    upper.plot(values, work, color=WORK, linewidth=0.8, label="work of the drive")
    upper.set_ylabel(units.label("work", "energy per period"))
    if axes is None:
        add_key(figure, upper.get_legend_handles_labels()[0])
    else:
        upper.legend(loc="upper left")
    with np.errstate(invalid="ignore"):
        lower.plot(values, friction / work, color=FRICTION)
    lower.set_ylabel("share of friction")
    lower.set_xlabel(units.label(record["parameter"]))
    lower.set_xlim(*span(record))
    for row in (upper, lower):
        mark_bifurcations(record, row)
    if axes is None:
        name_bifurcations(record, upper, units)
    return describe(figure, "Where the work of a period goes", **shared(record))
