"""Statements about entries of the transcription: what is printed beside what is derived."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from capsule_sym._symbolic.theory import (
    Statement,
    Verdict,
)
from paper.printed import Entry

AS_PRINTED = "as printed"
"""Text of `derived` if the derivation gives the printed statement."""

_READ = {
    "clear": "",
    "doubtful": " (doubtful scan: {})",
    "illegible": " (illegible in the scan: {})",
}


def beside(
    entry: Entry,
    name: str,
    check: Callable[..., bool],
    claim: Mapping[str, Any],
    wrong: Mapping[str, Any],
    *,
    says: str = "",
    printed: str = "",
    derived: str = AS_PRINTED,
    verdict: Verdict = "proved",
    place: str = "",
    **texts: Any,
) -> Statement:
    """Statement about an entry of the transcription.

    `printed` defaults to `says`; without `says` the statement is the printed text and the derived
    one. `texts` are further fields of the statement.
    """
    text = (printed or says) + _READ[entry.reading].format(entry.note)
    return Statement(
        name=f"{'erratum' if verdict == 'refuted' else 'printed'}.{name}",
        equation=place or entry.place,
        says=says or f"printed: {text}. Derived: {derived}",
        check=check,
        claim=claim,
        wrong=wrong,
        printed=text,
        derived=derived,
        verdict=verdict,
        **texts,
    )


def braces(texts: Iterable[str]) -> str:
    """Relations as a set in braces."""
    return "{" + ", ".join(texts) + "}"


def union(sets: Iterable[Iterable[str]]) -> str:
    """Sets of relations, any of which may hold."""
    return " or ".join(map(braces, sets))


def next_field(field: int) -> int:
    """Another field, for wrong claims."""
    return field % 6 + 1
