"""The work-precision plot: a curve a tool and way, hollow where switches are wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from benchmarks.speed.precision import plot_work_precision


def row(
    tool: str, setting: str, time: float, error: float | None, missed: int = 0, invented: int = 0
) -> dict[str, Any]:
    return {
        "tool": tool,
        "setting": setting,
        "us_per_period": time,
        "max_error": error,
        "missed": missed,
        "invented": invented,
    }


RECORD = {
    "trajectory": [
        row("ours", "double", 0.7, 0.0),
        row("theirs", "1e-12, careful", 50.0, 1e-12),
        row("theirs", "1e-6, careful", 5.0, 1e-6, missed=2),
        row("theirs", "1e-9, careful", 9.0, 1e-9, invented=1),
        row("theirs", "1e-9, naive", 8.0, 30.0, missed=5),
        row("stuck", "1e-9", 9.0, None, missed=1),
    ],
    "tangencies": [row("ours", "double", 0.9, 1e-15)],
    "sweep": [],
    "ratios": [],
}


def test_tools_are_curves_and_wrong_settings_are_hollow() -> None:
    figure = plot_work_precision(RECORD)
    study, tangencies = figure.axes
    assert (study.get_xscale(), study.get_yscale()) == ("log", "log")
    assert study.get_title(loc="left") == "the case study"
    assert tangencies.get_title(loc="left") == "beside tangencies"
    lines = {line.get_label(): line for line in study.lines if line.get_label() != "_wrong"}
    assert set(lines) == {"ours", "theirs, careful", "theirs, naive"}
    assert np.all(np.array(lines["ours"].get_ydata()) > 0)
    careful, naive = lines["theirs, careful"], lines["theirs, naive"]
    assert list(careful.get_xdata()) == [5.0, 9.0, 50.0]
    assert list(careful.get_ydata()) == [1e-6, 1e-9, 1e-12]
    assert careful.get_color() == naive.get_color() != lines["ours"].get_color()
    assert naive.is_dashed()
    assert not careful.is_dashed()
    wrong = [line for line in study.lines if line.get_label() == "_wrong"]
    assert [list(line.get_xdata()) for line in wrong] == [[], [5.0, 9.0], [8.0]]
    assert {to_hex(line.get_markerfacecolor()) for line in wrong} == {"#ffffff"}
    assert to_hex(wrong[1].get_color()) == to_hex(careful.get_color())
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    hollow = "hollow: events missed or invented"
    assert shown == ["ours", "theirs, careful", "theirs, naive", hollow]


def test_a_record_without_measurements_is_an_empty_picture() -> None:
    (axes,) = plot_work_precision({"trajectory": []}).axes
    assert list(axes.lines) == []
