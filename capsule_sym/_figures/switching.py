"""Figs. 3 to 5: what happens on surfaces, on L1 to L4 and on L5 to L8, from exact trajectories."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._figures.labels import PATCH, Names
from capsule_sym._figures.layout import NARROW, add_key
from capsule_sym._figures.portraits import field_handles
from capsule_sym._figures.sections import draw_section
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.statespace import top_view, window
from capsule_sym._figures.style import Colours, canvas, describe, figure_style, mathematical
from capsule_sym._map import Trajectory
from capsule_sym._parameters import Parameters
from capsule_sym._study.boundaries import Array, lines
from capsule_sym._study.sections import SCHEMATIC, Section, derivatives, line_point, sections

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Bundles = Sequence[Sequence[Trajectory]]


_THROUGH = {"S1": ((3,), 1), "S5": ((4, 6), 5), "S7": ((1,), 4)}  # sources and target of Fig. 3
_KEY = "arrows: $F_i$ at $\\omega\\tau=0$ (black), $\\pi$ (grey)"
_ARROW: dict[str, Any] = {
    **{"angles": "xy", "units": "inches", "width": 0.014, "zorder": 5},
    **{"scale_units": "inches", "scale": 4.0},
}


def plot_fig3(
    bundles: Bundles,
    parameters: Parameters = SCHEMATIC,
    *,
    colours: Colours = "safe",
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """Trajectories through S1, S5 and S7, with the normals and fields in one point (Fig. 3).

    `bundles` are those of the first of `sections` at the parameters, in their order.
    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    with figure_style():
        columns = 3 if width > NARROW else 1
        page = canvas(figure, width, 2.4 * 3 / columns, layout="constrained")
        panels = page.subplots(3 // columns, columns).flat
        for index, (axes, section, bundle) in enumerate(
            zip(panels, sections(parameters)[0], bundles, strict=True)
        ):
            draw_section(section, bundle, axes, colours)
            _vectors(section, parameters, axes)
            axes.set_title(f"({'abc'[index]})  {mathematical(section.name)}", loc="left")
        add_key(page, field_handles(page, colours))
        return describe(page, "Switching on surfaces", parameters=parameters)


def plot_fig4(
    bundles: Bundles,
    parameters: Parameters = SCHEMATIC,
    *,
    colours: Colours = "safe",
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """The plane P1 = 0 with the directions across L1 to L4, and sections of them (Fig. 4).

    `bundles` are those of the second of `sections`, in their order. Of the two arrows in a point
    one is the field of stick when the excitation is largest, one when it is least: on L2^(2) and
    L3^(2) they are on different sides of the line.
    Drawn into `figure`, a figure or a part of one, if it is given.
    """

    def arrows(axes: Axes) -> None:
        for name, field in (("L1", 2), ("L2", 2), ("L3", 5), ("L4", 5)):
            _fields(parameters, name, field, axes)

    return _plane_and_sections(parameters, 1, bundles, arrows, colours, width, figure)


def plot_fig5(
    bundles: Bundles,
    parameters: Parameters = SCHEMATIC,
    *,
    colours: Colours = "safe",
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """The plane P1 = 0 with the directions across L5 to L8, and sections of them (Fig. 5).

    `bundles` are those of the third of `sections`, in their order; arrows as in `plot_fig4`.
    Drawn into `figure`, a figure or a part of one, if it is given.
    """

    def arrows(axes: Axes) -> None:
        for name, field in (("L5", 4), ("L6", 5), ("L7", 2), ("L8", 3)):
            _fields(parameters, name, field, axes)

    return _plane_and_sections(parameters, 2, bundles, arrows, colours, width, figure)


def _plane_and_sections(
    parameters: Parameters,
    which: int,
    bundles: Bundles,
    arrows: Callable[[Axes], None],
    colours: Colours,
    width: float,
    figure: Figure | SubFigure | None,
) -> Figure:
    shown = sections(parameters)[which]
    with figure_style():
        # Two sections in a column beside the plane, or two in a row below it.
        half = -(-len(shown) // 2)
        beside = width > NARROW
        page = canvas(figure, width, 4.2 if beside else 2.9 + 1.5 * half, layout="constrained")
        grid = (
            page.add_gridspec(2, 1 + half, width_ratios=(1.75, *[1] * half))
            if beside
            else page.add_gridspec(1 + half, 2, height_ratios=(1.9, *[1] * half))
        )
        plane = page.add_subplot(grid[:, 0] if beside else grid[0, :])
        names = Names(page)
        top_view(parameters, plane, *window(parameters, 1.16, 0.96), names, colours)
        arrows(plane)
        plane.set_title(f"(a)  plane $P_1=0$\n{_KEY}", loc="left", fontsize=6.3)
        for index, (section, bundle) in enumerate(zip(shown, bundles, strict=True)):
            row, column = divmod(index, half if beside else 2)
            axes = page.add_subplot(grid[row, 1 + column] if beside else grid[1 + row, column])
            draw_section(section, bundle, axes, colours)
            axes.set_title(f"({'bcdefg'[index]})  {mathematical(section.name)}", loc="left")
        add_key(page, field_handles(page, colours))
        names.settle()
        return describe(page, "Switching on lines", parameters=parameters)


def _fields(parameters: Parameters, name: str, field: int, axes: Axes) -> None:
    """The field in the plane P1 = 0 at points of a line, when cos(omega tau) is 1 and -1."""
    line = lines(parameters, *window(parameters, 1.16, 0.96)).get(name)
    if line is None:
        return
    (_, low), (_, high) = sorted(line.tolist(), key=lambda end: end[1])
    count = max(2, round((high - low) / 0.9))
    for v_r in np.linspace(low, high, count + 2)[1:-1]:
        x_r, _, _ = line_point(parameters, name, v_r)
        for cosine, shade in ((1.0, "0.0"), (-1.0, "0.55")):
            step, turn, _ = derivatives(parameters, field, (x_r, v_r), cosine)
            size = np.hypot(step, turn)
            axes.quiver(x_r, v_r, step / size, turn / size, color=shade, **_ARROW)


def _vectors(section: Section, parameters: Parameters, axes: Axes) -> None:
    """Fields before and after (black), and the normals (grey), in the middle of a section."""
    x_r, v_r, v_c = section.state
    size = np.array([section.across, section.up])
    sources, target = _THROUGH[section.piece]
    plane = 2 if section.piece == "S7" else 1
    across = np.array([1.0, 0.0]) if plane == 2 else np.array([0.0, 1.0])

    def arrow(start: Array, end: Array, text: str, colour: str, place: Array) -> None:
        (x0, y0), (x1, y1), (x2, y2) = (
            size * p + np.array([0.0, v_c]) for p in (start, end, place)
        )
        looks = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (x1, y1), xytext=(x0, y0), arrowprops=looks, zorder=6)
        axes.text(x2, y2, text, ha="center", va="center", bbox=PATCH, zorder=30)

    middle, aside = np.zeros(2), np.array([0.0, 0.12]) if plane == 2 else np.zeros(2)
    for sign, mark in ((1, "+"), (-1, "-")):
        normal = 0.5 * sign * across
        name = rf"$\nabla P_{plane}^{{{mark}}}$"
        arrow(middle, normal, name, "0.45", 1.25 * normal - aside)
    for field, after in (*((source, False) for source in sources), (target, True)):
        step, _, rise = derivatives(parameters, field, (x_r, v_r), 1.0)
        way = np.array([step, rise]) / size
        way *= (0.75 if after else -0.75) / np.hypot(*way)
        start, end = (middle, way) if after else (way, middle)
        arrow(start, end, f"$F_{field}$", "black", 1.12 * way + aside)
