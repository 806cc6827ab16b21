"""No text of a figure is cut, on another, or struck through by a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from capsule_sym import (
    Parameters,
    figure_style,
    plot_bifurcations,
    plot_chart,
    plot_diagram,
    plot_energies,
)
from capsule_sym._figures import sweeps
from capsule_sym._figures.catalogue import FIGURES, Study
from capsule_sym._figures.sizes import PAGE
from capsule_sym._study.data import Store
from tests.figures.layout import problems
from tests.figures.test_charts import CODES, CURVE

# The others take more time to compute, or to draw.
QUICK = {("fig1", False), ("motion", True), ("margins", False)}


def looked_at(figure: Any) -> list[str]:
    with figure_style():
        return problems(figure)


@pytest.mark.parametrize(
    ("name", "wide"),
    [
        pytest.param(name, wide, marks=[] if (name, wide) in QUICK else [pytest.mark.long])
        for name in FIGURES
        if name != "work-precision"
        for wide in (True, False)
    ],
)
def test_every_text_of_a_figure_can_be_read(name: str, wide: bool, store: Store) -> None:
    entry = FIGURES[name]
    study = Study(store, Parameters(), width=PAGE if wide else entry.least)
    assert looked_at(entry.make(study)) == []


@pytest.mark.long
@pytest.mark.parametrize("name", ["fig2", "fig3", "fig4", "fig5", "motion", "margins"])
def test_so_it_is_for_another_system(name: str, store: Store) -> None:
    other = Parameters(alpha=0.9, delta=1.3, zeta=0.2, beta=4.0, gamma=5.0, f_b=1.2)
    assert looked_at(FIGURES[name].make(Study(store, other, chosen=True))) == []


@pytest.mark.parametrize(
    "draw",
    [
        plot_diagram,
        *(pytest.param(d, marks=pytest.mark.long) for d in (plot_bifurcations, plot_energies)),
    ],
)
def test_so_it_is_for_branches(draw: Callable[[Any], Any], branch) -> None:
    assert looked_at(draw({**branch, "switched": [], "origin": None})) == []


def test_so_it_is_for_sweeps() -> None:
    itineraries = np.where(np.arange(24)[:, None] + np.zeros(16) < 11, 11, 22)
    flags = {"flag_values": list(CODES), "flag_meanings": " ".join(CODES.values())}
    over = {"alpha": np.linspace(0, 2, 24), "gamma": np.linspace(1, 3, 16)}
    cells = {name: (tuple(over), np.ones((24, 16))) for name in ("velocity", "work")}
    results = xr.Dataset(
        {
            "itinerary": (tuple(over), itineraries, flags),
            "attractor": (tuple(over), np.where(itineraries == 11, 0, -1)),
            **cells,
        },
        coords=over,
        attrs={"omega": 0.8, "f_b": 1.0},
    )
    for figure in (
        plot_chart(results, [CURVE]),
        sweeps.plot_basin(results),
        sweeps.plot_pareto(results),
    ):
        assert looked_at(figure) == []


def blank() -> tuple[Figure, Any]:
    figure = Figure(figsize=(3, 2), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set(xlim=(0, 1), ylim=(0, 1))
    return figure, axes


def test_a_name_that_can_be_read_is_none() -> None:
    figure, axes = blank()
    axes.plot([0, 1], [0.3, 0.3])
    axes.text(0.4, 0.5, "here")
    axes.text(0.4, 0.8, "there", rotation=30)
    assert problems(figure) == []


def test_each_kind_of_flaw_is_found() -> None:
    figure, axes = blank()
    axes.text(0.97, 0.5, "cut")
    axes.text(0.3, 0.5, "one")
    axes.text(0.31, 0.52, "two")
    axes.plot([0.5, 0.9], [0.75, 0.85], label="line")
    axes.text(0.6, 0.75, "struck")
    axes.plot([0.2], [0.83], "o", label="point")
    axes.text(0.19, 0.8, "hit")
    axes.annotate("", (0.5, 0.2), xytext=(0.1, 0.2), arrowprops={"arrowstyle": "->"})
    axes.text(0.2, 0.17, "shot")
    kinds = sorted(problem.split(" by")[0] for problem in problems(figure))
    assert kinds == [
        "cut: cut",
        "on another: one / two",
        "struck through: hit",
        "struck through: shot",
        "struck through: struck",
    ]


def test_what_is_covered_strikes_nothing_through() -> None:
    figure, axes = blank()
    axes.plot([0, 1], [0.5, 0.5])
    patch = {"facecolor": "white", "edgecolor": "none"}
    name = axes.text(0.4, 0.48, "on its line", bbox=patch, zorder=9)
    assert problems(figure) == []
    name.set_zorder(0)
    assert len(problems(figure)) == 1


def test_turned_names_side_by_side_do_not_meet() -> None:
    figure, axes = blank()
    for x in (0.2, 0.3):
        axes.text(x, 0.3, "a long name", rotation=45, rotation_mode="anchor")
    assert problems(figure) == []
