"""Names in a drawing that find their own places: on no line, on no other text, and uncut."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from matplotlib.quiver import Quiver
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, bottom, right and top in pixels."""

PATCH: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "alpha": 1.0, "pad": 0.8}
"""Background of a name on its own line, so that the line does not strike it through."""

_COMPASS = (0.6, 0.6), (-0.6, 0.6), (0.6, -0.6), (-0.6, -0.6), (0, 0.8), (0, -0.8), (1, 0), (-1, 0)
_AROUND = [(far * x, far * y) for far in (1.0, 1.7, 2.6) for x, y in _COMPASS]
"""Directions from a point to a name beside it, in sizes of the name's type and more."""

_ROOM = 2.0  # pixels that are left free around a name
_REACH, _NEAR = 150.0, 30.0  # points that a name may be away from its point, and from its line
# Costs of a place: on a text, and cut off; touching a line costs 1.
_TEXT, _CUT = 100.0, 1000.0
_FAR, _STRUCK = 0.5, 5.0  # what the longest line costs that leads to a name, and one on a text
_LED = 3  # places from which lines may lead to a name


@dataclass(frozen=True)
class _Name:
    text: Any
    axes: Any
    places: Array  # (n, 2), data coordinates
    offsets: Sequence[tuple[float, float]]  # points
    own: frozenset[int]  # what it may cover
    reach: float  # points that it may be away from its places, with a line that leads to one

    def choices(self, pixels: Array) -> Iterable[tuple[Array, Array, tuple[float, float], float]]:
        """Possible places, the better first: a place, the same in pixels, and the way from it.

        With it how long the line is that leads there, in shares of the longest.
        """
        for place, pixel in zip(self.places, pixels, strict=True):
            for offset in self.offsets:
                yield place, pixel, offset, 0.0
        turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        for share in np.linspace(0.1, 1, 10):
            away = share * self.reach
            for turn in turns:
                way = away * np.cos(turn), away * np.sin(turn)
                for k in range(0, len(self.places), -(-len(self.places) // _LED)):
                    yield self.places[k], pixels[k], way, share


@dataclass(frozen=True)
class Names:
    """Names of a figure's lines, points and areas, given one by one and placed together."""

    figure: Figure | SubFigure
    _names: list[_Name] = field(default_factory=list)

    def on(
        self, axes: Axes, places: Any, text: str, own: Iterable[Artist] = (), **looks: Any
    ) -> None:
        """A name on a line or in an area, at one of `places` (n, 2), the better ones first.

        It covers what is its `own`. Where all is full, a line leads to it from beside.
        """
        mine = tuple(own)
        fill, reach = ("white", _NEAR) if mine else ("none", _REACH)
        self._add(axes, places, text, [(0.0, 0.0)], looks, reach, fill, own=mine)

    def beside(self, axes: Axes, places: Any, text: str, **looks: Any) -> None:
        """A name beside one of `places` (n, 2), or where all is full away from it, with a line."""
        size = FontProperties(size=looks.get("fontsize", "small")).get_size_in_points()
        width = 0.5 * size * 0.6 * max(0, len(text.replace("$", "")) - 2)
        offsets = [(size * x + np.sign(x) * width, size * y) for x, y in _AROUND]
        self._add(axes, places, text, offsets, looks, _REACH, "none")

    def _add(
        self,
        axes: Any,
        places: Any,
        text: str,
        offsets: Sequence[tuple[float, float]],
        looks: dict[str, Any],
        reach: float,
        fill: str,
        own: Iterable[Artist] = (),
    ) -> None:
        places = np.asarray(places, dtype=float).reshape(-1, 2)
        looks = {"fontsize": "small", "zorder": 30, **looks}
        looks["arrowprops"] = {"arrowstyle": "-", "color": "black", "shrinkA": 0, "shrinkB": 0}
        looks["arrowprops"]["linewidth"] = 0.3
        looks["bbox"] = PATCH | {"facecolor": fill}
        made = axes.annotate(
            text,
            places[0],
            offsets[0],
            textcoords="offset points",
            ha="center",
            va="center",
            annotation_clip=False,
            **looks,
        )
        made.set_visible(False)  # as long as it has no place
        covered = frozenset(map(id, own))
        self._names.append(_Name(made, axes, places, offsets, covered, reach))

    def settle(self) -> None:
        """Put each name where it meets least, in the order in which they were given."""
        if not self._names:
            return
        whole: Figure = self.figure.get_figure(root=True)
        renderer = FigureCanvasAgg(whole).get_renderer()  # type: ignore[no-untyped-call]
        whole.draw_without_rendering()
        if whole is self.figure:  # nothing moves any more, and drawing it takes half the time
            whole.set_layout_engine("none")
        texts: list[Any] = self.figure.findobj(Text)
        shown = (text for text in texts if text.get_visible() and text.get_text())
        taken = [_box(text, renderer) for text in shown]
        curves = _curves(self.figure)
        extents = np.array([_extent(curve) for _, curve in curves]).reshape(-1, 4)
        scale = whole.dpi / 72
        for name in self._names:
            name.text.set_visible(True)
            x0, y0, x1, y1 = _box(name.text, renderer)
            half = np.array([x1 - x0, y1 - y0]) / 2 + _ROOM
            at = name.axes.transData.transform(name.places)
            best = np.inf
            for place, pixel, offset, led in name.choices(at):
                middle = pixel + scale * np.array(offset)
                box = (*(middle - half), *(middle + half))
                lead = Path([pixel, middle]) if led else None
                cost = self._cost(box, name, taken, curves, extents) + _FAR * led
                if lead is not None and cost < best:
                    cost += _STRUCK * sum(_crosses(lead, other) for other in taken)
                if cost < best:
                    best, chosen = cost, (place, offset, box, lead)
                if best == 0.0:
                    break
            place, offset, box, lead = chosen
            name.text.xy, name.text.xyann = tuple(place), offset
            taken.append(box)
            if lead is not None:
                curves.append((name.text.arrow_patch, lead))
                extents = np.vstack([extents, _extent(lead)])
            else:
                name.text.arrow_patch.set_visible(False)
                name.text.get_bbox_patch().set_visible(bool(name.own))
        self._names.clear()

    def _cost(
        self,
        box: Box,
        name: _Name,
        taken: list[Box],
        curves: list[Any],
        extents: Array,
    ) -> float:
        frame = name.axes.bbox if name.axes.name != "3d" else self.figure.bbox
        inside = (
            box[0] >= frame.x0 and box[1] >= frame.y0 and box[2] <= frame.x1 and box[3] <= frame.y1
        )
        cost = 0.0 if inside else _CUT
        cost += _TEXT * sum(_meet(box, other) for other in taken)
        if cost >= _TEXT:
            return cost
        low, high = extents[:, :2], extents[:, 2:]
        near = np.all((low < box[2:]) & (high > box[:2]), axis=1)
        return cost + sum(
            id(curves[k][0]) not in name.own and _crosses(curves[k][1], box)
            for k in np.flatnonzero(near)
        )


def _meet(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _extent(curve: Path) -> Box:
    points = np.asarray(curve.vertices)
    with np.errstate(invalid="ignore"):
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def _crosses(curve: Path, box: Box) -> bool:
    return bool(curve.intersects_bbox(Bbox.from_extents(*box), filled=False))


def _box(text: Text, renderer: Any) -> Box:
    return tuple(Text.get_window_extent(text, renderer).extents)  # type: ignore[return-value]


def _marks(line: Any, path: Path) -> Iterable[Path]:
    """The outlines of a line's markers."""
    half = line.get_markersize() * line.get_figure(root=True).dpi / 72 / 2
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
    return [Path(at + half * corners) for at in np.asarray(path.vertices)]


def _curves(figure: Figure | SubFigure) -> list[tuple[Artist, Path]]:
    """All that is drawn as a line, in pixels, with what draws it."""
    found: list[tuple[Artist, Path]] = []
    for axes in figure.axes:
        for line in axes.lines:
            if line.get_visible() and np.isfinite(line.get_path().vertices).any():
                path = line.get_transform().transform_path(line.get_path())
                joined = line.get_linestyle() != "None"
                found += [(line, one) for one in ([path] if joined else _marks(line, path))]
        for child in axes.get_children():
            if isinstance(child, LineCollection | Quiver):
                whole = child.get_transform()
                offsets = child.get_offset_transform().transform(child.get_offsets())
                for k, path in enumerate(child.get_paths()):
                    moved = whole.transform_path(path)
                    if isinstance(child, Quiver):
                        moved = type(moved)(moved.vertices + offsets[k % len(offsets)])
                    found.append((child, moved))
            elif isinstance(child, FancyArrowPatch):
                found.append((child, child.get_transform().transform_path(child.get_path())))
        for note in axes.texts:
            arrow = getattr(note, "arrow_patch", None)
            if arrow is not None and note.get_visible():
                found.append((arrow, arrow.get_transform().transform_path(arrow.get_path())))
    # As open lines: where a path is closed, its last point is nowhere.
    return [
        (artist, Path(line))
        for artist, curve in found
        for line in map(np.asarray, curve.to_polygons(closed_only=False))
        if len(line) > 1
    ]
