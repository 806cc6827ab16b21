"""Every command in a terminal: with and without colour, narrow and wide, with Ctrl-C."""

from pathlib import Path

import pytest

from tests.cli.terminal import in_terminal, screen

CHART = """
periods = 40
compute = ["word"]
[axes]
alpha = { from = 0.01, to = 2.0, count = 9 }
gamma = { from = 1.0, to = 5.0, count = 9 }
"""
BASIN = ("basin", "--x-r", "-1", "1", "3", "--v-r", "-1", "1", "4", "--periods", "40")
TERMINALS = pytest.mark.parametrize(
    ("columns", "colour"), [(60, True), (60, False), (200, True), (200, False)]
)


def test_the_screen_is_what_a_terminal_shows() -> None:
    assert screen("one\r\n\x1b[1mtwo\x1b[0m\r\n") == ["one", "two"]
    assert screen("bar 10 %\rbar 20 %\r\x1b[2K\x1b[1A\x1b[2Kdone\r\n") == ["done"]
    assert screen("bar 10 %\r\x1b[2Kx\r\n") == ["x"]


@TERMINALS
@pytest.mark.parametrize("arguments", [("sweep", "chart.toml"), BASIN], ids=["sweep", "basin"])
def test_a_sweep_shows_its_progress(
    arguments: tuple[str, ...], columns: int, colour: bool, tmp_path: Path
) -> None:
    (tmp_path / "chart.toml").write_text(CHART)
    program = ("-m", "capsule_sym", *arguments, "--store", "store")
    shown = in_terminal(*program, columns=columns, colour=colour, cwd=tmp_path)
    assert shown.status == 0, shown.written
    assert "cells" in shown.written
    assert not [line for line in shown.lines if "Traceback" in line or "━" in line]
    assert shown.coloured == colour
    assert shown.cursor_is_shown
