"""Results of design: Pareto fronts, and residuals of fits."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from capsule_sym._figures.layout import add_key, axes_for, canvas, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import SERIES, STABLE, UNSTABLE, bulk, describe, styled
from capsule_sym._figures.units import known_labels
from capsule_sym._parameters import SceneDevice

if TYPE_CHECKING:
    from capsule_sym._design.fit import Fit
    from capsule_sym._design.front_search import Front


def metric_label(name: str, system: Any) -> str:
    """Label of a quantity, with its SI unit if the system is a device."""
    from capsule_sym._orbits.quantities import units_in
    from capsule_sym._units import METRIC_UNITS

    told = known_labels().get(name, name.replace("_", " ") if name in METRIC_UNITS else name)
    if not isinstance(system, SceneDevice):
        return told
    unit = units_in(system).get(name, "SI units")  # of arithmetic
    return f"{told.partition(' $')[0]} ({unit})" if unit else told


@styled
def plot_front(front: Front, *, width: float = PAGE, axes: Axes | None = None) -> Figure:
    """A Pareto front: the first metric over the second, a dot for each optimum, a line a part.

    Outliers lie beyond the axes, with a mark at their edge. Between parts of the front a dotted
    line has the metric of the part before. A front without points gives empty axes.

    Parameters
    ----------
    front : Front
        Front, as `pareto` gives.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the key, in place of a new figure: `axes` of one's own.

    Returns
    -------
    matplotlib.figure.Figure
        The figure. Its axes are in SI units if the system is a device, else dimensionless.

    Raises
    ------
    InvalidInput
        For an argument of another type or out of its range.

    See Also
    --------
    pareto : the computation.
    plot_diagram : a metric along branches.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> front = cs.pareto("velocity", "work", {"alpha": (0.8, 0.9)}, points=2, samples=2)
    >>> figure = cs.figures.plot_front(front)
    >>> print(figure.axes[0].get_xlabel(), [line.get_label() for line in figure.axes[0].lines][1:])
    work ['optimum']
    """
    system = front.points[0].system if front.points else None
    alone = axes is None
    figure, axes = axes_for(axes, width, max(2.4, 0.5 * width))
    for part in front.parts:
        along = slice(part.first, part.last + 1)
        axes.plot(front.costs[along], front.values[along], "-", color=STABLE)
    # Between parts no more of the metric is to be had, until the next one begins.
    for one, other in pairwise(front.parts):
        costs, values = front.costs[[one.last, other.first]], front.values[[one.last, other.first]]
        axes.plot(
            costs,
            values,
            ":",
            color="0.4",
            drawstyle="steps-post",
            label="between parts of the front",
        )
    kinds = {
        "optimal": ("o", STABLE, "optimum"),
        "optimal-at-border": ("s", UNSTABLE, "optimum at a border"),
    }
    for status in dict.fromkeys(str(point.status) for point in front.points):
        chosen = [str(point.status) == status for point in front.points]
        mark, colour, label = kinds.get(status, ("x", "0.4", "not proved an optimum"))
        axes.plot(front.costs[chosen], front.values[chosen], mark, color=colour, label=label)
    if len(front.points):
        near = []
        for values, name in ((front.costs, "xlim"), (front.values, "ylim")):
            low, high = bulk(values)
            if values.min() < low or values.max() > high:
                room = 0.05 * (high - low)
                axes.set(**{name: (low - room, high + room)})
            near.append(np.clip(values, *getattr(axes, f"get_{name}")()))
        out = (near[0] != front.costs) | (near[1] != front.values)
        looks: dict[str, Any] = {"color": "0.4", "clip_on": False, "linestyle": ""}
        if out.any():
            axes.plot(*np.array(near)[:, out], ">", label="outlier beyond the axes", **looks)
    axes.set_ylabel(metric_label(front.metrics[0], system))
    axes.set_xlabel(metric_label(front.metrics[1], system))
    if alone:
        add_key(figure, handles_of([axes]))
    return describe(figure, f"Pareto front of {front.metrics[0]} and {front.metrics[1]}")


@styled
def plot_residuals(
    fit: Fit, *, width: float = PAGE, figure: Figure | SubFigure | None = None
) -> Figure:
    """Residuals of a fit over time: a row for each measured column.

    They are in units of the fit's `noise`; bands show one and two of it. Time is in seconds if the
    system is a device, else dimensionless. Triangles at the edge are outliers beyond it.

    Parameters
    ----------
    fit : Fit
        Fit, as `fit` gives.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    figure : Figure or SubFigure of Matplotlib, optional
        Place to draw into in place of a new figure: `figure` is one of one's own, or a part of one.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For an argument of another type or out of its range.

    See Also
    --------
    fit : the computation.

    Examples
    --------
    >>> import numpy as np
    >>> import capsule_sym as cs
    >>> times = np.linspace(0.0, 15.0, 100)
    >>> x_r = cs.simulate(cs.Parameters(alpha=0.9), periods=2)(times)[:, 0]
    >>> found = cs.fit({"t": times, "x_r": x_r}, cs.Parameters(alpha=0.85), ["alpha"])
    >>> figure = cs.figures.plot_residuals(found)
    >>> print(figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel(), sep="; ")
    time (dimensionless); $x_r$, residual over noise
    """
    data, noise = fit.data, fit.noise or 1.0
    edge = max(6.0, 3.0 * float(np.quantile(abs(fit.residuals), 0.9)) / noise)
    height = max(1.5, 0.2 * width) * len(data.names) + 0.4
    page = canvas(figure, width, height, layout="constrained")
    panels = page.subplots(len(data.names), 1, sharex="col", squeeze=False)[:, 0]
    for place, (panel, name) in enumerate(zip(panels, data.names, strict=True)):
        panel.axhspan(-2, 2, color="0.93", linewidth=0, label="two standard deviations")
        panel.axhspan(-1, 1, color="0.86", linewidth=0, label="one standard deviation")
        chosen = data.column == place
        times, shown = data.times[chosen], fit.residuals[chosen] / noise
        for mark, part, label in (
            (".", abs(shown) <= edge, "_"),
            ("^", shown > edge, "outlier above"),
            ("v", shown < -edge, "outlier below"),
        ):
            if part.any() or label == "_":
                at = np.clip(shown[part], -edge, edge)
                panel.plot(times[part], at, mark, color=SERIES[place], label=label)
        panel.set_ylabel(f"${name}$, residual over noise")
    unit = "s" if isinstance(fit.system, SceneDevice) else "dimensionless"
    panels[-1].set_xlabel(f"time ({unit})")
    add_key(page, handles_of(panels))
    return describe(page, "Residuals of a fit", status=str(fit.status))
