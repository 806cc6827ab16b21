"""Branches, itineraries, energies: values, exact markers, and names."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from scipy.optimize import isotonic_regression

from capsule_sym import (
    Parameters,
    figure_style,
    plot_bifurcations,
    plot_energies,
    plot_itineraries,
    simulate,
)
from capsule_sym._figures.arcs import cycle
from capsule_sym._figures.branches import spread
from capsule_sym._figures.evolution import draw_itineraries
from tests.figures import SAFE
from tests.figures.layout import problems

PRINTED = (0.0074, 0.3687, 0.5245, 0.939, 1.443, 1.6148, 1.661, 1.7126)


def point(value: float, stable: bool, states: list[list[float]], velocity: float) -> dict[str, Any]:
    return {
        "value": value,
        "itinerary": ["F2"],
        "stable": stable,
        "stroboscopic": states,
        "average_velocity": velocity,
        "energy": {"work": 3 * value, "damper_loss": value, "friction_loss": 2 * value},
    }


SMALL = {
    "parameter": "omega",
    "points": [
        point(1.0, True, [[0.1, 0.2, 0.0]], 0.5),
        point(1.1, True, [[0.2, 0.3, 0.0]], 0.6),
        point(1.2, False, [[0.3, 0.4, 0.0], [0.5, 0.6, 0.0]], 0.7),
        point(1.3, False, [[0.4, 0.5, 0.0], [0.6, 0.7, 0.0]], 0.8),
    ],
    "bifurcations": [
        {
            "label": "GR1",
            "type": "grazing",
            "line": "L9",
            "value": 1.15,
            "stroboscopic": [[0.25, 0.35, 0.0]],
            "average_velocity": 0.65,
        },
        {
            "label": "LP1",
            "type": "fold",
            "line": None,
            "value": 1.16,
            "stroboscopic": [[0.26, 0.36, 0.0]],
            "average_velocity": 0.66,
        },
    ],
}


def test_a_branch_is_solid_where_stable_and_marked_at_exact_points() -> None:
    figure = plot_bifurcations(SMALL)
    x_r, v_r, velocity = figure.axes
    for axes, first, second, markers in (
        (x_r, [0.1, 0.2], [0.3, 0.4], [0.25, 0.26]),
        (v_r, [0.2, 0.3], [0.4, 0.5], [0.35, 0.36]),
        (velocity, [0.5, 0.6], [0.7, 0.8], [0.65, 0.66]),
    ):
        stable, unstable = (
            next(line for line in axes.lines if line.get_label() == name)
            for name in ("stable", "unstable")
        )
        assert list(stable.get_xdata()) == [1.0, 1.1, 1.2]
        assert list(stable.get_ydata()) == [*first, second[0]]
        assert not stable.is_dashed()
        assert list(unstable.get_xdata()) == [1.2, 1.3]
        assert list(unstable.get_ydata()) == second
        assert unstable.is_dashed()
        (marked,) = [line for line in axes.lines if line.get_marker() == "o"]
        assert list(marked.get_xdata()) == [1.15, 1.16]
        assert list(marked.get_ydata()) == markers
    # The second state of a doubled orbit is a curve of its own.
    doubled = [line for line in x_r.lines if line.get_label() == "unstable"][1]
    assert list(doubled.get_ydata()) == [0.5, 0.6]
    assert [text.get_text() for text in x_r.texts] == ["GR1", "LP1"]
    key, stand = ([text.get_text() for text in one.get_texts()] for one in figure.legends)
    assert key == ["stable", "unstable", "exact bifurcation point"]
    assert stand == ["GR1  grazing $L_{9}$, 1.150000", "LP1  fold, 1.160000"]
    assert x_r.texts[0].xy[0] == pytest.approx(0.5)
    assert velocity.get_xlabel() == r"excitation frequency $\omega$"


@pytest.mark.long
def test_the_case_study_has_the_printed_bifurcations(branch) -> None:
    velocity = plot_bifurcations(branch).axes[2]
    (marked,) = [line for line in velocity.lines if line.get_marker() == "o"]
    assert list(marked.get_xdata()) == pytest.approx(PRINTED, rel=0.01)
    uprights = [line.get_xdata() for line in velocity.lines if list(line.get_ydata()) == [0, 1]]
    assert [x for x, _ in uprights] == list(marked.get_xdata())


@given(st.lists(st.floats(0, 1), min_size=1, max_size=12).map(sorted))
def test_names_do_not_overlap_and_keep_their_order(places: list[float]) -> None:
    moved = spread(places, 0.03)
    assert all(after - before >= 0.03 - 1e-6 for before, after in pairwise(moved))
    assert moved[0] >= 0
    assert moved[-1] <= 1
    # As little as needed: by SciPy's regression, where the ends do not hold them.
    steps = 0.03 * np.arange(len(places))
    least = isotonic_regression(np.array(places) - steps).x.clip(0, 1 - steps[-1]) + steps
    assert moved == pytest.approx(least, abs=1e-12)


def test_names_stay_where_there_is_room() -> None:
    assert spread([0.1, 0.5, 0.9], 0.03) == pytest.approx([0.1, 0.5, 0.9], abs=1e-15)


@pytest.mark.long
def test_losses_stack_to_the_work(branch) -> None:
    upper, lower = plot_energies(branch).axes
    damper, friction = (container.patches for container in upper.containers)
    (work,) = [line for line in upper.lines if line.get_label() == "work of the drive"]
    tops = [bar.get_y() + bar.get_height() for bar in friction]
    assert tops == pytest.approx(work.get_ydata(), abs=1e-12)
    assert [bar.get_y() for bar in friction] == [bar.get_height() for bar in damper]
    for bars in (damper, friction):
        assert all(a.get_x() + a.get_width() == pytest.approx(b.get_x()) for a, b in pairwise(bars))
    share = lower.lines[0].get_ydata()
    assert share[0] == 0
    assert share == pytest.approx(
        [bar.get_height() for bar in friction] / np.array(work.get_ydata())
    )


@pytest.mark.parametrize("lift", [0.5, -0.5])
def test_lift_lies_on_the_losses_or_below_zero(lift: float) -> None:
    """Lift is stacked on the losses up to the work; sinking gives the part below 0."""
    points = [
        {**one, "energy": {**one["energy"], "work": 3 * one["value"] + lift, "lift": lift}}
        for one in SMALL["points"]
    ]
    upper = plot_energies({**SMALL, "points": points}).axes[0]
    ends = [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in upper.containers[2].patches]
    losses = [3 * one["value"] for one in points]
    below = losses if lift > 0 else [0.0] * len(points)
    assert ends == [(pytest.approx(at), pytest.approx(at + lift)) for at in below]


def test_a_column_of_itineraries_is_a_motions_word(settled) -> None:
    runs = [settled(alpha) for alpha in (1.2, 1.9, 0.7)]
    axes = Figure().subplots()
    draw_itineraries(runs, axes)
    assert axes.get_xlim() == (0.7, 1.9)
    columns: dict[float, float] = {}
    fields: dict[float, set[str]] = {}
    for collection in axes.collections:
        for path in collection.get_paths():
            (left, low), (_, high) = path.vertices.min(axis=0), path.vertices.max(axis=0)
            columns[left] = columns.get(left, 0.0) + high - low
            fields.setdefault(left, set()).add(collection.get_label())
    assert sorted(columns) == pytest.approx([0.7, 0.95, 1.55])
    assert list(columns.values()) == pytest.approx([1.0] * 3, abs=1e-12)
    assert [fields[left] for left in sorted(fields)] == [
        set(run.steady().itinerary) for run in (runs[2], runs[0], runs[1])
    ]
    colours = {c.get_label(): to_hex(c.get_facecolor()[0]) for c in axes.collections}
    assert colours["F4"] == to_hex(SAFE[3])


def test_a_motion_beside_longer_ones_is_drawn_over_as_many_periods(settled) -> None:
    doubled = simulate(Parameters(alpha=0.4, zeta=0.01), periods=512)
    assert doubled.steady().period_number == 2
    axes = Figure().subplots()
    draw_itineraries([doubled, settled(0.7)], axes)
    heights: dict[float, float] = {}
    for path in (path for one in axes.collections for path in one.get_paths()):
        (left, low), (_, high) = path.vertices.min(axis=0), path.vertices.max(axis=0)
        heights[left] = heights.get(left, 0.0) + high - low
    assert list(heights.values()) == pytest.approx([2.0, 2.0], abs=1e-12)
    assert axes.get_ylim() == (0, 2)


@pytest.mark.long
def test_what_is_not_periodic_has_a_meaning_in_the_legend(settled, branch) -> None:
    restless = simulate(Parameters(alpha=1.2, gamma=3.0), periods=3)
    motions = [settled(0.7), restless, settled(1.9)]
    figure = plot_itineraries(motions, branch)
    white = "not settled"
    assert [one.get_text() for one in figure.legends[0].get_texts()][-1] == white
    columns = {
        path.vertices[:, 0].min() for c in figure.axes[0].collections for path in c.get_paths()
    }
    assert sorted(columns) == pytest.approx([0.7, 1.55])  # that at 1.2 stays white
    without = plot_itineraries(motions[::2], branch)
    assert white not in [one.get_text() for one in without.legends[0].get_texts()]


@pytest.mark.long
def test_labels_lead_to_their_values_where_motions_reach_farther_than_the_branch(settled) -> None:
    found = [{**SMALL["bifurcations"][0], "value": value} for value in (1.15, 2.5)]
    record = {**SMALL, "parameter": "alpha", "bifurcations": found}
    axes = plot_itineraries([settled(0.7), settled(1.5)], record).axes[0]
    (note,) = [text for text in axes.texts if text.get_text() == "GR1"]
    low, high = axes.get_xlim()
    assert low + note.xy[0] * (high - low) == pytest.approx(1.15)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("draw", [plot_bifurcations, plot_energies])
def test_a_branch_may_be_one_orbit(draw) -> None:
    one = {**SMALL, "points": SMALL["points"][:1], "bifurcations": []}
    low, high = draw(one).axes[-1].get_xlim()
    assert low < 1.0 < high


@pytest.mark.parametrize("draw", [plot_bifurcations, plot_energies])
def test_a_branch_that_ends_early_says_so_in_its_figures(draw) -> None:
    labels = [
        draw({**SMALL, **status}, width=3.35).axes[-1].get_xlabel()
        for status in ({}, {"status": "reached"}, {"status": "turned-back"})
    ]
    assert labels[0] == labels[1]
    assert labels[2] == f"{labels[0]}; the branch ends early: turned-back"


@pytest.mark.long
def test_long_numbers_along_a_narrow_diagram_stay_apart() -> None:
    ends = ((0.005, 0.0012), (0.0072, 0.0034))
    points = [point(at, True, [[x, x, 0.0]], x) for at, x in ends]
    figure = plot_bifurcations({**SMALL, "points": points, "bifurcations": []}, width=3.35)
    with figure_style():
        assert problems(figure) == []


@pytest.mark.long
def test_itineraries_name_the_bifurcations(settled, branch) -> None:
    axes = plot_itineraries([settled(0.7), settled(1.9)], branch).axes[0]
    assert [line.get_xdata()[0] for line in axes.lines] == [
        one["value"] for one in branch["bifurcations"]
    ]
    within = [one["label"] for one in branch["bifurcations"] if 0.7 <= one["value"] <= 1.9]
    shown = [text.get_text() for text in axes.texts]
    # Each field is named where one of its segments is long.
    fields = [f"$F_{{{field}}}$" for field in (1, 2, 3, 4, 5, 6)]
    assert [text for text in shown if text not in fields] == within
    segments = {"$F_{1}$", "$F_{2}$", "$F_{3}$", "$F_{4}$"}
    assert segments <= set(shown)
    for text in axes.texts:
        if text.get_text() in fields:
            alpha, phase = text.get_position()
            arcs = cycle(settled(alpha))
            (arc,) = [a for a in arcs if 0 <= phase - a.time[0] + arcs[0].time[0] <= np.ptp(a.time)]
            assert f"$F_{{{arc.field}}}$" == text.get_text()
