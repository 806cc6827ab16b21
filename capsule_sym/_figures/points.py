"""All that a figure draws, as rows of a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, PolyCollection, QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from capsule_sym._records import table

_COLUMNS = ("panel", "x_label", "y_label", "series", "x", "y", "z")


def points_of(figure: Figure) -> str:
    """The points of all lines, areas and cells of a figure, as CSV.

    A row has the number of its panel, the labels of the axes, the name of the series as in the
    legend, and x and y; z is the third coordinate of a line in perspective, or the number of a
    cell's colour. A bar has two rows, its lower left and its upper right corner.
    """
    rows = []
    for panel, axes in enumerate(figure.axes, 1):
        head = (panel, axes.get_xlabel(), axes.get_ylabel())
        for series, points in _series(axes):
            name = "" if series.startswith("_child") else series.lstrip("_")
            for point in np.asarray(points, dtype=float).tolist():
                three = [*point, ""][:3]
                rows.append(dict(zip(_COLUMNS, (*head, name, *three), strict=True)))
    return table(rows, _COLUMNS)


def _series(axes: Axes) -> Iterator[tuple[str, Any]]:
    """Each artist with data: its label and points, (n, 2) or (n, 3)."""
    for line in axes.lines:
        if axes.name == "3d":
            yield str(line.get_label()), np.column_stack(line.get_data_3d())  # type: ignore[attr-defined]
        elif line.get_transform() == axes.transData:
            yield str(line.get_label()), line.get_xydata()
    bars = {one: str(group.get_label()) for group in axes.containers for one in group}
    for patch in axes.patches:
        if Patch.get_data_transform(patch) == axes.transData:
            yield bars.get(patch, str(patch.get_label())), _outline(patch)
    for drawn in axes.collections if axes.name != "3d" else ():
        label = str(drawn.get_label())
        if isinstance(drawn, QuadMesh):
            corners = np.asarray(drawn.get_coordinates(), dtype=float)
            middles = (corners[:-1, :-1] + corners[1:, 1:]).reshape(-1, 2) / 2
            colours: Any = np.ma.filled(np.ma.asarray(drawn.get_array(), dtype=float), np.nan)
            yield label, np.column_stack([middles, colours.ravel()])
        elif isinstance(drawn, PathCollection):
            yield label, drawn.get_offsets()
        elif isinstance(drawn, PolyCollection):
            for path in drawn.get_paths():
                yield label, path.vertices


def _outline(patch: Patch) -> Any:
    if isinstance(patch, Rectangle):
        return patch.get_corners()[[0, 2]]
    return patch.get_patch_transform().transform(patch.get_path().vertices)
