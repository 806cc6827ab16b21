"""Several branches of periodic orbits in one diagram, their bifurcations labelled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.style import LABELS, PAGE, draw_points, new_figure, styled
from capsule_sym._study.data import orbit_of, strobe

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from capsule_sym._orbits.shooting.orbit import Orbit

Record = Mapping[str, Any]
"""A branch as `capsule-sym branch --json` gives it, those that leave it in `switched`."""

QUANTITIES = ("x_r", "v_r", "v_c", "velocity")
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_ROOM = 0.03, 0.05  # of the axes, within which labels are written as one


def diagram(record: Record, quantity: str = "x_r") -> Figure:
    """A branch and those that leave it: stroboscopic x_r, v_r, v_c, or the average velocity.

    A colour is a branch; stable orbits are solid, unstable ones dashed. Every bifurcation has its
    label. Raises InvalidInput for another quantity.
    """
    if quantity not in QUANTITIES:
        raise InvalidInput("quantity", quantity, f"one of {', '.join(QUANTITIES)}")
    branches = [record, *record["switched"]]
    with styled():
        figure = new_figure(PAGE, 3.6)
        axes = figure.subplots()
        figure.subplots_adjust(left=0.1, right=0.98, bottom=0.14, top=0.97)
        colours = [_COLOURS[k % len(_COLOURS)] for k in range(len(branches))]
        for branch, colour in zip(branches, colours, strict=True):
            name = f"from {branch['origin']}" if branch["origin"] else "branch"
            _curves(axes, branch, quantity, colour, name)
        for style, name in (("-", "stable"), ("--", "unstable")):
            axes.plot([], [], style, color="0.4", label=name)
        for branch, colour in zip(branches, colours, strict=True):
            _labels(axes, branch, quantity, colour)
        axes.set_xlabel(LABELS.get(record["parameter"]) or record["parameter"])
        label = f"stroboscopic ${quantity}$" if quantity != "velocity" else LABELS[quantity]
        axes.set_ylabel(label)
        axes.legend(loc="best")
        return figure


def _values(orbit: Orbit, quantity: str) -> list[float]:
    """The quantity at each excitation period of an orbit."""
    if quantity == "velocity":
        return [float(orbit.average_velocity)]
    return [state[QUANTITIES.index(quantity)] for state in strobe(orbit)]


def _curves(axes: Axes, branch: Record, quantity: str, colour: str, name: str) -> None:
    """One line for each excitation period and each run of orbits of one stability."""
    points = branch["points"]
    values: list[list[float]] = []
    for point in points:
        these = _values(orbit_of(point), quantity)
        values.append(_in_order(these, values[-1]) if values else these)
    turns = [i for i, (a, b) in enumerate(pairwise(points), 1) if a["stable"] != b["stable"]]
    label: str | None = name
    for first, last in pairwise([0, *turns, len(points)]):
        # A run reaches to the first point of the next one.
        run = slice(first, last + 1)
        for place in range(len(values[first])):
            axes.plot(
                [point["value"] for point in points[run]],
                [of[place % len(of)] for of in values[run]],
                "-" if points[first]["stable"] else "--",
                color=colour,
                label=label,
            )
            label = None


def _in_order(values: list[float], before: Sequence[float]) -> list[float]:
    """The values of successive periods, begun at the one where they are nearest to those before."""
    count = len(values)
    turned = [values[k:] + values[:k] for k in range(count)]
    return min(
        turned, key=lambda these: sum(abs(a - b) for a, b in zip(these, before, strict=False))
    )


def _labels(axes: Axes, branch: Record, quantity: str, colour: str) -> None:
    """A point and the label at every bifurcation; labels that would meet become one."""
    found = branch["bifurcations"]
    places = [(one["value"], _values(orbit_of(one), quantity)[0]) for one in found]
    draw_points(axes, [x for x, _ in places], [y for _, y in places], "_nolegend_")
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    room = _ROOM[0] * (right - left), _ROOM[1] * (high - low)
    groups: list[tuple[tuple[float, float], list[str]]] = []
    for (x, y), one in zip(places, found, strict=True):
        near = (names for (a, b), names in groups if abs(a - x) < room[0] and abs(b - y) < room[1])
        names = next(near, None)
        if names is None:
            groups.append(((x, y), [one["label"]]))
        else:
            names.append(one["label"])
    for place, names in groups:
        text = " ".join(names) if len(names) < 3 else f"{names[0]} … {names[-1]}"
        axes.annotate(
            text, place, (4, 4), textcoords="offset points", fontsize=6, color=colour, zorder=6
        )
