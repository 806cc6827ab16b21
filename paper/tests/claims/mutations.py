"""Changes to the transcription of the paper, each of which some statement has to notice.

Every value of every entry is changed in one way or more: a sign, an index, a relation, a digit, a
name, the order of a list. A change is noticed when a statement that reads it cannot be made, is no
longer proved, or has another text than expected.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from capsule_sym._symbolic.proofs.statement import Statement, settle
from paper.claims import everything
from paper.claims.frozen import Expected, differences
from paper.printed import Entry, Paper

Path = tuple[Any, ...]

_KINDS = (
    "grazing",
    "adding-sliding",
    "boundary-intersection crossing",
    "crossing-sliding",
    "switching-sliding",
    "grazing-sliding",
)
_WORDS = {
    **dict(zip(_KINDS, (*_KINDS[1:], _KINDS[0]), strict=True)),
    **{"adding": "crossing", "crossing": "switching", "switching": "adding"},
    **{
        "repelling": "attracting",
        "forward": "backward",
        "backward": "forward",
        "ends": "begins",
        "begins": "ends",
        "with": "without",
        "without": "with",
        "meets": "inserted",
        "inserted": "point",
        "point": "meets",
        "impact": "forward",
        "attracting": "grazing",
    },
    **{"blue": "red", "red": "blue", "magenta": "green", "green": "black"},
    **{"black": "orange", "orange": "magenta", "<": ">", ">": "<", "?": "<"},
}


@dataclass(frozen=True)
class Mutation:
    """A value of an entry, at a path into it, and what stands there instead."""

    entry: str
    path: Path
    before: Any
    after: Any

    def __str__(self) -> str:
        place = ".".join(map(str, self.path))
        return f"{self.entry}: {place}: {self.before!r} -> {self.after!r}"


def _other_number(text: str) -> str:
    """A decimal with its last digit changed."""
    return text[:-1] + str((int(text[-1]) + 1) % 10)


def _other_name(text: str) -> str:
    """A name such as L3, Σ10, F2, L2^(1), NC-FD or 6(c) with another index or mode."""
    if match := re.fullmatch(r"(.*\^\()(\d)(\))", text):
        return match[1] + str(int(match[2]) % 3 + 1) + match[3]
    if match := re.fullmatch(r"(\D*)(\d+)", text):
        return match[1] + str(int(match[2]) % 6 + 1)
    if match := re.fullmatch(r"(\d)\((\w)\)", text):
        return f"{match[1]}({'b' if match[2] != 'b' else 'f'})"
    return text.replace("FD", "BD") if "FD" in text else text.replace("BD", "FD", 1)


def _formulas(text: str) -> Iterator[str]:
    """A formula with a relation turned, a sign changed, an index or a symbol exchanged."""
    for old, new in (("==", ">"), ("<=", ">="), (">=", "<="), (" < ", " > "), (" > ", " < ")):
        if old in text:
            yield text.replace(old, new, 1)
            break
    if " + " in text:
        yield text.replace(" + ", " - ", 1)
    if " - " in text:
        yield text.replace(" - ", " + ", 1)
    for old, new in (("P3", "P4"), ("P4", "P3"), ("delta", "f_b"), ("alpha", "beta")):
        if old in text:
            yield text.replace(old, new, 1)
            break
    if not re.search(r" [-+<>=]=? ", text):
        yield text[1:] if text.startswith("-") else f"-{text}"


def _texts(text: str) -> Iterator[str]:
    if re.fullmatch(r"-?\d+(\.\d+)?", text):
        yield _other_number(text)
        yield text + "5" if "." in text else text + ".5"
    elif text in _WORDS:
        yield _WORDS[text]
    elif "∘" in text:
        parts = text.split(" ∘ ")
        yield " ∘ ".join(parts[1:])
        yield text.replace("F4,Σ4", "F4,Σ2").replace("P_{Σ5,F2", "P_{Σ4,F2")
        yield text.replace("F2", "F1", 1)
    elif text.startswith("Id_"):
        yield text.replace("F2", "F5")
    elif "→" in text:
        yield " → ".join(reversed(text.split(" → "))) + " "
        yield text.replace("FD", "XD", 1).replace("NC-S", "C-S", 1)
    elif re.fullmatch(r"[A-ZΣ]?[a-z]?\d+|L\d\^\(\d\)|N?C-\w+|\d\(\w\)|no F\d", text):
        yield _other_name(text)
    elif re.fullmatch(r"[a-p]", text):
        yield "q" if text == "p" else chr(ord(text) + 1)
    else:
        yield from _formulas(text)


def _changes(value: Any) -> Iterator[tuple[Path, Any, Any]]:
    """Paths into a value, with what is there and what is to be there instead."""
    if isinstance(value, bool):
        yield (), value, not value
    elif isinstance(value, int):
        yield (), value, value % 6 + 1
    elif isinstance(value, str):
        for after in _texts(value):
            if after != value:
                yield (), value, after
    elif isinstance(value, Mapping):
        for key, part in value.items():
            for path, before, after in _changes(part):
                yield (key, *path), before, after
    else:
        if not value:
            yield (), value, ["c"]
        if len(value) > 1 and value[1:] != value[:-1]:
            yield (), value, value[1:]  # one left out
        if len(value) > 1 and value[::-1] != value and isinstance(value[0], list):
            yield (0,), value[0], value[-1]  # one given twice, another lost
        for index, part in enumerate(value):
            for path, before, after in _changes(part):
                yield (index, *path), before, after


def mutations(paper: Paper) -> Iterator[Mutation]:
    """Every change of every value of the transcription."""
    for entry in paper:
        for path, before, after in _changes(dict(entry.printed)):
            yield Mutation(entry.id, path, before, after)


def changed(paper: Paper, mutation: Mutation) -> Paper:
    """The transcription with one value changed."""

    def with_change(entry: Entry) -> Entry:
        if entry.id != mutation.entry:
            return entry
        printed = copy.deepcopy(dict(entry.printed))
        at: Any = printed
        for step in mutation.path[:-1]:
            at = at[step]
        at[mutation.path[-1]] = mutation.after
        return Entry(entry.id, entry.place, entry.reading, entry.note, printed)

    return Paper({entry.id: with_change(entry) for entry in paper})


class Reader(Paper):
    """A transcription that remembers which entries were read."""

    def __init__(self, paper: Paper) -> None:
        super().__init__({entry.id: entry for entry in paper})
        self.read: set[str] = set()

    def __getitem__(self, name: str) -> Entry:
        self.read.add(name)
        return super().__getitem__(name)

    def __iter__(self) -> Iterator[Entry]:
        self.read.update(self._entries)
        return super().__iter__()

    def begun_with(self, prefix: str) -> tuple[Entry, ...]:
        found = Paper(self._entries).begun_with(prefix)  # no entry changes its name
        self.read.update(entry.id for entry in found)
        return found


Claims = Callable[[Paper], Iterator[Statement]]
Key = tuple[Any, ...]


def _key(item: Statement) -> Key:
    return (
        item.name,
        item.equation,
        item.claim,
        item.correction,
        item.verdict,
        item.printed,
        item.derived,
    )


@dataclass(frozen=True)
class Baseline:
    """The statements of the unchanged transcription, and the entries that each function reads."""

    paper: Paper
    items: Mapping[Claims, Mapping[str, Statement]]
    reads: Mapping[Claims, frozenset[str]]

    @classmethod
    def of(cls, paper: Paper) -> Baseline:
        """The baseline of a transcription."""
        items, reads = {}, {}
        for claims in everything.CLAIMS:
            reader = Reader(paper)
            items[claims] = {item.name: item for item in claims(reader)}
            reads[claims] = frozenset(reader.read)
        return cls(paper, items, reads)


def noticed(mutation: Mutation, baseline: Baseline, frozen: Expected) -> str:
    """Way in which a change is noticed: `refused`, `verdict` or `words`; empty if it is not.

    Statements whose claim has not changed keep their result, since a check reads its claim only.
    """
    paper = changed(baseline.paper, mutation)
    by_words = ""
    for claims, before in baseline.items.items():
        if mutation.entry not in baseline.reads[claims]:
            continue
        try:
            now = {item.name: item for item in claims(paper)}
        except Exception:
            return "refused"
        if set(now) != set(before):
            return "verdict"
        for item in now.values():
            if _key(item) == _key(before[item.name]):
                continue
            try:
                result = settle(item)
            except Exception:
                return "refused"
            if not result.settled:
                return "verdict"
            if list(differences([result], frozen, whole=False)):
                by_words = "words"
    return by_words
