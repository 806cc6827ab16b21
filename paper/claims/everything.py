"""Every printed statement with its derivation, by the sections of the report."""

from __future__ import annotations

from functools import cache, partial

from capsule_sym._symbolic.proofs.rows import Row, read_rows
from capsule_sym._symbolic.proofs.statement import Statement, Verdict, named
from paper.claims import (
    captions,
    dimensions,
    errata,
    fields,
    frozen,
    motions,
    segments,
    space,
    tables,
)
from paper.printed import Paper, read

CHECKS = (captions, dimensions, errata, fields, motions, segments, space, tables)
"""Modules that register checks and the names used in rows."""

PARTS = ("section_2", "section_3", "tables", "appendices", "section_4", "captions")
"""Files of rows, in the order of the paper."""


@cache
def rows(parts: tuple[str, ...] = PARTS) -> tuple[Row, ...]:
    """Rows of these files."""
    return read_rows(__package__, ".", parts)


def items(paper: Paper) -> tuple[Statement, ...]:
    """All comparisons with a transcription."""
    return tuple(item for row in rows() for item in row.items(paper))


_TITLES: dict[Verdict, str] = {
    "refuted": "Errata",
    "conditional": "Printed statements that hold under a condition",
    "proved": "Printed statements that hold",
}


@cache
def sections() -> dict[str, tuple[Statement, ...]]:
    """All comparisons with the transcription that is shipped, by the titles of the report."""
    found = items(read())
    return {title: tuple(i for i in found if i.verdict == v) for v, title in _TITLES.items()}


def item(name: str) -> dict[str, tuple[Statement, ...]]:
    """The comparison of this name by the title of its section; raises InvalidInput for none."""
    own = {title: partial(tuple, found) for title, found in sections().items()}
    return named(name, own, dict.fromkeys(own, "printed erratum"), frozen.expected().statuses)
