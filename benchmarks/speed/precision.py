"""Work against precision: what a period costs with each tool, and how far off it ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from capsule_sym._figures.interface import (
    PAGE,
    across,
    add_key,
    canvas,
    describe,
    handles_of,
    styled,
)

Row = Mapping[str, Any]
_MARKERS = "osD^v<>ph*XP"
_PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_STYLES = ("-", ":", "--", "-.")
_LEAST = 1e-17  # stands for an error of exactly 0, which has no place on a logarithmic axis
_TITLES = {
    "trajectory": "the case study",
    "tangencies": "beside tangencies",
    "sweep": "a sweep over α",
}


@styled
def plot_work_precision(
    record: Mapping[str, Any],
    *,
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """Time per excitation period against the largest error, a curve for each tool and method.

    `record` is the JSON of `python -m benchmarks bench`; the method is the text after the tolerance
    in a row's `setting`. A hollow marker means that the tool missed or invented switches there.
    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    rows = {name: _measured(record.get(name, ())) for name in _TITLES}
    shown = [name for name in _TITLES if rows[name]]
    ways = list(dict.fromkeys(_way(row) for name in shown for row in rows[name]))
    columns = across(width, 2.2, max(1, len(shown)))
    down = max(1, -(-len(shown) // columns))
    page = canvas(figure, width, 3.2 * down, layout="constrained")
    panels = page.subplots(down, columns, squeeze=False, sharey=True)
    for axes, name in zip(panels.flat, shown, strict=False):
        _draw(rows[name], ways, axes)
        axes.set_title(_TITLES[name], loc="left")
        axes.set_xlabel("time per excitation period (µs)")
    for axes in panels[:, 0]:
        axes.set_ylabel("largest error of the final state")
    drawn = handles_of(panels.flat)
    if any(_wrong(row) for name in shown for row in rows[name]):
        look: dict[str, Any] = {"marker": "o", "markerfacecolor": "white", "linestyle": ""}
        drawn.append(Line2D([], [], color="0.4", label="hollow: events missed or invented", **look))
    add_key(page, drawn, below=True)
    return describe(page, "Work against precision")


def _measured(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.get("max_error") is not None]


def _way(row: Row) -> tuple[str, str]:
    """A tool and the way it is used, such as ("heyoka.py", "careful")."""
    return row["tool"], row["setting"].partition(", ")[2]


def _draw(rows: Sequence[Row], ways: Sequence[tuple[str, str]], axes: Axes) -> None:
    tools = list(dict.fromkeys(tool for tool, _ in ways))
    for tool, way in ways:
        own = [row for row in rows if _way(row) == (tool, way)]
        own.sort(key=lambda row: float(row["us_per_period"]))
        index = tools.index(tool)
        style = _STYLES[[w for t, w in ways if t == tool].index(way) % len(_STYLES)]
        colour, marker = _PALETTE[index % len(_PALETTE)], _MARKERS[index % len(_MARKERS)]
        points = [(row["us_per_period"], max(row["max_error"], _LEAST)) for row in own]
        axes.plot(
            [time for time, _ in points],
            [error for _, error in points],
            marker=marker,
            linestyle=style,
            color=colour,
            linewidth=0.8,
            label=f"{tool}, {way}" if way else tool,
        )
        wrong = [point for point, row in zip(points, own, strict=True) if _wrong(row)]
        axes.plot(
            [time for time, _ in wrong],
            [error for _, error in wrong],
            marker,
            color=colour,
            markerfacecolor="white",
            label="_wrong",
        )
    axes.set(xscale="log", yscale="log")
    axes.grid(visible=True)


def _wrong(row: Row) -> bool:
    return bool(row["missed"] or row["invented"])
