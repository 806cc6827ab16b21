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
_SIGNS = {"**2": "²", "**3": "³", "**": "^", "*": " ", "->": "→"}
_SIGNS |= {"<=": "≤", ">=": "≥", "+-": "±", " - ": " − "}


def text(line: str) -> str:
    """Line of text with Greek letters, and typographic signs for operators of code."""
    line = re.sub(r"[A-Za-z]+", lambda word: LETTERS.get(word[0], word[0]), line)
    for old, new in _SIGNS.items():
        line = line.replace(old, new)
    return re.sub(r"(?<![\w)])-(?=[\w(])", "−", line)  # a minus, not a hyphen


def marked(line: str) -> str:
    """Line of text with subscripts and powers, such as those of v_r' and of omega**4, as HTML."""
    line = re.sub(
        r"(?<![A-Za-z])([A-Za-zα-ω])_([a-z0-9])(?![a-z0-9_])", r"\1<sub>\2</sub>", text(line)
    )
    return re.sub(r"\^(\d+|\(\d\))", r"<sup>\1</sup>", line)


def _cell(line: str) -> str:
    return marked(line).replace("|", "&#124;")


_ESCAPED = {r"\{": r"\lbrace ", r"\}": r"\rbrace ", r"\,": r"\thinspace ", "|": r"\vert "}


def math(formula: str) -> str:
    """Formula without characters that Markdown reads as an escape or a table cell's end."""
    for old, new in _ESCAPED.items():
        formula = formula.replace(old, new)
    return formula


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Lines of a table in Markdown."""
    yield f"| {' | '.join(heads)} |"
    yield f"|{'---|' * len(heads)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def point(result: Finding) -> str:
    """Witness of a result in a line."""
    return marked("; ".join(f"{name} = {value}" for name, value in result.witness.items()))


def _row(result: Finding) -> tuple[str, ...]:
    """Cells of a statement, its formula below its text."""
    statement = result.statement
    below = f"<br>${math(statement.latex)}$" if statement.latex else ""
    says = f"{_cell(statement.says)}{below}"
    return _cell(statement.equation), says, result.status, f"`{statement.name}`"


def _proofs(results: Iterable[Finding]) -> Iterator[str]:
    """Texts of proofs and witnesses, of the statements that have one."""
    for result in results:
        if result.statement.proof:
            yield f"- `{result.statement.name}`: {marked(result.statement.proof)}"
        if result.witness:
            yield f"- `{result.statement.name}`: {point(result)}"


def counts(report: Report) -> str:
    """Number of statements of a report, and of each status."""
    statuses = Counter(result.status for section in report.values() for result in section)
    told = ", ".join(f"{many} {status}" for status, many in sorted(statuses.items()))
    return f"{statuses.total()} statements: {told}.\n"


def theorems(results: Sequence[Finding]) -> Iterator[str]:
    """Lines of a section: a row a statement, with its formula, then the texts of proofs."""
    yield from table(("Place", "Statement", "Status", "Identifier"), map(_row, results))
    yield ""
    yield from _proofs(results)
    yield ""


def document(report: Report, head: str) -> str:
    """Report with every statement in the order of the sections, formulas in LaTeX."""
    lines = [head, counts(report)]
    for title, results in report.items():
        lines += [f"## {title}\n", *theorems(results)]
    return "\n".join(lines).rstrip() + "\n"
