"""Fig. 1: the capsule with its mass, springs, damper and gap."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import FancyBboxPatch, Rectangle

from capsule_sym._figures.interface import PAGE, canvas, describe, styled
from paper.figures.space import size_of

_TYPE = 2.5  # points of type in each inch of Fig. 1
_MOST = 10.0  # points of type in Fig. 1 at most
_INK, _SHELL, _MASS, _SOFT = "#16202c", "#eef1f5", "#56B4E9", "#52606f"
_HALF, _HIGH, _ROUND = 2.6, 1.1, 0.55  # half length, height and rounding of the shell
_WIDE = 0.42  # half width of the mass
_WALL = 0.14
_STOP = 0.16  # thickness of the plate on the second spring
_GAP = 0.45  # between the mass at rest and the second spring


@styled
def plot_fig1(*, width: float = PAGE, figure: Figure | SubFigure | None = None) -> Figure:
    """The capsule with its mass, springs, damper and gap, and the symbols of each (Fig. 1).

    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    page = canvas(figure, width, 0.355 * width)
    axes = page.add_axes((0.0, 0.0, 1.0, 1.0))
    _draw_ground(axes, -4.4, 4.4)
    _draw_capsule(axes)
    # In a column the type grows with the drawing, so that it can be read on a narrow screen too.
    size = min(_TYPE * size_of(page)[0], _MOST)
    small: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": size}
    for x, y, text in (
        (0.0, 0.77, "$M_m$"),
        (-1.45, 1.28, "$k_1$"),
        (-1.45, 0.22, "$c$"),
        (1.75, 1.1, "$k_2$"),
        (0.66, 0.17, "$G$"),
        (-2.95, 1.2, "$M_c$"),
    ):
        axes.text(x, y, text, **small)
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": _INK, "linewidth": 1.0}
    for begin, end, y, text, aside in (
        (0.0, 1.0, 1.95, r"$P_d\,\cos\Omega t$", 1.75),
        (0.0, 1.0, 2.45, "$X_m$", 1.3),
        (-3.9, -2.9, 2.45, "$X_c$", -2.6),
        (3.9, 2.9, 0.25, "$F_r$", 4.15),
    ):
        axes.annotate("", (end, y), xytext=(begin, y), arrowprops=arrow)
        axes.text(aside, y, text, **small)
    for x, low in ((0.0, 1.3), (-3.9, 2.3)):
        axes.plot([x, x], [low, 2.6], color=_SOFT, linewidth=0.6)
    axes.annotate(
        "",
        (0.42, 0.44),
        xytext=(0.87, 0.44),
        arrowprops={"arrowstyle": "<->", "color": _INK, "linewidth": 0.7, "shrinkA": 0,
                    "shrinkB": 0},
    )  # fmt: skip
    return describe(page, "Capsule, inner mass, springs, damper and gap")


def _draw_capsule(axes: Axes) -> None:
    """The capsule with its mass at rest in the middle."""
    left, right = -_HALF, _HALF
    shell = FancyBboxPatch(
        (left + _ROUND, _ROUND),
        2 * (_HALF - _ROUND),
        _HIGH - _ROUND,
        boxstyle=f"round,pad={_ROUND}",
        facecolor=_SHELL,
        edgecolor=_INK,
        linewidth=1.2,
    )
    body = Rectangle((-_WIDE, 0.32), 2 * _WIDE, 0.9, facecolor=_MASS, edgecolor=_INK, linewidth=0.8)
    plate = _GAP + _WIDE
    stop = Rectangle((plate, 0.42), _STOP, 0.7, facecolor=_SOFT, edgecolor="none")
    for patch in (shell, body, stop):
        axes.add_patch(patch)
    for begin, end, height, turns in (
        (left + _WALL, -_WIDE, 0.95, 7),
        (plate + _STOP, right - _WALL, 0.77, 5),
    ):
        axes.plot(*_spring(begin, end, height, turns), color=_INK, linewidth=0.9)
    _draw_damper(axes, left + _WALL, -_WIDE, 0.52)


def _spring(begin: float, end: float, height: float, turns: int) -> tuple[Any, Any]:
    share = np.concatenate([[0, 0.12], np.linspace(0.15, 0.85, 2 * turns), [0.88, 1]])
    swing = np.concatenate([[0, 0], np.tile([0.12, -0.12], turns), [0, 0]])
    return begin + (end - begin) * share, height + swing


def _draw_damper(axes: Axes, begin: float, end: float, height: float) -> None:
    cup = begin + 0.42 * (end - begin), begin + 0.68 * (end - begin)
    rod = begin + 0.55 * (end - begin)
    for x, y in (
        ([begin, cup[0]], [height, height]),
        ([cup[1], cup[0], cup[0], cup[1]], [height + 0.1] * 2 + [height - 0.1] * 2),
        ([rod, end], [height, height]),
        ([rod, rod], [height - 0.07, height + 0.07]),
    ):
        axes.plot(x, y, color=_INK, linewidth=0.9)


def _draw_ground(axes: Axes, left: float, right: float) -> None:
    """The ground on which the capsule lies, hatched below, and nothing else on the axes."""
    axes.plot([left, right], [0, 0], color=_INK, linewidth=1.0)
    size = right - left, 0.16
    hatched: Any = {"hatch": "/////", "facecolor": "none", "edgecolor": _SOFT, "linewidth": 0}
    axes.add_patch(Rectangle((left, -0.16), *size, **hatched))
    axes.set(xlim=(left, right), ylim=(-0.36, 2.76), aspect="equal")
    axes.set_axis_off()
