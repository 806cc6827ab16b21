"""Files of pictures: their size and resolution, their metadata, and animations."""

from __future__ import annotations

import json
import re
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from matplotlib.figure import Figure
from PIL import Image

from capsule_sym import InvalidInput, Parameters, animate, plot_margins, plot_motion, save_figure
from capsule_sym._figures import device, sweeps
from capsule_sym._figures.notebook import new_figure
from capsule_sym._figures.style import describe
from tests.figures.test_command import run_here


@pytest.mark.long
def test_a_picture_tells_its_parameters(tmp_path: Path, settled) -> None:
    run = settled(1.2)
    drawn = plot_motion(run)
    for ending in ("png", "svg", "pdf"):
        save_figure(drawn, tmp_path / f"x.{ending}", dpi=50)
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
    save_figure(plot_motion(settled(1.2), width=5.0), tmp_path / "x.png", dpi=60)
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.width == 300
    for dpi in (29.0, 2401.0, float("nan")):
        with pytest.raises(InvalidInput, match=r"dpi = .*: must be in \[30, 2400\]"):
            save_figure(Figure(), tmp_path / "y.png", dpi=dpi)


def test_a_figure_is_drawn_into_axes_of_the_users_own(settled) -> None:
    figure = Figure()
    grid = figure.subplots(2, 3)
    assert plot_motion(settled(1.2), axes=grid[0, :2]) is figure
    assert plot_margins(settled(1.2), axes=[grid[0, 2], *grid[1]]) is figure
    assert all(axes.lines or axes.collections for axes in grid.flat)
    assert figure.legends == []
    part = Figure().subfigures(1, 2)[0]
    assert plot_motion(settled(1.2), axes=part.subplots(1, 2)) is part.figure


def test_what_is_described_twice_is_kept_once(tmp_path: Path) -> None:
    figure = new_figure(1, 1)
    describe(describe(figure, "one", a=1), "two", b=2)
    save_figure(figure, tmp_path / "x.png")
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.text["Title"] == "two"
        assert json.loads(picture.text["Description"]) == {"a": 1, "b": 2}


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ("margins --width 2", "'--width': 2.0 is not in the range 3.3<=x<=20"),
        ("margins --dpi 5", "dpi = 5.0: must be in [30, 2400]"),
        ("motion --params nowhere.toml", "--params"),
    ],
)
def test_what_no_picture_can_have_is_refused(tmp_path: Path, arguments: str, part: str) -> None:
    done = run_here("figure", *arguments.split(), "--out", "x.png", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"error: .*\n", done.stderr)
    assert part in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_an_animation_shows_one_period(tmp_path: Path, settled, monkeypatch) -> None:
    monkeypatch.setattr(device, "_PER_SECOND", 3)
    animate(settled(1.2), tmp_path / "x.gif", width=4.0, dpi=40)
    with Image.open(tmp_path / "x.gif") as picture:
        assert picture.n_frames == 12
        frames = []
        for index in range(picture.n_frames):
            picture.seek(index)
            frames.append(np.asarray(picture.convert("RGB"), dtype=float))
    # The capsule is on the left, its state on the right: both move.
    middle = frames[0].shape[1] * 6 // 10
    for one, other in pairwise(frames):
        assert abs(one[:, :middle] - other[:, :middle]).max() > 50
        assert abs(one[:, middle:] - other[:, middle:]).max() > 50


@pytest.mark.long
@pytest.mark.skipif(not FFMpegWriter.isAvailable(), reason="ffmpeg is not installed")
def test_an_mp4_shows_the_same_period(tmp_path: Path, settled, monkeypatch) -> None:
    monkeypatch.setattr(device, "_PER_SECOND", 3)
    animate(settled(1.2), tmp_path / "x.mp4", width=4.0, dpi=50)
    shape = (-1, 92, 200, 3)
    read = ["ffmpeg", "-v", "error", "-i", str(tmp_path / "x.mp4")]
    read += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(read, stdout=subprocess.PIPE, check=True)
    frames = np.frombuffer(done.stdout, np.uint8).reshape(shape).astype(float)
    assert len(frames) == 12
    for one, other in pairwise(frames):
        assert abs(one[:, :120] - other[:, :120]).max() > 50
        assert abs(one[:, 120:] - other[:, 120:]).max() > 50


def test_an_animation_needs_a_format_that_can_be_written(tmp_path: Path, settled) -> None:
    with pytest.raises(InvalidInput, match=r"ends in \.gif, \.mp4"):
        animate(settled(1.2), tmp_path / "x.avi")
    if not FFMpegWriter.isAvailable():
        with pytest.raises(InvalidInput, match="ffmpeg is not installed"):
            animate(settled(1.2), tmp_path / "x.mp4")


def test_the_front_holds_what_nothing_beats() -> None:
    generator = np.random.default_rng(5)
    speed, cost = generator.integers(0, 12, (2, 200)).astype(float)
    front = sweeps.non_dominated(speed, cost)

    def beaten(k: int) -> bool:
        as_good = (speed >= speed[k]) & (cost <= cost[k])
        return bool(np.any(as_good & ((speed > speed[k]) | (cost < cost[k]))))

    every = {(speed[k], cost[k]) for k in range(200) if not beaten(k)}
    assert {(speed[k], cost[k]) for k in front} == every
    assert list(cost[front]) == sorted(cost[front])
