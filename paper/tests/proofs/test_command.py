"""`python -m paper enclose`, as a user calls it."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner

from capsule_sym import check_certificate
from capsule_sym._cli import _status
from capsule_sym._files import write_whole
from capsule_sym._native import present
from capsule_sym.results import Rejected
from paper.__main__ import group
from paper.commands import enclose as enclosing
from paper.proofs import section4, subdivision


def test_certificates_of_section_4_are_accepted_and_a_changed_digit_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(section4, "LAST", Fraction(45, 100))
    monkeypatch.setattr(section4, "panels", lambda paper: {"d": "0.4"})
    held, missing = section4.certified("3.0")
    assert missing == []
    assert [one["kind"] for one in held] == ["bifurcation", "bifurcation", "orbit"]
    for one in held:
        assert one["parameters"]["gamma"] == "3"
        check_certificate(one)
    angle = held[1]["angle"]
    with pytest.raises(Rejected):
        check_certificate({**held[1], "angle": angle[:-1] + str((int(angle[-1]) + 5) % 10)})


REFUSED = {
    "--region a --thresholds": "--region and --thresholds exclude each other",
    "--from-rest a --out a.json": "--from-rest and --out exclude each other",
    "--horseshoe --thresholds": "--horseshoe and --thresholds exclude each other",
    "--fastest a --thresholds": "--fastest and --thresholds exclude each other",
    "--region a --max-seconds nan": "--max-seconds = nan: must be a number > 0",
    "--from-rest a --max-seconds 0": "'--max-seconds': 0.0 is not in the range x>0",
    "--thresholds --out taken/below.json": "taken is not a writable directory",
    "--from-rest a --region b": "--region and --from-rest exclude each other",
}


@pytest.mark.parametrize("line", REFUSED)
def test_a_wrong_line_is_refused_in_one_line(
    line: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("a file")
    monkeypatch.setattr(enclosing, "spawning", None)  # what would begin work
    assert _status(["enclose", *line.split()], group) == 2
    shown, told = capsys.readouterr()
    assert (shown, told.count("\n")) == ("", 1)
    assert REFUSED[line] in told


@pytest.mark.parametrize("option", ["--region", "--from-rest", "--fastest"])
def test_an_interrupt_says_that_the_file_goes_on(
    option: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(subdivision, "prove", cut)
    monkeypatch.chdir(tmp_path)
    line = ["enclose", option, "boxes.jsonl"]
    assert _status(line, group) == 130
    assert capsys.readouterr() == ("", "error: interrupted\n")  # nothing is written yet
    write_whole("boxes.jsonl", "begun")
    assert _status(line, group) == 130
    kept = "finished work is kept in boxes.jsonl; repeat the command to continue"
    assert capsys.readouterr() == ("", f"error: interrupted: {kept}\n")


@pytest.mark.long
def test_section_4_without_time_proves_nothing_and_keeps_the_file_before(tmp_path: Path) -> None:
    file = tmp_path / "section4.json"
    file.write_text("of a run before")
    line = ["enclose", "--thresholds", "--max-seconds", "1e-9", "--json", "--out", str(file)]
    run = CliRunner().invoke(group, line)
    record = json.loads(run.stdout)
    assert run.exit_code == 1
    assert [one["failed"] for one in record["sections"]] == ["the time was over"] * 2
    assert [one["thresholds"] for one in record["sections"]] == [[], []]
    assert (record["codimension_two"], file.read_text()) == ([], "of a run before")
    assert run.stderr.splitlines()[-1] == "not proved: the time was over"


@pytest.mark.long
def test_bifurcations_proved_before_the_time_is_over_are_kept() -> None:
    section = section4.prove_section("3.3", report=lambda box: present().stop(), max_seconds=1e9)
    assert len(section.events) == 8
    assert (section.intervals, section.failed) == ((), "the time was over")
