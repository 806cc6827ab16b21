"""Expected verdicts: `verdicts.toml`, which is changed on purpose only.

It holds the status of every statement and, for each comparison with the paper, the printed text,
the derived one and the witness. `differences` lists changed verdicts, errata with another text, and
statements that are missing or new.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from capsule_sym._files import write_whole
from capsule_sym._symbolic.theory import (
    Finding,
    Statement,
)
from paper.claims.beside import AS_PRINTED

PATH = Path(__file__).with_name("verdicts.toml")

_HEAD = """\
# Expected verdicts of `python -m paper claims`, written by its option --freeze. A change here
# changes the claims of the project: make it on purpose, and read it before it is kept.
"""


@dataclass(frozen=True)
class Expected:
    """Statuses by identifier, and the texts of comparisons with the paper."""

    statuses: Mapping[str, str]
    words: Mapping[str, Mapping[str, str]]


@cache
def expected() -> Expected:
    """Expected verdicts that are shipped."""
    document = tomllib.loads(PATH.read_text(encoding="utf-8")) if PATH.exists() else {}
    return Expected(document.get("status", {}), document.get("words", {}))


def words(item: Statement, witness: Mapping[str, str]) -> dict[str, str]:
    """Texts of a comparison with the paper; empty for other statements.

    A derived text equal to the printed one is left out.
    """
    if not item.printed:
        return {}
    derived = "" if item.derived == AS_PRINTED else item.derived or "nothing"
    point = "; ".join(f"{name} = {value}" for name, value in witness.items())
    texts = {"printed": item.printed, "derived": derived, "witness": point}
    return {key: text for key, text in texts.items() if text}


def differences(results: Iterable[Finding], frozen: Expected, whole: bool = True) -> Iterator[str]:
    """Differences between results and expected verdicts; `whole` if all statements were run."""
    found = {result.statement.name: result for result in results}
    for name, result in found.items():
        if name not in frozen.statuses:
            yield f"{name}: {result.status}, and not expected"
            continue
        if result.status != frozen.statuses[name]:
            yield f"{name}: {result.status}, expected: {frozen.statuses[name]}"
            continue
        now, then = words(result.statement, result.witness), frozen.words.get(name, {})
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


def _lines(results: Iterable[Finding]) -> Iterator[str]:
    results = sorted(results, key=lambda result: result.statement.name)
    yield _HEAD
    yield "[status]"
    yield from (
        f"{_quoted(result.statement.name)} = {_quoted(result.status)}" for result in results
    )
    for result in results:
        if texts := words(result.statement, result.witness):
            yield f"\n[words.{_quoted(result.statement.name)}]"
            yield from (f"{key} = {_quoted(text)}" for key, text in texts.items())


def freeze(results: Iterable[Finding], path: Path = PATH) -> None:
    """Save the results as the expected verdicts."""
    write_whole(path, "\n".join(_lines(results)) + "\n", "--freeze")
    expected.cache_clear()
