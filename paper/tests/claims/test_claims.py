"""Every claim is settled, and refused with a wrong claim; the report and the command."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import pytest
from click.testing import CliRunner

from capsule_sym import InvalidInput
from capsule_sym._symbolic.proofs.markdown import math
from capsule_sym._symbolic.proofs.statement import Finding, Statement, settle
from paper.claims import captions, everything, frozen, report, section_4
from paper.claims.errata import same_formula
from paper.claims.report import markdown
from paper.commands.claims import claims as command
from paper.printed import read
from tests.sampling import sampled, some

BY_ID = {item.name: item for item in everything.statements(read())}
CASE_STUDY = {
    item.name
    for part in (section_4, captions)
    for claims in part.STATEMENTS
    for item in claims(read())
}
"""Statements about motions, which `test_attractors` checks."""
LONG = (
    "erratum.table3.missing.every",
    "erratum.table3.missing.restricted",
    "erratum.section.3.1.O1.line",
    "erratum.section.3.1.O2.line",
    "printed.table3.scenario.δ<f_b",
    "printed.table3.scenario.δ=f_b",
    "printed.table3.scenario.δ>f_b",
)
"""Each takes seconds, with its wrong claim."""


def _check(item: Statement) -> str:
    return item.check.__name__


BY_CHECK = {
    check: list(items)
    for check, items in groupby(
        sorted((i for i in BY_ID.values() if i.name not in {*CASE_STUDY, *LONG}), key=_check),
        _check,
    )
}


def _settled_and_its_mutant_not(item: Statement) -> None:
    result = settle(item)
    assert result.settled, (item.name, result.status)
    assert bool(result.witness) == bool(item.witness), item.name
    assert item.wrong
    assert not item.mutant.holds(), item.name


@sampled
@pytest.mark.parametrize("check", BY_CHECK)
def test_a_check_holds_for_its_claims_and_not_for_wrong_ones(check: str) -> None:
    for item in some(BY_CHECK[check], 2):
        _settled_and_its_mutant_not(item)


@pytest.mark.long
@pytest.mark.parametrize("name", LONG)
def test_long_claims_are_settled_and_their_mutants_not(name: str) -> None:
    _settled_and_its_mutant_not(BY_ID[name])


def test_all_claims_have_names_and_expected_verdicts() -> None:
    told = [(one.name, one.verdict) for found in everything.sections().values() for one in found]
    assert len({name for name, _ in told}) == len(told)
    assert dict(told) == frozen.expected().statuses


@pytest.mark.long
def test_report_sets_printed_tables_beside_derived_ones() -> None:
    document = markdown({})
    assert "| S5 | Ω6 | Ω5 | F6 | F5 | C-BD → C-S | yes | yes |" in document
    assert "| L4 | Ω5 | Ω4 | F5 | F4 | C-S → C-FD | yes | never |" in document
    assert "| L4 | Ω5 | Ω6 | F5 | F6 | C-S → C-BD | — | n > 0 |" in document
    assert "| P_{Σ4,F2,Σ2} | F2 | NC-S | — | yes | — | — | — | yes | — |" in document
    for block in document.split("\n\n"):
        rows = [line for line in block.splitlines() if line.startswith("|")]
        assert len({row.count("|") for row in rows}) <= 1, rows[:1]


def test_a_printed_statement_is_shown_once_and_in_mathematics(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(report, "_TABLES", {})
    same = Statement(
        "one", "Eq. (6)", "where |P| > f_b it is F1", bool, {}, {}, printed="v_c' == 2*zeta*P3"
    )
    results = tuple(Finding(item, "proved", {}, 0.0) for item in (same, replace(same, name="two")))
    document = markdown({"Some": results})
    assert document.count("### 1–2. Eq. (6): proved") == 1
    assert document.count(r"- **Printed:** $v_c' = 2 \zeta  P_{3}$") == 1
    assert document.count(r": where $\vert P\vert  > f_b$ it is F1") == 2
    other = (
        *results,
        Finding(replace(same, name="three", printed="O1 is the end of L9"), "proved", {}, 0.0),
    )
    assert "- `three`, settled in 0.00 s: O1 is the end of L9" in markdown({"Some": other})


def test_every_erratum_has_what_the_report_needs() -> None:
    for item in BY_ID.values():
        if item.verdict == "refuted":
            assert item.printed
            assert item.derived
            assert item.proof
            assert item.consequence
            assert item.witness


def test_a_misprint_needs_the_printed_value_to_fail_and_the_derived_one_to_hold() -> None:
    claim, correction = {"printed": "v_c", "expected": "P3"}, {"printed": "P3"}
    one = Statement("one", "", "", same_formula, claim, {"printed": "P4"}, correction)
    assert one.holds()
    assert not one.mutant.holds()
    assert not replace(one, claim={"printed": "P3", "expected": "P3"}).holds()


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., None]:
    """Leaves the command some statements, in an empty directory."""

    def leave(*items: Statement) -> None:
        monkeypatch.setattr(everything, "sections", lambda: {"Some": items})
        known = frozen.expected()
        statuses = {one.name: known.statuses[one.name] for one in items}
        monkeypatch.setattr(frozen, "expected", lambda: frozen.Expected(statuses, known.words))

    monkeypatch.chdir(tmp_path)
    return leave


SOME = tuple(
    item
    for item in BY_ID.values()
    if item.name.startswith(("printed.equation.16", "erratum.equation.23", "printed.figure.2"))
)


def test_json_and_report_hold_every_statement(short: Callable[..., None]) -> None:
    short(*SOME)
    result = CliRunner().invoke(command, ["--json", "--out", "new/claims.md"])
    assert result.exit_code == 0
    records = json.loads(result.stdout)["items"]
    assert [record["id"] for record in records] == [item.name for item in SOME]
    for record in records:
        assert {"equation", "statement", "status", "seconds"} <= set(record)
        if record["status"] == "refuted":
            assert record["printed"] != record["derived"]
            assert record["witness"]
    document = Path("new/claims.md").read_text(encoding="utf-8")
    for item in SOME:
        assert f"`{item.name}`" in document
        assert math(item.latex) in document


def test_lines_name_status_equation_and_statement(short: Callable[..., None]) -> None:
    short(*SOME)
    lines = CliRunner().invoke(command, []).stdout.splitlines()
    assert len(lines) == len(SOME)
    for text, item in zip(lines, SOME, strict=True):
        assert text.startswith(item.verdict)
        assert item.says in text


def test_exit_status_is_one_for_what_is_not_settled_or_not_expected(
    short: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    short(SOME[0].mutant, *SOME[1:])
    result = CliRunner().invoke(command, [])
    assert result.exit_code == 1
    assert f"not settled: {SOME[0].name}" in result.stderr
    short(*SOME)
    known, right = frozen.expected(), SOME[0]
    statuses = {**known.statuses, right.name: "refuted", "gone": "proved"}
    monkeypatch.setattr(frozen, "expected", lambda: frozen.Expected(statuses, known.words))
    result = CliRunner().invoke(command, [])
    assert result.exit_code == 1
    assert f"{right.name}: {right.verdict}, expected: refuted" in result.stderr
    assert "gone: missing, expected: proved" in result.stderr


def test_only_named_statements_are_checked() -> None:
    result = CliRunner().invoke(command, ["--only", "printed.equation.16", "--json"])
    assert result.exit_code == 0
    found = [one["id"] for one in json.loads(result.stdout)["items"]]
    assert found == ["printed.equation.16", "printed.equation.16.sign"]
    assert everything.named("Errata") == {"Errata": everything.sections()["Errata"]}
    with pytest.raises(InvalidInput, match=r"printed\.equation\.16"):
        everything.named("printed.equation.16x")
    beside = CliRunner().invoke(command, ["--only", "printed.equation.16", "--out", "x.md"])
    assert beside.exit_code == 2
