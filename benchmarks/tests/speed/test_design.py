"""`bench-design`: its goals, and the goals met."""

import json
import re
import sys
import time

import psutil
import pytest
from click.testing import CliRunner

from benchmarks.speed import design
from benchmarks.speed.commands import bench_design
from benchmarks.speed.goals import Goal
from capsule_sym._native import core
from tests.cli.terminal import in_terminal


def test_the_command_prints_every_goal(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [Goal("cells", 0.75, "million", ">=", 0.5), Goal("runs", 6.0, "times", "<=", 5.0)]
    monkeypatch.setattr(design, "PARTS", (lambda quick, repeats: iter(found),))
    printed = CliRunner().invoke(bench_design, ["--quick"])
    assert printed.exit_code == 0
    rows = [line.split() for line in printed.stdout.splitlines()[2:] if line.strip()]
    assert rows == [
        ["cells", "million", "0.75", ">=", "0.5", "yes"],
        ["runs", "times", "6", "<=", "5", "no"],
    ]
    record = json.loads(CliRunner().invoke(bench_design, ["--json"]).stdout)
    assert [row["met"] for row in record["design"]] == [True, False]


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_what_is_measured_is_positive() -> None:
    found = [*design.derivatives(quick=True, repeats=1)]
    assert [goal.relation for goal in found] == ["<="]
    assert all(goal.value > 1 for goal in found)


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_the_survey_beside_the_optimum_comes_close_to_it() -> None:
    assert 0.65 < design._best_cell(12) < 0.71614046396294


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal")
@pytest.mark.parametrize(
    ("name", "patch"),
    [
        ("bench-design", "design._COLD, design.PARTS = CODE, (design.optima,)"),
        ("first-calls", "first_calls.figures = lambda *_: [first_calls._process('-c', CODE)]"),
    ],
)
def test_ctrl_c_in_a_measured_process_is_one_line(name, patch) -> None:
    """The process that is measured gets no Ctrl-C of its own, and ends with the command."""
    waiting = "import os, sys, time; print('at', os.getpid(), file=sys.stderr); time.sleep(300)"
    script = f"""
from benchmarks.__main__ import group
from benchmarks.speed import design, first_calls
from capsule_sym._cli import main
CODE = {waiting!r}
{patch}
main([{name!r}], group)
"""
    shown = in_terminal("-c", script, interrupt_at=r"at (\d+)\r")
    assert shown.status == 130
    assert shown.lines[-1].removeprefix("^C") == "error: interrupted"
    assert "Traceback" not in shown.written
    process = int(re.search(r"at (\d+)", shown.written)[1])
    while is_alive(process):  # it was killed, which takes a moment
        time.sleep(0.01)


def is_alive(process: int) -> bool:
    """True if a process has not ended, reaped or not."""
    try:
        return psutil.Process(process).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
