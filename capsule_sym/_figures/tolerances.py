"""The spread of metrics under tolerances of the parameters."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure, SubFigure

from capsule_sym._figures.design import metric_label
from capsule_sym._figures.layout import add_key, canvas, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import SERIES, STABLE, UNSTABLE, bulk, describe, styled

if TYPE_CHECKING:
    from capsule_sym._design.tolerances import Tolerances

_BARS = STABLE, SERIES[5]  # apart in grey too
_HALF = 0.2  # height of half a bar, and how far it is from the middle of its pair


@styled
def plot_tolerances(
    found: Tolerances, *, width: float = PAGE, figure: Figure | SubFigure | None = None
) -> Figure:
    """Samples of each metric as a histogram, and beside it Sobol's indices.

    Lines mark the nominal value and the middle 95 % of the samples. Outliers are not in the
    histogram; the key gives their number. Metrics are in SI units if the system is a device. After
    a time limit the panels are empty.

    Parameters
    ----------
    found : Tolerances
        Spread, as `tolerances` gives.
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
    tolerances : the computation.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> shares = {"alpha": 0.05, "zeta": 0.1}
    >>> found = cs.tolerances("velocity", shares, cs.Parameters(alpha=0.9), samples=64)
    >>> figure = cs.figures.plot_tolerances(found)
    >>> print([axes.get_xlabel()[:16] for axes in figure.axes])
    ['average velocity', 'share of the var']
    """
    rows = max(1, len(found.metrics))
    height = 0.4 + rows * max(1.7, 0.3 + 0.35 * len(found.names))
    page = canvas(figure, width, height, layout="constrained")
    panels = page.subplots(rows, 2, squeeze=False)
    places = np.arange(len(found.names))
    for k, one in enumerate(found.metrics):
        left, right = panels[k]
        numbers = found.values[:, k]
        numbers = numbers[np.isfinite(numbers)]
        if len(numbers):
            low, high = bulk(numbers)
            inside = numbers[(low <= numbers) & (numbers <= high)]
            # As many bins as these samples fill, by the rule of Rice.
            left.hist(inside, math.ceil(2 * len(inside) ** (1 / 3)), color=STABLE, alpha=0.7)
            beyond = f"outside, of {one.metric}: {len(numbers) - len(inside)} of {len(numbers)}"
            if len(inside) < len(numbers):
                left.plot([], [], linestyle="", label=beyond)
        left.axvline(one.nominal, color=UNSTABLE, label="nominal value")
        for end in (one.quantiles[0], one.quantiles[-1]) if one.quantiles else ():
            left.axvline(end, color="0.2", linestyle=":", label="middle 95 % of the samples")
        left.set_xlabel(metric_label(one.metric, found.system))
        left.set_ylabel("samples")
        bars = ((one.first, "first-order index"), (one.total, "total index"))
        for side, (values, name) in zip((-_HALF, _HALF), bars, strict=True):
            right.barh(places + side, values, 2 * _HALF, color=_BARS[side > 0], label=name)
        right.set_yticks(places, found.names)
        right.invert_yaxis()
        right.set_xlim(left=min(0.0, *right.get_xlim()))
        right.set_xlabel("share of the variance")
    add_key(page, handles_of(panels.flat))
    return describe(page, f"Spread of {', '.join(one.metric for one in found.metrics)}")
