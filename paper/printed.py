"""The printed paper as data: `paper.toml`, entry by entry, without SymPy.

No other module contains printed data. `casestudy` and `thresholds` read Section 4 here, and
`paper.claims` compares every entry with the derivation.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from capsule_sym import InvalidInput

Reading = Literal["clear", "doubtful", "illegible"]

_ABOUT = ("id", "place", "reading", "note", "columns")


@dataclass(frozen=True)
class Entry:
    """Printed data at one place of the paper, by key, and the certainty of its reading."""

    id: str
    place: str
    reading: Reading
    note: str
    printed: Mapping[str, Any]

    def __getitem__(self, key: str) -> Any:
        """A printed formula, number, name or list."""
        return self.printed[key]


class Paper:
    """The entries of the transcription by identifier."""

    def __init__(self, entries: Mapping[str, Entry]) -> None:
        self._entries = dict(entries)

    def __getitem__(self, name: str) -> Entry:
        return self._entries[name]

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    def begun_with(self, prefix: str) -> tuple[Entry, ...]:
        """The entries `prefix`1, `prefix`2, ... in their order."""
        return tuple(e for e in self if e.id.removeprefix(prefix).isdigit())


@dataclass(frozen=True)
class Row:
    """Row of Section 4: the global map for alpha up to `high`, and the event there.

    It holds from `low`, or only at `high` if `low` is None, and at `high` too if `closed`. Numbers
    are decimal, as printed; event, line and panel may be empty.
    """

    high: str
    closed: bool
    map: str
    low: str | None = None
    event: str = ""
    line: str = ""
    panel: str = ""


@dataclass(frozen=True)
class Event:
    """A bifurcation of Section 4: its type, the line or part of a line, and alpha as printed."""

    type: str
    line: str
    alpha: str


def section_4(paper: Paper) -> tuple[Row, ...]:
    """The rows of Section 4 in order of alpha."""
    return tuple(Row(**entry.printed) for entry in paper.begun_with("section.4."))


def row_at(paper: Paper, alpha: str | float) -> Row:
    """Row of an amplitude; a row for that value alone takes precedence.

    Raises InvalidInput for an amplitude that has none.
    """
    for row in section_4(paper) if float(alpha) > 0 else ():
        value, high = Fraction(str(alpha)), Fraction(row.high)
        if value < high or (row.closed and value == high):
            return row
    raise InvalidInput("alpha", alpha, "in (0, 2]")


def events(paper: Paper) -> tuple[Event, ...]:
    """The bifurcations of Section 4 in the printed order."""
    return tuple(Event(row.event, row.line, row.high) for row in section_4(paper) if row.event)


def panels(paper: Paper) -> dict[str, str]:
    """Excitation amplitude alpha of each panel of Fig. 7."""
    return dict(paper["figure.7"].printed)


def paper_of(document: Mapping[str, Any]) -> Paper:
    """Transcription from a parsed TOML document; no identifier may occur twice."""
    names = [record["id"] for record in document["entry"]]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"transcribed twice: {', '.join(twice)}")
    entries = {
        record["id"]: Entry(
            id=record["id"],
            place=record["place"],
            reading=record["reading"],
            note=record.get("note", ""),
            printed={key: value for key, value in record.items() if key not in _ABOUT},
        )
        for record in document["entry"]
    }
    return Paper(entries)


@cache
def read() -> Paper:
    """Transcription that is shipped."""
    text = (files(__package__) / "paper.toml").read_text(encoding="utf-8")
    return paper_of(tomllib.loads(text))
