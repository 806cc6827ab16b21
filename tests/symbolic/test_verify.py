"""Every statement is settled, and none survives a changed claim; the report and the command."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner

from capsule_sym import InvalidInput
from capsule_sym._commands.verify import verify as command
from capsule_sym._symbolic import verify
from capsule_sym._symbolic.model.elimination import Undecided
from capsule_sym._symbolic.proofs.markdown import document, math
from capsule_sym._symbolic.proofs.statement import Result, Statement, settle
from tests.sampling import sampled, some

SECTIONS = dict(verify.SECTIONS)  # some tests put fewer in their place
_APART = ("Closed-form flow, Eqs. (7)-(12)",)  # with tests of their own


@cache
def section(title: str) -> tuple[Statement, ...]:
    """Its statements. They take seconds to derive, which is not for the collection of tests."""
    return tuple(SECTIONS[title]())


@cache
def sample() -> tuple[Statement, ...]:
    begins = ("geometry", "appendix.A")
    return tuple(i for t in _TITLES for i in section(t) if i.name.startswith(begins))


_TITLES = [title for title in SECTIONS if title not in _APART]


@sampled
@pytest.mark.parametrize("title", _TITLES)
def test_statements_are_settled(title: str) -> None:
    for item in some(section(title), 4):
        result = settle(item)
        assert result.settled, (item.name, result.status)
        assert bool(result.witness) == bool(item.witness), item.name


@sampled
@pytest.mark.parametrize("title", _TITLES)
def test_changed_claims_are_refused(title: str) -> None:
    chosen = some(section(title), 12)
    assert [item.name for item in chosen if item.mutant.holds()] == []


def test_all_statements_have_names_and_rows() -> None:
    """One test, because to derive all of them takes long: the flow's are derived nowhere else."""
    whole = {title: section(title) for title in verify.SECTIONS}
    told = [(item.name, item.verdict) for items in whole.values() for item in items]
    assert len({name for name, _ in told}) == len(told)
    for title, items in whole.items():
        assert {item.name.partition(".")[0] for item in items} <= {*verify.FAMILIES[title].split()}
    wide = {title: tuple(Result(i, i.verdict, {}, 0.0) for i in s) for title, s in whole.items()}
    for block in document(wide, "").split("\n\n"):
        rows = [line for line in block.splitlines() if line.startswith("|")]
        # A bar in a statement or formula would end a cell.
        assert len({row.count("|") for row in rows}) <= 1, rows[:1]


def test_a_statement_that_does_not_hold_is_failed() -> None:
    item = sample()[0].mutant
    assert settle(item).status == "failed"
    assert not settle(item).settled


def _undecidable(**claim: object) -> bool:
    raise Undecided(claim)


def test_a_statement_that_cannot_be_decided_is_undecided() -> None:
    result = settle(replace(sample()[0], check=_undecidable))
    assert result.status == "undecided"
    assert not result.settled


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The command with few items, in an empty directory."""
    monkeypatch.setattr(verify, "SECTIONS", {"Some": sample})
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("short")
def test_json_holds_every_item_with_its_status() -> None:
    result = CliRunner().invoke(command, ["--json"])
    assert result.exit_code == 0
    records = json.loads(result.stdout)["items"]
    assert [record["id"] for record in records] == [item.name for item in sample()]
    for record in records:
        assert {"equation", "statement", "status", "seconds"} <= set(record)


@pytest.mark.usefixtures("short")
def test_lines_name_status_equation_and_statement() -> None:
    lines = CliRunner().invoke(command, []).stdout.splitlines()
    assert len(lines) == len(sample())
    for text, item in zip(lines, sample(), strict=True):
        assert text.startswith(item.verdict)
        assert item.says in text


def test_report_has_every_statement_and_formula(short: Path) -> None:
    assert CliRunner().invoke(command, ["--out", "new/verify.md"]).exit_code == 0
    report = (short / "new" / "verify.md").read_text(encoding="utf-8")
    for item in sample():
        assert f"`{item.name}`" in report
        assert math(item.latex) in report


def test_exit_status_is_one_when_a_proof_fails(
    short: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = (sample()[0].mutant, *sample()[1:])
    monkeypatch.setattr(verify, "SECTIONS", {"Some": lambda: broken})
    result = CliRunner().invoke(command, [])
    assert result.exit_code == 1
    assert f"not proved: {broken[0].name}" in result.stderr


@pytest.mark.usefixtures("short")
def test_only_the_named_statement_is_proved() -> None:
    for item in (sample()[0], sample()[-1]):
        result = CliRunner().invoke(command, ["--only", item.name, "--json"])
        assert result.exit_code == 0
        assert [record["id"] for record in json.loads(result.stdout)["items"]] == [item.name]


def test_one_statement_is_found_without_deriving_other_sections(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def others() -> tuple[Statement, ...]:
        raise AssertionError("derived")

    title = "The resting orbit"
    found = {name: others if name != title else verify.SECTIONS[title] for name in verify.SECTIONS}
    monkeypatch.setattr(verify, "SECTIONS", found)
    assert verify.item("grazing.L9.closed").keys() == {title}
    with pytest.raises(InvalidInput, match=r"grazing\.L9\.closed"):
        verify.item("grazing.L9.close")
    with pytest.raises(InvalidInput, match="begins with geometry"):
        verify.item("nothing")


@pytest.mark.usefixtures("short")
def test_a_name_of_no_statement_is_refused_with_names_alike() -> None:
    with pytest.raises(InvalidInput, match=re.escape(sample()[0].name)):
        verify.item(sample()[0].name + "x")
    assert CliRunner().invoke(command, ["--only", sample()[0].name, "--out", "x.md"]).exit_code == 2
