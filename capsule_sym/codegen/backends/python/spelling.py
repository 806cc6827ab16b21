"""Functions in Python, for any numbers with its operators."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from textwrap import wrap

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from capsule_sym.codegen._backend import WIDTH, Language, wrapped
from capsule_sym.codegen._lower import Kernel
from capsule_sym.codegen._printers import Products


class _Printer(Products, PythonCodePrinter):
    """Python code whose functions are plain names, which functions take from their library."""

    def _print_Function(self, expr: sp.Function) -> str:
        name = type(expr).__name__
        return f"{name}({', '.join(self._print(argument) for argument in expr.args)})"

    _print_sin = _print_cos = _print_exp = _print_expm1 = _print_Function


_VALUE = re.compile(r"(\s*(?:\w+ =|return) )(.*)")


class PythonSpelling(Language):
    """Spelling of functions in all Python code."""

    printer = _Printer()
    comment = "#"

    def body(self, kernel: Kernel) -> str:
        """Lines before the results: functions and constants, several in a line, and the steps."""
        lines = [*_read("by", _functions(kernel)), *_read("c", kernel.constants)]
        lines += [f"{name} = {self.expression(step)}" for name, step in kernel.steps]
        return "".join(f"    {line}\n" for line in lines)

    def function(self, kernel: Kernel) -> str:
        """Kernel as a function, which begins with the library `by` if it needs functions.

        Last arguments that only other models use may be omitted.
        """
        names, unused = ["c", *kernel.arguments], self.unused(kernel)
        given = [*(["by"] if _functions(kernel) else []), *names]
        for k in range(1, len(names) + 1):
            if names[-k] not in unused:
                break
            given[-k] += "=None"
        results = ", ".join(map(self.expression, kernel.results))
        if not kernel.single:
            results = f"({results}{',' * (len(kernel.results) == 1)})"
        head = f"def {kernel.name}({', '.join(given)}):"
        doc = f'    """{kernel.doc} {kernel.cost.capitalize()}."""'
        return f"{head}\n{doc}\n{self.body(kernel)}    return {results}\n"

    def laid_out(self, text: str) -> str:
        """Text with long lines broken, which Python allows within brackets."""
        lines = text.splitlines()
        for i, line in enumerate(lines):
            if len(line) > WIDTH and (found := _VALUE.fullmatch(line)):
                name, value = found.groups()
                lines[i] = line if _is_in_brackets(value) else f"{name}({value})"
        return wrapped("\n".join(lines))


def packed(head: str, entries: Iterable[str], tail: str) -> str:
    """Head, entries and tail of a list, with as many entries in a line as fit."""
    start = re.match(r"\s*", head)
    text = ", ".join(entry.replace(" ", "\0") for entry in entries)
    lines = wrap(
        f"{head}{text}{tail}",
        WIDTH,
        subsequent_indent=f"{start[0] if start else ''}    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines).replace("\0", " ")


def _functions(kernel: Kernel) -> list[str]:
    """Functions that a kernel needs of a library of numbers."""
    found = {type(f).__name__ for _, step in kernel.steps for f in step.atoms(sp.Function)}
    found |= {type(f).__name__ for result in kernel.results for f in result.atoms(sp.Function)}
    return sorted(found - {"Abs"})


def _read(owner: str, names: list[str] | tuple[str, ...]) -> Iterator[str]:
    """Assignments of an object's members to their names, as many in a line as fit."""
    row: list[str] = []
    for name in (*names, None):
        line = ", ".join(row) + " = " + ", ".join(f"{owner}.{one}" for one in row)
        if row and (name is None or len(line) + len(owner) + 2 * len(name) > WIDTH - 14):
            yield line
            row = []
        row += [name] if name else []


def _is_in_brackets(text: str) -> bool:
    """True if the first bracket of a text is closed by its last character."""
    depth = 0
    for i, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if depth == 0:
            return i == len(text) - 1 and i > 0
    return False
