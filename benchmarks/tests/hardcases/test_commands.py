"""`hardcases` and `adversarial` as commands: how they end, and what they say when stopped."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import group
from benchmarks.hardcases import adversarial, cases, table
from capsule_sym._cli import _status, main
from tests.cli.terminal import in_terminal
from tests.cli.test_streams import FULL, needs_full
from tests.cli.test_terminal import assert_clean, terminals


@pytest.fixture
def short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(table, "rows", lambda chosen: iter(()))
    monkeypatch.setattr(table, "cost", lambda: (2, 8))
    monkeypatch.setattr(adversarial, "run", lambda *_: iter([adversarial.Tally(seconds=1.0)]))


@needs_full
@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("option", ["", "--json", "--help"])
@pytest.mark.parametrize("line", ["hardcases --only graze", "adversarial --count 1"])
def test_a_full_disk_is_one_line(
    line: str, option: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with FULL.open("w") as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        with pytest.raises(SystemExit) as done:
            main([*line.split(), *option.split()], group)
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    assert (done.value.code, said) == (1, ["error: output: No space left on device"])


@pytest.mark.parametrize("name", group.commands)
def test_closed_output_ends_every_command_before_it_computes(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(SystemExit) as done:
        main([name], group)
    assert done.value.code == 1
    assert capsys.readouterr().err == "error: closed: standard output\n"


@pytest.mark.parametrize(
    ("line", "status", "told"),
    [
        ("adversarial --out taken", 2, "'taken' is a file"),
        ("adversarial --count 0", 2, "0 is not in the range x>=1"),
        ("hardcases --only nothing", 2, "no case has 'nothing' in its name"),
        ("hardcases --every 0", 2, "0 is not in the range x>=1"),
        ("nonsense", 2, "No such command 'nonsense'"),
    ],
)
def test_a_wrong_line_is_refused_in_one_line(
    line: str,
    status: int,
    told: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("a file")
    assert _status(line.split(), group) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert told in err


def test_an_interrupt_says_that_the_log_goes_on(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(adversarial, "run", cut)
    monkeypatch.chdir(tmp_path)
    line = ["adversarial", "--seed", "7", "--out", "log"]
    assert _status(line, group) == 130
    assert capsys.readouterr() == ("", "error: interrupted\n")  # nothing is written yet
    log = Path("log/seed-7.jsonl")
    log.parent.mkdir()
    log.write_text("begun")
    assert _status(line, group) == 130
    kept = f"finished work is kept in {log}; repeat the command to continue"
    assert capsys.readouterr() == ("", f"error: interrupted: {kept}\n")


@pytest.mark.long
def test_the_results_are_json_on_stdout() -> None:
    words = ["--only", "past", "--every", "2", "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "hardcases", *words],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert set(record) == {"cases", "evaluations_per_segment"}
    assert {case["verdict"] for case in record["cases"]} == {"ok"}
    named = [case.name for case in cases.cases() if "past" in case.name]
    assert [case["name"] for case in record["cases"]] == named[::2]


MIDDLE = {
    "hardcases": ([], "Checking the hard cases"),
    "adversarial": (["--count", "1000000"], "Comparing with 50 digits"),
}
ENDS = {
    "hardcases": ["--only", "graze from F2, 1e-02 past"],
    "adversarial": ["--count", "8"],
}


@pytest.mark.long
@terminals((60, True))
@pytest.mark.parametrize("name", MIDDLE)
def test_ctrl_c_in_the_middle_is_one_line(name: str, columns: int, colour: bool) -> None:
    arguments, middle = MIDDLE[name]
    line = ("-m", "benchmarks", name, *arguments)
    found = in_terminal(*line, columns=columns, colour=colour, interrupt_at=middle)
    assert found.status == 130, found.written
    assert_clean(found, colour)
    told = [line for line in found.written.splitlines() if "error:" in line]
    assert len(told) == 1
    assert found.written.rstrip("\r\n").endswith(told[0])


@pytest.mark.long
@terminals((200, False))
@pytest.mark.parametrize("name", ENDS)
def test_progress_is_gone_in_the_end(name: str, columns: int, colour: bool) -> None:
    found = in_terminal("-m", "benchmarks", name, *ENDS[name], columns=columns, colour=colour)
    assert found.status == 0, found.written
    assert re.search(r"(Checking|Comparing) [^\r\n]*\(\d+ s\)", found.written)
    assert_clean(found, colour)
