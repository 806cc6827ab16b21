"""Every printed statement with its derivation, by the sections of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial

from capsule_sym._symbolic import theory
from capsule_sym._symbolic.theory import (
    Statement,
    Verdict,
)
from paper.claims import appendices, captions, section_2, section_3, section_4, tables
from paper.printed import Paper, read

CLAIMS: tuple[Callable[[Paper], Iterator[Statement]], ...] = tuple(
    claims
    for part in (section_2, section_3, tables, appendices, section_4, captions)
    for claims in part.STATEMENTS
)
"""Statements about a transcription, in the order of the paper."""

_TITLES: dict[Verdict, str] = {
    "refuted": "Errata",
    "conditional": "Printed statements that hold under a condition",
    "proved": "Printed statements that hold",
}


@cache
def statements(paper: Paper) -> tuple[Statement, ...]:
    """All comparisons with a transcription."""
    return tuple(one for claims in CLAIMS for one in claims(paper))


@cache
def sections() -> dict[str, tuple[Statement, ...]]:
    """All comparisons with the transcription that is shipped, by the titles of the report."""
    found = statements(read())
    return {
        title: tuple(one for one in found if one.verdict == verdict)
        for verdict, title in _TITLES.items()
    }


def named(name: str) -> dict[str, tuple[Statement, ...]]:
    """Comparisons of a section or of names that begin so; raises InvalidInput for none."""
    own = {title: partial(tuple, found) for title, found in sections().items()}
    return theory.named(name, own, {title: "printed erratum" for title in own})
