"""No text of a figure is cut, on another, or struck through by a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import capsule_sym as cs
from capsule_sym._figures.curves import plot_curves
from capsule_sym._figures.labels import name_points
from capsule_sym._figures.style import CURVES
from tests.figures.layout import problems
from tests.figures.test_charts import CODES, CURVE
from tests.figures.test_parts import fitted, front_of, pulse, spread
from tests.sampling import sampled, some

COLUMN, PAGE = 3.35, 7.0


def looked_at(figure: Any) -> list[str]:
    with cs.figures.figure_style():
        return problems(figure)


def swept() -> xr.Dataset:
    """Cells of two itineraries, and attractors with and without a motion."""
    itineraries = np.where(np.arange(24)[:, None] + np.zeros(16) < 11, 11, 22)
    itineraries[20:, 12:] = -1
    flags = {"flag_values": list(CODES), "flag_meanings": " ".join(CODES.values())}
    known = {"attractors": [{"itinerary": CODES[11].replace("_", " "), "fraction": 0.5}]}
    over = {"alpha": np.linspace(0, 2, 24), "gamma": np.linspace(1, 3, 16)}
    cells = {name: (tuple(over), np.ones((24, 16))) for name in ("velocity", "work")}
    return xr.Dataset(
        {
            "itinerary": (tuple(over), itineraries, flags),
            "attractor": (tuple(over), np.where(itineraries == 11, 0, -1), known),
            **cells,
        },
        coords=over,
        attrs={"omega": 0.8, "f_b": 1.0},
    )


def coexisting() -> Any:
    system = cs.Parameters(omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    box = {"x_r": (-2, 2), "v_r": (-2, 2)}
    return cs.continue_attractors(system, "alpha", [1.5, 1.52, 1.54, 1.56], box, count=20)


def crowd() -> dict[str, Any]:
    """Curves of every type that meet in two dozen points, as those that leave others do."""
    kinds = [*CURVES, "period doubling"]
    met = np.random.default_rng(3).uniform((0.4, 1.0), (1.6, 3.0), (24, 2))
    return {
        "curves": [
            {
                "type": kind,
                "parameters": ["alpha", "gamma"],
                "points": [{"alpha": 0.4 + k / 9, "gamma": g} for g in (1.0, 2.0, 3.0)],
                "codimension_two": [
                    {"alpha": x, "gamma": y, "types": [kind, kinds[(k + n) % len(kinds)]]}
                    for n, (x, y) in enumerate(met[k::8])
                ],
            }
            for k, kind in enumerate(kinds)
        ]
    }


def drive() -> cs.results.Front:
    return front_of((1.0, 2.0, 3.0), (0.1, 0.2, 0.25), STATUSES, 2)


STATUSES = ("optimal", "optimal-at-border", "not-converged")
OTHERS: dict[str, Callable[[Any, float], Any]] = {
    "curves": lambda branch, width: plot_curves(crowd(), width=width),
    "chart": lambda branch, width: cs.figures.plot_chart(swept(), [CURVE], width=width),
    "basin": lambda branch, width: cs.figures.plot_basin(swept(), width=width),
    "front": lambda branch, width: cs.figures.plot_front(drive(), width=width),
    "residuals": lambda branch, width: cs.figures.plot_residuals(fitted(), width=width),
    "pulse": lambda branch, width: cs.plot(pulse(), width=width),
    "tolerances": lambda branch, width: cs.figures.plot_tolerances(spread(), width=width),
    "attractors": lambda branch, width: cs.plot(coexisting(), width=width),
    "shock": lambda branch, width: cs.plot(cs.minimal_shock(pulse().start), width=width),
    "diagram": lambda branch, width: cs.plot(branch, width=width),
    "motion": lambda branch, width: cs.plot(branch.points[0].orbit, width=width),
    "metric": lambda branch, width: cs.figures.plot_metric(swept(), width=width),
}


def test_statuses_are_told_in_words() -> None:
    (key,) = cs.figures.plot_front(drive()).legends
    shown = [text.get_text() for text in key.get_texts()]
    assert shown == [
        "between parts of the front",
        "optimum",
        "optimum at a border",
        "not proved an optimum",
    ]


@pytest.mark.long
@sampled
@pytest.mark.parametrize(
    ("name", "width"), some([(name, width) for name in OTHERS for width in (COLUMN, PAGE)], 2)
)
def test_so_it_is_for_results_of_ones_own(name: str, width: float, branch) -> None:
    assert looked_at(OTHERS[name](branch, width)) == []


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


def test_fractions_of_attractors_are_stacked_and_named() -> None:
    found = coexisting()
    figure = cs.plot(found)
    (axes,) = figure.axes
    below = np.zeros(len(found.values))
    for branch, area in zip(found.branches, axes.collections, strict=True):
        edges: dict[float, list[float]] = {}
        for x, y in area.get_paths()[0].vertices:
            edges.setdefault(x, []).append(y)
        share = np.zeros(len(found.values))
        share[np.searchsorted(found.values, branch.values)] = branch.fractions
        above = below + share
        assert [min(edges[x]) for x in found.values] == pytest.approx(below)
        assert [max(edges[x]) for x in found.values] == pytest.approx(above)
        below = above
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    for branch, text in zip(found.branches, shown, strict=False):
        low, high = 100 * branch.fractions.min(), 100 * branch.fractions.max()
        assert text.startswith(f"{branch.number}  {branch.shown[branch.fractions.argmax()][0]}")
        assert text.endswith(f"{high:.3g} %)")
        assert f"({low:.3g}" in text


def test_a_name_that_is_nearer_to_another_circle_has_a_line() -> None:
    figure = Figure(figsize=(4, 3), layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(0, 1), ylim=(0, 1))
    x = 0.5 + 0.017 * np.arange(6)
    places = {f"PD{k}": (at, 0.5 + 0.02 * (-1) ** k) for k, at in enumerate(x)}
    axes.plot(*np.transpose([*places.values()]), "o", fillstyle="none")
    before = {*axes.lines}
    name_points(axes, [(place, text, "C0") for text, place in places.items()])
    circles = {text: axes.transData.transform(place) for text, place in places.items()}
    led = [axes.transData.transform(line.get_xydata()) for line in {*axes.lines} - before]
    alone = 0
    for text in axes.texts:
        box = text.get_window_extent()
        near = {
            name: np.hypot(*(np.clip(at, box.min, box.max) - at)) for name, at in circles.items()
        }
        own = text.get_text()
        if not any(abs(ends - circles[own]).max(axis=1).min() < 1e-6 for ends in led):
            alone += 1
            assert min(near, key=lambda name: near[name]) == own
    assert alone < len(places)
