"""Branches of periodic orbits in one diagram, their bifurcations labelled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.branches import Record, draw_runs, shared
from capsule_sym._figures.labels import name_points
from capsule_sym._figures.layout import add_key, add_words, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.store import orbit_of, strobe
from capsule_sym._figures.style import LABELS, SERIES, describe, draw_points, styled
from capsule_sym._figures.units import named, said

if TYPE_CHECKING:
    from capsule_sym._orbits.shooting.orbit import Orbit

_STATES = ("x_r", "v_r", "v_c")
_MEANS = {"velocity": "average_velocity", "progression": "progression"}
QUANTITIES = (*_STATES, *_MEANS)
_POINT = "bifurcation"
_ROOM = 0.03, 0.05  # of the axes, within which labels are written as one


@styled
def plot_diagram(
    record: Record | Sequence[Record],
    quantity: str = "x_r",
    *,
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """Branches and those that leave them: stroboscopic states, average velocity or progression.

    The quantity is x_r, v_r, v_c, velocity or progression, that of an excitation period. A colour
    is a branch; stable orbits are solid, unstable ones dashed. Every bifurcation has its label.
    Drawn into `axes`, without the keys, if they are given. Raises InvalidInput for another
    quantity, and for branches in different parameters.
    """
    if quantity not in QUANTITIES:
        raise InvalidInput("quantity", quantity, f"one of {', '.join(QUANTITIES)}")
    records = [record] if isinstance(record, Mapping) else list(record)
    parameters = sorted({one["parameter"] for one in records})
    if len(parameters) != 1:
        raise InvalidInput("parameter", parameters, "the same of all branches")
    branches = [branch for one in records for branch in (one, *one["switched"])]
    colours = [SERIES[k % len(SERIES)] for k in range(len(branches))]
    alone = axes is None
    figure, axes = axes_for(axes, width, 3.3)
    for branch, colour, name in zip(branches, colours, _names(records), strict=True):
        _curves(axes, branch, quantity, colour, name)
    drawn = {point["stable"] for branch in branches for point in branch["points"]}
    for style, name, stable in (("-", "stable", True), ("--", "unstable", False)):
        if stable in drawn:
            axes.plot([], [], style, color="0.4", label=name)
    if any(branch["bifurcations"] for branch in branches):
        draw_points(axes, [], [], _POINT)
    axes.margins(x=0.04, y=0.1)
    axes.set_xlabel(named(parameters[0]))
    label = f"stroboscopic ${quantity}$" if quantity in _STATES else LABELS[quantity]
    axes.set_ylabel(label)
    if alone:
        add_key(figure, handles_of([axes]))
        add_words(figure, [*_kinds(branches), said(*parameters)])
    labels = [
        (*label, colour)
        for branch, colour in zip(branches, colours, strict=True)
        for label in _labels(axes, branch, quantity)
    ]
    name_points(axes, labels)
    return describe(figure, "Branches of periodic orbits", **shared(records[0]))


def _names(records: Sequence[Record]) -> list[str]:
    """A name for each branch: its number if there are several, and the point that it leaves."""
    found = []
    for number, record in enumerate(records, start=1):
        name = f"branch {number}" if len(records) > 1 else "branch"
        found.append(f"{name}, from {record['origin']}" if record["origin"] else name)
        before = f"{name}, " if number > 1 else ""
        found += [f"{before}from {branch['origin']}" for branch in record["switched"]]
    return found


def _kinds(branches: Sequence[Record]) -> list[str]:
    """Key of the letters of the labels."""
    found = [one for branch in branches for one in branch["bifurcations"]]
    kinds = {one["label"].rstrip("0123456789"): one["type"] for one in found}
    return [f"{letters}  {kind}" for letters, kind in sorted(kinds.items())]


def _values(orbit: Orbit, quantity: str) -> list[float]:
    """The quantity at each excitation period of an orbit."""
    if quantity in _MEANS:
        return [float(getattr(orbit, _MEANS[quantity]))]
    return [state[_STATES.index(quantity)] for state in strobe(orbit)]


def _curves(axes: Axes, branch: Record, quantity: str, colour: str, name: str) -> None:
    values: list[list[float]] = []
    for point in branch["points"]:
        these = _values(orbit_of(point), quantity)
        values.append(_in_order(these, values[-1]) if values else these)
    looks = {stable: {"color": colour} for stable in (True, False)}
    draw_runs(axes, branch["points"], values, looks)[0].set_label(name)


def _in_order(values: list[float], before: Sequence[float]) -> list[float]:
    """The values of successive periods, begun at the one where they are nearest to those before."""
    count = len(values)
    turned = [values[k:] + values[:k] for k in range(count)]
    return min(
        turned, key=lambda these: sum(abs(a - b) for a, b in zip(these, before, strict=False))
    )


def _labels(axes: Axes, branch: Record, quantity: str) -> Iterator[tuple[tuple[float, float], str]]:
    """A point at every bifurcation, its place and label; labels that would meet become one."""
    found = branch["bifurcations"]
    places = [(one["value"], _values(orbit_of(one), quantity)[0]) for one in found]
    draw_points(axes, [x for x, _ in places], [y for _, y in places], _POINT)
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
        yield place, " ".join(names) if len(names) < 3 else f"{names[0]} … {names[-1]}"
