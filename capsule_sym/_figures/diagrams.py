"""Branches of periodic orbits in one diagram, their bifurcations labelled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule_sym._arrays import Vector
from capsule_sym._attractors.neighbourhoods import stroboscopic
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
from capsule_sym._figures.units import DIMENSIONLESS, Units, named
from capsule_sym._orbits.continuation.branch import Branch
from capsule_sym._orbits.continuation.records import branch_record, orbit_from_record
from capsule_sym._orbits.quantities import metric_of
from capsule_sym._parameters import CAPSULE, SceneDevice, scene_in
from capsule_sym._units import METRIC_UNITS

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

    A colour is a branch; stable orbits are solid, unstable ones dashed. Bifurcations have their
    labels, close ones one for all; the key has their types and values.

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
        something. Also for a device of another scene, frequency, mass ratio, friction bound or load
        than theirs, or of other gaps in a scene with two stops; what varies along a branch may
        differ.

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
    # A branch that was stopped at its start has no points.
    records = [{**one, "switched": [b for b in one["switched"] if b["points"]]} for one in records]
    branches = [branch for one in records for branch in (one, *one["switched"])]
    alone = axes is None
    figure, axes = axes_for(axes, width, 3.3)
    fixed, scene = shared(records[0]), scene_in(records[0]) or CAPSULE
    units, *_ = (Units.of_known(device, shared(one)["parameters"], scene) for one in records)
    names = _names(records)
    scale = units.scale(quantity)
    for k, (branch, name) in enumerate(zip(branches, names, strict=True)):
        _draw_branch(axes, branch, quantity, scale, color=SERIES[k % len(SERIES)], label=name)
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
        add_words(figure, [*titles, DIMENSIONLESS])
    labels = [
        (*label, SERIES[k % len(SERIES)])
        for k, branch in enumerate(branches)
        for label in _labels(axes, branch, quantity, scale)
    ]
    name_points(axes, labels)
    return describe(figure, "Branches of periodic orbits", **fixed)


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


def _values_of(record: Record, quantity: str) -> Vector:
    """The quantity at each excitation period of an orbit, or the one of the orbit; (n,)."""
    orbit = orbit_from_record(record.get("orbit", record))
    if quantity in _STATES:
        return np.asarray(stroboscopic(orbit)[:, [*_STATES].index(quantity)])
    if quantity in _MEANS:
        value = getattr(orbit, _MEANS[quantity])
    elif quantity == "lyapunov":
        with np.errstate(divide="ignore"):
            grown = np.log(abs(orbit.multipliers[0]))
        value = grown / (orbit.itinerary.period_number * orbit.parameters.period)
    else:
        value = metric_of(orbit, quantity)
    return np.array([value], dtype=float)


def _draw_branch(axes: Axes, branch: Record, quantity: str, scale: float, **looks: Any) -> None:
    """A line for each excitation period and each run of stretches of one stability.

    Stable ones are solid. Orbits of fewer periods than others of their run repeat their values.
    """
    nodes, stable = in_order(branch)
    at, values = [one["value"] for one in nodes], list[Vector]()
    for these in (scale * _values_of(one, quantity) for one in nodes):
        # Periods begin at the one where they are nearest to those before.
        turned, before = [np.roll(these, k) for k in range(len(these))], (values or [these])[-1]
        count = min(len(these), len(before))
        values.append(min(turned, key=lambda one: abs(one[:count] - before[:count]).sum()))
    stable = stable or [True]
    turns = [i for i, (a, b) in enumerate(pairwise(stable), 1) if a != b]
    for first, last in pairwise([0, *turns, len(stable)]):
        run = slice(first, last + 1)
        for place in range(max(map(len, values[run]))):
            of = [one[place % len(one)] for one in values[run]]
            axes.plot(at[run], of, "-" if stable[first] else "--", **looks)


def _labels(
    axes: Axes, branch: Record, quantity: str, scale: float
) -> Iterator[tuple[tuple[float, float], str]]:
    """A point at every bifurcation, its place and label; labels that would meet become one."""
    found = branch["bifurcations"]
    places = [(one["value"], scale * _values_of(one, quantity)[0]) for one in found]
    draw_points(axes, [x for x, _ in places], [y for _, y in places], _POINT)
    view = np.array([axes.get_xlim(), axes.get_ylim()]).T
    groups: dict[tuple[int, ...], list[tuple[tuple[float, float], str]]] = {}
    for place, one in zip(places, found, strict=True):
        share = (np.array(place) - view[0]) / (view[1] - view[0])
        if (abs(share - 0.5) <= 0.5).all():
            cell = tuple((share / _ROOM).round().astype(int).tolist())
            groups.setdefault(cell, []).append((place, one["label"]))
    for (place, name), *others in groups.values():
        last = f" … {others[-1][1]}" if len(others) > 1 else "".join(f" {one}" for _, one in others)
        yield place, name + last


def shared(record: Record) -> dict[str, Any]:
    """Fixed parameters of a branch: all without the one that varies."""
    orbit = record["points"][0].get("orbit", record["points"][0])
    known = orbit.get("parameters", {})
    varied = {record["parameter"], *record.get("ties", ())}
    values = {k: v for k, v in known.items() if k not in varied}
    return {"parameters": values, "parameter": record["parameter"]}


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


def title_of(one: Record) -> str:
    """Label, type, line, value and unit of a bifurcation, as a text."""
    line = one["line"] or ""
    where = f" {mathematical(line) if line[1:2].isdigit() else line}" if line else ""
    unit = named(one["parameter"]).partition(" (")[2].rstrip(")")
    return f"{one['label']}  {one['type']}{where}, {one['value']:.6f} {unit}".rstrip()
