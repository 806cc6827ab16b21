"""The verdicts that are expected: `verdicts.toml`, changed on purpose only.

It holds the status of every statement, and of each that is set beside the paper what is printed,
what is derived and the witness. `differences` tells what is otherwise now: a changed verdict, an
erratum that reads differently, a statement that is missing or new.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from capsule_sym._files import write_whole
from capsule_sym._symbolic.proofs.items import AS_PRINTED, Item, Result

PATH = Path(__file__).with_name("verdicts.toml")

_HEAD = """\
# What `capsule-sym verify` is expected to find. Written by `capsule-sym verify --freeze`; a change
# here is a change of what the project claims, to be made on purpose and read before it is kept.
"""


@dataclass(frozen=True)
class Expected:
    """Statuses by identifier, and what comparisons with the paper say."""

    statuses: Mapping[str, str]
    words: Mapping[str, Mapping[str, str]]


@cache
def expected() -> Expected:
    """The expected verdicts that are shipped."""
    document = tomllib.loads(PATH.read_text(encoding="utf-8")) if PATH.exists() else {}
    return Expected(document.get("status", {}), document.get("words", {}))


def words(item: Item, witness: Mapping[str, str]) -> dict[str, str]:
    """What a comparison with the paper says; nothing for other statements.

    That what is derived is as printed goes without saying.
    """
    if not item.printed:
        return {}
    derived = "" if item.derived == AS_PRINTED else item.derived or "nothing"
    told = "; ".join(f"{name} = {value}" for name, value in witness.items())
    said = {"printed": item.printed, "derived": derived, "witness": told}
    return {key: text for key, text in said.items() if text}


def differences(results: Iterable[Result], frozen: Expected, whole: bool = True) -> Iterator[str]:
    """Lines that tell where results differ from what is expected; `whole`: of all statements."""
    found = {result.item.id: result for result in results}
    for name, result in found.items():
        if name not in frozen.statuses:
            yield f"{name}: {result.status}, and not expected"
            continue
        if result.status != frozen.statuses[name]:
            yield f"{name}: {result.status}, expected: {frozen.statuses[name]}"
            continue
        now, then = words(result.item, result.witness), frozen.words.get(name, {})
        for key in sorted({*now, *then}):
            if now.get(key) != then.get(key):
                yield f"{name}: {key} {now.get(key)!r}, expected: {then.get(key)!r}"
    if whole:
        yield from (
            f"{name}: missing, expected: {status}"
            for name, status in frozen.statuses.items()
            if name not in found
        )


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _lines(results: Iterable[Result]) -> Iterator[str]:
    results = sorted(results, key=lambda result: result.item.id)
    yield _HEAD
    yield "[status]"
    yield from (f"{_quoted(result.item.id)} = {_quoted(result.status)}" for result in results)
    for result in results:
        if said := words(result.item, result.witness):
            yield f"\n[words.{_quoted(result.item.id)}]"
            yield from (f"{key} = {_quoted(text)}" for key, text in said.items())


def freeze(results: Iterable[Result], path: Path = PATH) -> None:
    """Make the results what is expected."""
    write_whole(path, "\n".join(_lines(results)) + "\n", "--freeze")
    expected.cache_clear()
