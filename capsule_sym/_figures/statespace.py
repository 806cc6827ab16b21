"""Fig. 2: subspaces, surfaces and lines in perspective, and the plane P1 = 0 from above."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from capsule_sym._figures.space import Box, add_space, draw_space, walls
from capsule_sym._figures.style import (
    LOOKS,
    PAGE,
    Colours,
    field_colour,
    mathematical,
    new_figure,
    styled,
)
from capsule_sym._parameters import Parameters
from capsule_sym._study.boundaries import Limits, corners, lines, surfaces
from capsule_sym._study.sections import SCHEMATIC

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


GAPS = (0.4, 1.0, 1.6)
"""Gaps delta below, at and above the friction bound f_b = 1."""

_BOX = Box((-2.6, 4.2), (-8.5, 5.0), (-2.5, 2.5))
PATCH = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6}
"""What is behind a name, so that it can be read on lines."""


def fig2(parameters: Parameters = SCHEMATIC, *, colours: Colours = "safe") -> Figure:
    """The state space with Omega1-6, S1-S10 and L1-L9, and top views for three gaps (Fig. 2)."""
    with styled():
        figure = new_figure(PAGE, 6.6)
        grid = figure.add_gridspec(
            2, 3, height_ratios=(1.8, 1), left=0.06, right=0.99, bottom=0.065, top=0.97,
            wspace=0.22, hspace=0.16,
        )  # fmt: skip
        axes = add_space(figure, grid[0, :], _BOX, eye=(24.0, -50.0), zoom=1.3)
        draw_space(parameters, axes, _BOX, colours)
        _name_space(axes, parameters)
        axes.set_title(r"(a)  $\delta<f_b$", loc="left", y=0.94)
        for index, (delta, relation) in enumerate(zip(GAPS, ("<", "=", ">"), strict=True)):
            below = figure.add_subplot(grid[1, index])
            top_view(parameters.replace(delta=delta), below, _BOX.x_r, _BOX.v_r, colours)
            below.set_title(rf"({'bcd'[index]})  $\delta{relation}f_b$", loc="left")
        return figure


def top_view(
    parameters: Parameters, axes: Axes, x_r: Limits, v_r: Limits, colours: Colours = "safe"
) -> None:
    """The plane P1 = 0: surfaces S1-S6 tinted, lines L1-L8 and corners O1, O2 named."""
    for name, polygon in surfaces(parameters, x_r, v_r).items():
        tint = field_colour(int(name[1:]), colours)
        axes.fill(*polygon.T, color=tint, alpha=0.16, linewidth=0, label=name)
        _name(axes, polygon.mean(axis=0), name)
    for name, line in lines(parameters, x_r, v_r).items():
        style, colour = LOOKS[name]
        axes.plot(*line.T, style, color=colour, linewidth=0.9, label=name)
        _name(axes, line.mean(axis=0), name, colour)
    for index, corner in enumerate(corners(parameters), start=1):
        if v_r[0] < corner < v_r[1]:
            axes.plot(parameters.delta, corner, "o", color="black", label=f"O{index}")
            axes.annotate(
                f"$O_{index}$",
                (parameters.delta, corner),
                xytext=(5, 3),
                textcoords="offset points",
                bbox=PATCH,
            )
    axes.axhline(0, color="0.7", linewidth=0.4, zorder=0)
    axes.axvline(0, color="0.7", linewidth=0.4, zorder=0)
    axes.set(xlim=x_r, ylim=v_r, xlabel="$x_r$", ylabel="$v_r$")


def _name_space(axes: Any, parameters: Parameters) -> None:
    """The names of subspaces, surfaces and lines, where they are in the box of Fig. 2."""
    delta, (x_r, v_r, v_c) = parameters.delta, _BOX
    for name, polygon in surfaces(parameters, x_r, v_r).items():
        _name(axes, (*polygon.mean(axis=0), 0.0), name)
    for name, line in lines(parameters, x_r, v_r).items():
        # Off the middle, which the names of the walls S8 and S9 cover.
        along = 0.5 if name in ("L5", "L6", "L7", "L8") else 0.25
        _name(axes, (*(line[0] + along * (line[1] - line[0])), 0.0), name, LOOKS[name][1])
    for name, wall in walls(delta, _BOX).items():
        _, middle, _ = wall.mean(axis=0)
        high = name in ("S7", "S8")
        _name(axes, (delta, middle, 0.5 * v_c[1] if high else 0.85 * v_c[0]), name)
    for v in (0.85 * v_c[0], 0.85 * v_c[1]):
        _name(axes, (delta, 0.0, v), "L9", "0.3")
    left, right, back = (x_r[0] + delta) / 2, (x_r[1] + delta) / 2, 0.5 * v_r[1]
    for index, place in (
        (1, (left, back, 0.6 * v_c[1])),
        (3, (left, v_r[0] / 2, 0.6 * v_c[0])),
        (4, (right, back, 0.6 * v_c[1])),
        (6, (right, v_r[0] / 2, 0.6 * v_c[0])),
    ):
        axes.text(*place, rf"$\Omega_{index}$", ha="center", va="center", fontsize=10, zorder=20)


def _name(axes: Any, place: Iterable[float], name: str, colour: str = "black") -> None:
    axes.text(
        *place,
        mathematical(name),
        color=colour,
        ha="center",
        va="center",
        fontsize=6.5,
        bbox=PATCH,
        zorder=20,
    )
