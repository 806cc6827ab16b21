"""Fig. 1: the capsule with its mass, springs, damper and gap."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure, SubFigure

from capsule_sym._figures.interface import (
    INK,
    PAGE,
    SOFT,
    Frame,
    canvas,
    describe,
    draw_capsule,
    ground,
    styled,
)
from paper.figures.space import size_of

_TYPE = 2.5  # points of type in each inch of Fig. 1
_MOST = 10.0  # points of type in Fig. 1 at most


@styled
def plot_fig1(*, width: float = PAGE, figure: Figure | SubFigure | None = None) -> Figure:
    """The capsule with its mass, springs, damper and gap, and the symbols of each (Fig. 1).

    Drawn into `figure`, a figure or a part of one, if it is given.
    """
    page = canvas(figure, width, 0.355 * width)
    axes = page.add_axes((0.0, 0.0, 1.0, 1.0))
    ground(axes, -4.4, 4.4)
    axes.set_ylim(-0.36, 2.76)
    draw_capsule(axes, Frame())
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
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.0}
    for begin, end, y, text, aside in (
        (0.0, 1.0, 1.95, r"$P_d\,\cos\Omega t$", 1.75),
        (0.0, 1.0, 2.45, "$X_m$", 1.3),
        (-3.9, -2.9, 2.45, "$X_c$", -2.6),
        (3.9, 2.9, 0.25, "$F_r$", 4.15),
    ):
        axes.annotate("", (end, y), xytext=(begin, y), arrowprops=arrow)
        axes.text(aside, y, text, **small)
    for x, low in ((0.0, 1.3), (-3.9, 2.3)):
        axes.plot([x, x], [low, 2.6], color=SOFT, linewidth=0.6)
    axes.annotate(
        "",
        (0.42, 0.44),
        xytext=(0.87, 0.44),
        arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 0.7, "shrinkA": 0,
                    "shrinkB": 0},
    )  # fmt: skip
    return describe(page, "Capsule, inner mass, springs, damper and gap")
