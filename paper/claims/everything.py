"""Every printed statement with its derivation, by the sections of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial

from capsule_sym._symbolic import theory
from capsule_sym._symbolic.theory import (
    Statement,
    Verdict,
)
from paper.claims import (
    appendices,
    captions,
    every_motion,
    resting,
    section_2,
    section_3,
    section_4,
    tables,
)
from paper.derived import appendices as stick
from paper.derived import inner_products
from paper.derived.tables import table_2, table_3
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

_THEOREMS: dict[str, tuple[Callable[[], Iterator[Statement]], str]] = {
    "The resting orbit": (resting.resting_orbit, "grazing"),
    "Where every motion goes": (every_motion.attraction, "attraction"),
    "Eqs. (16)-(23): inner products": (inner_products.inner, "inner"),
    "Table 2: passages on lines": (table_2, "table2"),
    "Table 3: local maps": (table_3, "table3"),
    "Appendices A, B: stick on L1-L4": (stick.items, "appendix"),
}
"""Theorems that are not printed so: their statements, and the word that names begin with."""


@cache
def statements(paper: Paper) -> tuple[Statement, ...]:
    """All comparisons with a transcription."""
    return tuple(one for claims in CLAIMS for one in claims(paper))


@cache
def sections() -> dict[str, tuple[Statement, ...]]:
    """All comparisons with the transcription that is shipped, and theorems, by title."""
    found = statements(read())
    return {
        title: tuple(one for one in found if one.verdict == verdict)
        for verdict, title in _TITLES.items()
    } | {title: tuple(theorems()) for title, (theorems, _) in _THEOREMS.items()}


def named(name: str) -> dict[str, tuple[Statement, ...]]:
    """Comparisons of a section or of names that begin so; raises InvalidInput for none."""
    own = {title: partial(tuple, found) for title, found in sections().items()}
    families = dict.fromkeys(own, "printed erratum") | {
        t: word for t, (_, word) in _THEOREMS.items()
    }
    return theory.named(name, own, families)
