"""Figs. 8 and 9: trajectories in the state space below, at and above a bifurcation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from capsule_sym.figures.arcs import Arc, Motion, cycle
from capsule_sym.figures.boundaries import LOOKS, Array
from capsule_sym.figures.boundaries import lines as boundary_lines
from capsule_sym.figures.portraits import field_handles
from capsule_sym.figures.space import Box, add_space, box_of, draw_arcs, draw_space
from capsule_sym.figures.style import PAGE, Colours, mathematical, new_figure, styled
from capsule_sym.generated import formulas
from capsule_sym.map.backend import NumpyBackend
from capsule_sym.parameters import Parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Event(NamedTuple):
    """A bifurcation as Figs. 8 and 9 show it: what it is, its line, and the field that meets it.

    `alphas` are the printed amplitudes of the trajectories, in increasing order; `middle` is the
    printed bifurcation value among them. `zoom` is the size of the magnified view in parts of the
    whole.
    """

    name: str
    line: str
    field: int
    alphas: tuple[float, ...]
    middle: float
    zoom: float


CROSSINGS = (
    Event("boundary-intersection crossing", "L7", 4, (0.4, 0.5245, 0.6), 0.5245, 0.22),
    Event("boundary-intersection crossing", "L6", 3, (1.4, 1.443, 1.5), 1.443, 0.22),
)
"""The events of Fig. 8."""

SLIDINGS = (
    Event("adding-sliding", "L2", 2, (0.939, 1.2), 0.939, 0.22),
    Event("crossing-sliding", "L3", 6, (1.5, 1.6148, 1.64), 1.6148, 0.22),
    Event("switching-sliding", "L2", 1, (1.64, 1.661, 1.69), 1.661, 0.06),
    Event("grazing-sliding", "L2", 3, (1.69, 1.7126, 1.9), 1.7126, 0.12),
)
"""The events of Fig. 9."""

_STYLES: dict[int, Any] = {
    -1: (0, (1, 1)),
    0: "-",
    1: (0, (4, 1.5)),
}  # below, at and above the bifurcation


def exact(
    events: Sequence[Event], bifurcations: Sequence[Mapping[str, Any]]
) -> list[tuple[Event, Mapping[str, Any] | None]]:
    """The events around their exact values, each with its bifurcation of a branch.

    The amplitudes keep their distances from the middle. An event that is not on the branch stays
    where it is, with None.
    """
    found = []
    for event in events:
        same = [
            one
            for one in bifurcations
            if one["type"] == event.name and (one["line"] or "").split("^")[0] == event.line
        ]
        nearest = min(same, key=lambda one: abs(one["value"] - event.middle), default=None)
        if nearest:
            middle = nearest["value"]
            alphas = tuple(
                middle if alpha == event.middle else middle + alpha - event.middle
                for alpha in event.alphas
            )
            event = event._replace(alphas=alphas, middle=middle)
        found.append((event, nearest))
    return found


def around(
    events: Sequence[Event],
    motions: Sequence[Sequence[Motion]],
    *,
    colours: Colours = "safe",
) -> Figure:
    """The motions of each event in the state space, and the view of its line magnified.

    Fig. 8 with the events `CROSSINGS`, Fig. 9 with `SLIDINGS`; the motions of an event are those
    at its `alphas`, in their order.
    """
    with styled():
        height = 2.3 * len(events) + 0.45
        figure = new_figure(PAGE, height)
        grid = figure.add_gridspec(
            len(events), 2, left=0.0, right=0.97, bottom=0.2 / height, top=1 - 0.45 / height,
            wspace=0.0, hspace=0.16,
        )  # fmt: skip
        for row, (event, group) in enumerate(zip(events, motions, strict=True)):
            drawn = [cycle(motion) for motion in group]
            parameters = group[0].parameters
            whole = box_of([arc for one in drawn for arc in one])
            middle = drawn[event.alphas.index(event.middle)]
            close = whole.around(nearest(middle, event, parameters), event.zoom)
            for column, box in enumerate((whole, close)):
                axes = add_space(figure, grid[row, column], box)
                draw_space(parameters, axes, box, colours)
                for one, alpha in zip(drawn, event.alphas, strict=True):
                    style = _STYLES[int(np.sign(alpha - event.middle))]
                    draw_arcs(one, axes, colours, style, width=1.3 if style == "-" else 0.9)
                _name_lines(axes, parameters, box)
                letter = "abcdefgh"[2 * row + column]
                title = _title(event, group) if column == 0 else "magnified"
                axes.set_title(f"({letter})  {title}", loc="left", x=0.03, y=0.98)
        handles = [*field_handles(colours), *_style_handles()]
        figure.legend(handles=handles, loc="upper center", ncols=9, columnspacing=1.2)
        return figure


def nearest(drawn: Sequence[Arc], event: Event, parameters: Parameters) -> Array:
    """The drawn state of the event's field that comes nearest to the event's line, shape (3,)."""
    candidates = np.concatenate(
        [np.column_stack(arc.states) for arc in drawn if arc.field == event.field]
    )
    x_r, v_r, v_c = candidates.T
    p = parameters
    free, pressed = (
        formulas.force(NumpyBackend().constants(field, p), x_r, x_r - p.delta, v_r)
        for field in (2, 5)
    )
    misses = {
        "L2": free + p.f_b,
        "L3": pressed - p.f_b,
        "L6": np.where(v_r > 0, x_r - p.delta, np.inf),
        "L7": np.where(v_r < 0, x_r - p.delta, np.inf),
    }
    best: Array = candidates[np.argmin(np.hypot(v_c, misses[event.line]))]
    return best


def _title(event: Event, group: Sequence[Motion]) -> str:
    alphas = ", ".join(f"{motion.parameters.alpha:g}" for motion in group)
    return rf"{event.name} on {mathematical(event.line)}, $\alpha$ = {alphas}"


def _name_lines(axes: Any, parameters: Parameters, box: Box) -> None:
    if not box.v_c[0] <= 0 <= box.v_c[1]:
        return
    for name, line in boundary_lines(parameters, box.x_r, box.v_r).items():
        place = 0.12 * line[0] + 0.88 * line[1]
        axes.text(*place, 0.0, mathematical(name), color=LOOKS[name][1], fontsize=6, zorder=20)


def _style_handles() -> list[Any]:
    from matplotlib.lines import Line2D

    names = {-1: "below", 0: "at", 1: "above"}
    return [
        Line2D([], [], color="0.4", linestyle=style, label=f"{names[side]} the value")
        for side, style in _STYLES.items()
    ]
