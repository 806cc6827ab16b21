"""A chart of itineraries over two parameters, its regions bounded by exact bifurcation curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import Stroke

from capsule_sym._figures.labels import Names
from capsule_sym._figures.layout import add_key, axes_for
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    CURVES,
    NOT_PERIODIC,
    OTHER_CURVE,
    REGIONS,
    describe,
    draw_points,
    readable,
    styled,
)
from capsule_sym._figures.units import named
from capsule_sym._study.regions import Array, Curve, Plane, Region, by_cells

if TYPE_CHECKING:
    import xarray as xr

_PLACES = 24  # points across a chart at which a region's name is tried
_SMALL, _TINY = 0.01, 0.001  # of a chart: a region of an itinerary that is named, or is not
_OTHERS = "#dddddd"
_REACH = 90.0  # points that a name may be away from a region that has no room for it


@styled
def plot_chart(
    results: xr.Dataset,
    curves: Sequence[Curve] = (),
    *,
    levels: Sequence[float] = (),
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """Itineraries over two axes, each region named by its fields, exact curves and points on top.

    `results` is what `open_results` gives of a sweep or a refined chart over two parameters.
    Regions are bounded by the `curves` of `capsule-sym curve --json`, and by cells where these
    leave motions of several kinds together; what did not become periodic is white, as the legend
    says. Where there are more itineraries than colours, the largest regions have numbers that the
    legend explains, and the others are grey. A circle is a codimension-two point. A thin line is
    drawn at the `levels` of the second parameter. Drawn into `axes` if they are given. Raises
    InvalidInput for results of another kind.
    """
    plane, regions = by_cells(results, curves)
    return draw_regions(plane, regions, curves, levels=levels, width=width, axes=axes)


@styled
def draw_regions(
    plane: Plane,
    regions: Sequence[Region],
    curves: Sequence[Curve] = (),
    *,
    levels: Sequence[float] = (),
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """A `plot_chart` of given regions."""
    alone = axes is None
    figure, axes = axes_for(axes, width, 4.2)
    axes.set(xlim=plane.x, ylim=plane.y)
    axes.set_xlabel(named(plane.first))
    axes.set_ylabel(named(plane.second))
    itineraries = by_area(plane, regions)
    crowded = len(itineraries) > (2 if curves else 1) * len(REGIONS)
    shown = itineraries[: len(REGIONS)] if crowded else itineraries
    _fill(axes, regions, shown)
    for level in levels:
        axes.axhline(level, color="0.2", linewidth=0.5, linestyle=(0, (6, 4)))
    for curve in curves:
        _draw_curve(axes, curve, plane)
    if alone:
        _legend(figure, axes, regions, shown if crowded else [], len(itineraries) - len(shown))
    names = Names(figure)
    _name_regions(axes, plane, regions, names, shown, crowded)
    names.settle()
    return describe(figure, "Itineraries over two parameters", **plane._asdict())


def by_area(plane: Plane, regions: Sequence[Region]) -> list[str]:
    """The itineraries of regions, that of the largest area first."""
    areas: dict[str, float] = {}
    for region in regions:
        if region.itinerary:
            outline = region._replace(rings=tuple(map(plane.unit, region.rings)))
            areas[region.itinerary] = areas.get(region.itinerary, 0.0) + outline.shape().area
    return sorted(areas, key=lambda one: -areas[one])


def _fill(axes: Axes, regions: Sequence[Region], itineraries: Sequence[str]) -> None:
    for region in regions:
        if not region.itinerary:
            continue
        known = region.itinerary in itineraries
        rank = itineraries.index(region.itinerary) if known else 0
        colour = REGIONS[rank % len(REGIONS)] if known else _OTHERS
        # A second round through the colours is striped.
        stripes: dict[str, Any] = (
            {"hatch": "/////", "edgecolor": readable(colour)} if rank >= len(REGIONS) else {}
        )
        path = Path.make_compound_path(*(Path(ring, closed=True) for ring in region.rings))
        looks = {
            "facecolor": colour,
            "linewidth": 0,
            "zorder": 0.5,
            "label": f"_{region.itinerary}",
        }
        axes.add_patch(PathPatch(path, **looks, **stripes))


def _name_regions(
    axes: Axes,
    plane: Plane,
    regions: Sequence[Region],
    names: Names,
    itineraries: Sequence[str],
    crowded: bool,
) -> None:
    """The itinerary of each region where it has most room, or beside it where it has none.

    In a crowd its number, of regions that are not small.
    """
    whole = float(np.ptp(plane.x) * np.ptp(plane.y))
    seen: set[str] = set()
    for region in sorted(regions, key=lambda one: -one.shape().area):
        # Of an itinerary the largest region is named, and what else is not small.
        least = _SMALL if crowded or region.itinerary in seen else _TINY
        if region.itinerary not in itineraries or region.shape().area < least * whole:
            continue
        seen.add(region.itinerary)
        rank = itineraries.index(region.itinerary)
        colour = REGIONS[rank % len(REGIONS)]
        names.within(
            axes,
            _middles(plane, region),
            str(rank + 1) if crowded else region.itinerary,
            _REACH,
            fill=colour,
            color=readable(colour),
        )


def _middles(plane: Plane, region: Region) -> Array:
    """Points inside a region, those farther from its border first."""
    import shapely

    shape = region._replace(rings=tuple(map(plane.unit, region.rings))).shape()
    middle = shapely.point_on_surface(shape)
    side = (np.arange(_PLACES) + 0.5) / _PLACES
    grid = np.column_stack([v.ravel() for v in np.meshgrid(side, side)])
    inside = np.array([(middle.x, middle.y), *grid[shapely.contains_xy(shape, *grid.T)]])
    depth = shapely.distance(shape.boundary, shapely.points(inside))
    return plane.back(inside[np.argsort(-depth, kind="stable")])


def _draw_curve(axes: Axes, curve: Curve, plane: Plane) -> None:
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
    figure: Figure, axes: Axes, regions: Sequence[Region], numbered: Sequence[str], others: int
) -> None:
    handles, labels = axes.get_legend_handles_labels()
    unique: dict[str, Any] = dict(zip(labels, handles, strict=True))
    for place, itinerary in enumerate(numbered):
        unique[itinerary] = Patch(color=REGIONS[place], label=f"{place + 1}  {itinerary}")
    if others:
        unique["others"] = Patch(color=_OTHERS, label=f"{others} other itineraries")
    if not all(region.itinerary for region in regions):
        unique[""] = Patch(facecolor="white", edgecolor="0.5", label=NOT_PERIODIC)
    add_key(figure, list(unique.values()), below=True)
