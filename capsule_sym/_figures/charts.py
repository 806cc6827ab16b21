"""A chart of motion types over two parameters, with exact bifurcation curves on top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._figures.style import LABELS, PAGE, draw_points, new_figure, styled

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Curve = Mapping[str, Any]
"""A curve of bifurcations as plain data; `orbits.records.curve_record` describes it."""

_TINT = 0.55  # of an itinerary's colour, the rest is white
_NAMED = 0.028  # radius of the largest disc in a region that is named, over the width of the chart
_CURVES = {
    "grazing": ("black", ":"),
    "adding-sliding": ("#0072B2", "-"),
    "boundary-intersection crossing": ("black", "-"),
    "crossing-sliding": ("#D55E00", "-"),
    "switching-sliding": ("#009E73", "-"),
    "grazing-sliding": ("#B0307A", "-"),
}
_OTHER_CURVE = ("0.3", "--")


def chart(
    results: xr.Dataset, curves: Sequence[Curve] = (), *, levels: Sequence[float] = ()
) -> Figure:
    """Itineraries over two axes, each region named by its fields, exact curves and points on top.

    `results` is what `capsule_sym._sweeps.open_results` gives of a sweep or a refined chart over
    two parameters; cells that did not become periodic are white. A circle is a point of a curve
    where a second condition holds. A thin line is drawn at the `levels` of the second parameter.
    """
    first, second = map(str, results["itinerary"].dims)
    x, y = results[first].values, results[second].values
    numbers, itineraries = regions(results)
    with styled():
        figure = new_figure(PAGE, 5.0)
        axes = figure.subplots()
        figure.subplots_adjust(left=0.07, right=0.985, bottom=0.16, top=0.985)
        _fill(axes, x, y, numbers, len(itineraries))
        _name_regions(axes, x, y, numbers, itineraries)
        for level in levels:
            axes.axhline(level, color="0.35", linewidth=0.5, linestyle=(0, (6, 4)))
        for curve in curves:
            _draw_curve(axes, curve, first, second)
        axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        axes.set_xlabel(LABELS[first])
        axes.set_ylabel(LABELS[second])
        _legend(figure, axes)
        return figure


def regions(results: xr.Dataset) -> tuple[NDArray[np.int64], list[str]]:
    """The itinerary's number at each cell, -1 where there is none, and the itineraries by number.

    The itinerary of the largest area has number 0; an itinerary is its fields' digits, such as
    "5412".
    """
    codes = results["itinerary"].values
    attributes = results["itinerary"].attrs
    texts = dict(zip(attributes["flag_values"], attributes["flag_meanings"].split(), strict=True))
    known, counts = np.unique(codes, return_counts=True)
    order = [int(code) for code in known[np.argsort(-counts)] if int(code) in texts]
    numbers = np.full(codes.shape, -1, dtype=np.int64)
    for number, code in enumerate(order):
        numbers[codes == code] = number
    return numbers, [texts[code].replace("F", "").replace("_", "") for code in order]


def _fill(axes: Axes, x: Any, y: Any, numbers: NDArray[np.int64], count: int) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    # Full colours for the large regions, then their light companions.
    base = colormaps["tab20"](np.r_[0:20:2, 1:20:2])[:, :3]
    tints = 1 - _TINT * (1 - base[np.arange(max(count, 1)) % len(base)])
    axes.pcolormesh(
        x,
        y,
        np.ma.masked_less(numbers.T, 0),
        cmap=ListedColormap(tints),
        vmin=-0.5,
        vmax=max(count, 1) - 0.5,
        shading="nearest",
        rasterized=True,
    )


def _name_regions(
    axes: Axes, x: Any, y: Any, numbers: NDArray[np.int64], itineraries: Sequence[str]
) -> None:
    """The digits of each region's itinerary, in its largest disc, where there is room for them."""
    from scipy.ndimage import distance_transform_edt, label

    cell = 1.0 / max(numbers.shape)
    for number, itinerary in enumerate(itineraries):
        parts, count = label(numbers == number)
        for part in range(1, count + 1):
            inside = np.pad(parts == part, 1)
            depth = distance_transform_edt(inside)[1:-1, 1:-1]
            if depth.max() * cell < _NAMED:
                continue
            i, j = np.unravel_index(int(np.argmax(depth)), depth.shape)
            axes.text(x[i], y[j], itinerary, ha="center", va="center", fontsize=6.5)


def _draw_curve(axes: Axes, curve: Curve, first: str, second: str) -> None:
    colour, style = _CURVES.get(curve["type"], _OTHER_CURVE)
    points = curve["points"]
    axes.plot(
        [point[first] for point in points],
        [point[second] for point in points],
        linestyle=style,
        color=colour,
        linewidth=1.0,
        label=curve["type"],
    )
    meetings = curve["codimension_two"]
    x, y = ([one[name] for one in meetings] for name in (first, second))
    draw_points(axes, x, y, "two conditions")


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="lower center", ncols=4, columnspacing=1.5)
