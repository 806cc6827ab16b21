"""Base of all backends: functions, templates and the files made from them."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from string import Template
from typing import ClassVar

import sympy as sp
from sympy.printing.codeprinter import CodePrinter

from capsule_sym._symbolic.model import jacobian
from capsule_sym._symbolic.model.symbols import PULSED
from capsule_sym.codegen._derived import PARAMETER_NAMES, Derived
from capsule_sym.codegen._lower import Kernel

_INLINE = re.compile("⟨([^⟨⟩¦]*)(?:¦([^⟨⟩]*))?⟩")


def _kept(text: str) -> str:
    """Template without the parts that the model does not need.

    Lines after `@harmonic` are for a drive that varies within a segment, those after `@pulsed` for
    a drive that is constant in each; both up to the next of these marks, or `@end`. Within a line
    `⟨...⟩` is for the former only, and `⟨...¦...⟩` has a text for each. A line of which nothing is
    left is omitted.
    """
    left_out = "@harmonic" if PULSED else "@pulsed"
    kept, leaving = [], False
    for line in text.splitlines(keepends=True):
        if line.strip() in ("@harmonic", "@pulsed", "@end"):
            leaving = line.strip() == left_out
        elif not leaving:
            chosen = _INLINE.sub(lambda one: (one[2] or "") if PULSED else one[1], line)
            kept += [chosen] if chosen.strip() or not line.strip() else []
    return "".join(kept)


class Language:
    """Language: its printer, its spelling of functions, and its files.

    Templates are files of the folder of the backend's class. In them `$name` is one of `texts`.
    """

    printer: CodePrinter
    comment: str
    """Mark of a comment."""
    unpack = "{0} = c.{0}"
    """Statement that reads a constant."""
    assign = "{} = {}"
    """Statement that assigns a step."""
    files: ClassVar[dict[str, str]]
    """Template of each file, by its path in the scene's folder; of `Shared` in `generated/`."""

    def __init__(self, derived: Derived) -> None:
        self.derived = derived

    def expression(self, expression: sp.Expr) -> str:
        """Expression in the language."""
        return str(self.printer.doprint(expression))

    def body(self, kernel: Kernel) -> str:
        """Lines of a kernel before its results: its constants and its steps."""
        lines = [self.unpack.format(name) for name in kernel.constants]
        lines += [self.assign.format(name, self.expression(step)) for name, step in kernel.steps]
        return "".join(f"    {line}\n" for line in lines)

    def function(self, kernel: Kernel) -> str:
        """Kernel as a function; a backend defines it."""
        raise NotImplementedError(f"{type(self).__name__} has no functions")

    @staticmethod
    def unused(kernel: Kernel) -> list[str]:
        """Arguments that callers pass for any model, and that this one does not need."""
        used = {str(symbol) for _, step in kernel.steps for symbol in step.free_symbols}
        used |= {str(symbol) for result in kernel.results for symbol in result.free_symbols}
        return [name for name in kernel.arguments if name not in used]

    def texts(self) -> dict[str, str]:
        """Texts for the names in templates; a backend adds its own."""
        derived = self.derived
        return {
            "header": derived.header,
            "marked_header": "\n".join(f"{self.comment} {r}" for r in derived.header.split("\n\n")),
            "digest": derived.digest,
            "jet_order": str(derived.jet_order),
            "series_terms": str(derived.series_terms),
            "parameters": ", ".join(PARAMETER_NAMES),
            "jacobian_columns": ", ".join(f'"{column}"' for column in jacobian.COLUMNS),
        }

    def templates(self) -> dict[str, Template]:
        """Templates in the folder of the backend's class, by file name."""
        paths = Path(inspect.getfile(type(self))).parent.glob("*.in")
        return {path.name: Template(_kept(path.read_text(encoding="utf-8"))) for path in paths}

    def written(self) -> dict[str, str]:
        """Text of each file by its path."""
        texts, templates = self.texts(), self.templates()
        return {path: templates[name].substitute(texts) for path, name in self.files.items()}
