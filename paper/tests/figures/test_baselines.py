"""Pictures against those of before, with a tolerance that a wrong colour exceeds.

To make them again after a change that is meant: python -m paper.tests.figures.test_baselines
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from matplotlib.testing.compare import compare_images

from capsule_sym import Parameters, figure_style, plot_fig2, plot_motion, simulate

BASELINES = Path(__file__).parent / "baselines"
_TOLERANCE = 6.0  # root mean square of pixel values: room for another version of FreeType
_RESOLUTION = 60  # dots per inch


def _motion(colours: Any) -> Any:
    return plot_motion(simulate(Parameters(alpha=1.2, gamma=3.0), periods=64), colours=colours)


PICTURES: dict[str, Callable[[Any], Any]] = {
    "fig2": lambda colours: plot_fig2(colours=colours),
    "motion": _motion,
}


def draw(name: str, path: Path, colours: str = "safe") -> None:
    with figure_style():
        PICTURES[name](colours).savefig(path, dpi=_RESOLUTION)


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_the_one_of_before(name: str, tmp_path: Path) -> None:
    draw(name, tmp_path / f"{name}.png")
    baseline = BASELINES / f"{name}.png"
    assert compare_images(baseline, tmp_path / f"{name}.png", _TOLERANCE) is None


def test_another_motion_is_another_picture(tmp_path: Path) -> None:
    drawn = tmp_path / "motion.png"
    with figure_style():
        other = simulate(Parameters(alpha=1.3, gamma=3.0), periods=64)
        plot_motion(other).savefig(drawn, dpi=_RESOLUTION)
    assert compare_images(BASELINES / "motion.png", drawn, _TOLERANCE) is not None


def test_other_colours_are_another_picture(tmp_path: Path) -> None:
    draw("fig2", tmp_path / "fig2.png", "paper")
    assert compare_images(BASELINES / "fig2.png", tmp_path / "fig2.png", _TOLERANCE) is not None


if __name__ == "__main__":
    BASELINES.mkdir(exist_ok=True)
    for picture in PICTURES:
        draw(picture, BASELINES / f"{picture}.png")
