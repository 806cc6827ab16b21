"""Results of sweeps: basins of attraction, and the Pareto front of speed and cost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.layout import add_key, axes_for, handles_of
from capsule_sym._figures.regions import unsettled
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    AREAS,
    LABELS,
    NO_RESULT,
    NOT_SETTLED,
    STABLE,
    blank,
    describe,
    readable,
    styled,
)
from capsule_sym._figures.units import named, prefixed
from capsule_sym._parameters import CAPSULE, scene_in
from capsule_sym._sweeps import itineraries

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

_STATE = "x_r", "v_r", "v_c"
_DIGITS = 4  # of final states: those of an attractor differ by less
_ROOM = 0.04  # of a basin: distance from its border to a number


@styled
def plot_basin(results: xr.Dataset, *, width: float = PAGE, axes: Axes | None = None) -> Figure:
    """Attractor of each start, over the two coordinates of a basin's cells.

    `results` is what `open_results` gives of a basin. A colour is an attractor, the most frequent
    first; its number is that of the key, which gives its itinerary and share. Grey are starts that
    have not settled within the sweep's periods, white those without a result. Stars are the
    attractors' own stroboscopic states, where both coordinates are among the state's,
    dimensionless. Drawn into `axes`, without the key, if they are given. Raises InvalidInput for
    results of another kind.
    """
    if "attractor" not in results or len(results["attractor"].dims) != 2:
        raise InvalidInput("results", sorted(map(str, results)), "a basin over two coordinates")
    codes = results["attractor"]
    first, second = map(str, codes.dims)
    known, counts = np.unique(codes.values[codes.values >= 0], return_counts=True)
    order = [int(code) for code in known[np.argsort(-counts, kind="stable")]]
    rank = np.full(codes.shape, -1)
    for place, code in enumerate(order):
        rank[codes.values == code] = place
    colours = [AREAS[place % len(AREAS)] for place in range(len(order))]
    late, said = unsettled(results)
    rank[late & (rank < 0)] = len(colours)
    colours.append(NOT_SETTLED)
    (x, x_label), (y, y_label) = (_axis(results, name) for name in (first, second))
    alone = axes is None
    figure, axes = axes_for(axes, width, 0.62 * width)
    axes.pcolormesh(
        x,
        y,
        np.ma.masked_less(rank.T, 0),
        cmap=ListedColormap(colours),
        norm=BoundaryNorm(np.arange(len(colours) + 1) - 0.5, len(colours)),
        shading="nearest",
        rasterized=True,
    )
    for place, colour in enumerate(colours[: len(order)]):
        (i, j), depth = _deepest(rank == place)
        if depth >= _ROOM * min(rank.shape):
            middle: dict[str, Any] = {"ha": "center", "va": "center", "color": readable(colour)}
            axes.text(x[i], y[j], str(place + 1), **middle)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    _draw_attractors(axes, results, order)
    if alone:
        handles = [
            Patch(facecolor=colours[place], label=f"{place + 1}  {_name(results, code)}")
            for place, code in enumerate(order)
        ]
        if np.any(rank == len(order)):
            handles.append(Patch(facecolor=NOT_SETTLED, label=said))
        if np.any(rank < 0):
            handles.append(blank(NO_RESULT))
        handles += handles_of([axes])
        add_key(figure, handles)
    return describe(figure, "Basins of attraction", axes=[first, second])


def _deepest(area: NDArray[np.bool_]) -> tuple[tuple[int, int], int]:
    """The cell of an area that lies farthest inside, and how many cells deep."""
    left, depth = np.pad(area, 1), 0
    while left.any():
        last, depth = left.copy(), depth + 1
        left[1:-1, 1:-1] &= left[:-2, 1:-1] & left[2:, 1:-1] & left[1:-1, :-2] & left[1:-1, 2:]
    cells = np.argwhere(last) - 1
    i, j = cells[len(cells) // 2]
    return (int(i), int(j)), depth


def _draw_attractors(axes: Axes, results: xr.Dataset, order: list[int]) -> None:
    """Stars at the states in which the starts of each attractor end."""
    names = list(map(str, results["attractor"].dims))
    if "final" not in results or not {*names} <= {*_STATE}:
        return
    if any("si_units" in results[name].attrs for name in names):
        return
    ends, codes = results["final"].values, results["attractor"].values
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())  # an attractor may lie outside
    for code in order:
        states = ends[codes == code][:, [_STATE.index(name) for name in names]]
        x, y = np.unique(states.round(_DIGITS), axis=0).T
        rim: dict[str, Any] = {"markeredgecolor": "black", "markeredgewidth": 0.5}
        axes.plot(x, y, "*", color="white", markersize=6, label="attractor, once a period", **rim)


def _axis(results: xr.Dataset, name: str) -> tuple[Array, str]:
    """Values and label along an axis, of a start in SI units where the sweep is a device's."""
    values, attributes = results[name].values, results[name].attrs
    if "si_units" not in attributes:
        return values, named(name)
    factor, unit = prefixed(attributes["si_scale"], attributes["si_units"])
    return values * factor, f"{LABELS.get(name, name).partition(' $')[0]} ({unit})"


def _name(results: xr.Dataset, code: int) -> str:
    """An attractor's number, itinerary and share."""
    cells = results["attractor"].values == code
    share = 100 * np.mean(cells)
    code = int(results["itinerary"].values[cells].flat[0])
    itinerary = itineraries.texts(results).get(code, "")
    return f"{itinerary or 'attractor'} ({share:.1f} %)"


@styled
def plot_pareto(results: xr.Dataset, *, width: float = PAGE, axes: Axes | None = None) -> Figure:
    """Speed against cost of transport of a sweep's cells, with their Pareto front.

    The speed is the absolute average velocity. The cost of transport is the work of the drive
    divided by the friction bound and the distance. A cell is on the front if no other cell is at
    least as fast at no greater cost. Drawn into `axes` if they are given. Raises InvalidInput for a
    sweep without energies.
    """
    speed, cost = speed_and_cost(results)
    front = non_dominated(speed, cost)
    of_device = results["velocity"].attrs
    speed, unit = speed * of_device.get("si_scale", 1.0), of_device.get("si_units", "")
    alone = axes is None
    figure, axes = axes_for(axes, width, max(2.4, 0.5 * width))
    axes.plot(cost, speed, ".", color="0.6", markersize=2.5, label="cells", rasterized=True)
    axes.plot(
        cost[front], speed[front], "o-", color=STABLE, drawstyle="steps-post",
        label="Pareto front",
    )  # fmt: skip
    axes.set_xscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())  # within two decades its labels would collide
    if cost.max() < 100 * cost.min():
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
    velocity, work = results["velocity"], results["work"]
    bounds = (scene_in(results.attrs) or CAPSULE).facts.BOUNDS
    omega, forward, backward = (
        results[name] if name in results.coords else results.attrs.get(name, 0.0)
        for name in ("omega", bounds.get(1), bounds.get(-1))
    )
    back = velocity < 0
    bound = back * backward + ~back * forward
    way = abs(velocity) * 2 * np.pi / omega
    cost = (work / (bound * way)).values.ravel()
    speed = abs(velocity).values.ravel()
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
