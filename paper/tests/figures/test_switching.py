"""Sections across surfaces and lines: who comes from where and goes where."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from capsule_sym import InvalidInput, simulate
from capsule_sym._figures.style import mathematical
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._orbits.shooting.stability import field as rates
from paper.figures.switching import draw_section, plot_switching
from paper.study import sections
from paper.study.data import bundle
from paper.study.sections import SCHEMATIC, Section, line_point
from tests.figures import SAFE
from tests.judges.dop853 import derivative

FIELDS = {to_hex(colour): field for field, colour in enumerate(SAFE, start=1)}
FIG3, FIG4, FIG5 = sections.sections(SCHEMATIC)
SECTIONS = {section.name: section for section in (*FIG3, *FIG4, *FIG5)}


@pytest.fixture(scope="module")
def curves() -> dict[str, list[tuple[int, np.ndarray, np.ndarray]]]:
    """The curves of every section by its name, of fewer trajectories than the figures show."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sections, "_ON_EDGE", 5)
        return {name: drawn(section) for name, section in SECTIONS.items()}


def drawn(section: Section) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Field, abscissae and ordinates of every curve of a section."""
    axes = Figure().subplots()
    draw_section(section, bundle(section, SCHEMATIC), axes)
    assert axes.get_xlim() == (-section.across, section.across)
    return [
        (FIELDS[to_hex(line.get_color())], *map(np.asarray, line.get_data()))
        for line in axes.lines
        if line.get_label().startswith("F")
    ]


@pytest.mark.parametrize("section", SECTIONS.values(), ids=SECTIONS)
def test_curves_are_in_the_region_of_their_field(section: Section, curves) -> None:
    p = SCHEMATIC
    assert len(curves[section.name]) >= 10
    for field, x, v_c in curves[section.name]:
        drift = {1: 1, 2: 0, 3: -1, 4: 1, 5: 0, 6: -1}[field]
        assert np.all(drift * v_c >= -1e-12) if drift else np.all(v_c == 0)
        if section.piece in ("L5", "L6", "L7", "L8", "S7"):
            assert np.all(x >= -1e-9) if field >= 4 else np.all(x <= 1e-9)
        if section.piece in ("L1", "L2", "L3", "L4") and not drift:
            # Stick is on the side where the force is below the bound.
            below = -1 if section.piece in ("L1", "L3") else 1
            assert np.all(below * x >= -1e-9)
            assert np.all(below * x <= 2 * p.f_b)


# Stick is beside L6 and L7 and not beside L5 and L8; S1 and S7 are crossed, S5 is stuck to.
@pytest.mark.parametrize(
    ("piece", "fields"),
    [
        *[("S1", {1, 3}), ("S5", {4, 5, 6}), ("S7", {1, 4})],
        *[("L1", {1, 2, 3}), ("L2", {1, 2, 3}), ("L3", {4, 5, 6}), ("L4", {4, 5, 6})],
        *[("L5", {1, 3, 4, 6}), ("L6", {1, 2, 3, 4, 5, 6})],
        *[("L7", {1, 2, 3, 4, 5, 6}), ("L8", {1, 3, 4, 6})],
    ],
)
def test_fields_around_a_piece_are_those_that_meet_there(piece, fields, curves) -> None:
    for name, section in SECTIONS.items():
        if section.piece == piece:
            assert {field for field, _, _ in curves[name]} == fields


def test_line_points_are_on_their_lines() -> None:
    p = SCHEMATIC
    for name, bound in (("L1", 1), ("L2", -1)):
        x_r, v_r, v_c = line_point(p, name, 0.7)
        assert x_r + 2 * p.zeta * v_r == pytest.approx(bound * p.f_b)
        assert v_c == 0
    for name, bound in (("L3", 1), ("L4", -1)):
        x_r, v_r, _ = line_point(p, name, 0.7)
        force = x_r + 2 * p.zeta * v_r + p.beta * (x_r - p.delta)
        assert force == pytest.approx(bound * p.f_b)
    assert line_point(p, "L7", -1.0) == (p.delta, -1.0, 0.0)


@pytest.mark.parametrize("field", range(1, 7))
@pytest.mark.parametrize("cosine", [1.0, -1.0])
def test_arrows_are_the_fields(field: int, cosine: float) -> None:
    time = 0.0 if cosine > 0 else np.pi / SCHEMATIC.omega
    expected = derivative(SCHEMATIC, field, time, np.array([0.3, -0.4, 0.0, 0.0]))[:3]
    constants = NumpyBackend().constants(field, SCHEMATIC)
    assert rates(constants, (0.3, -0.4, 0.0), cosine) == pytest.approx(expected)


@pytest.mark.parametrize(("which", "shown"), [(3, FIG3), (4, FIG4), (5, FIG5)])
def test_figures_have_a_panel_for_each_section(which: int, shown) -> None:
    # One trajectory for each section, since the bundles are tested above.
    start = (0.0, 1.0, 0.5)
    axes = plot_switching(which, [[simulate(SCHEMATIC, start, periods=1)] for _ in shown]).axes
    titles = [one.get_title(loc="left") for one in axes]
    expected = [mathematical(section.name) for section in shown]
    assert [title.split("  ")[1] for title in titles][-len(shown) :] == expected
    assert len(axes) == len(shown) + (which != 3)


def test_another_figure_is_refused() -> None:
    with pytest.raises(InvalidInput, match="which = 2: must be 3, 4 or 5"):
        plot_switching(2, [])
