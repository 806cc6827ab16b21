"""Where the work of a period goes: damper and friction, along a branch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._figures.branches import Record, mark_bifurcations, name_bifurcations
from capsule_sym._figures.style import LABELS, PAGE, SEAMLESS, column_edges, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DAMPER, FRICTION, WORK = "#56B4E9", "#E69F00", "black"


def energies(record: Record) -> Figure:
    """Energy per excitation period along a branch: what damper and friction take of the work.

    The two losses are stacked bars, the drive's work a line; they meet but for rounding. Below
    stands the share of the work that friction takes, which is what moves the capsule against it.
    """
    points = [point for point in record["points"] if point["energy"]]
    values = np.array([point["value"] for point in points])
    work, damper, friction = (
        np.array([point["energy"][name] for point in points])
        for name in ("work", "damper_loss", "friction_loss")
    )
    with styled():
        figure = new_figure(PAGE, 4.8)
        upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (1.6, 1)})
        figure.subplots_adjust(left=0.075, right=0.985, bottom=0.085, top=0.66, hspace=0.1)
        edges = column_edges(values)
        left, width = edges[:-1], np.diff(edges)
        bars: dict[str, Any] = {"align": "edge", **SEAMLESS}
        upper.bar(left, damper, width, color=DAMPER, label="lost in the damper", **bars)
        upper.bar(left, friction, width, damper, color=FRICTION, label="lost to friction", **bars)
        upper.plot(values, work, color=WORK, linewidth=0.8, label="work of the drive")
        upper.set_ylabel("energy per period")
        upper.legend(loc="upper left")
        with np.errstate(invalid="ignore"):
            lower.plot(values, friction / work, color=FRICTION)
        lower.set_ylabel("share of friction")
        lower.set_xlabel(LABELS[record["parameter"]])
        lower.set_xlim(float(values.min()), float(values.max()))
        name_bifurcations(record, upper)
        for axes in (upper, lower):
            mark_bifurcations(record, axes)
        return figure
