"""All that is computed about the paper: case study, proofs, hard cases, and the report."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import Any

import click

from capsule_sym._files import write_whole
from paper.figures.report import RESULTS, SOURCES

_ROOT = Path(__file__).parents[2]
_FOLDERS = ("capsule_sym", "generated", "paper", "benchmarks")
_CODE = (".py", ".pyx", ".c", ".h", ".toml", ".j2", ".html")


def write_everything() -> None:
    """Write the records of the paper, and the report on them, into results/.

    A file that is newer than all code and than the records that it is made from is kept. Exits with
    the status of a command that fails.
    """
    code = [
        path
        for folder in _FOLDERS
        for path in (_ROOT / folder).rglob("*")
        if path.suffix in _CODE and "tests" not in path.parts
    ]
    cases, proofs, hard = (SOURCES[name][0] for name in ("cases", "proofs", "hard"))
    if not _newest(cases, code):
        _end(_begin("paper", "case-study", "--out", str(cases.parent), out=None))
    wanted: dict[Path, list[tuple[str, ...]]] = {
        proofs: [("paper", "claims", "--json"), ("capsule_sym", "verify", "--json")],
        # A third shows each series of cases on both sides; the whole suite is a command and a test.
        hard: [("benchmarks", "hardcases", "--json", "--every", "3")],
    }
    begun = {
        path: [_begin(*words) for words in commands]
        for path, commands in wanted.items()
        if not _newest(path, code)
    }
    try:
        for path, processes in begun.items():
            write_whole(path, json.dumps(_merged(map(_end, processes)), ensure_ascii=False) + "\n")
            click.echo(f"wrote {path}", err=True)
    finally:
        for process in chain(*begun.values()):
            process.terminate()  # unless it has ended
            process.communicate()
    report = RESULTS / "report.html"
    if not _newest(report, [*code, cases, *wanted]):
        _end(_begin("paper", "report", "--out", str(report), out=None))


def _newest(made: Path, sources: Iterable[Path]) -> bool:
    """True if a file is there, and newer than all that it is made from."""
    if not made.exists():
        return False
    time = made.stat().st_mtime
    return all(path.stat().st_mtime < time for path in sources)


def _begin(*words: str, out: int | None = subprocess.PIPE) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", *words], stdout=out, text=True, encoding="utf-8")


def _end(process: subprocess.Popen[str]) -> str:
    """Output of a command; exits with its status if it fails."""
    printed = process.stdout.read() if process.stdout else ""
    process.wait()
    if process.returncode:
        raise click.exceptions.Exit(process.returncode)
    return printed


def _merged(printed: Iterable[str]) -> dict[str, Any]:
    """One record of several, the items of the first one first, each once."""
    records: list[dict[str, Any]] = [json.loads(text) for text in printed]
    first, *others = records
    for other in others:
        known = {item["id"] for item in first["items"]}
        first["items"] += [item for item in other["items"] if item["id"] not in known]
    return first
