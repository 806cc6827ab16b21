"""Figs. 8 and 9: trajectories in the state space below, at and above a bifurcation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from capsule_sym import Parameters
from capsule_sym._figures.arcs import Motion, cycle, is_periodic
from capsule_sym._figures.interface import (
    LOOKS,
    PAGE,
    across,
    add_key,
    canvas,
    describe,
    field_handles,
    mathematical,
    styled,
)
from capsule_sym._figures.interface import lines as boundary_lines
from capsule_sym._parameters import of_paper
from paper.figures.labels import PATCH, Names
from paper.figures.space import Box, add_space, box_of, draw_arcs, draw_space, fit_view
from paper.figures.statespace import along, name_upright, projected
from paper.study.events import CROSSINGS, SLIDINGS, Event, nearest

_STYLES: dict[int, Any] = {
    -1: (0, (1, 1)),
    0: "-",
    1: (0, (4, 1.5)),
}  # below, at and above the bifurcation


@styled
def plot_events(
    events: Sequence[Event],
    motions: Sequence[Sequence[Motion]],
    *,
    width: float = PAGE,
    figure: Figure | SubFigure | None = None,
) -> Figure:
    """The motions of each event in the state space, and the view of its line magnified.

    Fig. 8 with the events `CROSSINGS`, Fig. 9 with `SLIDINGS`; the motions of an event are those
    at its `alphas`, in their order. Drawn into `figure`, a figure or a part of one, if it is given.
    """
    columns = across(width, 2.5, 2)
    rows = 2 * len(events) // columns
    page = canvas(figure, width, rows * (0.47 * width / columns + 0.3))
    names = Names(page)
    grid = page.add_gridspec(
        rows, columns, left=0, right=1, bottom=0, top=1, wspace=0.02, hspace=0.04
    )
    for row, (event, group) in enumerate(zip(events, motions, strict=True)):
        drawn = [cycle(motion) for motion in group]
        parameters = of_paper(group[0].parameters)
        whole = box_of([arc for one in drawn for arc in one])
        middle = drawn[event.alphas.index(event.middle)]
        close = whole.around(nearest(middle, event, parameters), event.zoom)
        for column, box in enumerate((whole, close)):
            place = divmod(2 * row + column, columns)
            axes = add_space(page, grid[place], box)
            draw_space(parameters, axes, box)
            for one, alpha in zip(drawn, event.alphas, strict=True):
                style = _STYLES[int(np.sign(alpha - event.middle))]
                draw_arcs(one, axes, style, width=1.3 if style == "-" else 0.9)
            _name_lines(axes, parameters, box, names)
            letter = "abcdefgh"[2 * row + column]
            title = _title(event, group) if column == 0 else "magnified"
            fit_view(axes, axes.set_title(f"({letter})  {title}", loc="left", y=1.0))
    add_key(page, [*field_handles(page), *_style_handles(events)])
    names.settle()
    system = motions[0][0].parameters
    return describe(page, "Motions around bifurcations", parameters=system)


def _title(event: Event, group: Sequence[Motion]) -> str:
    alphas = ", ".join(
        f"{round(motion.parameters.alpha, 5):g}"
        + ("" if is_periodic(motion) else " (not periodic)")
        for motion in group
    )
    return f"{event.name} on {mathematical(event.line)}\n" rf"       $\alpha$ = {alphas}"


def _name_lines(axes: Any, parameters: Parameters, box: Box, names: Names) -> None:
    if not box.v_c[0] <= 0 <= box.v_c[1]:
        return
    for name, line in boundary_lines(parameters, box.x_r, box.v_r).items():
        own = [one for one in axes.lines if one.get_label() == name]
        ends = line[1] + np.outer((0.04, 0.96, 0.0, 1.0), line[0] - line[1])
        places = np.concatenate([ends, along(line)])
        level = np.column_stack([places, np.zeros(len(places))])
        looks = {"color": LOOKS[name][1], "bbox": PATCH}
        names.on(axes, projected(axes, level), mathematical(name), own, **looks)
    name_upright(axes, parameters.delta, box, names)


def _style_handles(events: Sequence[Event]) -> list[Any]:
    drawn = {int(np.sign(alpha - event.middle)) for event in events for alpha in event.alphas}
    names = {-1: "below", 0: "at", 1: "above"}
    # The paper's amplitudes are bifurcations at γ = 3 alone.
    value = "printed value" if set(events) <= {*CROSSINGS, *SLIDINGS} else "value"
    return [
        Line2D([], [], color="0.4", linestyle=style, label=f"{names[side]} the {value}")
        for side, style in _STYLES.items()
        if side in drawn
    ]
