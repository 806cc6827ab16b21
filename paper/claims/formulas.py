"""Formulas of the transcription as LaTeX."""

from __future__ import annotations

import re
from collections.abc import Callable

from capsule_sym._symbolic.theory import LETTERS, marked

_NAME = (
    rf"(?:{'|'.join(LETTERS)}|abs|cos|sin|sqrt|sign|mu|Omega(?:_0|\d)?|[A-Za-z]{{1,2}}_\w+|"
    r"[PFSLOH]\d+(?:\^\(\d\))?|[XVAGHPcgtvx])(?![\w^])'?"
)
_TOKEN = rf"(?:P_\{{[^}}]*\}}|\{{[^}}]*\}}|{_NAME}|\d[\d.]*(?!\w)|[-−+*/=<>≤≥±∘|()²³])"
_FORMULA = re.compile(rf"(?<![\w.]){_TOKEN}(?: ?{_TOKEN})*")
_NAMED = {word: word for word in (*LETTERS, "cos", "sin", "mu", "Omega")}
_NAMED |= {"sign": "operatorname{sign}"}
_INSIDE = r"\(((?:[^()]|\([^()]*\))*)\)"  # of a function: at most one more pair of brackets in it
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
    formula = re.sub(rf"abs{_INSIDE}", r"|\1|", formula)
    formula = re.sub(rf"sqrt{_INSIDE}", r"\\sqrt{\1}", formula)
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


def with_formulas(line: str, prose: Callable[[str], str] = marked) -> str:
    """Line of text with its formulas in LaTeX, each between dollars, and the rest as `prose`."""

    def one(found: re.Match[str]) -> str:
        term = found[0].rstrip(" (")
        before, after = "", found[0][len(term) :]
        while term.count("(") > term.count(")") and term.startswith("("):
            term, before = term[1:], f"{before}("
        while term.count(")") > term.count("(") and term.endswith(")"):
            term, after = term[:-1], f"){after}"
        whole = term.count("(") == term.count(")")
        if not whole or not re.search(r"\w.*[=<>≤≥*/'].*\w|P_\{|\{.*\}", term):
            return found[0]
        return f"{before}${_latex(term)}${after}"

    parts = re.split(r"(\$[^$]*\$)", _FORMULA.sub(one, line))
    return "".join(part if part.startswith("$") else prose(part) for part in parts)
