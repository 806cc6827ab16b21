"""Fig. 2: subspaces, surfaces and lines in perspective, and the plane P1 = 0 from above."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from mpl_toolkits.mplot3d import proj3d

from capsule_sym import InvalidInput, Parameters
from capsule_sym._figures.interface import (
    LOOKS,
    NARROW,
    PAGE,
    Array,
    Limits,
    canvas,
    corners,
    describe,
    field_colour,
    lines,
    mathematical,
    styled,
)
from paper.figures.labels import PATCH, Names
from paper.figures.space import Box, add_space, draw_space, fit_view, size_of, surfaces, walls
from paper.study.sections import SCHEMATIC, line_point

GAPS = (0.4, 1.0, 1.6)
"""Gaps delta below, at and above the friction bound f_b = 1."""


def window(parameters: Parameters, below: float, above: float) -> tuple[Limits, Limits]:
    """Ranges of x_r and v_r around the corner points O1 and O2, and so much of their distance more.

    Raises InvalidInput without damping, where these are at infinity.
    """
    p = parameters
    if p.zeta == 0.0:
        raise InvalidInput("zeta", p.zeta, "above 0 for the switching surfaces' corner points")
    upper, lower = corners(p)
    low, high = lower - below * (upper - lower), upper + above * (upper - lower)
    left, right = line_point(p, "L1", high)[0], line_point(p, "L3", low)[0]
    room = 0.1 * (right - left)
    return (left - room, right + room / 2), (low, high)


@styled
def plot_fig2(
    parameters: Parameters = SCHEMATIC,
    *,
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """The state space with Omega1-6, S1-S10 and L1-L9, and top views for three gaps (Fig. 2).

    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    columns = 3 if width > NARROW else 1
    above, below = max(2.7, 0.52 * width), 2.4 * (3 // columns)
    page = canvas(figure, width, above + below)
    names = Names(page)
    # Margins of the top views are for the texts of their axes.
    size, high = size_of(page)
    share = below / (above + below)
    view = page.add_gridspec(1, 1, left=0, right=1, bottom=share, top=1)
    grid = page.add_gridspec(
        3 // columns, columns, left=0.42 / size, right=1 - 0.1 / size, bottom=0.4 / high,
        top=share - 0.2 / high, wspace=0.22, hspace=0.3,
    )  # fmt: skip
    x_r, v_r = window(parameters, 1.85, 1.2)
    box = Box(x_r, v_r, (-2.5 * parameters.f_b, 2.5 * parameters.f_b))
    axes = add_space(page, view[0], box, eye=(24.0, -50.0))
    draw_space(parameters, axes, box)
    _name_space(axes, parameters, box, names)
    relation = ("<", "=", ">")[int(np.sign(parameters.delta - parameters.f_b)) + 1]
    fit_view(axes, axes.set_title(rf"(a)  $\delta{relation}f_b$", loc="left", y=1.0))
    for index, gap in enumerate(_gaps(parameters)):
        flat = page.add_subplot(grid[index])
        top_view(gap, flat, box.x_r, box.v_r, names)
        flat.set_title(rf"({'bcd'[index]})  $\delta{'<=>'[index]}f_b$", loc="left")
    names.settle()
    return describe(page, "State space", parameters=parameters)


def _gaps(parameters: Parameters) -> list[Parameters]:
    """The parameters with gaps below, at and above the friction bound; where it can, its own."""
    own, bound = parameters.delta, parameters.f_b
    low, _, high = (factor * bound for factor in GAPS)
    gaps = (own if own < bound else low, bound, own if own > bound else high)
    return [parameters.replace(delta=gap) for gap in gaps]


def top_view(
    parameters: Parameters,
    axes: Axes,
    x_r: Limits,
    v_r: Limits,
    names: Names,
) -> None:
    """The plane P1 = 0: surfaces S1-S6 tinted, lines L1-L8 and corners O1, O2 named.

    The names are given to `names`, which places them.
    """
    at = {f"O{k}": v for k, v in enumerate(corners(parameters), start=1) if v_r[0] < v < v_r[1]}
    for name, v in at.items():
        axes.plot(parameters.delta, v, "o", color="black", label=name)
    for name, line in lines(parameters, x_r, v_r).items():
        style, colour = LOOKS[name]
        own = axes.plot(*line.T, style, color=colour, linewidth=0.9, label=name)
        names.on(axes, along(line), mathematical(name), own, color=colour, bbox=PATCH)
    for name, polygon in surfaces(parameters, x_r, v_r).items():
        tint = field_colour(int(name[1:]))
        axes.fill(*polygon.T, color=tint, alpha=0.16, linewidth=0, label=name)
        names.on(axes, inside(polygon), mathematical(name))
    for name, v in at.items():
        names.beside(axes, (parameters.delta, v), mathematical(name))
    axes.axhline(0, color="0.7", linewidth=0.4, zorder=0)
    axes.axvline(0, color="0.7", linewidth=0.4, zorder=0)
    axes.set(xlim=x_r, ylim=v_r, xlabel="$x_r$", ylabel="$v_r$")


def along(line: Array) -> Array:
    """Places for a name on a line between two ends, the middle first."""
    share = 0.5 + np.array([0, *(s * k for k in np.arange(0.05, 0.46, 0.05) for s in (1, -1))])
    found: Array = line[0] + np.outer(share, line[1] - line[0])
    return found


def inside(polygon: Array) -> Array:
    """Places for a name in a convex polygon, the middle first."""
    middle = polygon.mean(axis=0)
    between = np.concatenate([polygon, (polygon + np.roll(polygon, 1, axis=0)) / 2])
    steps = [middle + share * (between - middle) for share in (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75)]
    found: Array = np.concatenate(steps)
    return found


def _name_space(axes: Any, parameters: Parameters, box: Box, names: Names) -> None:
    """The names of subspaces, surfaces and lines, where they are in the box."""
    delta, (x_r, v_r, v_c) = parameters.delta, box
    left, right, back = (x_r[0] + delta) / 2, (x_r[1] + delta) / 2, 0.5 * v_r[1]
    for index, place in (
        (1, (left, back, 0.6 * v_c[1])),
        (3, (left, v_r[0] / 2, 0.6 * v_c[0])),
        (4, (right, back, 0.6 * v_c[1])),
        (6, (right, v_r[0] / 2, 0.6 * v_c[0])),
    ):
        names.beside(axes, projected(axes, [place]), rf"$\Omega_{index}$", fontsize="x-large")
    own = {line.get_label(): line for line in axes.lines}
    for name, line in lines(parameters, x_r, v_r).items():
        level = np.column_stack([along(line), np.zeros(len(along(line)))])
        looks = {"color": LOOKS[name][1], "bbox": PATCH}
        names.on(axes, projected(axes, level), mathematical(name), [own[name]], **looks)
    name_upright(axes, delta, box, names)
    areas = {
        name: np.column_stack([polygon, np.zeros(len(polygon))])
        for name, polygon in surfaces(parameters, x_r, v_r).items()
    }
    for name, polygon in (areas | walls(delta, box)).items():
        places = inside(polygon)
        if name == "S10":  # most of it is behind the plane P1 = 0
            places = places + np.array([0.0, 0.0, 0.3 * v_c[0]])
        names.on(axes, projected(axes, places), mathematical(name))


def name_upright(axes: Any, delta: float, box: Box, names: Names) -> None:
    """The name of L9 on each of its halves in the box."""
    own = [line for line in axes.lines if line.get_label() == "L9"]
    for end in (v for v in box.v_c if own and abs(v) > 0.2 * max(map(abs, box.v_c))):
        half = [(delta, 0.0, share * end) for share in (0.85, 0.75, 0.65, 0.55, 0.95)]
        looks = {"color": "0.3", "bbox": PATCH}
        names.on(axes, projected(axes, half), mathematical("L9"), own, **looks)


def projected(axes: Any, places: Any) -> Array:
    """Places (n, 3) of the state space as coordinates (n, 2) of its picture."""
    x, y, _ = proj3d.proj_transform(*np.asarray(places, dtype=float).T, axes.get_proj())
    return np.column_stack([x, y])
