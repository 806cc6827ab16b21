"""Faults of a drawing's texts, as its renderer lays them out: cut, overlapping, struck.

All that is drawn is recorded while it is drawn, so that only visible texts are checked.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from matplotlib.quiver import Quiver
from matplotlib.spines import Spine
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Bbox

_SPARE = 1.0  # pixels at the rim of a text's box that hold no ink


@dataclass(frozen=True)
class Label:
    """A drawn text: its box, turned about its middle, and what lies above or below it."""

    text: str
    middle: np.ndarray
    half: np.ndarray
    angle: float
    level: float
    patch: bool  # it hides what is below it

    def corners(self) -> np.ndarray:
        square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (self.half - _SPARE)
        return self._turn().transform(square)

    def _turn(self) -> Affine2D:
        return Affine2D().rotate_deg(self.angle).translate(*self.middle)

    def meets(self, other: Label) -> bool:
        """True if two boxes have a point in common, by the axes that could separate them."""
        mine, theirs = self.corners(), other.corners()
        for angle in (self.angle, other.angle):
            for turn in (angle, angle + 90):
                axis = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
                a, b = mine @ axis, theirs @ axis
                if a.max() <= b.min() or b.max() <= a.min():
                    return False
        return True

    def crossed(self, path: Path) -> bool:
        own = self._turn().inverted().transform_path(path)
        half = self.half - _SPARE
        return bool(own.intersects_bbox(Bbox([-half, half]), filled=False))


def _label(text: Text, renderer: Any) -> Label:
    whole = Text.get_window_extent(text, renderer)
    angle = text.get_rotation()
    text.set_rotation(0)
    flat = Text.get_window_extent(text, renderer)
    text.set_rotation(angle)
    patch = text.get_bbox_patch()
    hides = patch is not None and patch.get_visible() and patch.get_alpha() in (None, 1.0)
    hides = hides and patch.get_facecolor()[3] == 1.0
    middle = np.array([whole.x0 + whole.x1, whole.y0 + whole.y1]) / 2
    half = np.array([flat.width, flat.height]) / 2
    return Label(text.get_text(), middle, half, angle, text.get_zorder(), bool(hides))


def _paths(artist: Any) -> list[Path]:
    if np.all(np.asarray(artist.get_linewidth()) == 0) and not isinstance(artist, FancyArrowPatch):
        return []
    # As open lines: the point that closes a path is nowhere.
    return [
        Path(line)
        for path in _whole_paths(artist)
        for line in path.to_polygons(closed_only=False)
        if len(line) > 1
    ]


def _whole_paths(artist: Any) -> list[Path]:
    transform = artist.get_transform()
    if isinstance(artist, Collection):
        offsets = artist.get_offset_transform().transform(artist.get_offsets())
        found = [transform.transform_path(path) for path in artist.get_paths()]
        if isinstance(artist, Quiver):
            found = [Path(path.vertices + at) for path, at in zip(found, offsets, strict=False)]
        return found
    path = transform.transform_path(artist.get_path())
    if isinstance(artist, Line2D) and artist.get_linestyle() in ("None", "none", "", " "):
        return []
    return [path]


def _points(artist: Any) -> list[Path]:
    """The markers of a line, as small squares."""
    if not isinstance(artist, Line2D) or artist.get_marker() in ("None", None, "", " "):
        return []
    if len(artist.get_xdata()) == 0:
        return []
    half = artist.get_markersize() * artist.figure.dpi / 72 / 2
    return [
        Path(at + half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]))
        for at in artist.get_transform().transform(artist.get_xydata())
    ]


@contextmanager
def _recording(seen: Callable[[Any, Any], None]):
    kinds = (Text, Line2D, LineCollection, Quiver, FancyArrowPatch, Spine)
    before = {kind: kind.__dict__.get("draw") for kind in kinds}

    def recorder(kind):
        inherited = kind.draw

        def draw(self, renderer, *rest, **named):
            if self.get_visible():
                seen(self, renderer)
            return inherited(self, renderer, *rest, **named)

        draw._supports_rasterization = getattr(inherited, "_supports_rasterization", False)
        return draw

    wrapped = {kind: recorder(kind) for kind in kinds}
    try:
        for kind, draw in wrapped.items():
            kind.draw = draw
        yield
    finally:
        for kind, draw in before.items():
            if draw is None:
                del kind.draw
            else:
                kind.draw = draw


def problems(figure: Any) -> list[str]:
    """Faults, one line each; none if the figure can be printed."""
    canvas = FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    labels: list[Label] = []
    lines: list[tuple[Path, float, Any, str]] = []
    extents: list[tuple[float, ...]] = []

    def seen(artist: Any, renderer: Any) -> None:
        if isinstance(artist, Text):
            if artist.get_text().strip():
                labels.append(_label(artist, renderer))
        else:
            clip = artist.get_clip_box() if artist.get_clip_on() else None
            name = f"{type(artist).__name__} {artist.get_label()!r}"
            for path in [*_paths(artist), *_points(artist)]:
                lines.append((path, artist.get_zorder(), clip, name))
                low, high = path.vertices.min(axis=0), path.vertices.max(axis=0)
                extents.append((*low, *high))

    with _recording(seen):
        figure.draw(canvas.get_renderer())
    whole = figure.bbox
    found = []
    for label in labels:
        x, y = label.corners().T
        if x.min() < 0 or y.min() < 0 or x.max() > whole.width or y.max() > whole.height:
            found.append(f"cut: {label.text}")
    found += [
        f"on another: {one.text} / {other.text}"
        for one, other in combinations(labels, 2)
        if one.meets(other)
    ]
    low_x, low_y, high_x, high_y = np.array(extents).reshape(-1, 4).T
    for label in labels:
        x, y = label.corners().T
        near = (low_x < x.max()) & (x.min() < high_x) & (low_y < y.max()) & (y.min() < high_y)
        for index in np.flatnonzero(near):
            path, level, clip, name = lines[index]
            if label.patch and label.level > level:
                continue
            if clip is not None and not _within(label, clip):
                continue
            if label.crossed(path):
                found.append(f"struck through: {label.text} by {name}")
    return found


def _within(label: Label, clip: Any) -> bool:
    x, y = label.corners().T
    return bool(x.min() < clip.x1 and clip.x0 < x.max() and y.min() < clip.y1 and clip.y0 < y.max())
