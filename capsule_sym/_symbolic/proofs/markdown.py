"""Reports of proofs in Markdown: comparisons with the paper one by one, others in tables."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import groupby

from capsule_sym._symbolic.proofs.statement import Report, Result

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


_NAME = (
    rf"(?:{'|'.join(_LETTERS)}|abs|cos|sin|sqrt|sign|mu|Omega(?:_0|\d)?|[A-Za-z]{{1,2}}_\w+|"
    r"[PFSLOH]\d+(?:\^\(\d\))?|[XVAGHPcgtvx])(?![\w^])'?"
)
_TOKEN = rf"(?:P_\{{[^}}]*\}}|\{{[^}}]*\}}|{_NAME}|\d[\d.]*(?!\w)|[-−+*/=<>≤≥±∘|()²³])"
_FORMULA = re.compile(rf"(?<![\w.]){_TOKEN}(?: ?{_TOKEN})*")
_NAMED = {"abs": "operatorname{abs}", "sqrt": "operatorname{sqrt}", "sign": "operatorname{sign}"}
_NAMED |= {word: word for word in (*_LETTERS, "cos", "sin", "mu", "Omega")}
_MARKS = {"**": "^", "==": "=", "<=": r"\le ", ">=": r"\ge ", "≤": r"\le ", "≥": r"\ge ", "*": " "}
_MARKS |= {
    "±": r"\pm ",
    "∘": r"\circ ",
    "−": "-",
    "Σ": r"\Sigma",
    "²": "^2",
    "³": "^3",
    "|": r"\vert ",
}


def _latex(formula: str) -> str:
    """A formula of the transcription as LaTeX, term for term as it is printed."""
    formula = re.sub(r"P_\{[^}]*\}", lambda map_: re.sub(r"(\d+)", r"_{\1}", map_[0]), formula)
    formula = re.sub(
        r"(?<!_)\{([^}_]|(?<!P)_)*\}", lambda set_: rf"\lbrace {set_[0][1:-1]}\rbrace ", formula
    )
    formula = re.sub(r"\b([A-Za-z]+)(\d+)\b", r"\1_{\2}", formula)
    formula = re.sub(r"\b([A-Za-z]{1,2})_([A-Za-z]\w+)", r"\1_{\2}", formula)
    formula = re.sub(
        r"[A-Za-z]+",
        lambda word: rf"\{_NAMED[word[0]]} " if word[0] in _NAMED else word[0],
        formula,
    )
    for old, new in _MARKS.items():
        formula = formula.replace(old, new)
    return formula


def _shown(line: str) -> str:
    """A line of text, its formulas in LaTeX."""

    def one(found: re.Match[str]) -> str:
        text = found[0].rstrip(" (")
        before, after = "", found[0][len(text) :]
        while text.count("(") > text.count(")") and text.startswith("("):
            text, before = text[1:], f"{before}("
        while text.count(")") > text.count("(") and text.endswith(")"):
            text, after = text[:-1], f"){after}"
        if not re.search(r"\w.*[=<>≤≥*/'].*\w|P_\{|\{.*\}", text) or text.count("(") != text.count(
            ")"
        ):
            return found[0]
        return f"{before}${_latex(text)}${after}"

    parts = re.split(r"(\$[^$]*\$)", _FORMULA.sub(one, line))
    return "".join(part if part.startswith("$") else _text(part) for part in parts)


def _alike(result: Result) -> tuple[str, ...]:
    """Key of printed statements that are shown together."""
    item = result.statement
    return item.equation, result.status, item.derived, item.proof, item.consequence


def _beside(results: Sequence[Result], number: int) -> Iterator[str]:
    """Printed statements that are alike, with the derivation, the proof, and the witnesses."""
    item, last = results[0].statement, number + len(results) - 1
    numbers = f"{number}" if len(results) == 1 else f"{number}–{last}"
    yield f"### {numbers}. {item.equation}: {results[0].status}\n"
    once = len({one.statement.printed for one in results}) == 1
    if once:
        yield f"- **Printed:** {_shown(item.printed)}"
    yield f"- **Derived:** {_shown(item.derived)}"
    if item.proof:
        yield f"- **Proof:** {_text(item.proof)}"
    if item.consequence:
        yield f"- **Consequence:** {_text(item.consequence)}"
    for one in results:
        own = one.statement.says if once else one.statement.printed
        said = "" if len(results) == 1 else f": {_shown(own)}"
        yield f"- `{one.statement.name}`, {one.seconds:.2f} s{said}"
        if one.witness:
            yield f"  - **Witness:** {_point(one)}"
        if one.statement.latex:
            yield f"\n  $${math(one.statement.latex)}$$\n"
    yield ""


def _rows(place: str, results: Iterable[Result]) -> Iterator[str]:
    heads = (place, "Statement", "Formula", "Status", "Identifier")
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


def _witnesses(results: Iterable[Result]) -> Iterator[str]:
    """Witnesses of the statements of a section that have one and no place of their own."""
    for result in results:
        if result.witness:
            yield f"- `{result.statement.name}`: {_point(result)}"


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
    number = 1
    for title, section in report.items():
        lines += [f"## {title}\n"]
        for name, made in (tables or {}).items():
            if title == name or (name.startswith("Table") and title.startswith(name)):
                lines += [*made(), ""]
        printed = [result for result in section if result.statement.printed]
        for _, alike in groupby(printed, _alike):
            together = list(alike)
            lines += _beside(together, number)
            number += len(together)
        rest = [result for result in section if not result.statement.printed]
        if rest:
            lines += [*_rows(place, rest), "", *_witnesses(rest), ""]
    return "\n".join(lines).rstrip() + "\n"
