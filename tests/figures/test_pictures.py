"""Files of pictures: their size and resolution, and their metadata."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from PIL import Image

from capsule_sym import InvalidInput, Parameters, figures
from capsule_sym._figures.notebook import new_figure
from capsule_sym._figures.style import describe
from tests.figures.test_command import run_here


@pytest.mark.long
def test_a_picture_tells_its_parameters(tmp_path: Path, settled) -> None:
    run = settled(1.2)
    drawn = figures.plot_motion(run)
    for ending in ("png", "svg", "pdf"):
        figures.save_figure(drawn, tmp_path / f"x.{ending}", dpi=50)
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.text["Title"] == "Displacements and phase portrait"
        assert picture.text["Software"].startswith("capsule-sym ")
        kept = json.loads(picture.text["Description"])
    assert Parameters(**kept["parameters"]) == run.parameters
    svg = (tmp_path / "x.svg").read_text(encoding="utf-8")
    assert "<dc:title>Displacements and phase portrait</dc:title>" in svg
    assert '"alpha": 1.2' in svg
    assert rb"/Subject ({" in (tmp_path / "x.pdf").read_bytes()


@pytest.mark.long
def test_resolution_and_width_decide_the_size(tmp_path: Path, settled) -> None:
    figures.save_figure(figures.plot_motion(settled(1.2), width=5.0), tmp_path / "x.png", dpi=60)
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.width == 300
    for dpi, allowed in (
        (29.0, "in [30, 2400]"),
        (2401.0, "in [30, 2400]"),
        (math.nan, "a number"),
    ):
        with pytest.raises(InvalidInput, match=re.escape(f"dpi = {dpi}: must be {allowed}")):
            figures.save_figure(Figure(), tmp_path / "y.png", dpi=dpi)


def test_a_figure_is_drawn_into_axes_of_the_users_own(settled) -> None:
    figure = Figure()
    grid = figure.subplots(2, 3)
    assert figures.plot_motion(settled(1.2), axes=grid[0, :2]) is figure
    assert all(axes.lines for axes in grid[0, :2])
    assert figure.legends == []
    part = Figure().subfigures(1, 2)[0]
    assert figures.plot_motion(settled(1.2), axes=part.subplots(1, 2)) is part.figure


def test_what_is_described_twice_is_kept_once(tmp_path: Path) -> None:
    figure = new_figure(1, 1)
    describe(describe(figure, "one", a=1), "two", b=2)
    figures.save_figure(figure, tmp_path / "x.png")
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.text["Title"] == "two"
        assert json.loads(picture.text["Description"]) == {"a": 1, "b": 2}


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (". --width 2", "'--width': 2.0 is not in the range 3.3<=x<=20"),
        (". --dpi 5", "dpi = 5.0: must be in [30, 2400]"),
        (". --scene nowhere", "--scene"),
    ],
)
def test_what_no_picture_can_have_is_refused(tmp_path: Path, arguments: str, part: str) -> None:
    done = run_here("figure", *arguments.split(), "--out", "x.png", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"error: .*\n", done.stderr)
    assert part in done.stderr
    assert list(tmp_path.iterdir()) == []
