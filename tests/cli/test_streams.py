"""Streams that are closed, or a disk that is full: one line, and a status that is not 0."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from capsule_sym._cli import group, main
from capsule_sym._symbolic import verify
from capsule_sym._symbolic.proofs import cells

FULL = Path("/dev/full")
SWEEP = """periods = 2
[axes]
alpha = [0.5, 0.7]
"""
# Each command that prints results, as short as it can be.
SHORT = {
    "run": "--periods 1",
    "verify": "",
    "sweep": "two.toml --out one",
    "basin": "--x-r 0:1:2 --periods 2 --out two",
    "attractors": "--x-r 0:1 --starts 2 --periods 40",
    "orbit": "",
    "shock": "--samples 100 --largest 0.01",
    "branch": "--alpha 0.7:0.701 --points 1",
    "optimise": "--maximise speed --over alpha=0.7:0.71 --samples 1",
    "pulse": "--alpha 2.5 --omega 0.41 --delta 0.41 --zeta 0.025 --beta 12 --gamma 2.2 "
    "--state 0.5 -0.9 -0.9 --to 0.4 0.9 0.1 --max-periods 1",
    "fit": "measured.csv --unknown alpha",
    "check": "switches.csv",
    "tolerances": "--tolerance alpha=0.01 --samples 64",
    "curve": "--alpha 0.36:0.37 --gamma 3.29:3.3 --bifurcation adding --points 1 --at 3.3",
}
needs_full = pytest.mark.skipif(not FULL.exists(), reason="there is no /dev/full")


def test_every_command_that_prints_results_is_here() -> None:
    assert set(SHORT) == set(group.commands) - {"explore", "figure"}


@pytest.fixture
def short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes every command short, in a folder with a sweep and the results of one."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.toml").write_text(SWEEP)
    (tmp_path / "switches.csv").write_text("time,entered\n")
    (tmp_path / "measured.csv").write_text("t,x_r\n0,0\n1,0.2\n2,0.4\n3,0.3\n")
    monkeypatch.setattr(verify, "statements", lambda only: {"cells": cells.items()[:1]})


@needs_full
@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("option", ["", pytest.param("--json", marks=pytest.mark.long), "--help"])
@pytest.mark.parametrize("name", SHORT)
def test_a_full_disk_is_one_line(name, option, capsys, monkeypatch) -> None:
    with FULL.open("w") as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        with pytest.raises(SystemExit) as done:
            main([name, *SHORT[name].split(), *option.split()])
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    assert (done.value.code, said) == (1, ["error: output: No space left on device"])


def shell(redirection: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The program with its streams as a shell redirects them."""
    program = [sys.executable, "-m", "capsule_sym", *arguments]
    return subprocess.run(
        ["sh", "-c", f'"$@" {redirection}', "sh", *program],
        capture_output=True,
        text=True,
        env={k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"},
        check=False,
    )


@pytest.mark.parametrize(
    ("redirection", "said"),
    [
        (">&-", "error: closed: standard output"),
        ("2>&-", "error: closed: standard error"),
        pytest.param(">/dev/full", "error: output: No space left on device", marks=needs_full),
        pytest.param(">/dev/full 2>/dev/full", "", marks=needs_full),
        (">&- 2>&-", ""),
    ],
)
def test_a_stream_that_takes_nothing_ends_a_process(redirection: str, said: str) -> None:
    done = shell(redirection, "run", "--json")
    assert done.returncode == 1
    assert (done.stdout + done.stderr).splitlines() == said.splitlines()


@needs_full
@pytest.mark.parametrize("arguments", [["run"], ["run", "--help"], []])
def test_a_full_disk_ends_a_process(arguments: list[str]) -> None:
    done = shell(">/dev/full", *arguments)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "error: output: No space left on device\n"


@needs_full
def test_results_are_shown_where_messages_cannot_be() -> None:
    assert shell("2>/dev/full", "run", "--json").returncode == 0
    assert shell("2>/dev/full", "run", "--alpha", "-1").returncode == 2


@pytest.mark.parametrize("name", group.commands)
def test_closed_output_ends_every_command_before_it_computes(name, capsys, monkeypatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(SystemExit) as done:
        main([name])
    assert done.value.code == 1
    assert capsys.readouterr().err == "error: closed: standard output\n"
