"""Every command with progress in a terminal: narrow and wide, in colour or not, with Ctrl-C."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from capsule_sym._cli import group
from tests.cli.terminal import Shown, in_terminal

CHART = """
periods = 40
compute = ["itinerary"]
[axes]
alpha = { from = 0.01, to = 2.0, count = COUNT }
gamma = { from = 1.0, to = 5.0, count = 9 }
"""
NO_PROGRESS = {"run", "explore", "figure"}
NO_PROGRESS |= {"optimise", "fit"}
# Arguments of each command, and its progress text in the middle of the work.
MIDDLE = {
    "verify": ([], "deriving"),
    "sweep": (["long.toml", "--out", "store"], r"Running cells: [\d,]+ of 810,000"),
    "basin": (
        ["--x-r", "-1:1:900", "--v-r", "-1:1:900", "--out", "store"],
        r"Running cells: [\d,]+ of 810,000",
    ),
    "attractors": (
        [
            *("--alpha", "1.88", "--omega", "0.32", "--delta", "0.03", "--zeta", "0.05"),
            *("--beta", "17.57", "--gamma", "7.47"),
            *("--x-r", "-1:1", "--starts", "2000", "--periods", "1000000"),
        ],
        r"Settling: 0 of 2,000",
    ),
    "pulse": (
        [
            *("--alpha", "2.5", "--omega", "0.41", "--delta", "0.41", "--zeta", "0.025"),
            *("--beta", "12", "--gamma", "2.2", "--state", "0.5", "-0.9", "-0.9"),
            *("--to", "0.4", "0.9", "0.1", "--over", "alpha=2.45:2.55", "--max-periods", "1000"),
        ],
        r"Switching: pulses of \d+ of 1,000",
    ),
    "orbit": (["--starts", "100000"], "Searching"),
    "tolerances": (
        ["--tolerance", "alpha=0.1", "--samples", "1048576"],
        r"Sampling: [\d,]+ of [\d,]+ runs",
    ),
    "shock": (["--samples", "10000000"], "Knocking: knocks of"),
    "branch": (["--alpha", "0.1:2", "--points", "3000"], r"Following: \d{2,} points, at"),
    "curve": (
        ["--alpha", "0.6:1.2", "--gamma", "3:5", "--bifurcation", "all", "--points", "3000"],
        r"Following: \d{2,} points, at \S+, \S+",
    ),
    "check": (["switches.csv"], r"exact run to period \d"),
}
ENDS = {
    "verify": ["--only", "cells.F1.guards"],
    "sweep": ["short.toml", "--out", "store"],
    "basin": ["--x-r", "-1:1:3", "--v-r", "-1:1:4", "--periods", "40", "--out", "store"],
    "orbit": ["--starts", "2"],
}
QUICK = {"sweep", "orbit"}  # of Ctrl-C; the others take as long together


@pytest.fixture
def shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Shown]:
    """Runs a command in a folder with two sweeps."""
    (tmp_path / "switches.csv").write_text("# end = 1e4\ntime,entered\n")
    (tmp_path / "short.toml").write_text(CHART.replace("COUNT", "9"))
    (tmp_path / "long.toml").write_text(CHART.replace("COUNT", "90000"))

    def run(*arguments: str, columns: int, colour: bool, interrupt_at: str | None = None) -> Shown:
        return in_terminal(
            *("-m", "capsule_sym", *arguments),
            columns=columns,
            colour=colour,
            cwd=tmp_path,
            interrupt_at=interrupt_at,
        )

    return run


def terminals(*chosen: tuple[int, bool]) -> pytest.MarkDecorator:
    """All four terminals; the chosen ones in the quick tests."""
    every = [(columns, colour) for columns in (60, 200) for colour in (True, False)]
    values = [pytest.param(*one, marks=() if one in chosen else pytest.mark.long) for one in every]
    return pytest.mark.parametrize(("columns", "colour"), values)


def assert_clean(shown: Shown, colour: bool) -> None:
    assert "Traceback" not in shown.written
    assert not [line for line in shown.lines if "━" in line]
    assert shown.cursor
    assert shown.coloured <= colour


def test_every_command_is_here() -> None:
    assert set(MIDDLE) | NO_PROGRESS == set(group.commands)


@terminals((60, True))
@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.long) for n in MIDDLE]
)
def test_ctrl_c_in_the_middle_is_one_line(name, columns, colour, shown) -> None:
    arguments, middle = MIDDLE[name]
    found = shown(name, *arguments, columns=columns, colour=colour, interrupt_at=middle)
    assert found.status == 130, found.written
    assert_clean(found, colour)
    told = [line for line in found.written.splitlines() if "error:" in line]
    assert len(told) == 1
    assert re.search(r"error: interrupted[^\x1b]*$", told[0])
    assert found.written.rstrip("\r\n").endswith(told[0])


@pytest.mark.long
def test_a_branch_that_ctrl_c_ends_is_kept_to_go_on_from(shown: Callable[..., Shown]) -> None:
    arguments, middle = MIDDLE["branch"]
    arguments = ["branch", *arguments, "--out", "kept"]
    found = shown(*arguments, columns=200, colour=False, interrupt_at=middle)
    assert found.status == 130
    said = re.search(r"interrupted: (--restart .*) continues this branch", found.written)
    assert said is not None
    again = shown("branch", *said[1].split(), "--points", "2", columns=200, colour=False)
    assert again.status == 0
    assert any(re.search("origin +EP2", line) for line in again.lines)


@terminals((200, False))
@pytest.mark.parametrize(
    "name", [n if n == "orbit" else pytest.param(n, marks=pytest.mark.long) for n in ENDS]
)
def test_progress_is_gone_in_the_end(name, columns, colour, shown) -> None:
    found = shown(name, *ENDS[name], columns=columns, colour=colour)
    assert found.status == 0, found.written
    assert re.search("Proving|Running cells|Searching", found.written)
    assert_clean(found, colour)
    assert found.lines
    assert found.lines[0]


INTERRUPTED_WHILE_WRITTEN = """
import signal
from capsule_sym._texts import bars

bars._PAUSE = 0
try:
    with bars.reporting("Working") as report:
        for k in range(9):
            if k == {when}:
                signal.signal(signal.SIGALRM, signal.default_int_handler)
                signal.setitimer(signal.ITIMER_REAL, 1e-5)
            report("x" * 100)
        signal.pause()
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.parametrize("when", [0, 1, 2, 5])
def test_ctrl_c_leaves_nothing_of_the_progress(when: int) -> None:
    found = in_terminal("-c", INTERRUPTED_WHILE_WRITTEN.format(when=when), columns=60)
    assert found.status == 0, found.written
    assert "Working: xxx" in found.written or when == 0
    assert found.lines == ["interrupted"]
