"""Composed figures in a part of a figure of one's own: the same artists, and nothing beside it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import capsule_sym
from capsule_sym import (
    Parameters,
    fit,
    plot_events,
    plot_fig1,
    plot_fig2,
    plot_fig6,
    plot_fig7,
    plot_pulse,
    plot_residuals,
    plot_switching,
    plot_tolerances,
    plot_work_precision,
    simulate,
    solve_orbit,
    switch_by_pulse,
    tolerances,
)
from paper.study.events import CROSSINGS
from paper.study.sections import SCHEMATIC, sections
from tests.figures.test_precision import RECORD
from tests.sampling import sampled, some


def bundles(shown: Any) -> Any:
    return [[simulate(SCHEMATIC, (0.0, 1.0, 0.5), periods=1)] for _ in shown]


def fitted() -> Any:
    times = np.linspace(0.0, 20.0, 60)
    x_r, *_, x_c = simulate(Parameters(), periods=3)(times, position=True).T
    return fit({"t": times, "x_m": x_r + x_c, "x_c": x_c}, Parameters(alpha=0.71), ("alpha",))


def spread() -> Any:
    return tolerances(("speed", "work"), {"alpha": 0.02}, Parameters(), samples=64)


def pulse() -> Any:
    both = Parameters(alpha=2.5, omega=0.41, delta=0.41, zeta=0.025, beta=12.0, gamma=2.2)
    ends = (solve_orbit(both, start) for start in ((0.5, -0.9, -0.9), (0.4, 0.9, 0.1)))
    return switch_by_pulse(*ends, values=100)


FIG3, FIG4, FIG5 = sections(SCHEMATIC)
Arguments = Callable[[Any], tuple[Any, ...]]
COMPOSED: dict[str, tuple[Callable[..., Figure], Arguments]] = {
    "fig1": (plot_fig1, lambda settled: ()),
    "fig2": (plot_fig2, lambda settled: ()),
    "fig3": (plot_switching, lambda settled: (3, bundles(FIG3))),
    "fig4": (plot_switching, lambda settled: (4, bundles(FIG4))),
    "fig5": (plot_switching, lambda settled: (5, bundles(FIG5))),
    "fig6": (plot_fig6, lambda settled: ([settled(0.7), settled(1.9)],)),
    "fig7": (plot_fig7, lambda settled: ([settled(0.7), settled(1.2), settled(1.9)],)),
    "events": (
        plot_events,
        lambda settled: (CROSSINGS[:1], [[settled(a) for a in CROSSINGS[0].alphas]]),
    ),
    "work-precision": (plot_work_precision, lambda settled: (RECORD,)),
    "residuals": (plot_residuals, lambda settled: (fitted(),)),
    "tolerances": (plot_tolerances, lambda settled: (spread(),)),
    "pulse": (plot_pulse, lambda settled: (pulse(),)),
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


# The others take more time to draw, or are drawn as these are.
QUICK = {"fig1", "fig3", "fig6", "work-precision", "residuals"}


@sampled
@pytest.mark.parametrize("layout", some([None, "constrained"], 1))
@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[] if one in QUICK else [pytest.mark.long]) for one in COMPOSED],
)
def test_a_part_of_a_figure_holds_what_the_figure_alone_holds(name, layout, settled) -> None:
    function, given = COMPOSED[name]
    arguments = given(settled)
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


def test_a_whole_figure_can_be_given_as_well(settled) -> None:
    figure = Figure(figsize=(7, 4))
    assert plot_fig7([settled(0.7)], figure=figure) is figure
    assert len(figure.axes) == 4


@pytest.mark.parametrize("name", [one for one in capsule_sym.__all__ if one.startswith("plot_")])
def test_every_figure_can_be_drawn_into_ones_own(name) -> None:
    taken = inspect.signature(getattr(capsule_sym, name)).parameters
    assert len({"axes", "figure"} & set(taken)) == 1
    place = "axes" if "axes" in taken else "figure"
    required = taken[place].default is inspect.Parameter.empty
    assert required or f"`{place}`" in (getattr(capsule_sym, name).__doc__ or "")
    composed = {function for function, _ in COMPOSED.values()}
    assert (getattr(capsule_sym, name) in composed) == (place == "figure")


def test_a_key_in_a_sliver_of_a_page_is_wrapped(settled) -> None:
    page = Figure(figsize=(5, 3))
    left, _ = page.subfigures(1, 2, width_ratios=(1, 20))
    assert plot_fig7([settled(0.7)], figure=left) is page


def test_an_outlier_does_not_flatten_the_residuals() -> None:
    times = np.linspace(0.0, 20.0, 60)
    x_r, *_ = simulate(Parameters(), periods=3)(times, position=True).T
    x_r = x_r + 1e-3 * np.random.default_rng(0).normal(size=60)
    x_r[30] += 10.0
    found = fit({"t": times, "x_r": x_r}, Parameters(alpha=0.71), ("alpha",), loss="cauchy")
    (panel,) = plot_residuals(found).axes
    beyond = [line for line in panel.lines if str(line.get_label()).startswith("outlier")]
    assert times[30] in np.concatenate([line.get_xdata() for line in beyond])
    assert np.abs(panel.get_ylim()).max() < 20
