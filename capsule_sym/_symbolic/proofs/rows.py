"""Rows of `statements/` and of `claims/`, from which statements are made.

A row names the check and its arguments, a wrong claim, and the sentences of the report; a claim
about the paper names the entry of the transcription. Texts are templates: `{e[value]}` is a value
of the entry, other names are those of `each` and of `FACTS`, and names after a colon are those of
`FILTERS`. A template that is one field alone stands for the value itself. `{{` is a brace.

With a `correction` the row is refuted: the check holds with it, and fails for the printed text.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files
from inspect import signature
from string import Formatter
from typing import Any, TypeVar, cast

from capsule_sym._symbolic.proofs.statement import AS_PRINTED, Statement, Verdict
from paper.printed import Entry, Paper

Check = TypeVar("Check", bound=Callable[..., bool])
CHECKERS: dict[str, Callable[..., bool]] = {}
"""Checks by name: functions of a row's arguments."""
DEFAULTS: dict[str, Mapping[str, Any]] = {}
"""Default arguments of a check."""
EACH: dict[str, Callable[[Context], Iterator[dict[str, Any]]]] = {}
"""Repetitions of a row: the names that each repetition has."""
FACTS: dict[str, Callable[[Context], Any]] = {}
"""Names that every template may use, computed from those of the entry and of `each`."""
FILTERS: dict[str, Callable[[Any], Any]] = {}
"""Functions that may follow the colon of a field."""
WITNESSES: dict[str, Callable[[Any], Mapping[str, str]]] = {}
"""Exact points or motions that a row can show, by kind."""

_READ = {
    "clear": "",
    "doubtful": " (doubtful scan: {})",
    "illegible": " (illegible in the scan: {})",
}


def checker(check: Check) -> Check:
    """Register a check under its name."""
    CHECKERS[check.__name__] = check
    return check


class Context(dict[str, Any]):
    """Names of a repetition of a row; a fact is computed when it is first used."""

    def __missing__(self, name: str) -> Any:
        self[name] = FACTS[name](self)
        return self[name]


class _Templates(Formatter):
    def format_field(self, value: Any, spec: str) -> str:
        return str(_filtered(value, spec))


def _filtered(value: Any, spec: str) -> Any:
    for name in filter(None, spec.split("|")):
        value = FILTERS[name](value)
    return value


_TEMPLATES = _Templates()


def _tuples(value: Any) -> Any:
    """Lists as tuples, which can be compared and hashed."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def resolved(template: Any, context: Context) -> Any:
    """Value of a row with its templates filled in: lists as tuples, a lone field as its value."""
    if isinstance(template, Mapping):
        return {key: resolved(value, context) for key, value in template.items()}
    if isinstance(template, list):
        return tuple(resolved(value, context) for value in template)
    if not isinstance(template, str):
        return template
    parsed = list(_TEMPLATES.parse(template))
    if len(parsed) == 1 and not parsed[0][0] and parsed[0][1]:
        value, _ = _TEMPLATES.get_field(parsed[0][1], (), context)
        return _tuples(_filtered(value, parsed[0][2] or ""))
    return _TEMPLATES.vformat(template, (), context)


_TEXTS = ("says", "printed", "derived", "proof", "consequence", "formula", "place", "verdict")
_KEYS = {
    *_TEXTS,
    "name",
    "entry",
    "each",
    "skip",
    "check",
    "given",
    "wrong",
    "correction",
    "witness",
}


@dataclass(frozen=True, eq=False)
class Row:
    """A row, which gives one statement or one for each entry of a list."""

    fields: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Raises ValueError for an unknown key or check."""
        if unknown := self.fields.keys() - _KEYS:
            raise ValueError(f"{self.name}: no key of a row: {', '.join(sorted(unknown))}")
        if self.fields["check"] not in CHECKERS:
            raise ValueError(f"{self.name}: no check: {self.fields['check']}")
        known = signature(CHECKERS[self.fields["check"]]).parameters
        for table in ("given", "wrong", "correction"):
            if unknown := self.fields.get(table, {}).keys() - known:
                raise ValueError(f"{self.name}: {table}: {', '.join(sorted(unknown))}")

    @property
    def name(self) -> str:
        """Names of its claims, as a template."""
        return str(self.fields["name"])

    def items(self, paper: Paper | None = None) -> Iterator[Statement]:
        """Statements of the row, compared with a transcription if they are about the paper."""
        for context in self._contexts(paper or Paper({})):
            if context.get("key") not in self.fields.get("skip", ()):
                yield self._item(context)

    def _contexts(self, paper: Paper) -> Iterator[Context]:
        entries = self.fields.get("entry", "")
        for entry in [entries] if isinstance(entries, str) else entries:
            start, each = Context(paper=paper), self.fields.get("each", [{}])
            if entry and "{" not in entry:
                start["e"] = paper[entry]
            if isinstance(each, str):
                each = EACH[each](start) if each in EACH else start["e"][each]
            elif isinstance(each, Mapping):
                each = _printed_rows(start["e"], each["rows"])
            for one in each:
                context = Context(start | (one if isinstance(one, dict) else {"key": one}))
                if entry and "e" not in context:
                    context["e"] = paper[resolved(entry, context)]
                yield context

    def _item(self, context: Context) -> Statement:
        fields = {**DEFAULTS.get(self.fields["check"], {}), **self.fields}
        check = CHECKERS[fields["check"]]

        def text(key: str, default: str = "") -> str:
            return str(resolved(fields.get(key, default), context))

        given = context["given"] = resolved(fields["given"], context)
        wrong = resolved(fields.get("wrong", {}), context)
        correction = fields.get("correction")
        witness = partial(_witness, fields["witness"], context) if "witness" in fields else None
        item = Statement(
            name=text("name"),
            equation=text("place"),
            says=text("says"),
            check=check,
            claim=given,
            wrong=wrong,
            correction=None if correction is None else resolved(correction, context),
            formula=partial(text, "formula"),
            verdict=cast(Verdict, text("verdict", "proved")),
            proof=text("proof"),
            consequence=text("consequence"),
            witness=witness,
        )
        if "e" not in context:
            return item
        printed, derived = text("printed", item.says), text("derived", AS_PRINTED)
        return _beside(context["e"], item, printed, derived)


def _printed_rows(entry: Entry, names: Iterable[str]) -> Iterator[dict[str, Any]]:
    """Printed rows of an entry, their values by name and their number as `key`."""
    for number, row in enumerate(entry["rows"], start=1):
        yield {"key": number, **dict(zip(names, row, strict=True))}


def _beside(entry: Entry, item: Statement, printed: str, derived: str) -> Statement:
    """Item of a claim about an entry of the transcription."""
    told = printed + _READ[entry.reading].format(entry.note)
    return replace(
        item,
        name=f"{'erratum' if item.verdict == 'refuted' else 'printed'}.{item.name}",
        equation=item.equation or entry.place,
        says=item.says or f"printed: {told}. Derived: {derived}",
        printed=told,
        derived=derived,
    )


def _witness(fields: Mapping[str, Any], context: Context) -> Mapping[str, str]:
    ((kind, template),) = fields.items()
    return WITNESSES[kind](resolved(template, context))


def read_rows(package: str, folder: str, names: Iterable[str]) -> tuple[Row, ...]:
    """Rows of files in a folder of a package."""
    place = files(package) / folder
    texts = (place.joinpath(f"{name}.toml").read_text(encoding="utf-8") for name in names)
    return tuple(Row(row) for text in texts for row in tomllib.loads(text)["claim"])
