"""Regions of a plane of two parameters, bounded by exact curves, each with its itinerary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix as Array
from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym._sweeps import itineraries
from capsule_sym._sweeps.quantities import CellOutcome

if TYPE_CHECKING:
    import xarray as xr

Limits = tuple[float, float]

_GRID = 1e-9  # of the unit square: points of two curves closer than this are merged
_BESIDE = 0.1  # of half a cell
_LEAST = 1e-7  # least area of a region, of the unit square
_LATE = -2  # stands for the code of an itinerary where a motion has not settled


class Region(NamedTuple):
    """Part of the plane in which all motions have one itinerary.

    `rings` are its outline and the outlines of its holes, each of shape (n, 2). `itinerary` has the
    fields in order of time, such as "F5 F2"; it is empty where there is no result, and a sentence
    where motions have not settled.
    """

    rings: tuple[Array, ...]
    itinerary: str

    def shape(self) -> Any:
        """Region as a polygon of shapely."""
        from shapely import Polygon

        outline, *holes = self.rings
        return Polygon(outline, holes)


class Plane(NamedTuple):
    """Two parameters and their ranges."""

    first: str
    second: str
    x: Limits
    y: Limits

    def of(self, records: Sequence[Mapping[str, Any]]) -> list[tuple[float, float]]:
        """Positions of a curve's points; parameters of a device are read from "si".

        Raises InvalidInput for a curve over other parameters.
        """
        found = []
        for record in records:
            si = {name.partition(" [")[0]: value for name, value in record.get("si", {}).items()}
            known = {**si, **record}
            if not {self.first, self.second} <= known.keys():
                allowed = f"of {self.first} and {self.second}, the parameters of the results"
                raise InvalidInput("curve", list(record)[:2], allowed)
            found.append((known[self.first], known[self.second]))
        return found

    def unit(self, points: Any) -> Array:
        """Points (n, 2) of the plane as points of the unit square."""
        low, size = self._frame()
        found: Array = (np.asarray(points, dtype=float).reshape(-1, 2) - low) / size
        return found

    def back(self, points: Any) -> Array:
        """Points (n, 2) of the unit square as points of the plane."""
        low, size = self._frame()
        found: Array = low + np.asarray(points, dtype=float) * size
        return found

    def _frame(self) -> tuple[Array, Array]:
        return np.array([self.x[0], self.y[0]]), np.array([np.ptp(self.x), np.ptp(self.y)])


def patches(plane: Plane, curves: Sequence[Mapping[str, Any]]) -> list[Any]:
    """Patches into which curves cut the unit square of a plane, as polygons of shapely.

    Raises NotInstalled without shapely.
    """
    try:
        from shapely import LineString, box, polygonize, unary_union
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    square = box(0.0, 0.0, 1.0, 1.0)
    lines = [square.exterior]
    for curve in curves:
        points = plane.unit(plane.of(curve["points"]))
        if len(points) < 2:
            continue
        line = LineString(points)
        ends = plane.unit(plane.of(curve["codimension_two"]))
        lines.append(LineString(_through(line, ends)))
    cut = polygonize([unary_union(lines, grid_size=_GRID)])
    return [patch for patch in cut.geoms if patch.area > _LEAST and square.covers(patch.centroid)]


def _through(line: Any, codimension_two: Array) -> Array:
    """Points of a line with the points `codimension_two` inserted in order."""
    from shapely import Point

    known = np.asarray(line.coords)
    steps = np.hypot(*np.diff(known, axis=0).T)
    there = [line.project(Point(point)) for point in codimension_two]
    places = [*np.concatenate([[0.0], np.cumsum(steps)]), *there]
    points = np.concatenate([known, codimension_two])
    found = points[np.argsort(places, kind="stable")]
    # A curve is continued up to just before its codimension-two end point.
    if 0.0 in there:
        found[[0, 1]] = found[[1, 0]]
    return found


def by_cells(
    results: xr.Dataset, curves: Sequence[Mapping[str, Any]]
) -> tuple[Plane, list[Region]]:
    """Regions of a sweep over two parameters; `results` are those of `open_results`.

    The curves bound them. Within a patch of several motions the cells bound them. Raises
    InvalidInput for results of another kind.
    """
    if "itinerary" not in results or len(sizes := results["itinerary"].sizes) != 2:
        raise InvalidInput("results", sorted(map(str, results)), "itineraries over two parameters")
    if min(sizes.values()) < 2:
        raise InvalidInput("results", dict(sizes), "two values or more of each parameter")
    first, second = map(str, sizes)
    x, y = (np.asarray(results[name].values, dtype=float) for name in (first, second))
    plane = Plane(first, second, (x[0], x[-1]), (y[0], y[-1]))
    cut = patches(plane, curves)
    import shapely

    late, said = unsettled(results)
    codes = np.where(late, _LATE, results["itinerary"].values)
    texts = itineraries.texts(results) | {_LATE: said}
    middles = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    at = plane.unit(middles.reshape(-1, 2)).reshape(middles.shape)
    within = np.clip(at, _LEAST, 1 - _LEAST)  # points on the rim count as inside
    steps = [0.5 / (len(v) - 1) for v in (x, y)]
    rim = shapely.box(0.0, 0.0, 1.0, 1.0).boundary.buffer(_GRID)
    found = []
    for patch in cut:
        inside = shapely.contains_xy(patch, within[..., 0], within[..., 1])
        own, parts = patch.boundary.difference(rim), []
        known, counts = np.unique(codes[inside], return_counts=True)
        most = ""
        for rank, code in enumerate(known[np.argsort(-counts)]):
            itinerary = texts.get(int(code), "")
            if rank == 0:
                most = itinerary
                continue
            chosen = inside & (codes == code)
            cells = at[chosen]
            # Beside a curve a cell may lie on the other side of the chord between two curve points.
            away = shapely.distance(own, shapely.points(cells))
            if float(np.nan_to_num(away.max(), nan=np.inf)) < _BESIDE * min(steps):
                continue
            # One box for each run of cells: to join single ones takes much longer.
            turns = np.diff(np.pad(chosen, ((0, 0), (1, 1))).astype(int), axis=1)
            (rows, begin), (_, end) = (np.nonzero(turns == way) for way in (1, -1))
            low, high = at[rows, begin] - steps, at[rows, end - 1] + steps
            boxes = shapely.box(*low.T, *high.T)
            parts.append(
                (itinerary, shapely.unary_union(boxes, grid_size=_GRID).intersection(patch))
            )
        rest = patch.difference(shapely.unary_union([part for _, part in parts]))
        for itinerary, part in ((most, rest), *parts):
            found += [
                region_of(plane, piece, itinerary)
                for piece in getattr(part, "geoms", [part])
                if piece.geom_type == "Polygon" and piece.area > _LEAST
            ]
    return plane, found


def unsettled(results: xr.Dataset) -> tuple[NDArray[np.bool_], str]:
    """Mask of the cells of a sweep that have not settled, and the text that states it."""
    outcomes = results["outcome"].values if "outcome" in results else np.array(0)
    said = f"not settled in {results.attrs.get('periods', 0):,} periods"
    return outcomes == CellOutcome.NOT_SETTLED, said


def region_of(plane: Plane, polygon: Any, itinerary: str) -> Region:
    """Region of a polygon of the unit square."""
    rings = [polygon.exterior, *polygon.interiors]
    return Region(tuple(plane.back(np.asarray(ring.coords)) for ring in rings), itinerary)
