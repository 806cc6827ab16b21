"""Rows of claims: each kind of check holds for its rows and is refused a wrong one."""

from __future__ import annotations

from functools import cache

import pytest

from capsule_sym._symbolic.proofs import theorems
from capsule_sym._symbolic.proofs.rows import CHECKERS, Context, resolved
from capsule_sym._symbolic.proofs.statement import Statement

ROWS = theorems.rows()


@cache
def items_of(check: str) -> tuple[Statement, ...]:
    rows = [row for row in ROWS if row.fields["check"] == check]
    return tuple(next(iter(row.items())) for row in rows)


@pytest.mark.parametrize("check", sorted(CHECKERS))
def test_a_check_holds_for_its_rows_and_not_for_wrong_ones(check: str) -> None:
    for item in items_of(check):
        assert item.wrong
        assert item.holds(), item.name
        assert not item.mutant.holds(), item.name


def test_every_row_stands_for_a_claim() -> None:
    assert [row.name for row in ROWS if not list(row.items())] == []


def test_templates() -> None:
    context = Context(names=["L1", "L2"], number=6)
    assert resolved("{names}", context) == ("L1", "L2")
    assert resolved("{names:list}", context) == "L1, L2"
    assert resolved("{number:next}", context) == 1
    assert resolved("on {names[0]}, {{F{number}}}", context) == "on L1, {F6}"
    assert resolved({"a": ["{number}", "x"]}, context) == {"a": (6, "x")}
    with pytest.raises(KeyError, match="nothing"):
        resolved("{nothing} at all", context)
