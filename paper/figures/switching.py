"""Figs. 3 to 5: what happens on surfaces, on L1 to L4 and on L5 to L8, from exact trajectories.

A bundle of trajectories starts on the rim of a small window around a point and is drawn while it is
inside: where the paper sketches one trajectory, all its neighbours are drawn, from the exact map.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from capsule_sym import InvalidInput, Parameters
from capsule_sym._figures.arcs import opening
from capsule_sym._figures.interface import (
    NARROW,
    PAGE,
    Array,
    add_key,
    canvas,
    describe,
    field_colour,
    field_handles,
    lines,
    mathematical,
    styled,
)
from capsule_sym._map.interface import NumpyBackend
from capsule_sym._orbits.interface import field as rates
from capsule_sym._parameters import of_paper
from capsule_sym.results import Trajectory
from paper.figures.labels import PATCH, Names
from paper.figures.statespace import top_view, window
from paper.study.sections import SCHEMATIC, SIGNS, Section, abscissa, line_point, sections

Bundles = Sequence[Sequence[Trajectory]]


_THROUGH = {"S1": ((3,), 1), "S5": ((4, 6), 5), "S7": ((1,), 4)}  # sources and target of Fig. 3
# The lines of Figs. 4 and 5 with the field whose directions are drawn on each.
_ALONG = {4: {"L1": 2, "L2": 2, "L3": 5, "L4": 5}, 5: {"L5": 4, "L6": 5, "L7": 2, "L8": 3}}
_KEY = "arrows: $F_i$ at $\\omega\\tau=0$ (black), $\\pi$ (grey)"
_ARROW: dict[str, Any] = {
    **{"angles": "xy", "units": "inches", "width": 0.014, "zorder": 5},
    **{"scale_units": "inches", "scale": 4.0},
}


@styled
def plot_switching(
    which: int,
    bundles: Bundles,
    parameters: Parameters = SCHEMATIC,
    *,
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """Switching on S1, S5 and S7, on L1 to L4, or on L5 to L8 (Fig. 3, 4 or 5).

    `bundles` are those of the sections of this figure at the parameters, in their order. On the
    surfaces they have the normals and fields in one point. Beside the lines is the plane P1 = 0:
    of the two arrows in a point one is the field of stick when the excitation is largest, one when
    it is least: on L2^(2) and L3^(2) they are on different sides of the line.
    Drawn into `figure`, a figure or a part of one, if it is given. Raises InvalidInput for another
    figure than 3, 4 and 5.
    """
    if which not in (3, *_ALONG):
        raise InvalidInput("which", which, "3, 4 or 5")
    shown = sections(parameters)[which - 3]
    wide = width > NARROW
    if which == 3:
        columns = 3 if wide else 1
        page = canvas(figure, width, 2.4 * 3 / columns, layout="constrained")
        panels = list(page.subplots(3 // columns, columns).flat)
    else:
        panels = []
        # Two sections in a column beside the plane, or two in a row below it.
        half = -(-len(shown) // 2)
        page = canvas(figure, width, 4.2 if wide else 2.9 + 1.5 * half, layout="constrained")
        grid = (
            page.add_gridspec(2, 1 + half, width_ratios=(1.75, *[1] * half))
            if wide
            else page.add_gridspec(1 + half, 2, height_ratios=(1.9, *[1] * half))
        )
        plane = page.add_subplot(grid[:, 0] if wide else grid[0, :])
        for k in range(len(shown)):
            row, column = divmod(k, half if wide else 2)
            place = grid[row, 1 + column] if wide else grid[1 + row, column]
            panels.append(page.add_subplot(place))
    names = Names(page)
    if which != 3:
        top_view(parameters, plane, *window(parameters, 1.16, 0.96), names)
        for name, field in _ALONG[which].items():
            _fields(parameters, name, field, plane)
        plane.set_title(f"(a)  plane $P_1=0$\n{_KEY}", loc="left", fontsize="small")
    letters = ("abc" if which == 3 else "bcdefg")[: len(shown)]
    for axes, letter, section, bundle in zip(panels, letters, shown, bundles, strict=True):
        draw_section(section, bundle, axes)
        if which == 3:
            _vectors(section, parameters, axes)
        axes.set_title(f"({letter})  {mathematical(section.name)}", loc="left")
    add_key(page, field_handles(page))
    names.settle()
    title = f"Switching on {'surfaces' if which == 3 else 'lines'}"
    return describe(page, title, parameters=parameters)


def _fields(parameters: Parameters, name: str, field: int, axes: Axes) -> None:
    """The field in the plane P1 = 0 at points of a line, when cos(omega tau) is 1 and -1."""
    line = lines(parameters, *window(parameters, 1.16, 0.96)).get(name)
    if line is None:
        return
    (_, low), (_, high) = sorted(line.tolist(), key=lambda end: end[1])
    constants = NumpyBackend().constants(field, parameters)
    count = max(2, round((high - low) / 0.9))
    for v_r in np.linspace(low, high, count + 2)[1:-1]:
        x_r, _, _ = line_point(parameters, name, v_r)
        for cosine, shade in ((1.0, "0.0"), (-1.0, "0.55")):
            step, turn, _ = rates(constants, (x_r, v_r, 0.0), cosine)
            size = np.hypot(step, turn)
            axes.quiver(x_r, v_r, step / size, turn / size, color=shade, **_ARROW)


def _vectors(section: Section, parameters: Parameters, axes: Axes) -> None:
    """Fields before and after (black), and the normals (grey), in the middle of a section."""
    x_r, v_r, v_c = section.state
    size = np.array([section.across, section.up])
    sources, target = _THROUGH[section.piece]
    plane = 2 if section.piece == "S7" else 1
    across = np.array([1.0, 0.0]) if plane == 2 else np.array([0.0, 1.0])

    def arrow(
        start: Array, end: Array, text: str, colour: str, place: Array, wide: float = 1.2
    ) -> None:
        (x0, y0), (x1, y1), (x2, y2) = (
            size * p + np.array([0.0, v_c]) for p in (start, end, place)
        )
        looks = {
            "arrowstyle": "-|>",
            "color": colour,
            "linewidth": wide,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        axes.annotate("", (x1, y1), xytext=(x0, y0), arrowprops=looks, zorder=6)
        axes.text(x2, y2, text, ha="center", va="center", bbox=PATCH, zorder=30)

    middle, aside = np.zeros(2), np.array([0.0, 0.12]) if plane == 2 else np.zeros(2)
    for sign, mark in ((1, "+"), (-1, "-")):
        normal = 0.5 * sign * across
        name = rf"$\nabla P_{plane}^{{{mark}}}$"
        # A field may go the same way, so that a normal is seen beside it.
        arrow(middle, normal, name, "0.65", 1.25 * normal - aside, 3.0)
    for field, after in (*((source, False) for source in sources), (target, True)):
        constants = NumpyBackend().constants(field, parameters)
        step, _, rise = rates(constants, (x_r, v_r, 0.0), 1.0)
        way = np.array([step, rise]) / size
        way *= (0.75 if after else -0.75) / np.hypot(*way)
        start, end = (middle, way) if after else (way, middle)
        arrow(start, end, f"$F_{field}$", "black", 1.12 * way + aside)


_CROSSINGS = 12  # half-widths that a trajectory goes at most, at its first velocity
_RIM = 1.0001  # a start on the rim is inside
_SHORT = 0.2  # span of a curve without an arrow head, in half-widths of the panel


def draw_section(section: Section, bundle: Iterable[Trajectory], axes: Axes) -> None:
    """A bundle of trajectories that starts on the rim of a section's window."""
    _, v_r, middle = section.state
    for trajectory in bundle:
        for arc in opening(trajectory, _CROSSINGS * section.across / abs(v_r)):
            x, y = abscissa(section, arc, of_paper(trajectory.parameters)), arc.v_c
            outside = (abs(x) > _RIM * section.across) | (abs(y - middle) > _RIM * section.up)
            inside = int(np.argmax(outside)) + 1 if outside.any() else len(x)
            colour = field_colour(arc.field)
            axes.plot(x[:inside], y[:inside], color=colour, linewidth=0.8, label=f"F{arc.field}")
            spans = np.ptp(x[:inside]) / section.across, np.ptp(y[:inside]) / section.up
            if max(spans) > _SHORT:
                _arrow(axes, x[:inside], y[:inside], colour)
            if outside.any():
                break
    if section.piece not in ("S1", "S5"):
        axes.axvline(0, color="black", linewidth=0.6, zorder=1)
    if abs(middle) < section.up:
        axes.axhline(0, color="black", linewidth=0.6, zorder=1)
    axes.set_xlim(-section.across, section.across)
    axes.set_ylim(middle - section.up, middle + section.up)
    axes.set_xticks([-section.across / 2, 0, section.across / 2])
    axes.set_xlabel(_label(section))
    axes.set_ylabel("$v_c$")


def _label(section: Section) -> str:
    sign = SIGNS.get(section.piece)
    if sign is None:
        return r"$x_r-\delta$"
    if sign == 0:
        return "$x_r-x_{r0}$"
    force = 3 if section.piece in ("L1", "L2") else 4
    return rf"$P_{force}{'-' if sign > 0 else '+'}f_b$"


def _arrow(axes: Axes, x: Array, y: Array, colour: str) -> None:
    """An arrow head halfway along a curve."""
    at = len(x) // 2
    before, after = at - 1, min(at + 1, len(x) - 1)
    axes.annotate(
        "",
        (x[after], y[after]),
        xytext=(x[before], y[before]),
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0, "mutation_scale": 6},
    )
