"""`python -m paper enclose`, as a user calls it."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner

from capsule_sym import Rejected, check_certificate
from capsule_sym._native import present
from paper.__main__ import group
from paper.proofs import section4


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


def test_two_proofs_at_once_are_refused() -> None:
    run = CliRunner().invoke(
        group, ["enclose", "--from-rest", "rest.jsonl", "--region", "plane.jsonl"]
    )
    assert run.exit_code == 2
    assert "--region and --from-rest exclude each other" in run.output


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


def test_bifurcations_proved_before_the_time_is_over_are_kept() -> None:
    section = section4.prove_section("3.3", report=lambda box: present().stop(), max_seconds=1e9)
    assert len(section.events) == 8
    assert (section.intervals, section.failed) == ((), "the time was over")
