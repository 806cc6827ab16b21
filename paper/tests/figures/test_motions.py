"""Figs. 6 to 9: motions by amplitude, panel by panel, and around bifurcations."""

from __future__ import annotations

import numpy as np
import pytest

from capsule_sym import Parameters, simulate
from capsule_sym._figures.arcs import cycle
from paper.figures.events import plot_events
from paper.figures.motions import plot_fig6, plot_fig7
from paper.study.events import CROSSINGS, SLIDINGS, exact, nearest


@pytest.mark.long
def test_fig6_puts_each_motion_at_its_alpha(settled, branch) -> None:
    heavy = branch.bifurcations[3].orbit
    axes = plot_fig6([settled(0.7), settled(1.9)], [heavy]).axes[0]
    found = {}
    for line in axes.lines:
        x_r, alpha, v_r = line.get_data_3d()
        assert len(set(alpha)) == 1
        found.setdefault(float(alpha[0]), []).append((line, x_r, v_r))
    assert set(found) == {0.7, 1.9, branch.bifurcations[3].value}
    for alpha, lines in found.items():
        wide = {line.get_linewidth() > 1 for line, _, _ in lines}
        assert wide == {alpha == heavy.parameters.alpha}
    expected = np.concatenate([arc.x_r for arc in cycle(settled(0.7))])
    assert np.concatenate([x for _, x, _ in found[0.7]]) == pytest.approx(expected)


def test_fig7_has_a_pair_of_axes_and_the_word_for_each_motion(settled) -> None:
    runs = [settled(alpha) for alpha in (0.45, 0.7, 1.2)]
    figure = plot_fig7(runs)
    shown = [axes for axes in figure.axes if axes.axison]
    assert len(shown) == 6
    titles = [axes.get_title(loc="left") for axes in shown]
    assert [title for title in titles if title.startswith("F")] == [
        "F5 F4 F5 F2",
        "F5 F4 F1 F2",
        "F5 F4 F1 F2 F3 F2",
    ]
    assert [title[:3] for title in titles if title.startswith("(")] == ["(a)", "(b)", "(c)"]
    assert "0.7" in titles[2]


@pytest.mark.long
def test_what_is_not_periodic_is_grey_and_named(settled) -> None:
    restless = simulate(Parameters(alpha=1.2, gamma=3.0), periods=3)
    motions = [settled(0.7), restless, settled(1.9)]
    behind = plot_fig6(motions)
    grey = {line.get_data_3d()[1][0] for line in behind.axes[0].lines if line.get_color() == "0.6"}
    assert grey == {1.2}
    named = behind.legends[0].get_texts()[-1].get_text()
    assert named == "not settled: last periods of the run"
    pages = plot_fig7(motions)
    assert [one.get_text() for one in pages.legends[0].get_texts()].count(named) == 1
    assert [axes.get_title(loc="left") for axes in pages.axes].count("not settled") == 1


def test_events_move_to_their_exact_values(branch) -> None:
    for event, (moved, one) in zip(
        (*CROSSINGS, *SLIDINGS), exact((*CROSSINGS, *SLIDINGS), branch.bifurcations), strict=True
    ):
        assert one is not None
        assert moved.middle == one.value == pytest.approx(event.middle, rel=0.01)
        assert moved.middle in moved.alphas
        assert np.array(moved.alphas) - moved.middle == pytest.approx(
            np.array(event.alphas) - event.middle, abs=1e-12
        )
    absent = exact(CROSSINGS, [])
    assert absent == [(event, None) for event in CROSSINGS]


def test_an_exact_orbit_meets_its_line(branch) -> None:
    for event, one in exact((*CROSSINGS, *SLIDINGS), branch.bifurcations):
        orbit = one.orbit
        p = orbit.parameters
        assert p.alpha == one.value
        x_r, v_r, v_c = nearest(cycle(orbit), event, p)
        force = x_r + 2 * p.zeta * v_r
        miss = {
            "L2": force + p.f_b,
            "L3": force + p.beta * (x_r - p.delta) - p.f_b,
            "L6": x_r - p.delta,
            "L7": x_r - p.delta,
        }[event.line]
        assert abs(v_c) < 1e-4
        assert abs(miss) < 1e-3
        if event.line in ("L6", "L7"):
            assert (v_r > 0) == (event.line == "L6")


@pytest.mark.long
def test_fig8_draws_below_at_and_above_in_three_styles(settled) -> None:
    groups = [[settled(alpha) for alpha in event.alphas] for event in CROSSINGS]
    axes = plot_events(CROSSINGS, groups).axes
    assert len(axes) == 4
    for row, group in zip((axes[0:2], axes[2:4]), groups, strict=True):
        plot_itineraries = [len(cycle(run)) for run in group]
        for view in row:
            arcs = [line for line in view.lines if line.get_label().startswith("F")]
            assert len(arcs) == sum(plot_itineraries)
            styles = [line._unscaled_dash_pattern for line in arcs]
            assert [len({str(style) for style in styles})] == [3]
    box, close = axes[0], axes[1]
    wide, narrow = (view.get_xlim3d() for view in (box, close))
    assert narrow[1] - narrow[0] == pytest.approx(0.22 * (wide[1] - wide[0]))
