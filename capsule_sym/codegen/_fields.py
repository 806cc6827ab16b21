"""The fields and guards as matrices in the extended state, as source text."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp
from sympy.printing.pycode import pycode

from capsule_sym._symbolic.model.enclosure import coefficients, extended_rates
from capsule_sym._symbolic.model.model import SEGMENTS, Segment
from capsule_sym._symbolic.model.symbols import PARAMETERS, alpha
from capsule_sym.codegen._printers import LANGUAGES, Language

Matrix = Sequence[Sequence[sp.Expr]]
_PARAMETERS = tuple(parameter for parameter in PARAMETERS if parameter is not alpha)


def matrices(segment: Segment) -> dict[str, Matrix]:
    """Rates and guards of a field: rows of coefficients of `EXTENDED` and, last, of 1."""
    found = {"rates": extended_rates(segment), "guards": segment.guards}
    return {name: [coefficients(row) for row in rows] for name, rows in found.items()}


def _entries(matrix: Matrix) -> str:
    """The entries of a matrix that are not 0, as text."""
    found = [
        f"({i}, {j}, {pycode(sp.factor(value))})"
        for i, row in enumerate(matrix)
        for j, value in enumerate(row)
        if value != 0
    ]
    return f"({', '.join(found)},)" if found else "()"


def _by(matrix: Matrix) -> str:
    slopes = {p: [[sp.diff(value, p) for value in row] for row in matrix] for p in _PARAMETERS}
    texts = {p: _entries(slope) for p, slope in slopes.items()}
    return ", ".join(f'"{p}": {text}' for p, text in texts.items() if text != "()")


def field_texts(language: Language) -> str:
    """What gives each field's matrices, in Python functions of their own; empty for C."""
    if language.comment == "%":
        return "".join(map(_matlab_field, SEGMENTS))
    if language.comment != "#":
        return ""
    arguments = ", ".join(map(str, _PARAMETERS))
    names = ", ".join(f'"{parameter}"' for parameter in _PARAMETERS)
    texts = [f"PARAMETERS = ({names})\n"]
    for segment in SEGMENTS:
        for name, matrix in matrices(segment).items():
            texts.append(
                f"def {name}_{segment.name}({arguments}):\n    return {_entries(matrix)}\n"
            )
            texts.append(
                f"def {name}_{segment.name}_by({arguments}):\n    return {{{_by(matrix)}}}\n"
            )
    for name in ("rates", "guards"):
        for suffix in ("", "_by"):
            names = ", ".join(f"{name}_{segment.name}{suffix}" for segment in SEGMENTS)
            texts.append(f"{name.upper()}{suffix.upper()} = ({names})\n")
    return "\n\n".join(texts)


def _matlab_field(segment: Segment) -> str:
    """Assignments of a field's matrices A and G, in a switch by its number."""
    found = matrices(segment)
    size = len(found["rates"]) + 1
    text = f"    case {segment.index} % {segment.mode}\n"
    text += f"        A = zeros({size}); G = zeros({len(found['guards'])}, {size});\n"
    for name, matrix in (("A", found["rates"]), ("G", found["guards"])):
        for i, row in enumerate(matrix, start=1):
            for j, value in enumerate(row, start=1):
                if value != 0:
                    printed = LANGUAGES["matlab"].expression(sp.factor(value))
                    text += f"        {name}({i}, {j}) = {printed};\n"
    return text
