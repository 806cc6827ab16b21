"""Results of sweeps: basins of attraction, and the Pareto front of speed and cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from capsule_sym._design.quantities import with_derived
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.charts import draw_curve
from capsule_sym._figures.layout import add_key, axes_for, handles_of, limit
from capsule_sym._figures.regions import Plane, unsettled
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    LABELS,
    NO_RESULT,
    NOT_SETTLED,
    STABLE,
    area_colours,
    blank,
    bulk,
    describe,
    labels_of,
    readable,
    share,
    styled,
)
from capsule_sym._figures.units import named, prefixed
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._parameters import CAPSULE, scene_in
from capsule_sym._sweeps import itineraries
from capsule_sym._units import METRIC_UNITS, UNITS, scale_of

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

_STATE = "x_r", "v_r", "v_c"
_DIGITS = 4  # of final states: those of an attractor differ by less
_ROOM = 0.04  # of a basin: distance from its border to a number
_FAR = 10  # times the front's largest cost, up to which cells are drawn


@styled
def plot_basin(results: xr.Dataset, *, width: float = PAGE, axes: Axes | None = None) -> Figure:
    """Attractor of each start, over the two coordinates of a basin's cells.

    A colour is an attractor; its number is that of the results and of `sweep --info`. The key gives
    its itinerary and share. Grey are starts that have not settled within the sweep's periods, white
    those without a result.

    Stars, in the colour of their attractor, are its own stroboscopic states, where both coordinates
    are among the state's. They may lie in another area, as starts have one value of the third.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a basin over two coordinates, as `open_results` gives, dimensionless or with SI
        units.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the key, in place of a new figure: `axes` of one's own.

    Returns
    -------
    matplotlib.figure.Figure
        The figure. Its axes are in SI units if the basin is a device's, else dimensionless.

    Raises
    ------
    InvalidInput
        For results of another kind.

    See Also
    --------
    run_basin : computes a basin.
    plot_attractors : fractions of the starts along a parameter.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> axes = Axis.linear("x_r", -2.0, 2.0, 6), Axis.linear("v_r", -2.0, 2.0, 4)
    >>> system = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> sweep = Sweep(axes, system, periods=300)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary, basin = cs.run_basin(sweep, f"{folder}/basin")
    ...     figure = cs.figures.plot_basin(cs.results.open_results(f"{folder}/basin"))
    >>> print(figure.axes[0].get_xlabel())
    relative displacement $x_r$
    >>> print([text.get_text()[-8:] for text in figure.legends[0].get_texts()][:2])
    ['(66.7 %)', '(33.3 %)']
    """
    if "attractor" not in results or len(results["attractor"].dims) != 2:
        raise InvalidInput("results", sorted(map(str, results)), "a basin over two coordinates")
    codes = results["attractor"]
    first, second = map(str, codes.dims)
    known = [int(code) for code in np.unique(codes.values[codes.values >= 0])]
    named_so = [(code, _itinerary(results, code)) for code in known]
    late, said = unsettled(results)
    late = late & (codes.values < 0)
    (x, x_label, _), (y, y_label, _) = (_axis(results, name) for name in (first, second))
    alone = axes is None
    figure, axes = axes_for(axes, width, 0.62 * width)
    colours = area_colours(figure, [text or f"attractor {code}" for code, text in named_so])
    place = np.where(late, len(known), np.searchsorted(known, codes.values))
    axes.pcolormesh(
        x,
        y,
        np.ma.masked_where((codes.values < 0) & ~late, place).T,
        cmap=ListedColormap([*colours, NOT_SETTLED]),
        norm=BoundaryNorm(np.arange(len(colours) + 2) - 0.5, len(colours) + 1),
        shading="nearest",
        rasterized=True,
    )
    for code, colour in zip(known, colours, strict=True):
        (i, j), depth = _deepest(codes.values == code)
        if depth >= _ROOM * min(codes.shape):
            middle: dict[str, Any] = {"ha": "center", "va": "center", "color": readable(colour)}
            axes.text(x[i], y[j], str(code), **middle)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    _draw_attractors(axes, results, dict(zip(known, colours, strict=True)))
    limit(axes)
    if alone:
        handles = [
            Patch(facecolor=colour, label=f"{code}  {text} {share(np.mean(codes.values == code))}")
            for (code, text), colour in zip(named_so, colours, strict=True)
        ]
        if np.any(late):
            handles.append(Patch(facecolor=NOT_SETTLED, label=said))
        if np.any(~late & (codes.values < 0)):
            handles.append(blank(NO_RESULT))
        handles += handles_of([axes])
        add_key(figure, handles)
    return describe(figure, "Basins of attraction", axes=[first, second])


def _deepest(area: NDArray[np.bool_]) -> tuple[tuple[int, int], int]:
    """The cell of an area that lies farthest inside, and how many cells deep."""
    depth = distance_transform_cdt(np.pad(area, 1), "taxicab")[1:-1, 1:-1]
    cells = np.argwhere(depth == depth.max())
    i, j = cells[len(cells) // 2]
    return (int(i), int(j)), int(depth.max())


def _draw_attractors(axes: Axes, results: xr.Dataset, colours: Mapping[int, str]) -> None:
    """Stars at the states in which the starts of each attractor end."""
    names = list(map(str, results["attractor"].dims))
    if "final" not in results or not {*names} <= {*_STATE}:
        return
    ends, codes = results["final"].values, results["attractor"].values
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())  # an attractor may lie outside
    for code, colour in colours.items():
        states = ends[codes == code][:, [_STATE.index(name) for name in names]]
        states = np.unique(states.round(_DIGITS), axis=0)
        x, y = (states * [_axis(results, name)[2] for name in names]).T
        looks: dict[str, Any] = {"markeredgecolor": readable(colour), "markeredgewidth": 0.6}
        looks |= {"color": colour, "markersize": 7, "label": "attractor, once a period"}
        axes.plot(x, y, "*", **looks)


def _axis(results: xr.Dataset, name: str) -> tuple[Array, str, float]:
    """Values, label and scale of an axis, of a start in SI units where the sweep is a device's."""
    values, attributes = results[name].values, results[name].attrs
    if "si_units" not in attributes:
        return values, named(name), 1.0
    factor, unit = prefixed(attributes["si_scale"], attributes["si_units"])
    return values * factor, f"{LABELS.get(name, name).partition(' $')[0]} ({unit})", factor


def _itinerary(results: xr.Dataset, code: int) -> str:
    """Itinerary of an attractor."""
    known = [one["itinerary"] for one in results["attractor"].attrs.get("attractors", ())]
    if code < len(known):
        return str(known[code])
    cells = results["attractor"].values == code
    code = int(results["itinerary"].values[cells].flat[0])
    return itineraries.texts(results).get(code, "")


METRICS = (*METRIC_UNITS, "lift", "lyapunov")
"""Metrics of a motion that are drawn over parameters."""
_EXTENDED = "neither", "min", "max", "both"


@styled
def plot_metric(
    results: xr.Dataset,
    metric: str = "velocity",
    curves: Sequence[Mapping[str, Any]] = (),
    *,
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """A metric of a sweep's cells, such as the average velocity, over its one or two axes.

    Over two axes a colour bar has the scale, in two hues around 0 where the metric has both signs;
    its arrow stands for outliers. Grey are cells without a result, such as the cost of a capsule
    that does not advance. Over one axis each cell is a dot.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a sweep over one or two axes, as `open_results` gives, dimensionless. Those of a
        device are drawn in SI units.
    metric : str, default "velocity"
        Metric to draw, as far as the sweep computes what it needs: velocity, speed, progression,
        work, damper_loss, friction_loss, power, peak_force, peak_contact, speed_per_work,
        cost_of_transport and lyapunov, and in a scene with a load lift.
    curves : sequence of mapping, default ()
        Curves of bifurcations that lie on top of two axes, as `capsule-sym curve --json` prints
        them.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the key, in place of a new figure: `axes` of one's own.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For results of another kind, and for a metric that the sweep does not compute.

    See Also
    --------
    plot_chart : itineraries over two parameters.
    plot_pareto : speed against cost of transport.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> sweep = Sweep((Axis.linear("alpha", 0.5, 1.0, 6),), compute=("progression",))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary = cs.run_sweep(sweep, f"{folder}/line")
    ...     cells = cs.results.open_results(f"{folder}/line")
    ...     figure = cs.figures.plot_metric(cells, "progression")
    >>> print(figure.axes[0].get_ylabel(), figure.axes[0].lines[0].get_ydata().round(3))
    progression per period [0.094 0.239 0.412 0.601 0.801 1.003]
    """
    values = metric_of(results, metric)
    if not 1 <= values.ndim <= 2 or any(name not in results.coords for name in values.dims):
        raise InvalidInput("results", dict(values.sizes), "a sweep over one or two axes")
    factor, unit = 1.0, values.attrs.get("si_units", "")
    if unit:
        factor, unit = prefixed(values.attrs["si_scale"], unit)
    name = labels_of(scene_in(results.attrs) or CAPSULE).get(metric, metric.replace("_", " "))
    label = f"{name.partition(' $')[0]} ({unit})" if unit else name
    sides = [_axis(results, str(name)) for name in values.dims]
    alone = axes is None
    figure, axes = axes_for(axes, width, (0.62 if values.ndim == 2 else 0.5) * width)
    shown = np.ma.masked_invalid(values.values * factor)
    missing = shown.mask & np.ones(shown.shape, dtype=bool)
    axes.set_xlabel(sides[0][1])
    if values.ndim == 1:
        axes.plot(sides[0][0], shown, ".", color=STABLE)
        axes.set_ylabel(label)
    else:
        low, high = bulk(shown.compressed(), 0.25) if shown.count() else (0.0, 1.0)
        beyond = int(np.any(shown < low)) + 2 * int(np.any(shown > high))
        looks: dict[str, Any] = {"shading": "nearest", "rasterized": True}
        if low < 0 < high:
            low, high = -max(-low, high), max(-low, high)
            looks["cmap"] = "PuOr_r"
        mesh = axes.pcolormesh(*(side for side, *_ in sides), shown.T, vmin=low, vmax=high, **looks)
        axes.set_facecolor(NOT_SETTLED)  # the middle of two hues is white
        figure.colorbar(mesh, ax=axes, label=label, extend=_EXTENDED[beyond])
        axes.set_ylabel(sides[1][1])
        x, y = ((float(side[0]), float(side[-1])) for side, *_ in sides)
        plane = Plane(str(values.dims[0]), str(values.dims[1]), x, y)
        for curve in curves:
            draw_curve(axes, curve, plane)
    limit(axes)
    if alone and values.ndim == 2:
        (late, said), infinite = unsettled(results), np.isinf(values.values)
        reasons = {said: late & missing, "infinite": infinite, NO_RESULT: ~(late | infinite)}
        told = " or ".join(one for one, cells in reasons.items() if np.any(cells & missing))
        grey = [Patch(facecolor=NOT_SETTLED, label=told)] * bool(told)
        add_key(figure, handles_of([axes]) + grey)
    return describe(figure, f"{label} over parameters", metric=metric)


def metric_of(results: xr.Dataset, name: str) -> xr.DataArray:
    """A metric of each cell; raises InvalidInput for one that the sweep does not compute.

    Attributes of a device's have the SI unit, as results have it.
    """
    facts, units = (scene_in(results.attrs) or CAPSULE).facts, results.attrs.get("si_scales")
    known: dict[Any, Any] = {one: results[one] for one in METRICS if one in results}
    own = {
        one: results[one] if one in results.coords else results.attrs.get(one, np.nan)
        for one in ("omega", *facts.BOUNDS.values())
    }
    turn = own["omega"] / (2 * np.pi)
    if "progression" in known:
        known.setdefault("velocity", known["progression"] * turn)
    if "velocity" in known:
        velocity = known["velocity"]
        known.setdefault("progression", velocity / turn)
        known["speed"] = abs(velocity)
    if {"velocity", "work"} <= known.keys():
        if facts.LIFTS:
            known["lift"] = known["work"] - known["damper_loss"] - known["friction_loss"]
        # Each of n cells as a motion of its own, without derivatives.
        bounds = {one: Slope((0 * velocity + own[one]).values, 0.0) for one in own}
        given = ("velocity", "progression", "work")
        metrics = {one: Slope((0 * velocity + known[one]).values, 0.0) for one in given}
        for one, derived in with_derived(metrics, bounds, facts.BOUNDS).items():
            known.setdefault(one, velocity.copy(data=derived.value).where(velocity.notnull()))
    if name not in known:
        allowed = ", ".join(one for one in METRICS if one in known) or "progression or energies"
        raise InvalidInput("metric", name, f"what the sweep computes: {allowed}")
    attributes = results[name].attrs if name in results else {}
    if units is not None:
        attributes = {"si_units": UNITS[name].name, "si_scale": scale_of(units, name)}
    found: xr.DataArray = known[name].copy()
    found.attrs = attributes
    return found


@styled
def plot_pareto(results: xr.Dataset, *, width: float = PAGE, axes: Axes | None = None) -> Figure:
    """Speed against cost of transport of a sweep's cells, with their Pareto front.

    The speed is the absolute average velocity. The cost of transport is the work of the drive
    divided by the friction bound and the distance. A cell is on the front if no other cell is at
    least as fast at no greater cost. Cells of over ten times the front's largest cost are counted,
    and not shown.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a sweep with energies, as `open_results` gives, dimensionless. For a device the
        speed is drawn in SI units.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the key, in place of a new figure: `axes` of one's own.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For a sweep without energies, and for one in which no cell advances.

    See Also
    --------
    pareto : front of optima, without a grid.
    plot_metric : a metric over the parameters.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> sweep = Sweep((Axis.linear("alpha", 0.5, 3.0, 6),), compute=("energies",))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary = cs.run_sweep(sweep, f"{folder}/line")
    ...     figure = cs.figures.plot_pareto(cs.results.open_results(f"{folder}/line"))
    >>> for line in figure.axes[0].lines:
    ...     print(line.get_label(), len(line.get_xdata()))
    cells 6
    Pareto front 3
    """
    speed, cost = speed_and_cost(results)
    front = non_dominated(speed, cost)
    of_device = results["velocity"].attrs
    speed, unit = speed * of_device.get("si_scale", 1.0), of_device.get("si_units", "")
    alone = axes is None
    figure, axes = axes_for(axes, width, max(2.4, 0.5 * width))
    near = cost <= _FAR * cost[front].max()
    label = f"cells, {np.sum(~near):,} of {len(cost):,} beyond" if np.any(~near) else "cells"
    axes.plot(
        cost[near], speed[near], ".", color="0.6", markersize=2.5, label=label, rasterized=True
    )
    axes.plot(
        cost[front], speed[front], "o-", color=STABLE, drawstyle="steps-post",
        label="Pareto front",
    )  # fmt: skip
    axes.set_xscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())  # within two decades its labels would collide
    if cost[near].max() < 100 * cost.min():
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
    bounds = (scene_in(results.attrs) or CAPSULE).facts.BOUNDS
    bound = "f_b" if len({*bounds.values()}) == 1 else r"f_\pm"
    axes.set_xlabel(rf"cost of transport $W/({bound}\,|\Delta x_c|)$")
    axes.set_ylabel(f"speed ({unit})" if unit else r"speed $|\langle v_c\rangle|$")
    if alone:
        add_key(figure, handles_of([axes]))
    return describe(figure, "Pareto front of speed and cost of transport")


def speed_and_cost(results: xr.Dataset) -> tuple[Array, Array]:
    """Average speed and cost of transport of the cells that move, each of shape (n,).

    Raises InvalidInput for a sweep without energies, or in which no cell moves.
    """
    if not {"velocity", "work"} <= set(results):
        raise InvalidInput("results", sorted(map(str, results)), "a sweep that computes energies")
    cost = metric_of(results, "cost_of_transport").values.ravel()
    speed = abs(results["velocity"]).values.ravel()
    moves = np.isfinite(cost) & (speed > 1e-12)
    if not moves.any():
        raise InvalidInput("results", "no cell in which the capsule advances", "some that do")
    return speed[moves], cost[moves]


def non_dominated(speed: Array, cost: Array) -> NDArray[np.int64]:
    """Indices of the cells that none beats, by increasing cost: none as fast costs less."""
    order = np.lexsort((-speed, cost))
    best = np.maximum.accumulate(speed[order])
    first = np.concatenate([[True], best[1:] > best[:-1]])
    found: NDArray[np.int64] = order[first]
    return found
