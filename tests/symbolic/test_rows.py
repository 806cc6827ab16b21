"""Rows of claims: each kind of check holds for its rows and is refused a wrong one."""

from __future__ import annotations

from functools import cache

import pytest

from capsule_sym._symbolic.proofs import theorems
from capsule_sym._symbolic.proofs.rows import CHECKERS, Context, Row, resolved
from capsule_sym._symbolic.proofs.statement import Statement
from paper.claims import everything
from paper.printed import read

_LONG = (
    "excluded",
    "types",
    "ordered",
    "stick_vanishes",
    "lacks",
    "restricted",
    "unlike_its_lines",
)
"""Checks that take seconds."""


ROWS = (*everything.rows(), *theorems.rows())


@cache
def items_of(check: str) -> tuple[Statement, ...]:
    rows = [row for row in ROWS if row.fields["check"] == check]
    return tuple(next(iter(row.items(read()))) for row in rows)


@pytest.mark.parametrize(
    "check",
    [pytest.param(c, marks=pytest.mark.long if c in _LONG else ()) for c in sorted(CHECKERS)],
)
def test_a_check_holds_for_its_rows_and_not_for_wrong_ones(check: str) -> None:
    for item in items_of(check):
        assert item.wrong
        assert item.holds(), item.name
        assert not item.mutant.holds(), item.name


def test_every_row_stands_for_a_claim() -> None:
    assert [row.name for row in ROWS if not list(row.items(read()))] == []


_ROW = {
    "name": "some.{key}",
    "entry": "auxiliary",
    "each": "printed",
    "check": "same_formula",
    "given": {"printed": "{text}", "expected": "{key}"},
    "says": "{key} is {text}",
}


def test_a_new_claim_is_one_row() -> None:
    (first, *_) = Row(_ROW).items(read())
    assert (first.name, first.says, first.equation) == (
        "printed.some.P1",
        "P1 is v_c",
        "Section 2, after Eq. (6)",
    )
    assert first.holds()
    assert not first.check(**{**first.claim, "expected": "P2"})


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"sayz": ""}, "some.*sayz"),
        ({"given": {"printed": "1", "expcted": "1"}}, "given: expcted"),
        ({"wrong": {"other": "1"}}, "wrong: other"),
        ({"check": "none_such"}, "none_such"),
    ],
)
def test_a_row_that_is_none_is_refused(change: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Row({**_ROW, **change})


def test_a_misprint_needs_the_printed_value_to_fail_and_the_derived_one_to_hold() -> None:
    row = {**_ROW, "each": [{"key": "P3", "text": "v_c"}], "verdict": "refuted"}
    (item,) = Row({**row, "correction": {"printed": "P3"}}).items(read())
    assert item.name == "erratum.some.P3"
    assert item.holds()
    (both_hold,) = Row({**row, "each": [{"key": "P3", "text": "P3"}], "correction": {}}).items(
        read()
    )
    assert not both_hold.holds()
    (neither,) = Row({**row, "correction": {"printed": "P4"}}).items(read())
    assert not neither.holds()


def test_templates() -> None:
    context = Context(names=["L1", "L2"], number=6)
    assert resolved("{names}", context) == ("L1", "L2")
    assert resolved("{names:list}", context) == "L1, L2"
    assert resolved("{number:next}", context) == 1
    assert resolved("on {names[0]}, {{F{number}}}", context) == "on L1, {F6}"
    assert resolved({"a": ["{number}", "x"]}, context) == {"a": (6, "x")}
    with pytest.raises(KeyError, match="nothing"):
        resolved("{nothing} at all", context)
