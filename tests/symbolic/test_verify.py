"""Every statement is settled, and none survives a wrong claim; the report and the command."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner
from click.testing import Result as Output

from capsule_sym import InvalidInput
from capsule_sym._commands.verify import verify as command
from capsule_sym._symbolic import verify
from capsule_sym._symbolic.model.elimination import Undecided
from capsule_sym._symbolic.proofs.markdown import math
from capsule_sym._symbolic.proofs.statement import Finding, Statement, settle
from tests.sampling import sampled, some

_APART = ("basis", "flow")  # with tests of their own
_SHORT = ("cells", "saltation")


@cache
def group(name: str) -> tuple[Statement, ...]:
    """Its statements. They take seconds to derive, which is not for the collection of tests."""
    return verify.statements(name)[name]


@sampled
@pytest.mark.parametrize("name", [name for name in verify.GROUPS if name not in _APART])
def test_statements_are_settled_and_wrong_claims_refused(name: str) -> None:
    for one in some(group(name), 2):
        result = settle(one)
        assert result.settled, (one.name, result.status)
        assert bool(result.witness) == bool(one.witness), one.name
        assert settle(one.mutant).status == "failed", one.name


def test_all_statements_have_names_verdicts_and_rows() -> None:
    """One test, because to derive all of them takes long: the flow's are derived nowhere else."""
    whole = verify.statements()
    told = {one.name: one.verdict for statements in whole.values() for one in statements}
    assert len(told) == sum(map(len, whole.values())) == 347
    assert {*told.values()} == {"proved"}
    for name, statements in whole.items():
        families = {one.name.partition(".")[0] for one in statements}
        assert families == {*verify.GROUPS[name].families.split()}
    wide = {name: [Finding(i, i.verdict, {}, 0.0) for i in found] for name, found in whole.items()}
    for block in verify.markdown(wide).split("\n\n"):
        rows = [line for line in block.splitlines() if line.startswith("|")]
        # A bar in a statement or formula would end a cell.
        assert len({row.count("|") for row in rows}) <= 1, rows[:1]


def test_a_statement_that_does_not_hold_is_failed() -> None:
    result = settle(group("cells")[0].mutant)
    assert result.status == "failed"
    assert not result.settled


def _undecidable(**claim: object) -> bool:
    raise Undecided(claim)


def test_a_statement_that_cannot_be_decided_is_undecided() -> None:
    result = settle(replace(group("cells")[0], check=_undecidable))
    assert result.status == "undecided"
    assert not result.settled


def test_a_refuted_claim_fails_and_its_correction_holds() -> None:
    refuted = Statement(
        "one", "", "", lambda value: value == 1, {"value": 2}, {"value": 3}, {"value": 1}
    )
    assert refuted.holds()
    assert not refuted.mutant.holds()
    assert not replace(refuted, claim={"value": 1}).holds()


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The command with few groups, in an empty directory."""
    monkeypatch.setattr(verify, "GROUPS", {name: verify.GROUPS[name] for name in _SHORT})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _run(*options: str) -> Output:
    return CliRunner().invoke(command, options)


@pytest.mark.usefixtures("short")
def test_one_row_tells_of_each_group() -> None:
    result = _run()
    assert result.exit_code == 0
    rows = {words[0]: words for line in result.stdout.splitlines() if (words := line.split())}
    for name in _SHORT:
        assert str(len([i for i in group(name) if i.verdict == "proved"])) in rows[name]
    assert "49 statements, 0 unproved" in result.stderr


@pytest.mark.usefixtures("short")
def test_records_and_lines_have_every_statement() -> None:
    statements = [one for name in _SHORT for one in group(name)]
    records = json.loads(_run("--json").stdout)["items"]
    assert [record["id"] for record in records] == [one.name for one in statements]
    assert all({"equation", "statement", "status", "seconds"} <= {*one} for one in records)
    lines = _run("--all").stdout.splitlines()
    for text, one in zip(lines[: len(statements)], statements, strict=True):
        assert text.startswith(one.verdict)
        assert one.says in text


def test_report_has_every_statement_and_formula(short: Path) -> None:
    assert _run("--out", "new/verify.md").exit_code == 0
    report = (short / "new" / "verify.md").read_text(encoding="utf-8")
    for one in (one for name in _SHORT for one in group(name)):
        assert f"`{one.name}`" in report
        assert math(one.latex) in report


def test_exit_status_is_one_when_a_proof_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = [group("cells")[0].mutant, *group("cells")[1:]]
    wrong = replace(verify.GROUPS["cells"], derive=lambda: broken)
    monkeypatch.setattr(verify, "GROUPS", {"cells": wrong})
    result = _run()
    assert result.exit_code == 1
    assert f"not proved: {broken[0].name}" in result.stderr


@pytest.mark.parametrize(
    ("only", "first", "count"),
    [
        ("cells", "cells.apart", 31),
        ("cells.F1", "cells.F1.guards", 4),
        ("saltation.F1", "saltation.F1.F4", 3),
        ("saltation.F1.F4", "saltation.F1.F4", 1),
    ],
)
@pytest.mark.usefixtures("short")
def test_only_what_is_named_is_proved(only: str, first: str, count: int) -> None:
    result = _run("--only", only, "--json")
    assert result.exit_code == 0
    records = json.loads(result.stdout)["items"]
    assert (records[0]["id"], len(records)) == (first, count)


def test_a_statement_is_found_without_deriving_other_groups(monkeypatch) -> None:
    def others() -> tuple[Statement, ...]:
        raise AssertionError("derived")

    own = {"saltation": verify.GROUPS["saltation"]}
    found = {name: replace(one, derive=others) for name, one in verify.GROUPS.items()} | own
    monkeypatch.setattr(verify, "GROUPS", found)
    assert verify.statements("saltation.F1.F4").keys() == {"saltation"}
    with pytest.raises(InvalidInput, match=r"saltation\.F1\.F4"):
        verify.statements("saltation.F1.F")
    with pytest.raises(InvalidInput, match="such as"):
        verify.statements("nothing")
