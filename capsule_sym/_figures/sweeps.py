"""Results of sweeps over their axes: itineraries, basins of attraction, metrics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.curves import draw_curve
from capsule_sym._figures.layout import add_key, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    DASHES,
    LABELS,
    NO_RESULT,
    NOT_SETTLED,
    OTHERS,
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
from capsule_sym._orbits.quantities import with_derived
from capsule_sym._parameters import CAPSULE, scene_in
from capsule_sym._sweeps import itineraries
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._units import METRIC_UNITS, UNITS, scale_of

if TYPE_CHECKING:
    import xarray as xr


_Side = tuple[NDArray[np.float64], str, float]
_STATE = "x_r", "v_r", "v_c"
_DIGITS = 4  # of final states: those of an attractor differ by less
_ROOM = 0.04  # of the cells along a side: distance from the border of an area to its number


@styled
def plot_chart(
    results: xr.Dataset,
    curves: Sequence[Mapping[str, Any]] = (),
    *,
    levels: Sequence[float] = (),
    width: float = PAGE,
    axes: Axes | None = None,
) -> Figure:
    """Itineraries over two axes, large areas with a number, exact curves and points on top.

    Each cell has the colour of its itinerary. The key gives the itinerary of each number. Numbers
    ascend as areas descend, and from the 19th on itineraries are pale grey. Cells that have not
    settled within the sweep's periods are dark grey, those without a result white. A circle is a
    codimension-two point.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a sweep over two parameters, or of a basin, as `open_results` gives. Axes are in
        SI units where those of the sweep are, else dimensionless.
    curves : sequence of mapping, default ()
        Curves of bifurcations over the same two parameters: entries of "curves" in what
        `capsule-sym curve --json` prints.
    levels : sequence of float, default ()
        Values of the second parameter at which a thin line is drawn, in the unit of its axis.
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
        For results without itineraries over two axes, for an axis that is no quantity, for curves
        over other axes, and for incomplete curves.

    See Also
    --------
    run_sweep : computes the results.
    plot_metric : a metric in place of the itinerary.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> axes = Axis.linear("alpha", 0.1, 1.0, 6), Axis.linear("delta", 0.0, 0.4, 4)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary = cs.run_sweep(Sweep(axes, periods=100), f"{folder}/chart")
    ...     figure = cs.figures.plot_chart(cs.results.open_results(f"{folder}/chart"))
    >>> print([text.get_text() for text in figure.legends[0].get_texts()][:3])
    ['1  F5 F4 F1 F2', '2  F5 F4 F1 F2 F3 F2', '3  F5 F2']
    """
    if "itinerary" not in results or len(results["itinerary"].dims) != 2:
        raise InvalidInput("results", sorted(map(str, results)), "itineraries over two axes")
    codes, texts = results["itinerary"], itineraries.texts(results)
    late, said = unsettled(results)
    sides = [_axis(results, str(name)) for name in codes.dims]
    none = ~late & ~np.isin(codes.values, [*texts])
    known, counts = np.unique(codes.values[~late & ~none], return_counts=True)
    known = known[np.argsort(-counts, kind="stable")]
    names, alone = [texts[int(code)] for code in known], axes is None
    figure, axes = axes_for(axes, width, 0.62 * width)
    colours = area_colours(figure, names, again=False)
    areas = [
        _Area(codes.values == code, colour, f"{number}  {text}", str(number))
        for number, (code, text, colour) in enumerate(zip(known, names, colours, strict=True), 1)
        if colour != OTHERS
    ]
    pale = [code for code, colour in zip(known, colours, strict=True) if colour == OTHERS]
    areas += [_Area(np.isin(codes.values, pale), OTHERS, f"{len(pale)} other itineraries")]
    areas += [_Area(late, NOT_SETTLED, said), _Area(none, "", NO_RESULT)]
    _draw_areas(axes, sides, areas)
    first, second = map(str, codes.dims)
    shown = f"{named(second)} = {', '.join(f'{level:g}' for level in sorted(levels))}"
    for level in levels:
        dashes: Any = (0, (6, 4))
        axes.axhline(level, color="0.2", linewidth=0.5, linestyle=dashes, label=shown)
    for curve in curves:
        draw_curve(axes, curve, first, second)
    if alone:
        key = handles_of([axes]) + _handles(areas)
        add_key(figure, key, below=True, handlelength=DASHES)
    return describe(figure, "Itineraries over two axes", axes=[first, second])


class _Area(NamedTuple):
    """Cells of one colour, white without one: their entry of the key, and their number."""

    cells: NDArray[np.bool_]
    colour: str
    label: str
    number: str = ""


def _draw_areas(axes: Axes, sides: Sequence[_Side], areas: Sequence[_Area]) -> None:
    """Fill the cells of each area; a large one has its number where it has most room."""
    (x, x_label, _), (y, y_label, _) = sides
    shown = [area for area in areas if area.colour and area.cells.any()]
    cells = np.ones((len(x), len(y), 4))
    for area in shown:
        cells[area.cells] = to_rgba(area.colour)
    axes.pcolormesh(x, y, cells.swapaxes(0, 1), shading="nearest", rasterized=True)
    for area in shown:
        depth = distance_transform_cdt(np.pad(area.cells, 1), "taxicab")[1:-1, 1:-1]
        deepest = np.argwhere(depth == depth.max())
        i, j = deepest[len(deepest) // 2]
        if area.number and depth.max() >= _ROOM * min(depth.shape):
            # On a patch of its area, above lines of levels.
            patch = {"facecolor": area.colour, "edgecolor": "none", "pad": 1}
            looks: dict[str, Any] = {"ha": "center", "va": "center", "color": readable(area.colour)}
            axes.text(x[i], y[j], area.number, bbox=patch, **looks)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)


def _handles(areas: Sequence[_Area]) -> list[Patch]:
    """Entries of the key for areas that have cells."""
    return [
        Patch(facecolor=area.colour, label=area.label) if area.colour else blank(area.label)
        for area in areas
        if area.cells.any()
    ]


def unsettled(results: xr.Dataset) -> tuple[NDArray[np.bool_], str]:
    """Mask of the cells of a sweep that have not settled, and the text that states it."""
    outcomes = results["outcome"].values if "outcome" in results else np.array(0)
    said = f"not settled in {results.attrs.get('periods', 0):,} periods"
    return outcomes == CellOutcome.NOT_SETTLED, said


@styled
def plot_basin(results: xr.Dataset, *, width: float = PAGE, axes: Axes | None = None) -> Figure:
    """Attractor of each start, over the two coordinates of a basin's cells.

    A colour is an attractor. Its number, from 0 on, is that of the results; `sweep --info` lists
    the attractors in this order. The key gives its number, itinerary and share of the starts. Grey
    are starts that have not settled within the sweep's periods, white other ones without an
    attractor.

    Stars, in the colour of their attractor, are the states in which its starts end, at phase 0,
    where both coordinates are among the state's. They may lie in another area, as starts have one
    value of the third.

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
        For results of another kind, and for an axis that is no quantity.

    See Also
    --------
    run_basin : computes a basin.
    continue_attractors : fractions of the starts along a parameter.

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
    codes = results["attractor"].values
    known = [int(code) for code in np.unique(codes[codes >= 0])]
    found = results["attractor"].attrs["attractors"]
    texts = [str(found[code]["itinerary"]) for code in known]
    late, said = unsettled(results)
    late, alone = late & (codes < 0), axes is None
    dims = results["attractor"].dims
    sides = [_axis(results, str(name)) for name in dims]
    figure, axes = axes_for(axes, width, 0.62 * width)
    colours = area_colours(figure, texts)
    areas = [
        _Area(at, colour, f"{code}  {text} {share(np.mean(at))}", str(code))
        for code, text, colour in zip(known, texts, colours, strict=True)
        for at in [codes == code]
    ]
    areas += [_Area(late, NOT_SETTLED, said), _Area(~late & (codes < 0), "", NO_RESULT)]
    _draw_areas(axes, sides, areas)
    _draw_attractors(axes, results, dict(zip(known, colours, strict=True)))
    if alone:
        add_key(figure, _handles(areas) + handles_of([axes]))
    return describe(figure, "Basins of attraction", axes=[*map(str, dims)])


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


def _axis(results: xr.Dataset, name: str) -> _Side:
    """Values, label and scale of an axis; raises InvalidInput unless it is a quantity.

    A start in a sweep of a device is in SI units, and the scale is that of its dimensionless value.
    """
    if name not in results.coords:
        raise InvalidInput("axis", name, "a quantity, to be drawn")
    values, attributes = results[name].values, results[name].attrs
    if "si_units" not in attributes:
        return values, named(name), 1.0
    factor, unit = prefixed(attributes["si_scale"], attributes["si_units"])
    return values * factor, f"{LABELS.get(name, name).partition(' $')[0]} ({unit})", factor


METRICS = (*METRIC_UNITS, "lift", "lyapunov")
"""Metrics of a motion that are drawn over parameters."""
_EXTENDED = "neither", "min", "max", "both"
_NO_VALUE = "not settled, infinite, or no result"


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
    its arrow stands for outliers. Grey are cells without a finite value: those that have not
    settled, except for lyapunov, those without a result, and those of an infinite metric, such as
    the cost of a capsule that does not advance. Over one axis each cell with a finite value is a
    dot.

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
        Curves of bifurcations that lie on top of two axes: entries of "curves" in what
        `capsule-sym curve --json` prints.
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
        For results of another kind, for a metric that the sweep does not compute, for an axis that
        is no quantity, for curves over other parameters than the axes, and for incomplete curves.

    See Also
    --------
    plot_chart : itineraries over two parameters.
    pareto : front of two metrics.

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
    if not 1 <= values.ndim <= 2:
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
    axes.set_xlabel(sides[0][1])
    if values.ndim == 1:
        axes.plot(sides[0][0], shown, ".", color=STABLE)
        axes.set_ylabel(label)
    else:
        low, high = bulk(shown.compressed(), 0.25) if shown.count() else (0.0, 1.0)
        looks: dict[str, Any] = {"shading": "nearest", "rasterized": True}
        if low < 0 < high:
            low, high = -max(-low, high), max(-low, high)
            looks["cmap"] = "PuOr_r"
        beyond = int(np.any(shown < low)) + 2 * int(np.any(shown > high))
        mesh = axes.pcolormesh(*(side for side, *_ in sides), shown.T, vmin=low, vmax=high, **looks)
        axes.set_facecolor(NOT_SETTLED)  # the middle of two hues is white
        figure.colorbar(mesh, ax=axes, label=label, extend=_EXTENDED[beyond])
        axes.set_ylabel(sides[1][1])
        for curve in curves:
            draw_curve(axes, curve, *map(str, values.dims))
    if alone and values.ndim == 2:
        grey = [Patch(facecolor=NOT_SETTLED, label=_NO_VALUE)] * bool(shown.mask.any())
        add_key(figure, handles_of([axes]) + grey)
    return describe(figure, f"{label} over parameters", metric=metric)


def metric_of(results: xr.Dataset, name: str) -> xr.DataArray:
    """A metric of each cell; raises InvalidInput for one that the sweep does not compute.

    In a sweep of a device its attributes `si_units` and `si_scale` convert it to SI units.
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
        has = ", ".join(m for m in METRICS if m in known) or "none; compute progression or energies"
        raise InvalidInput("metric", name, f"a metric that the sweep has: {has}")
    attributes = results[name].attrs if name in results else {}
    if units is not None:
        attributes = {"si_units": UNITS[name].name, "si_scale": scale_of(units, name)}
    found: xr.DataArray = known[name].copy()
    found.attrs = attributes
    return found
