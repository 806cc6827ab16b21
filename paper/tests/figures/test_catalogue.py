"""The figures by name: their texts, their places in a part of a figure, and the command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from capsule_sym import simulate
from capsule_sym._cli import _status
from paper.__main__ import group
from paper.figures.capsule import plot_fig1
from paper.figures.catalogue import FIGURES
from paper.figures.events import plot_events
from paper.figures.motions import plot_fig6, plot_fig7
from paper.figures.statespace import plot_fig2
from paper.figures.switching import plot_switching
from paper.study.events import CROSSINGS
from paper.study.motions import Study
from paper.study.sections import SCHEMATIC, sections
from paper.tests.figures import studies, study
from tests.figures import DEVICE, untracked
from tests.figures.layout import problems
from tests.figures.test_layout import COLUMN, PAGE, looked_at
from tests.figures.test_parts import check_part
from tests.sampling import sampled, some

OWN = [*FIGURES]


def bundles(shown: Any) -> Any:
    return [[simulate(SCHEMATIC, (0.0, 1.0, 0.5), periods=1)] for _ in shown]


FIG3, FIG4, FIG5 = sections(SCHEMATIC)
COMPOSED: dict[str, Any] = {
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
}
_REFUSED = (
    "error: --scene = 'slope': must be capsule, for a figure of the paper; of any scene are mot"
)
QUICK = {"fig1", "fig3", "fig6"}  # the others take more time to draw, or are drawn as these


@sampled
@pytest.mark.parametrize("layout", some([None, "constrained"], 1))
@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[] if one in QUICK else [pytest.mark.long]) for one in COMPOSED],
)
def test_a_part_of_a_figure_holds_what_the_figure_alone_holds(name, layout, settled) -> None:
    function, given = COMPOSED[name]
    check_part(function, given(settled), layout)


def test_a_whole_figure_can_be_given_as_well(settled) -> None:
    figure = Figure(figsize=(7, 4))
    assert plot_fig7([settled(0.7)], figure=figure) is figure
    assert len(figure.axes) == 4


def test_a_key_in_a_sliver_of_a_page_is_wrapped(settled) -> None:
    page = Figure(figsize=(5, 3))
    left, _ = page.subfigures(1, 2, width_ratios=(1, 20))
    assert plot_fig7([settled(0.7)], figure=left) is page


@pytest.mark.parametrize(("name", "width", "of"), studies(OWN, [("fig1", COLUMN), ("fig1", PAGE)]))
def test_every_text_of_a_figure_can_be_read(name, width, of) -> None:
    assert looked_at(FIGURES[name].drawn(study(width, of))) == []


@pytest.mark.long
def test_another_figure_of_a_device_says_that_it_is_dimensionless() -> None:
    study = Study(untracked, DEVICE.dimensionless(), chosen=True, device=DEVICE)
    figure = FIGURES["fig3"].drawn(study)
    words = [text.get_text() for key in figure.legends for text in key.get_texts()]
    assert "quantities without a unit are dimensionless" in words
    assert len({text.get_fontsize() for key in figure.legends for text in key.get_texts()}) == 1
    assert problems(figure) == []
    plain = FIGURES["fig3"].drawn(Study(untracked, DEVICE.dimensionless(), chosen=True))
    assert len(plain.legends) == 1


@pytest.mark.parametrize(
    ("line", "told"),
    [
        *((f"{one} --scene slope", _REFUSED) for one in ("fig1", "fig7", "fig9-exact", "chart")),
        ("fig2 --zeta 0", "error: --zeta = 0.0: must be above 0"),
        ("fig99", "error: Invalid value for 'NAME': 'fig99' is not one of 'fig1', 'fig2'"),
    ],
)
def test_bad_input_is_one_line_and_status_2(line: str, told: str, here: Path, capsys) -> None:
    assert _status(["figure", *line.split(), "--out", "a.svg"], group) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert output.err.startswith(told)
    assert not list(here.iterdir())


def test_the_command_writes_a_figure(here: Path, capsys) -> None:
    assert _status(["figure", "fig1", "--out", "a.svg", "--json"], group) == 0
    size = (here / "a.svg").stat().st_size
    told = {"figure": "fig1", "files": [{"path": "a.svg", "bytes": size}]}
    assert json.loads(capsys.readouterr().out) == told
