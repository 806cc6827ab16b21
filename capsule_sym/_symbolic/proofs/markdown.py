"""Reports of proofs in Markdown: a table of statements for each section."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from capsule_sym._symbolic.proofs.statement import Finding, Report

LETTERS = {
    **{"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "zeta": "ζ", "omega": "ω"},
    **{"tau": "τ", "theta": "θ", "sigma": "σ", "nu": "ν", "pi": "π"},
}
_SIGNS = {"**2": "²", "**3": "³", "*": " ", "<=": "≤", ">=": "≥", "+-": "±", " - ": " − "}


def text(line: str) -> str:
    """Line of text with the paper's letters, with Markdown's special characters escaped."""
    line = re.sub(r"[A-Za-z]+", lambda word: LETTERS.get(word[0], word[0]), line)
    for old, new in _SIGNS.items():
        line = line.replace(old, new)
    return re.sub(r"(?<![\w)])-(?=[\w(])", "−", line)  # a minus, not a hyphen


def _cell(line: str) -> str:
    return text(line).replace("|", "&#124;")


_ESCAPED = {r"\{": r"\lbrace ", r"\}": r"\rbrace ", r"\,": r"\thinspace ", "|": r"\vert "}


def math(formula: str) -> str:
    """Formula without characters that Markdown reads as an escape or a table cell's end."""
    for old, new in _ESCAPED.items():
        formula = formula.replace(old, new)
    return formula


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Table in Markdown."""
    yield f"| {' | '.join(heads)} |"
    yield f"|{'---|' * len(heads)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def point(result: Finding) -> str:
    """Witness of a result in a line."""
    return text("; ".join(f"{name} = {value}" for name, value in result.witness.items()))


def _rows(results: Iterable[Finding]) -> Iterator[str]:
    heads = ("Place", "Statement", "Formula", "Status", "Identifier")
    yield from table(
        heads,
        (
            (
                _cell(result.statement.equation),
                _cell(result.statement.says),
                f"${math(result.statement.latex)}$" if result.statement.latex else "",
                result.status,
                f"`{result.statement.name}`",
            )
            for result in results
        ),
    )


def _proofs(results: Iterable[Finding]) -> Iterator[str]:
    """Texts of proofs and witnesses, of the statements that have one."""
    for result in results:
        if result.statement.proof:
            yield f"- `{result.statement.name}`: {text(result.statement.proof)}"
        if result.witness:
            yield f"- `{result.statement.name}`: {point(result)}"


def counts(report: Report) -> str:
    """Number of statements of a report, and of each status."""
    statuses = Counter(result.status for section in report.values() for result in section)
    told = ", ".join(f"{many} {status}" for status, many in sorted(statuses.items()))
    return f"{statuses.total()} statements: {told}.\n"


def theorems(results: Sequence[Finding]) -> Iterator[str]:
    """Lines of a section: a row a statement, with its formula, then the texts of proofs."""
    yield from _rows(results)
    yield ""
    yield from _proofs(results)
    yield ""


def document(report: Report, head: str) -> str:
    """Report with every statement in the order of the sections, formulas in LaTeX."""
    lines = [head, counts(report)]
    for title, results in report.items():
        lines += [f"## {title}\n", *theorems(results)]
    return "\n".join(lines).rstrip() + "\n"
