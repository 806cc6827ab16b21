"""Branches of periodic orbits in one diagram, their bifurcations labelled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from capsule_sym._design.quantities import metric_of
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.labels import name_points
from capsule_sym._figures.layout import add_key, add_words, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    SERIES,
    describe,
    draw_points,
    mathematical,
    of_records,
    styled,
)
from capsule_sym._figures.units import Units, named, said
from capsule_sym._orbits.continuation.branch import Branch
from capsule_sym._orbits.continuation.records import branch_record, orbit_from_record
from capsule_sym._parameters import CAPSULE, SceneDevice, scene_in
from capsule_sym._units import METRIC_UNITS

if TYPE_CHECKING:
    from capsule_sym._orbits.shooting.orbit import Orbit

Record = Mapping[str, Any]
"""A branch as plain data, as `read_branch` gives it."""

_STATES = {
    "x_r": ("stroboscopic $x_r$", "strobed displacement"),
    "v_r": ("stroboscopic $v_r$", "strobed velocity"),
    "v_c": ("stroboscopic $v_c$", "strobed velocity of the capsule"),
}
_MEANS = {"velocity": "average_velocity", "progression": "progression"}
QUANTITIES = (*_STATES, *METRIC_UNITS, "lift", "lyapunov")
"""Quantities of an orbit that are drawn along branches."""
_POINT = "bifurcation"
_ROOM = 0.03, 0.05  # of the axes, within which labels are written as one


@styled
@of_records
def plot_diagram(
    record: Branch | Record | Sequence[Branch | Record],
    quantity: str = "x_r",
    *,
    width: float = PAGE,
    axes: Axes | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """Branches and those that leave them: stroboscopic states, or a metric of the orbits.

    A colour is a branch; stable orbits are solid, unstable ones dashed. Every bifurcation has its
    label, and the key its type and value.

    Parameters
    ----------
    record : Branch, mapping of str, or sequence of them
        Branches, or records of them as `read_branch` gives, all in the same parameter.
    quantity : str, default "x_r"
        Quantity to draw: x_r, v_r, v_c or a metric. Metrics are velocity, speed, progression, work,
        damper_loss, friction_loss, power, peak_force, peak_contact, speed_per_work,
        cost_of_transport and lyapunov, and lift in a scene with a load. Energies and progression
        are those of an excitation period.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the keys, in place of a new figure: `axes` of one's own.
    device : PhysicalParameters, optional
        Device whose orbits they are; the quantity is then in SI units.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For another quantity, for branches in different parameters, and for records that lack
        something.

    See Also
    --------
    read_branch : record of a file.
    plot : figure of a branch in memory.

    Examples
    --------
    The command `branch` writes the file:

    >>> import subprocess, sys, tempfile
    >>> import capsule_sym as cs
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     command = [sys.executable, "-m", "capsule_sym", "branch", "--alpha", "0.9:1"]
    ...     done = subprocess.run([*command, "--out", folder], capture_output=True)
    ...     record = cs.results.read_branch(f"{folder}/branch.json")
    >>> figure = cs.figures.plot_diagram(record, "progression")
    >>> print(figure.axes[0].get_ylabel())
    progression per period
    >>> print(figure.legends[1].get_texts()[0].get_text()[:19])
    AS1  adding-sliding
    """
    if quantity not in QUANTITIES:
        raise InvalidInput("quantity", quantity, f"one of {', '.join(QUANTITIES)}")
    given = [record] if isinstance(record, Branch | Mapping) else record
    records = [one if isinstance(one, Mapping) else branch_record(one) for one in given]
    parameters = sorted({one["parameter"] for one in records})
    if len(parameters) != 1:
        raise InvalidInput("parameter", parameters, "the same of all branches")
    branches = [branch for one in records for branch in (one, *one["switched"])]
    colours = [SERIES[k % len(SERIES)] for k in range(len(branches))]
    alone = axes is None
    figure, axes = axes_for(axes, width, 3.3)
    units, names = units_of(records[0], device), _names(records)
    values = _Values(quantity, units.scale(quantity))
    for branch, colour, name in zip(branches, colours, names, strict=True):
        _curves(axes, branch, values, colour, name)
    drawn = {point["stable"] for branch in branches for point in branch["points"]}
    for style, name, stable in (("-", "stable", True), ("--", "unstable", False)):
        if stable in drawn:
            axes.plot([], [], style, color="0.4", label=name)
    axes.margins(x=0.04, y=0.1)
    titles = _titles(branches, names, axes.get_xlim())
    if titles:
        draw_points(axes, [], [], _POINT)
    axes.set_xlabel(named(parameters[0]))
    axes.set_ylabel(units.label(quantity, *_STATES.get(quantity, ())))
    if alone:
        add_key(figure, handles_of([axes]))
        add_words(figure, [*titles, *said(*parameters, device=device is not None)])
    labels = [
        (*label, colour)
        for branch, colour in zip(branches, colours, strict=True)
        for label in _labels(axes, branch, values)
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


def _titles(
    branches: Sequence[Record], names: Sequence[str], view: tuple[float, float]
) -> list[str]:
    """Label, type and value of the bifurcations in view, after the name of their branch."""
    return [
        title_of(one) if name == "branch" else f"{name}: {title_of(one)}"
        for branch, name in zip(branches, names, strict=True)
        for one in branch["bifurcations"]
        if view[0] <= one["value"] <= view[1]
    ]


def strobe(orbit: Orbit) -> list[list[float]]:
    """States (x_r, v_r, v_c) of an orbit at the beginning of its excitation periods."""
    times = orbit.parameters.period * np.arange(1, orbit.itinerary.period_number + 1)
    trajectory = orbit.trajectory()
    at = trajectory(np.minimum(times, trajectory.span[1]))  # the trajectory's end is a rounded sum
    return [[float(value) for value in state] for state in at]


class _Values(NamedTuple):
    """A quantity in the units of the figure."""

    quantity: str
    scale: float

    def of(self, record: Record) -> list[float]:
        """The quantity at each excitation period of an orbit."""
        orbit = orbit_from_record(record.get("orbit", record))
        return [self.scale * value for value in self._plain(orbit)]

    def _plain(self, orbit: Orbit) -> list[float]:
        if self.quantity in _STATES:
            return [state[[*_STATES].index(self.quantity)] for state in strobe(orbit)]
        if self.quantity in _MEANS:
            return [float(getattr(orbit, _MEANS[self.quantity]))]
        if self.quantity == "lyapunov":
            with np.errstate(divide="ignore"):
                grown = np.log(abs(orbit.multipliers[0]))
            return [float(grown / (orbit.itinerary.period_number * orbit.parameters.period))]
        return [metric_of(orbit, self.quantity)]


def _curves(axes: Axes, branch: Record, values: _Values, colour: str, name: str) -> None:
    nodes, stable = in_order(branch)
    looks = {stable: {"color": colour} for stable in (True, False)}
    at = [one["value"] for one in nodes]
    draw_runs(axes, at, [*map(values.of, nodes)], stable, looks)[0].set_label(name)


def _labels(
    axes: Axes, branch: Record, values: _Values
) -> Iterator[tuple[tuple[float, float], str]]:
    """A point at every bifurcation, its place and label; labels that would meet become one."""
    found = branch["bifurcations"]
    places = [(one["value"], values.of(one)[0]) for one in found]
    draw_points(axes, [x for x, _ in places], [y for _, y in places], _POINT)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    chosen = zip(places, found, strict=True)
    shown = [(at, one) for at, one in chosen if left <= at[0] <= right and low <= at[1] <= high]
    room = _ROOM[0] * (right - left), _ROOM[1] * (high - low)
    groups: list[tuple[tuple[float, float], list[str]]] = []
    for (x, y), one in shown:
        near = (names for (a, b), names in groups if abs(a - x) < room[0] and abs(b - y) < room[1])
        names = next(near, None)
        if names is None:
            groups.append(((x, y), [one["label"]]))
        else:
            names.append(one["label"])
    for place, names in groups:
        yield place, " ".join(names) if len(names) < 3 else f"{names[0]} … {names[-1]}"


def shared(record: Record) -> dict[str, Any]:
    """Fixed parameters of a branch: all without the one that varies."""
    orbit = record["points"][0].get("orbit", record["points"][0])
    known = orbit.get("parameters", {})
    varied = {record["parameter"], *record.get("ties", ())}
    values = {k: v for k, v in known.items() if k not in varied}
    return {"parameters": values, "parameter": record["parameter"]}


def units_of(record: Record, device: SceneDevice | None) -> Units:
    """Units of a branch; raises InvalidInput where its orbits are those of another device."""
    return Units.of_known(device, shared(record)["parameters"], scene_in(record) or CAPSULE)


def in_order(record: Record) -> tuple[list[Record], list[bool]]:
    """Points and bifurcations along a branch, and the stability of each stretch between them."""
    points, first = record["points"], 0
    beside: list[list[Record]] = [[] for _ in points]  # bifurcations by the point before them
    for one in record["bifurcations"]:
        places = range(first, len(points) - 1)
        first = next((k for k in places if _between(one, *points[k : k + 2])), first)
        beside[first].append(one)
    nodes, stable = list[Record](), list[bool]()
    for k, (point, between) in enumerate(zip(points, beside, strict=True)):
        nodes += [point, *between]
        # Between two bifurcations it is that after the first.
        after = [abs(complex(*one["multipliers_after"][0])) < 1 for one in between[:-1]]
        stable += [point["stable"], *after]
        stable += [points[min(k + 1, len(points) - 1)]["stable"]] * bool(between)
    return nodes, stable[: len(nodes) - 1]


def _between(one: Record, before: Record, after: Record) -> bool:
    """True if a bifurcation lies between two points; the value of a fold is beyond both."""
    low, high = sorted((before["value"], after["value"]))
    return bool(low <= one["value"] <= high or one["interval"][0] == before["value"])


def draw_runs(
    axes: Axes,
    at: Sequence[float],
    values: Sequence[Sequence[float]],
    stable: Sequence[bool],
    looks: Mapping[bool, Mapping[str, Any]],
) -> list[Line2D]:
    """A line for each excitation period and each run of stretches of one stability.

    Stable ones are solid; `looks` are further options, by stability. Orbits of fewer periods than
    others of their run repeat their values.
    """
    ordered: list[Sequence[float]] = []
    for these in values:
        ordered.append(_turned(these, ordered[-1]) if ordered else these)
    stable = stable or [True]
    turns = [i for i, (a, b) in enumerate(pairwise(stable), 1) if a != b]
    drawn = []
    for first, last in pairwise([0, *turns, len(stable)]):
        run = slice(first, last + 1)
        for place in range(max(map(len, ordered[run]))):
            of = [one[place % len(one)] for one in ordered[run]]
            style = "-" if stable[first] else "--"
            drawn += axes.plot(at[run], of, style, **looks[stable[first]])
    return drawn


def _turned(values: Sequence[float], before: Sequence[float]) -> Sequence[float]:
    """The values of successive periods, begun at the one where they are nearest to those before."""
    turned = [[*values[k:], *values[:k]] for k in range(len(values))]
    return min(
        turned, key=lambda these: sum(abs(a - b) for a, b in zip(these, before, strict=False))
    )


def title_of(one: Record) -> str:
    line = one["line"] or ""
    where = f" {mathematical(line) if line[1:2].isdigit() else line}" if line else ""
    return f"{one['label']}  {one['type']}{where}, {one['value']:.6f}"
