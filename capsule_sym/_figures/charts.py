"""A chart of itineraries over two parameters, its regions bounded by exact bifurcation curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import Stroke

from capsule_sym._figures.labels import CENTRED, fix_layout, name_points, widest
from capsule_sym._figures.layout import add_key, axes_for, handles_of, limit
from capsule_sym._figures.regions import Plane, Region, by_cells
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    CURVES,
    DASHES,
    NO_RESULT,
    NOT_SETTLED,
    OTHER_CURVE,
    OTHERS,
    area_colours,
    blank,
    describe,
    draw_points,
    readable,
    styled,
)
from capsule_sym._figures.units import named

if TYPE_CHECKING:
    import xarray as xr

_SMALL, _TINY = 0.01, 0.001  # of a chart: regions that have a number, beside others and alone


@styled
def plot_chart(
    results: xr.Dataset,
    curves: Sequence[Mapping[str, Any]] = (),
    *,
    levels: Sequence[float] = (),
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """Itineraries over two axes, large regions with a number, exact curves and points on top.

    Regions are bounded by the curves, and by the edges of cells where several itineraries remain
    between curves. The key gives the itinerary of each number. Numbers ascend as areas descend, and
    from the 19th on itineraries are pale grey. Cells that have not settled within the sweep's
    periods are dark grey, those without a result white. A circle is a codimension-two point.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a sweep over two parameters, as `open_results` gives, with two values or more of
        each. Axes are in SI units where those of the sweep are, else dimensionless.
    curves : sequence of mapping, default ()
        Curves of bifurcations over the same two parameters, as `capsule-sym curve --json` prints
        them.
    levels : sequence of float, default ()
        Values of the second parameter at which a thin line is drawn, in the unit of its axis.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the key, in place of a new figure: `axes` of one's own.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For results of another kind, and for curves over other parameters.

    See Also
    --------
    run_sweep : computes the results.
    plot_metric : a metric in place of the itinerary.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> axes = Axis.linear("alpha", 0.1, 1.0, 6), Axis.linear("delta", 0.0, 0.4, 4)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary = cs.run_sweep(Sweep(axes, periods=100), f"{folder}/chart")
    ...     figure = cs.figures.plot_chart(cs.results.open_results(f"{folder}/chart"))
    >>> print([text.get_text() for text in figure.legends[0].get_texts()][:3])
    ['1  F5 F4 F1 F2', '2  F5 F2', '3  F5 F4 F1 F2 F3 F2']
    """
    plane, regions = by_cells(results, curves)
    return draw_regions(plane, regions, curves, levels=levels, width=width, axes=axes)


@styled
def draw_regions(
    plane: Plane,
    regions: Sequence[Region],
    curves: Sequence[Mapping[str, Any]] = (),
    *,
    levels: Sequence[float] = (),
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """A `plot_chart` of given regions."""
    alone = axes is None
    figure, axes = axes_for(axes, width, 4.2)
    limit(axes, plane.x, plane.y)
    axes.set_xlabel(named(plane.first))
    axes.set_ylabel(named(plane.second))
    itineraries = by_area(plane, regions)
    coloured = zip(itineraries, area_colours(figure, itineraries, again=False), strict=True)
    shown = {itinerary: colour for itinerary, colour in coloured if colour != OTHERS}
    _fill(axes, regions, shown)
    said = f"{named(plane.second)} = {', '.join(f'{level:g}' for level in sorted(levels))}"
    for level in levels:
        dashes: Any = (0, (6, 4))
        axes.axhline(level, color="0.2", linewidth=0.5, linestyle=dashes, label=said)
    for curve in curves:
        draw_curve(axes, curve, plane)
    if alone:
        _legend(figure, axes, regions, shown, len(itineraries) - len(shown))
    _number_regions(axes, plane, regions, shown)
    return describe(figure, "Itineraries over two parameters", **plane._asdict())


def by_area(plane: Plane, regions: Sequence[Region]) -> list[str]:
    """The itineraries of regions, that of the largest area first."""
    areas: dict[str, float] = {}
    for region in regions:
        if region.itinerary.startswith("F"):
            outline = region._replace(rings=tuple(map(plane.unit, region.rings)))
            areas[region.itinerary] = areas.get(region.itinerary, 0.0) + outline.shape().area
    return sorted(areas, key=lambda one: -areas[one])


def _fill(axes: Axes, regions: Sequence[Region], colours: Mapping[str, str]) -> None:
    rings: dict[str, list[Path]] = {}
    for region in regions:
        rings.setdefault(region.itinerary, []).extend(
            Path(one, closed=True) for one in region.rings
        )
    rings.pop("", None)
    for itinerary, paths in rings.items():
        looks: dict[str, Any] = {"linewidth": 0, "zorder": 0.5, "label": f"_{itinerary}"}
        colour = colours.get(itinerary, OTHERS if itinerary.startswith("F") else NOT_SETTLED)
        axes.add_patch(PathPatch(Path.make_compound_path(*paths), facecolor=colour, **looks))


def _number_regions(
    axes: Axes, plane: Plane, regions: Sequence[Region], colours: Mapping[str, str]
) -> None:
    """The number of each region where it has most room, or beside it where it has none."""
    whole = float(np.ptp(plane.x) * np.ptp(plane.y))
    areas = [(region.shape().area / whole, region) for region in regions]
    chosen = list[Region]()
    for area, region in sorted(areas, key=lambda one: -one[0]):
        # Of an itinerary the largest region has its number, and what else is not small.
        seen = any(one.itinerary == region.itinerary for one in chosen)
        if area >= (_SMALL if seen else _TINY) and region.itinerary in colours:
            chosen.append(region)
    fix_layout(axes)
    pixels = axes.transData.transform
    shapes = [one._replace(rings=tuple(map(pixels, one.rings))).shape() for one in chosen]
    beside, fills = list[tuple[Any, str, str]](), list[str]()
    for region, (place, room) in zip(chosen, widest(axes, shapes), strict=True):
        colour = colours[region.itinerary]
        ink, number = readable(colour), str(list(colours).index(region.itinerary) + 1)
        name = axes.text(*place, number, color=ink, **CENTRED)
        if np.hypot(*name.get_window_extent().size) / 2 > room:
            name.remove()
            beside.append((place, number, ink))
            fills.append(colour)
    name_points(axes, beside, fills)


def draw_curve(axes: Axes, curve: Mapping[str, Any], plane: Plane) -> None:
    """A curve of bifurcations, and its codimension-two points, over a plane."""
    colour, style = CURVES.get(curve["type"], OTHER_CURVE)
    # On a white rim, so that it is seen on dark regions as well.
    axes.plot(
        *np.reshape(plane.of(curve["points"]), (-1, 2)).T,
        linestyle=style,
        color=colour,
        linewidth=1.2,
        label=curve["type"],
        path_effects=[Stroke(linewidth=2.6, foreground="white"), Stroke()],
    )
    if found := plane.of(curve["codimension_two"]):
        draw_points(axes, [x for x, _ in found], [y for _, y in found], "codimension-two point")


def _legend(
    figure: Figure, axes: Axes, regions: Sequence[Region], colours: Mapping[str, str], others: int
) -> None:
    handles = handles_of([axes])
    for number, (itinerary, colour) in enumerate(colours.items(), 1):
        handles.append(Patch(color=colour, label=f"{number}  {itinerary}"))
    if others:
        handles.append(Patch(color=OTHERS, label=f"{others} other itineraries"))
    for said in {one.itinerary for one in regions if not one.itinerary.startswith("F")}:
        handles.append(Patch(color=NOT_SETTLED, label=said) if said else blank(NO_RESULT))
    add_key(figure, handles, below=True, handlelength=DASHES)
