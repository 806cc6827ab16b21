"""Functions in Python, for any numbers with its operators."""

from __future__ import annotations

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from capsule_sym.codegen._backend import Language
from capsule_sym.codegen._lower import Kernel
from capsule_sym.codegen._printers import Products


class _Printer(Products, PythonCodePrinter):
    """Python code in which sin, cos, exp and expm1 are plain names, not those of a module."""

    def _print_Function(self, expr: sp.Function) -> str:
        name = type(expr).__name__
        return f"{name}({', '.join(self._print(argument) for argument in expr.args)})"

    _print_sin = _print_cos = _print_exp = _print_expm1 = _print_Function


class PythonSpelling(Language):
    """Spelling of functions in all Python code."""

    printer = _Printer()
    comment = "#"

    def body(self, kernel: Kernel) -> str:
        """Lines before the results: functions, constants and steps."""
        functions = (f"    {name} = by.{name}\n" for name in _functions(kernel))
        return "".join(functions) + super().body(kernel)

    def function(self, kernel: Kernel) -> str:
        """Kernel as a function, whose first argument is the library `by` if it needs functions.

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


def _functions(kernel: Kernel) -> list[str]:
    """Functions that a kernel needs of a library of numbers."""
    found = {type(f).__name__ for _, step in kernel.steps for f in step.atoms(sp.Function)}
    found |= {type(f).__name__ for result in kernel.results for f in result.atoms(sp.Function)}
    return sorted(found - {"Abs"})
