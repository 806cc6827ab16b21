"""Surfaces and lines as drawn, against the inequalities of Eqs. (13) and (14)."""

from __future__ import annotations

import math
import pathlib

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.path import Path

from capsule_sym import Parameters
from capsule_sym._figures.arcs import cycle
from capsule_sym._figures.boundaries import corners, lines
from paper.figures.labels import Names
from paper.figures.space import Box, add_space, box_of, draw_arcs, draw_space, surfaces, walls
from paper.figures.statespace import GAPS, plot_fig2, top_view
from tests.figures.baselines import as_before

X, V = (-2.6, 4.2), (-8.5, 5.0)
SETS = {
    **{f"δ = {delta}": Parameters(delta=delta, zeta=0.3, beta=0.6) for delta in GAPS},
    "case study": Parameters(),
    "no damping": Parameters(zeta=0.0, delta=0.4),
    "no second spring": Parameters(beta=0.0, zeta=0.2),
}


def surface_of(p: Parameters, x_r: float, v_r: float) -> str:
    """The surface of a point of P1 = 0, from Eq. (13)."""
    force = x_r + 2 * p.zeta * v_r + (p.beta * (x_r - p.delta) if x_r > p.delta else 0.0)
    level = 0 if force > p.f_b else (2 if force < -p.f_b else 1)
    return f"S{level + (4 if x_r > p.delta else 1)}"


@pytest.mark.parametrize("p", SETS.values(), ids=SETS)
def test_surfaces_fill_the_plane_and_hold_what_they_should(p: Parameters) -> None:
    found = {name: Path(polygon) for name, polygon in surfaces(p, X, V).items()}
    rng = np.random.default_rng(1)
    for x_r, v_r in rng.uniform((X[0], V[0]), (X[1], V[1]), (2000, 2)):
        holding = [name for name, path in found.items() if path.contains_point((x_r, v_r))]
        assert holding == [surface_of(p, x_r, v_r)]


@pytest.mark.parametrize("p", SETS.values(), ids=SETS)
def test_lines_lie_where_their_definitions_say(p: Parameters) -> None:
    found = lines(p, X, V)
    upper, lower = corners(p)
    for name, ends in found.items():
        for x_r, v_r in ends:
            assert X[0] - 1e-9 <= x_r <= X[1] + 1e-9
            assert V[0] - 1e-9 <= v_r <= V[1] + 1e-9
            force = x_r + 2 * p.zeta * v_r
            if name in ("L1", "L2"):
                assert force == pytest.approx({"L1": p.f_b, "L2": -p.f_b}[name])
                assert x_r <= p.delta + 1e-9
            elif name in ("L3", "L4"):
                pressed = force + p.beta * (x_r - p.delta)
                assert pressed == pytest.approx({"L3": p.f_b, "L4": -p.f_b}[name])
                assert x_r >= p.delta - 1e-9
            else:
                assert x_r == p.delta
        if name in ("L5", "L6", "L7", "L8", "L10"):
            middle = float(ends[:, 1].mean())
            expected = {
                "L5": middle > max(upper, 0.0),
                "L6": 0 < middle <= upper,
                "L10": upper < middle < 0,
                "L7": lower <= middle < min(upper, 0.0),
                "L8": middle < lower,
            }
            assert expected[name], name
    assert ("L6" in found) == (p.delta < p.f_b)
    assert ("L10" in found) == (p.delta > p.f_b)


def test_lines_are_edges_of_surfaces() -> None:
    p = SETS["δ = 0.4"]
    edges = {"L1": ("S1", "S2"), "L2": ("S2", "S3"), "L3": ("S4", "S5"), "L4": ("S5", "S6")}
    drawn, polygons = lines(p, X, V), surfaces(p, X, V)
    for name, pair in edges.items():
        for end in drawn[name]:
            for surface in pair:
                assert np.abs(polygons[surface] - end).sum(axis=1).min() < 1e-9


def test_corners_are_those_of_section_3_1() -> None:
    p = Parameters(delta=0.4, zeta=0.3)
    assert corners(p) == (pytest.approx(1.0), pytest.approx(-1.4 / 0.6))
    assert corners(Parameters(zeta=0.0)) == (math.inf, -math.inf)
    assert corners(Parameters(zeta=0.0, delta=2.0)) == (-math.inf, -math.inf)


def test_a_rectangle_off_the_lines_holds_one_surface() -> None:
    assert set(surfaces(Parameters(), (-0.2, 0.0), (-0.1, 0.1))) == {"S2"}
    assert lines(Parameters(), (-0.2, 0.0), (-0.1, 0.1)) == {}


def test_top_view_draws_corners_and_lines_by_name() -> None:
    figure = Figure()
    axes, names = figure.subplots(), Names(figure)
    top_view(Parameters(delta=1.6, zeta=0.3, beta=0.6), axes, X, V, names)
    names.settle()
    named = {line.get_label(): line for line in axes.lines}
    assert {"L1", "L2", "L3", "L4", "L5", "L7", "L8", "L10", "O1", "O2"} <= set(named)
    assert "L6" not in named
    assert named["O1"].get_data() == ([1.6], [pytest.approx(-1.0)])
    shown = {text.get_text() for text in axes.texts}
    assert {"$S_{1}$", "$L_{10}$", "$O_{1}$"} <= shown


@pytest.mark.long
def test_fig2_names_everything_once_in_space(tmp_path: pathlib.Path) -> None:
    figure = plot_fig2()
    baseline = pathlib.Path(__file__).parent / "baselines" / "fig2.png"
    assert as_before(figure, baseline, tmp_path)
    space, *views = figure.axes
    shown = [text.get_text() for text in space.texts]
    expected = [f"$S_{{{i}}}$" for i in range(1, 11)] + [f"$L_{{{i}}}$" for i in range(1, 9)]
    assert sorted(shown) == sorted(
        [*expected, "$L_{9}$", "$L_{9}$", *(rf"$\Omega_{i}$" for i in (1, 3, 4, 6))]
    )
    assert [axes.get_title(loc="left")[:3] for axes in views] == ["(b)", "(c)", "(d)"]


def test_walls_are_the_quarters_of_the_impact_plane() -> None:
    found = walls(0.5, Box((-1, 1), (-2, 3), (-4, 5)))
    assert set(found) == {"S7", "S8", "S9", "S10"}
    for name, wall in found.items():
        assert set(wall[:, 0]) == {0.5}
        assert (wall[:, 1].mean() > 0) == (name in ("S7", "S9"))
        assert (wall[:, 2].mean() > 0) == (name in ("S7", "S8"))
    assert walls(0.5, Box((-1, 0), (-2, 3), (-4, 5))) == {}
    assert set(walls(0.5, Box((-1, 1), (1, 3), (0, 5)))) == {"S7"}


@pytest.mark.parametrize(("azimuth", "nearest"), [(-60, 4), (-120, 1)])
def test_the_nearest_cell_is_drawn_last(settled, azimuth: float, nearest: int) -> None:
    drawn = cycle(settled(1.2))
    figure, box = Figure(), box_of(drawn)
    axes = add_space(figure, 111, box, eye=(20, azimuth))
    draw_space(settled(1.2).parameters, axes, box)
    draw_arcs(drawn, axes)
    levels = {line.get_label(): line.get_zorder() for line in axes.lines}
    levels |= {patch.get_label(): patch.get_zorder() for patch in axes.collections}
    assert max(levels, key=levels.__getitem__) == f"F{nearest}"
    far = 3 if nearest == 4 else 6
    assert levels.get(f"F{far}", 0) < levels["S2"] < levels["F2"] < levels["S8"]


def test_a_box_holds_its_arcs(settled) -> None:
    drawn = cycle(settled(1.9))
    box = box_of(drawn)
    for arc in drawn:
        for values, (low, high) in zip(arc.states, box, strict=True):
            assert low < values.min() <= values.max() < high
    small = box.around((0.1, 0.2, 0.3), 0.5)
    for (low, high), (a, b), middle in zip(box, small, (0.1, 0.2, 0.3), strict=True):
        assert b - a == pytest.approx(0.5 * (high - low))
        assert (a + b) / 2 == pytest.approx(middle)
