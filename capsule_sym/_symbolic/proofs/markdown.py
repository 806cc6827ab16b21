"""Reports of proofs in Markdown: comparisons with the paper one by one, others in tables."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count

from capsule_sym._symbolic.proofs.items import Report, Result

_LETTERS = {
    **{"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "zeta": "ζ", "omega": "ω"},
    **{"tau": "τ", "theta": "θ", "sigma": "σ", "nu": "ν", "pi": "π"},
}
_SIGNS = {"**2": "²", "**3": "³", "*": " ", "<=": "≤", ">=": "≥", "+-": "±", " - ": " − "}


def _text(line: str) -> str:
    """Line of text with the paper's letters, with Markdown's special characters escaped."""
    line = re.sub(r"[A-Za-z]+", lambda word: _LETTERS.get(word[0], word[0]), line)
    for old, new in _SIGNS.items():
        line = line.replace(old, new)
    return re.sub(r"(?<![\w)])-(?=[\w(])", "−", line)  # a minus, not a hyphen


def _cell(line: str) -> str:
    return _text(line).replace("|", "&#124;")


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


def _point(result: Result) -> str:
    return _text("; ".join(f"{name} = {value}" for name, value in result.witness.items()))


def _beside(result: Result, number: int) -> Iterator[str]:
    """Printed statement with the derived one, the proof, the witness and the consequence."""
    item = result.item
    yield f"### {number}. {item.equation}: {result.status}\n"
    yield f"- **Printed:** {_text(item.printed)}"
    yield f"- **Derived:** {_text(item.derived)}"
    if item.proof:
        yield f"- **Proof:** {_text(item.proof)}"
    if result.witness:
        yield f"- **Witness:** {_point(result)}"
    if item.consequence:
        yield f"- **Consequence:** {_text(item.consequence)}"
    yield f"- `{item.id}`, {result.seconds:.2f} s\n"
    if item.latex:
        yield f"$${math(item.latex)}$$\n"


def _rows(place: str, results: Iterable[Result]) -> Iterator[str]:
    heads = (place, "Statement", "Formula", "Status", "Identifier")
    yield from table(
        heads,
        (
            (
                _cell(result.item.equation),
                _cell(result.item.statement),
                f"${math(result.item.latex)}$" if result.item.latex else "",
                result.status,
                f"`{result.item.id}`",
            )
            for result in results
        ),
    )


def _witnesses(results: Iterable[Result]) -> Iterator[str]:
    """Witnesses of the statements of a section that have one and no place of their own."""
    for result in results:
        if result.witness:
            yield f"- `{result.item.id}`: {_point(result)}"


Tables = Mapping[str, Callable[[], Iterator[str]]]
"""Tables at the beginning of a section, by the beginning of its title."""


def document(report: Report, head: str, place: str = "Place", tables: Tables | None = None) -> str:
    """Report with every item in the order of the sections, formulas in LaTeX.

    `place` is the heading of the column with the place of a statement.
    """
    results = [result for section in report.values() for result in section]
    statuses = Counter(result.status for result in results)
    counts = ", ".join(f"{many} {status}" for status, many in sorted(statuses.items()))
    lines = [head, f"{len(results)} statements: {counts}.\n"]
    numbers = count(1)
    for title, section in report.items():
        lines += [f"## {title}\n"]
        for name, made in (tables or {}).items():
            if title == name or (name.startswith("Table") and title.startswith(name)):
                lines += [*made(), ""]
        for result in section:
            if result.item.printed:
                lines += _beside(result, next(numbers))
        rest = [result for result in section if not result.item.printed]
        if rest:
            lines += [*_rows(place, rest), "", *_witnesses(rest), ""]
    return "\n".join(lines).rstrip() + "\n"
