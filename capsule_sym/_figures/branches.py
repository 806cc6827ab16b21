"""A branch of periodic orbits over its parameter, its bifurcations named: states and energies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import offset_copy

from capsule_sym._figures.layout import (
    NARROW,
    add_key,
    add_words,
    axes_for,
    handles_of,
    label_row,
    limit,
)
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    SEAMLESS,
    STABLE,
    UNSTABLE,
    describe,
    draw_points,
    figure_of,
    mathematical,
    of_records,
    styled,
)
from capsule_sym._figures.units import Units
from capsule_sym._parameters import CAPSULE, SceneDevice, scene_in

Record = Mapping[str, Any]
"""A branch as plain data; `data.branch_record` describes it."""

_BESIDE = 0.85  # inches at most beside a diagram, for its texts
_ROOM, _UPRIGHT = 0.26, 0.11  # least distance of labels in inches, flat and upright
_ABOVE = 9.0  # points from a diagram to the labels above it
_BY_STABILITY = {
    True: {"color": STABLE, "label": "stable"},
    False: {"color": UNSTABLE, "label": "unstable"},
}
# A leader ends below its label: above, it would strike others through.
_LEADER: dict[str, Any] = {"arrowstyle": "-", "color": "0.6", "linewidth": 0.5}
_LEADER |= {"relpos": (0.5, 0.0), "shrinkA": 0, "shrinkB": 0}


@styled
@of_records
def plot_bifurcations(
    record: Record,
    *,
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """Stroboscopic x_r and v_r and the average velocity along a branch, stable parts solid.

    Every exact bifurcation point has a marker. Its label is above, one for neighbours that lie too
    close; the legend below explains the labels.

    Parameters
    ----------
    record : mapping of str
        Branch as plain data. `parameter` is the name of the one that varies. `points` and
        `bifurcations` have for each orbit its `value`, its states at the beginning of each
        excitation period as `stroboscopic`, and its `average_velocity`, dimensionless. A point has
        `stable` and `itinerary` besides, a bifurcation its `label`, `type` and `line`, and
        optionally `itinerary_before`, `itinerary_after` and `multipliers_after`. Files of `branch
        --out` have no `stroboscopic`; `plot` draws a branch itself.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : three Axes of Matplotlib, optional
        Panels to draw into, without the labels, in place of a new figure: `axes` of one's own.
    device : PhysicalParameters, optional
        Device whose excitation amplitude, frequency, gap, damping or second spring varies; the
        figure is then in SI units.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For a record that lacks something, and for another number of axes. Also for a device of
        another scene, frequency, mass ratio or friction bound than that of the orbits.

    See Also
    --------
    plot : the same figure of a branch.
    plot_diagram : one quantity of several branches.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.8)), "alpha", 0.9, points=5)
    >>> points = []
    >>> for one in branch.points:
    ...     orbit = one.orbit
    ...     state = orbit.trajectory()(orbit.parameters.period).tolist()  # its period number is 1
    ...     point = {"value": one.value, "stable": orbit.stable, "stroboscopic": [state]}
    ...     points.append(point | {"average_velocity": float(orbit.average_velocity)})
    >>> record = {"parameter": "alpha", "points": points, "bifurcations": []}
    >>> figure = cs.figures.plot_bifurcations(record)
    >>> print([axes.get_ylabel() for axes in figure.axes[:2]])
    ['stroboscopic $x_r$', 'stroboscopic $v_r$']
    """
    units = units_of(record, device)
    record = in_units(record, units)
    figure, rows = axes_for(axes, width, 4.2, nrows=3, sharex=True)
    found, (nodes, stable) = record["bifurcations"], in_order(record)
    labels = (
        units.label("x_r", "stroboscopic $x_r$", "strobed displacement"),
        units.label("v_r", "stroboscopic $v_r$", "strobed velocity"),
        units.label("velocity"),
    )
    at = [one["value"] for one in nodes]
    for row, name, label in zip(rows, ("x_r", "v_r", "velocity"), labels, strict=True):
        scale = units.scale(name)
        draw_runs(row, at, [_values(one, name, scale) for one in nodes], stable, _BY_STABILITY)
        marked = [_values(one, name, scale)[0] for one in found]
        draw_points(row, [one["value"] for one in found], marked, "exact bifurcation point")
        label_row(row, label)
    key = handles_of(rows[:1]) if axes is None else None
    _finish(record, units, rows, key)
    return describe(figure, "Bifurcation diagram", **shared(record))


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


def axis_label(record: Record, units: Units) -> str:
    """Parameter that varies along a branch, and the reason if the branch ends early."""
    label, status = units.label(record["parameter"]), record.get("status", "reached")
    return label if status == "reached" else f"{label}; the branch ends early: {status}"


def span(record: Record) -> tuple[float, float]:
    """The values between which a branch is drawn, around that of a single orbit."""
    values = [point["value"] for point in record["points"]]
    low, high = min(values), max(values)
    room = 0.0 if low < high else 0.01 * abs(low) or 0.01  # a branch may be one orbit
    return low - room, high + room


def _values(point: Record, name: str, scale: float) -> list[float]:
    """A stroboscopic coordinate at each excitation period of an orbit, or its average velocity."""
    if name == "velocity":
        return [scale * point["average_velocity"]]
    return [scale * float(state[("x_r", "v_r").index(name)]) for state in point["stroboscopic"]]


def in_order(record: Record) -> tuple[list[Record], list[bool]]:
    """Points and bifurcations along a branch, and the stability of each stretch between them."""
    points, after = record["points"], 0
    beside: dict[int, list[Record]] = {}  # bifurcations by the number of points before them
    steps = np.diff([points[0]["value"], *(one["value"] for one in points), points[-1]["value"]])
    turns = steps[:-2] * steps[2:] < 0  # around each stretch, as at a fold alone
    for one in record["bifurcations"]:
        stretches = zip(turns[after:], pairwise(points[after:]), strict=True)
        fits = [_fits(one, *ends, turned) for turned, ends in stretches]
        after += fits.index(max(fits)) if fits else 0
        ends = [abs(point["value"] - one["value"]) for point in points[after : after + 2]]
        beyond = after + 2 == len(points) and fits[-1][1] < 0
        last = beyond and ends[1] < ends[0]
        beside.setdefault(after + last, []).append(one)
    nodes, stable = [], []
    for k, point in enumerate(points):
        between = beside.get(k, [])
        nodes += [point, *between]
        following = points[min(k + 1, len(points) - 1)]["stable"]
        stable.append(point["stable"])
        # Stability is that of the orbits beside: between two bifurcations that after the first.
        stable += [_stable_after(one, following) for one in between[:-1]]
        stable += [following] * bool(between)
    return nodes, stable[: len(nodes) - 1]


def _fits(one: Record, before: Record, after: Record, turned: bool) -> tuple[bool, float, int]:
    """Rank of a place between two points for a bifurcation: by its value, then by their orbits.

    The value of a fold is beyond both, and the branch may pass it later on.
    """
    low, high = sorted((before["value"], after["value"]))
    changed = before["stable"] != after["stable"]
    alike = (
        one.get("itinerary_before") == before["itinerary"],
        one.get("itinerary_after") == after["itinerary"],
        changed and one["type"] in ("fold", "period doubling"),
    )
    away = max(low - one["value"], one["value"] - high, 0.0)
    return bool(turned) and one["type"] == "fold", -away, sum(alike)


def _stable_after(one: Record, otherwise: bool) -> bool:
    largest = one.get("multipliers_after")
    return abs(complex(*largest[0])) < 1 if largest else otherwise


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


def _finish(record: Record, units: Units, rows: Sequence[Axes], key: list[Any] | None) -> None:
    """Label the common axis, mark bifurcations on all rows, and name them if there is a key."""
    rows[-1].set_xlabel(axis_label(record, units))
    limit(rows[-1], span(record))
    for row in rows:
        for one in record["bifurcations"]:
            row.axvline(one["value"], color="0.6", linewidth=0.5, zorder=0)
    if key is not None:
        add_key(figure_of(rows[0]), key)
        name_bifurcations(record, rows[0], units)


def in_units(record: Record, units: Units) -> Record:
    """A branch with the values of its parameter in the units of a figure."""
    scale = units.scale(record["parameter"])
    nodes = {name: record[name] for name in ("points", "bifurcations")}
    return {**record} | {
        name: [{**one, "value": one["value"] * scale} for one in each]
        for name, each in nodes.items()
    }


def name_bifurcations(record: Record, axes: Axes, units: Units) -> None:
    """The label of every bifurcation above the axes, led to its value; below, what it stands for.

    Where there are too many, neighbours have one label.
    """
    low, high = axes.get_xlim()
    found = sorted(record["bifurcations"], key=lambda one: one["value"])
    found = [one for one in found if low <= one["value"] <= high]
    page = figure_of(axes)
    unit = units.unit(record["parameter"])
    add_words(page, [f"{title_of(one)} {unit}".rstrip() for one in found])
    wide = page.get_figwidth() - _BESIDE
    if page.get_figwidth() < NARROW:  # numbers of many digits have no room
        axes.locator_params(axis="x", nbins=5)
    flat = len(found) * _ROOM <= wide
    room = (_ROOM if flat else _UPRIGHT) / wide
    each = max(1, -(-len(found) // max(1, int(1 / room))))
    groups = [found[k : k + each] for k in range(0, len(found), each)]
    at = [(group[0]["value"] - low) / (high - low) for group in groups]
    above = offset_copy(axes.transAxes, page, y=_ABOVE, units="points")
    for group, true, place in zip(groups, at, spread(at, room), strict=True):
        axes.annotate(
            "…".join(dict.fromkeys((group[0]["label"], group[-1]["label"]))),
            (true, 1.0),
            xytext=(place, 1.0),
            xycoords="axes fraction",
            textcoords=above,
            rotation=0 if flat else 90,
            ha="center",
            va="bottom",
            fontsize="small",
            arrowprops=_LEADER,
        )


def title_of(one: Record) -> str:
    line = one["line"] or ""
    where = f" {mathematical(line) if line[1:2].isdigit() else line}" if line else ""
    return f"{one['label']}  {one['type']}{where}, {one['value']:.6f}"


def spread(places: Sequence[float], room: float, last: float = 1.0) -> list[float]:
    """Ascending places in [0, last] moved as little as needed to lie at least `room` apart."""
    if not places:
        return []
    # Less their least distances from the first, places need only ascend: neighbours that do not are
    # put together at their mean.
    steps = room * np.arange(len(places))
    pools: list[tuple[float, int]] = []
    for place in np.array(places) - steps:
        pool = float(place), 1
        while pools and pools[-1][0] > pool[0]:
            mean, many = pools.pop()
            pool = (mean * many + pool[0] * pool[1]) / (many + pool[1]), many + pool[1]
        pools.append(pool)
    ascending = np.concatenate([np.full(many, mean) for mean, many in pools])
    return [float(place) for place in np.clip(ascending, 0.0, last - steps[-1]) + steps]


# Apart in grey too.
DAMPER, FRICTION, LIFT, WORK = "#0072B2", "#E69F00", "#d9d9d9", "black"


@styled
@of_records
def plot_energies(
    record: Record,
    *,
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """Energy per excitation period along a branch: work of the drive, and losses.

    The losses in damper and friction are stacked areas, the drive's work is a line. On level ground
    the line is at the top of the areas, up to rounding. On a slope the work of lifting the bodies
    is an area too: on top of the losses where they rise, and below zero where they sink, as gravity
    then adds to the drive's work. The lower panel has the share of the work that friction takes.

    Parameters
    ----------
    record : mapping of str
        Branch as plain data, as in `plot_bifurcations`. Points and bifurcations with `energy` are
        drawn: `work`, `damper_loss`, `friction_loss` and on a slope `lift`, per excitation period
        and dimensionless. Files of `branch --out` have none.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : two Axes of Matplotlib, optional
        Panels to draw into, without labels of bifurcations, in place of a new figure: `axes` of
        one's own.
    device : PhysicalParameters, optional
        Device whose excitation amplitude, frequency, gap, damping or second spring varies; the
        figure is then in SI units.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For a record that lacks something, and for another number of axes. Also for a device of
        another scene, frequency, mass ratio or friction bound than that of the orbits.

    See Also
    --------
    performance : energies of one orbit.
    plot_bifurcations : states along the branch.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.8)), "alpha", 0.9, points=5)
    >>> points = []
    >>> for one in branch.points:
    ...     found = cs.performance(one.orbit)
    ...     names = ("work", "damper_loss", "friction_loss")
    ...     energy = {name: float(getattr(found, name).value) for name in names}
    ...     points.append({"value": one.value, "stable": one.orbit.stable, "energy": energy})
    >>> record = {"parameter": "alpha", "points": points, "bifurcations": []}
    >>> figure = cs.figures.plot_energies(record)
    >>> print([axes.get_ylabel() for axes in figure.axes])
    ['energy per period', 'share of friction']
    """
    units = units_of(record, device)
    record = in_units(record, units)
    points = [one for one in in_order(record)[0] if one.get("energy")]
    values = np.array([point["value"] for point in points])
    work, damper, friction, lift = (
        np.array([point["energy"].get(name, 0.0) for point in points]) * units.scale("work")
        for name in ("work", "damper_loss", "friction_loss", "lift")
    )
    rows = {"height_ratios": (1.6, 1)}
    figure, (upper, lower) = axes_for(axes, width, 3.4, nrows=2, sharex=True, gridspec_kw=rows)
    losses, rise = damper + friction, np.maximum(lift, 0.0)
    for low, high, colour, label in (
        (0.0 * damper, damper, DAMPER, "lost in the damper"),
        (damper, losses, FRICTION, "lost to friction"),
        (losses, losses + rise, LIFT, "lift of the bodies"),
        (np.minimum(lift, 0.0), 0.0 * lift, LIFT, "lift of the bodies"),
    ):
        if np.any(high > low):
            upper.fill_between(values, low, high, color=colour, label=label, **SEAMLESS)
    upper.plot(values, work, color=WORK, linewidth=0.8, label="work of the drive")
    upper.set_ylabel(units.label("work", "energy per period"))
    key = handles_of([upper]) if axes is None else None
    if key is None:
        upper.legend(loc="upper left")
    with np.errstate(invalid="ignore"):
        lower.plot(values, friction / work, color=FRICTION)
    lower.set_ylabel("share of friction")
    _finish(record, units, (upper, lower), key)
    return describe(figure, "Where the work of a period goes", **shared(record))
