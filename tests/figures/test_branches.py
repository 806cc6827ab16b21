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

from capsule_sym import Parameters, continue_orbit, figures, performance, simulate, solve_orbit
from capsule_sym._figures.arcs import cycle
from capsule_sym._figures.branches import spread
from capsule_sym._figures.computed import branch_record, orbit_of
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
            "multipliers_after": [[0.5, 0.0]],
        },
        {
            "label": "LP1",
            "type": "fold",
            "line": None,
            "value": 1.16,
            "stroboscopic": [[0.26, 0.36, 0.0]],
            "average_velocity": 0.66,
            "multipliers_after": [[1.2, 0.0]],
        },
    ],
}


def test_a_branch_is_solid_where_stable_and_marked_at_exact_points() -> None:
    figure = figures.plot_bifurcations(SMALL)
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
        # The style changes at the second of the two bifurcations between samples.
        assert list(stable.get_xdata()) == [1.0, 1.1, 1.15, 1.16]
        assert list(stable.get_ydata()) == [*first, *markers]
        assert not stable.is_dashed()
        assert list(unstable.get_xdata()) == [1.16, 1.2, 1.3]
        assert list(unstable.get_ydata()) == [markers[1], *second]
        assert unstable.is_dashed()
        (marked,) = [line for line in axes.lines if line.get_marker() == "o"]
        assert list(marked.get_xdata()) == [1.15, 1.16]
        assert list(marked.get_ydata()) == markers
    # The second state of a doubled orbit is a curve of its own.
    doubled = [line for line in x_r.lines if line.get_label() == "unstable"][1]
    assert list(doubled.get_ydata()) == [0.26, 0.5, 0.6]
    assert [text.get_text() for text in x_r.texts] == ["GR1", "LP1"]
    key, stand = ([text.get_text() for text in one.get_texts()] for one in figure.legends)
    assert key == ["stable", "unstable", "exact bifurcation point"]
    assert stand == ["GR1  grazing $L_{9}$, 1.150000", "LP1  fold, 1.160000"]
    assert x_r.texts[0].xy[0] == pytest.approx(0.5)
    assert velocity.get_xlabel() == r"excitation frequency $\omega$"


@pytest.mark.long
def test_the_case_study_has_the_printed_bifurcations(branch) -> None:
    velocity = figures.plot_bifurcations(branch).axes[2]
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


def test_names_stay_where_there_is_room() -> None:
    assert spread([0.1, 0.5, 0.9], 0.03) == pytest.approx([0.1, 0.5, 0.9], abs=1e-15)


def bands(axes: Any, label: str) -> list[dict[float, tuple[float, float]]]:
    """Lower and upper edge of each area of a label, by its places."""
    found = []
    for area in (one for one in axes.collections if one.get_label() == label):
        edges: dict[float, list[float]] = {}
        for x, y in area.get_paths()[0].vertices:
            edges.setdefault(x, []).append(y)
        found.append({x: (min(ys), max(ys)) for x, ys in edges.items()})
    return found


@pytest.mark.long
def test_losses_stack_to_the_work_at_every_orbit_and_bifurcation(branch) -> None:
    upper, lower = figures.plot_energies(branch).axes
    (damper,), (friction,) = (bands(upper, f"lost {where}") for where in DAMPED)
    orbits = [orbit_of(one) for one in (*branch["points"], *branch["bifurcations"])]
    assert sorted(damper) == sorted(friction) == sorted({one.value("alpha") for one in orbits})
    (work,) = [line for line in upper.lines if line.get_label() == "work of the drive"]
    (share,) = (dict(zip(*line.get_data(), strict=True)) for line in lower.lines[:1])
    for at, done in zip(*work.get_data(), strict=True):
        assert damper[at][0] == 0
        assert friction[at] == (damper[at][1], pytest.approx(done, abs=1e-12))
        assert share[at] * done == pytest.approx(np.ptp(friction[at]), abs=1e-12)
    for orbit in orbits[:: len(orbits) // 4]:
        lost = float(performance(orbit).damper_loss.value)
        assert damper[orbit.value("alpha")][1] == pytest.approx(lost, abs=1e-12)


DAMPED = ("in the damper", "to friction")


@pytest.mark.parametrize("lift", [0.5, -0.5])
def test_lift_lies_on_the_losses_or_below_zero(lift: float) -> None:
    """Lift is stacked on the losses up to the work; sinking gives the part below 0."""
    points = [
        {**one, "energy": {**one["energy"], "work": 3 * one["value"] + lift, "lift": lift}}
        for one in SMALL["points"]
    ]
    (area,) = bands(
        figures.plot_energies({**SMALL, "points": points}).axes[0], "lift of the bodies"
    )
    for one in points:
        base = 3 * one["value"] if lift > 0 else 0.0
        assert area[one["value"]] == pytest.approx(sorted((base, base + lift)))


def test_styles_change_at_the_solved_bifurcation(doubling) -> None:
    """Not at the next sample, in the diagram of states as in one of several branches."""
    exact = doubling.bifurcations[0].value
    assert exact not in [point.value for point in doubling.points]
    record = branch_record(doubling)
    for axes in (
        figures.plot_bifurcations(record).axes[2],
        figures.plot_diagram({**record, "switched": []}).axes[0],
    ):
        drawn = [line for line in axes.lines if len(line.get_xdata()) > 2]
        before, after = (
            np.concatenate([line.get_xdata() for line in drawn if line.is_dashed() == dashed])
            for dashed in (False, True)
        )
        assert max(before) == min(after) == exact


def test_styles_change_at_a_fold_whose_value_the_branch_passes_again() -> None:
    values = (1.0, 0.9, 0.8, 0.85, 0.95, 0.9, 0.7)
    points = [
        point(value, stable, [[value, value, 0.0]], value)
        for value, stable in zip(values, (True, True, True, False, False, True, True), strict=True)
    ]
    folds = [
        {**SMALL["bifurcations"][1], "value": value, "average_velocity": value}
        for value in (0.799, 0.951)
    ]
    for one, size in zip(folds, (1.1, 0.9), strict=True):
        one["multipliers_after"] = [[size, 0.0]]
    axes = figures.plot_bifurcations({**SMALL, "points": points, "bifurcations": folds}).axes[2]
    drawn = [list(line.get_xdata()) for line in axes.lines if line.get_label() in STYLES]
    assert drawn == [[1.0, 0.9, 0.8, 0.799], [0.799, 0.85, 0.95, 0.951], [0.951, 0.9, 0.7]]


STYLES = "stable", "unstable"


@pytest.fixture(scope="module")
def doubling() -> Any:
    return continue_orbit(solve_orbit(Parameters(alpha=0.04, zeta=0.005)), "alpha", 0.046, points=3)


def test_an_area_of_itineraries_ends_at_the_solved_bifurcation(settled, branch) -> None:
    """Between two motions the backward drift begins at the branch's point, and joins switches."""
    exact = next(one["value"] for one in branch["bifurcations"] if one["label"] == "AS2")
    runs = [settled(exact - 0.01), settled(exact + 0.01)]
    areas = {
        one.get_label(): one for one in figures.plot_itineraries(runs, branch).axes[0].collections
    }
    corners = np.concatenate([path.vertices for path in areas["F3"].get_paths()])
    assert corners[:, 0].min() == pytest.approx(exact, abs=1e-15)
    step = np.ptp(corners[corners[:, 0] == corners[:, 0].min(), 1])
    assert step < 1e-6
    (backward,) = [arc for arc in cycle(runs[1]) if arc.field == 3]
    at_end = corners[corners[:, 0] == runs[1].parameters.alpha, 1]
    assert [at_end.min(), at_end.max()] == pytest.approx(backward.time[[0, -1]] % 1, abs=1e-9)


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
    # Motions so far apart jump halfway.
    assert sorted(columns) == pytest.approx([0.7, 0.95, 1.2, 1.55])
    assert list(columns.values()) == pytest.approx([1.0] * 4, abs=1e-12)
    assert [fields[left] for left in sorted(fields)] == [
        set(run.steady().itinerary) for run in (runs[2], runs[0], runs[0], runs[1])
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
    figure = figures.plot_itineraries(motions, branch)
    white = "not settled"
    assert [one.get_text() for one in figure.legends[0].get_texts()][-1] == white
    columns = {
        path.vertices[:, 0].min() for c in figure.axes[0].collections for path in c.get_paths()
    }
    assert sorted(columns) == pytest.approx([0.7, 1.55])  # that at 1.2 stays white
    without = figures.plot_itineraries(motions[::2], branch)
    assert white not in [one.get_text() for one in without.legends[0].get_texts()]


@pytest.mark.long
def test_labels_lead_to_their_values_where_motions_reach_farther_than_the_branch(settled) -> None:
    found = [{**SMALL["bifurcations"][0], "value": value} for value in (1.15, 2.5)]
    record = {**SMALL, "parameter": "alpha", "bifurcations": found}
    axes = figures.plot_itineraries([settled(0.7), settled(1.5)], record).axes[0]
    (note,) = [text for text in axes.texts if text.get_text() == "GR1"]
    low, high = axes.get_xlim()
    assert low + note.xy[0] * (high - low) == pytest.approx(1.15)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("draw", [figures.plot_bifurcations, figures.plot_energies])
def test_a_branch_may_be_one_orbit(draw) -> None:
    one = {**SMALL, "points": SMALL["points"][:1], "bifurcations": []}
    low, high = draw(one).axes[-1].get_xlim()
    assert low < 1.0 < high


@pytest.mark.parametrize("draw", [figures.plot_bifurcations, figures.plot_energies])
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
    figure = figures.plot_bifurcations({**SMALL, "points": points, "bifurcations": []}, width=3.35)
    with figures.figure_style():
        assert problems(figure) == []


@pytest.mark.long
def test_itineraries_name_the_bifurcations(settled, branch) -> None:
    axes = figures.plot_itineraries([settled(0.7), settled(1.9)], branch).axes[0]
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
