"""Functions in Python, for any numbers with its operators, and the base of its kernels."""

from __future__ import annotations

import re

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import PULSED
from capsule_sym.codegen._backend import WIDTH, Backend, wrapped
from capsule_sym.codegen._blocks import OWN, segment_constants
from capsule_sym.codegen._derived import CONSTANTS, PARAMETER_NAMES
from capsule_sym.codegen._lower import Kernel
from capsule_sym.codegen._printers import Products


class _Printer(Products, PythonCodePrinter):
    """Python code whose functions are plain names, imported by the template."""

    def _print_Function(self, expr: sp.Function) -> str:
        name = type(expr).__name__
        return f"{name}({', '.join(self._print(argument) for argument in expr.args)})"

    _print_sin = _print_cos = _print_exp = _print_expm1 = _print_Function


_VALUE = re.compile(r"(\s*(?:\w+ =|return) )(.*)")


class PythonSpelling(Backend):
    """Spelling of functions in all Python code."""

    printer = _Printer()
    comment = "#"

    def function(self, kernel: Kernel, kind: str = "") -> str:
        """Kernel as a function, whose numbers are annotated as a kind if there is one.

        Last arguments that only other models use may be omitted.
        """
        names, unused = ["c", *kernel.arguments], self.unused(kernel)
        given = [f"{name}: {kind}" if kind else name for name in names]
        for k in reversed(range(len(names))):
            if names[k] not in unused:
                break
            given[k] += "=None"
        returned = f" -> {kind}" if kind else ""
        results = ", ".join(map(self.expression, kernel.results))
        if not kernel.single:
            results = f"({results},)"
        elif len(results) > WIDTH - 15:  # where it is broken it needs brackets
            results = f"({results})"
        head = f"def {kernel.name}({', '.join(given)}){returned}:"
        if len(head) > WIDTH - 4:  # a method is further in
            head = f"def {kernel.name}(\n    {', '.join(given)}\n){returned}:"
        return (
            f"{head}\n"
            f'    """{kernel.doc}\n\n    {kernel.cost}.\n    """\n'
            f"{self.body(kernel)}    return {results}\n"
        )

    def laid_out(self, text: str) -> str:
        """Text with long lines broken, which Python allows within brackets."""
        lines = text.splitlines()
        for i, line in enumerate(lines):
            if len(line) > WIDTH and (found := _VALUE.fullmatch(line)):
                name, value = found.groups()
                lines[i] = line if _is_in_brackets(value) else f"{name}({value})"
        return wrapped("\n".join(lines))


def _is_in_brackets(text: str) -> bool:
    """True if the first bracket of a text is closed by its last character."""
    depth = 0
    for i, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if depth == 0:
            return i == len(text) - 1 and i > 0
    return False


class PythonKernels(PythonSpelling):
    """Kernels in Python, with the choice between closed forms."""

    def texts(self) -> dict[str, str]:
        """Fields of a tuple of constants, functions that give the constants, and kernels."""
        return {
            **super().texts(),
            "modes": "high, contact, drift" if PULSED else "contact, drift",
            "constants_fields": "\n".join(f"    {name}: float" for name in CONSTANTS),
            "own_constants": ", ".join(OWN),
            "segment_constants": self._segment_constants(),
            "kernels": self.kernels(),
        }

    def _segment_constants(self) -> str:
        texts = []
        for segment in SEGMENTS:
            results = [self.expression(value) for _, value in segment_constants(segment.index)]
            texts.append(
                f"def _constants_{segment.name}({', '.join(PARAMETER_NAMES)}):\n"
                f'    """{", ".join(OWN[:-1])} and {OWN[-1]} of {segment.mode}."""\n'
                f"    return ({', '.join(results)})\n"
            )
        names = ", ".join(f"_constants_{segment.name}" for segment in SEGMENTS)
        level = "{}, " if PULSED else ""
        modes = ", ".join(f"({level.format(1 - g.level)}{g.contact}, {g.drift})" for g in SEGMENTS)
        order = "high, contact, drift" if PULSED else "contact, drift"
        texts.append(f"_CONSTANTS = ({names})\n# {order}\n_MODES = ({modes})\n")
        return "\n\n".join(texts)
