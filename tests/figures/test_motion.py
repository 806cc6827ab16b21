"""Displacements, phase portraits and guards: curves, colours by segment, boundary lines."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from capsule_sym import InvalidInput, Parameters, simulate, solve_orbit
from capsule_sym._figures.arcs import arcs, cycle, opening
from capsule_sym.figures import plot_displacements, plot_motion, plot_phase_portrait
from tests.figures import SAFE, integrated
from tests.figures.baselines import as_before


def axes_of() -> Axes:
    return Figure().subplots()


def curves(axes: Axes) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Colour, x and y of every curve but boundary lines, which have names L1 to L10."""
    return [
        (to_hex(line.get_color()), *map(np.asarray, line.get_data()))
        for line in axes.lines
        if not line.get_label().startswith("L")
    ]


@pytest.mark.parametrize("alpha", [0.45, 1.2, 1.5, 1.9])
def test_arcs_are_what_their_fields_do(settled, alpha: float) -> None:
    run = settled(alpha)
    period = run.parameters.period
    drawn = cycle(run)
    assert sum(arc.time[-1] - arc.time[0] for arc in drawn) == pytest.approx(1.0, abs=1e-12)
    for arc in drawn:
        start = [values[0] for values in (*arc.states, arc.x_c)]
        expected = integrated(run.parameters, arc.field, arc.time * period, start)
        assert np.stack([*arc.states, arc.x_c]) == pytest.approx(expected, abs=1e-8)
        assert len(arc.time) >= 240 * (arc.time[-1] - arc.time[0])
    for before, after in pairwise(drawn):
        assert before.states[0][-1] == pytest.approx(after.states[0][0], abs=1e-12)


def test_portrait_draws_each_segment_in_its_colour(settled) -> None:
    run, axes = settled(1.5), axes_of()
    plot_phase_portrait(run, axes)
    steady = run.steady()
    assert steady is not None
    drawn = curves(axes)
    itinerary = [to_hex(SAFE[segment.field - 1]) for segment in steady.segments]
    # A period begins at phase 0, inside a segment: that one is drawn in two pieces.
    colour = [one for one, _, _ in drawn]
    assert colour[0] == colour[-1]
    assert colour[:-1] in [itinerary[i:] + itinerary[:i] for i in range(len(itinerary))]
    for segment in steady.segments:
        ends = [(x[0], y[0]) for _, x, y in drawn]
        distance = np.hypot(*(np.array(ends) - segment.start_state[:2]).T)
        assert distance.min() < 1e-9


def test_displacements_are_dashed_for_the_mass_and_solid_for_the_capsule(settled) -> None:
    run, axes = settled(1.2), axes_of()
    plot_displacements(run, axes, periods=3)
    period, steady = run.parameters.period, run.steady()
    dashed = [line for line in axes.lines if line.is_dashed()]
    solid = [line for line in axes.lines if not line.is_dashed()]
    time, mass, capsule = (
        np.concatenate(parts)
        for parts in (
            [line.get_xdata() for line in solid],
            [line.get_ydata() for line in dashed],
            [line.get_ydata() for line in solid],
        )
    )
    assert (time[0], time[-1]) == (0.0, pytest.approx(3.0))
    assert capsule[0] == 0
    assert capsule[-1] == pytest.approx(3 * steady.progression, rel=1e-9)
    begin = (run.final[0].period - 3) * period
    inside = (time > 0) & (time < 3)
    x_r = run(begin + time[inside] * period)[:, 0]
    assert (mass - capsule)[inside] == pytest.approx(x_r, abs=1e-9)


def test_boundary_lines_are_those_of_the_caption(settled) -> None:
    run, axes = settled(1.9), axes_of()
    plot_phase_portrait(run, axes)
    p = run.parameters
    named = {line.get_label(): line for line in axes.lines if line.get_label().startswith("L")}
    assert set(named) == {"L2", "L3", "L6", "L7"}
    x, v = named["L2"].get_data()
    assert x + 2 * p.zeta * v == pytest.approx([-p.f_b] * 2)
    x, v = named["L3"].get_data()
    assert x + 2 * p.zeta * v + p.beta * (x - p.delta) == pytest.approx([p.f_b] * 2)
    for name, sign in (("L6", 1), ("L7", -1)):
        x, v = named[name].get_data()
        assert list(x) == [p.delta] * 2
        assert max(sign * v) > 0 >= min(sign * v)
    assert named["L2"].is_dashed()
    assert named["L3"].is_dashed()
    assert to_hex(named["L2"].get_color()) == "#707070"
    assert to_hex(named["L6"].get_color()) == "#000000"


def test_an_orbit_is_drawn_as_its_motion_is(settled) -> None:
    run = settled(1.2)
    orbit = solve_orbit(run.parameters)
    left, right = axes_of(), axes_of()
    plot_phase_portrait(run, left)
    plot_phase_portrait(orbit, right)
    assert left.get_xlim() == pytest.approx(right.get_xlim(), abs=1e-4)
    assert left.get_ylim() == pytest.approx(right.get_ylim(), abs=1e-3)
    assert {colour for colour, _, _ in curves(left)} == {colour for colour, _, _ in curves(right)}


@pytest.mark.parametrize(("alpha", "zeta"), [(1.2, 0.05), (0.4, 0.01)])
def test_time_begins_at_phase_0_of_the_forcing(alpha: float, zeta: float) -> None:
    """On an orbit, whose segments begin at a switch, and on a run from a later phase."""
    orbit = solve_orbit(Parameters(alpha=alpha, zeta=zeta))
    period, turns = orbit.parameters.period, orbit.itinerary.period_number
    begin, _ = orbit.trajectory().span
    assert begin > 0.1 * period
    run = simulate(orbit.parameters, orbit.trajectory()(period), periods=turns)
    late = simulate(orbit.parameters, (0.0, 1.0, 0.5), phase=1.0, periods=2)
    for drawn, exact, first in ((orbit, run, 0.0), (late, late, 1.0 / period)):
        axes = axes_of()
        plot_displacements(drawn, axes, periods=2)
        mass, capsule = axes.lines[::2], axes.lines[1::2]
        time, x_m, x_c = (
            np.concatenate(parts)
            for parts in (
                [line.get_xdata() for line in capsule],
                [line.get_ydata() for line in mass],
                [line.get_ydata() for line in capsule],
            )
        )
        assert (axes.get_xlim()[0], time[0]) == (0.0, pytest.approx(first, abs=1e-12))
        at = np.clip(time, first, exact.span[1] / period) * period
        assert x_m - x_c == pytest.approx(exact(at)[:, 0], abs=1e-9)


def test_opening_is_the_first_part_of_a_run() -> None:
    run = simulate(Parameters(alpha=1.2), (0.0, 1.0, 0.5), phase=1.0, periods=2)
    drawn = opening(run, 0.7)
    assert drawn[0].time[0] * run.parameters.period == pytest.approx(1.0)
    assert drawn[-1].time[-1] * run.parameters.period == pytest.approx(1.7)


@pytest.mark.parametrize("periods", [0, 129])
def test_more_periods_than_were_run_are_refused(settled, periods: int) -> None:
    with pytest.raises(InvalidInput, match=r"periods = \d+: must be from 1 to the run's 128"):
        arcs(settled(1.2), periods)


def test_a_run_that_has_not_settled_is_drawn_as_it_ends_and_named() -> None:
    run = simulate(Parameters(alpha=1.2), periods=3)
    assert cycle(run)[0].time[0] == pytest.approx(0, abs=1e-12)
    assert cycle(run)[-1].time[-1] == pytest.approx(3)
    named = "not settled: last periods of the run"
    (key,) = plot_motion(run, periods=2).legends
    assert [one.get_text() for one in key.get_texts()].count(named) == 1
    other = simulate(Parameters(alpha=0.7, gamma=3.0), periods=128)
    assert named not in [one.get_text() for one in plot_motion(other).legends[0].get_texts()]


@pytest.mark.long
def test_a_picture_is_the_one_of_before_unless_the_motion_differs(settled, tmp_path: Path) -> None:
    baseline = Path(__file__).parent / "baselines" / "motion.png"
    for alpha, same in ((1.2, True), (1.3, False)):
        drawn = plot_motion(settled(alpha, periods=64))
        assert as_before(drawn, baseline, tmp_path) == same
