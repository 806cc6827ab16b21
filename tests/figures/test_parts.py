"""Composed figures in a part of a figure of one's own: the same artists, and nothing beside it."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import capsule_sym as cs
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._design.front_search import FrontPart
from capsule_sym.figures import plot_front, plot_residuals, plot_tolerances
from capsule_sym.results import Front, Optimum, Status
from tests.public import PUBLIC
from tests.sampling import sampled, some


def fitted() -> Any:
    times = np.linspace(0.0, 20.0, 60)
    x_r, *_, x_c = cs.simulate(cs.Parameters(), periods=3)(times, position=True).T
    return cs.fit({"t": times, "x_m": x_r + x_c, "x_c": x_c}, cs.Parameters(alpha=0.71), ("alpha",))


def spread() -> Any:
    return cs.tolerances(("speed", "work"), {"alpha": 0.02}, cs.Parameters(), samples=64)


def pulse() -> Any:
    both = cs.Parameters(alpha=2.5, omega=0.41, delta=0.41, zeta=0.025, beta=12.0, gamma=2.2)
    ends = (cs.solve_orbit(both, start) for start in ((0.5, -0.9, -0.9), (0.4, 0.9, 0.1)))
    return cs.switch_by_pulse(*ends, values=100)


@pytest.mark.parametrize("turns", [0, 1])
def test_periods_after_a_shock_are_counted_from_its_own(turns: int) -> None:
    """A shock at phase 0, also of the second period, is one of a stroboscopic state."""
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.05, zeta=0.005))
    assert orbit.itinerary.period_number == 2
    phase = turns * orbit.parameters.period
    start, knock = stroboscopic(orbit)[turns], np.array([0.0, 1e-3, 0.0])
    about = (orbit, (1.0, 1.0, 1.0), 1e-3, knock, phase, start, None, 1, Status.FOUND, "")
    _, right = cs.plot(cs.results.Shock(*about)).axes
    for line, share in zip(right.lines, (0.999, 1.001), strict=True):
        assert line.get_xdata().tolist() == list(range(65))
        assert line.get_ydata()[0] == pytest.approx(share * 1e-3, rel=1e-6)


def front_of(
    costs: Sequence[float], values: Sequence[float], statuses: Sequence[str], second: int
) -> Front:
    """A front of two parts: points from number `second` on are of the second."""
    kinds = map(Status, statuses)
    points = [
        Optimum("speed", True, cs.Parameters(), value=value, status=kind)
        for value, kind in zip(values, kinds, strict=True)
    ]
    parts = FrontPart(0, second - 1), FrontPart(second, len(costs) - 1)
    status, slopes = Status.OPTIMAL, np.full(len(costs), np.nan)
    both = np.array(values), np.array(costs)
    return Front(("speed", "work"), True, tuple(points), *both, slopes, parts, status, "")


Arguments = Callable[[], tuple[Any, ...]]
COMPOSED: dict[str, tuple[Callable[..., Figure], Arguments]] = {
    "residuals": (plot_residuals, lambda: (fitted(),)),
    "tolerances": (plot_tolerances, lambda: (spread(),)),
    "pulse": (cs.plot, lambda: (pulse(),)),
}


def drawn(axes: Any) -> dict[str, Any]:
    """Content of axes, by the data of their artists; names without their places."""
    lines = [
        np.column_stack([np.asarray(one, dtype=float) for one in data]).tolist()
        for line in axes.lines
        for data in [line.get_data_3d() if axes.name == "3d" else line.get_data()]
    ]
    return {
        "lines": lines,
        "collections": [type(one).__name__ for one in axes.collections],
        "patches": len(axes.patches),
        "texts": [one.get_text() for one in axes.texts],
        "titles": [axes.get_title(loc=loc) for loc in ("left", "center")],
        "labels": (axes.get_xlabel(), axes.get_ylabel()),
    }


QUICK = {"residuals"}  # the others take more time to draw, or are drawn as these


@sampled
@pytest.mark.parametrize("layout", some([None, "constrained"], 1))
@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[] if one in QUICK else [pytest.mark.long]) for one in COMPOSED],
)
def test_a_part_of_a_figure_holds_what_the_figure_alone_holds(name, layout) -> None:
    function, given = COMPOSED[name]
    check_part(function, given(), layout)


def check_part(function: Callable[..., Figure], arguments: Any, layout: str | None) -> None:
    """A picture in a part of a figure is the one drawn alone, and within the part."""
    alone = function(*arguments)
    figure = Figure(figsize=(15, 7), layout=layout)
    left, right = figure.subfigures(1, 2)
    beside = right.subplots()
    assert function(*arguments, figure=left) is figure
    assert list(map(drawn, left.axes)) == list(map(drawn, alone.axes))
    assert left.axes
    assert right.axes == [beside]
    assert not beside.has_data()
    assert len(left.legends) == len(alone.legends)
    assert (figure.legends, right.legends) == ([], [])
    figure.draw_without_rendering()
    middle = figure.bbox.width / 2
    for axes in left.axes:
        assert axes.bbox.x1 <= middle + 1
    assert (figure.get_layout_engine() is None) == (layout is None)  # the rest is still laid out


@pytest.mark.parametrize("name", [one for one in PUBLIC if one.startswith("plot_")])
def test_every_figure_can_be_drawn_into_ones_own(name) -> None:
    taken = inspect.signature(PUBLIC[name]).parameters
    assert len({"axes", "figure"} & set(taken)) == 1
    place = "axes" if "axes" in taken else "figure"
    required = taken[place].default is inspect.Parameter.empty
    assert required or f"`{place}`" in (PUBLIC[name].__doc__ or "")
    composed = {function for function, _ in COMPOSED.values()}
    assert (PUBLIC[name] in composed) == (place == "figure")


def test_an_outlier_does_not_flatten_the_residuals() -> None:
    times = np.linspace(0.0, 20.0, 60)
    x_r, *_ = cs.simulate(cs.Parameters(), periods=3)(times, position=True).T
    x_r = x_r + 1e-3 * np.random.default_rng(0).normal(size=60)
    x_r[30] += 10.0
    found = cs.fit({"t": times, "x_r": x_r}, cs.Parameters(alpha=0.71), ("alpha",), loss="cauchy")
    (panel,) = plot_residuals(found).axes
    beyond = [line for line in panel.lines if str(line.get_label()).startswith("outlier")]
    assert times[30] in np.concatenate([line.get_xdata() for line in beyond])
    assert np.abs(panel.get_ylim()).max() < 20


def test_a_histogram_has_the_bins_that_its_samples_deserve() -> None:
    """Some times the cube root of their number, without samples far from all others."""
    found, counts = spread(), []
    for size in (64, 4096):
        samples = np.random.default_rng(0).normal(size=(size, 2))
        samples[0] = 1e6
        axes = plot_tolerances(replace(found, values=samples)).axes[0]
        counts.append(len(axes.patches))
        assert axes.get_xlim()[1] < 10
        assert sum(bar.get_height() for bar in axes.patches) == size - 1
    assert counts[0] <= math.sqrt(64)
    assert counts[1] == pytest.approx(4 * counts[0], abs=1)


def test_an_outlier_of_a_front_does_not_squeeze_it() -> None:
    costs = [0.1, 0.2, 0.3, 0.4, 0.5, 1e5]
    front = front_of(costs, [1.0, 1.2, 1.4, 1.6, 1.8, 2.0], ["optimal"] * 6, 5)
    (axes,) = plot_front(front).axes
    low, high = axes.get_xlim()
    assert low < 0.1 < 0.5 < high < 1.0
    (beyond,) = [one for one in axes.lines if str(one.get_label()).startswith("outlier")]
    assert (list(beyond.get_xdata()), list(beyond.get_ydata())) == ([high], [2.0])
    (dots,) = [one for one in axes.lines if one.get_label() == "optimum"]
    assert list(dots.get_xdata()) == list(costs)
