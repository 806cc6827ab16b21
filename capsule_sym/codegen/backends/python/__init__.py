"""Python of a scene: kernels and formulas for any numbers, tables, and facts of parameters."""

from __future__ import annotations

from textwrap import indent
from typing import ClassVar

import sympy as sp
from sympy.printing.pycode import pycode

from capsule_sym._symbolic.model import declaration
from capsule_sym._symbolic.model.formulas import edge_planes, impact_planes
from capsule_sym._symbolic.model.model import SEGMENTS, Linear
from capsule_sym._symbolic.model.symbols import PARAMETERS, PULSED, alpha, stop
from capsule_sym.codegen._blocks import segment_constants
from capsule_sym.codegen._derived import CONSTANTS, Matrix, entries, matrices
from capsule_sym.codegen.backends.python import facts
from capsule_sym.codegen.backends.python.spelling import PythonSpelling


class Python(PythonSpelling):
    """Python code of a scene."""

    files: ClassVar = {
        "__init__.py": "init.py.in",
        **{
            f"{name}.py": f"{name}.py.in"
            for name in ("switching", "kernels", "formulas", "fields", "facts", "parameters")
        },
    }

    def texts(self) -> dict[str, str]:
        """Kernels, formulas, tables and facts."""
        derived = self.derived
        formulas = (*derived.formulas, *derived.sizes)
        return {
            **super().texts(),
            "constants": ", ".join(f'"{name}"' for name in CONSTANTS),
            "own_constants": "".join(map(self._own_constants, SEGMENTS)).rstrip(),
            "kernels": "\n\n".join(map(self.function, derived.kernels)),
            "formulas": indent("\n".join(map(self.function, formulas)), "    "),
            "own_stop": str(stop),
            "friction_bounds": " + ".join(f"c.{name}" for name in derived.bounds),
            "units": "\n".join(f"    {name} = {number}" for name, number in derived.units.items()),
            "table": facts.assigned(
                {"IMPACT_PLANES": impact_planes(), "EDGE_PLANES": edge_planes()}, _ABOUT
            ),
            **facts.texts(),
            "fields": _fields() if self._enclosed else "",
        }

    def written(self) -> dict[str, str]:
        """Text of each file by its path; `fields.py` only where fields are enclosed."""
        texts = super().written()
        if not self._enclosed:
            del texts["fields.py"]
        return texts

    @property
    def _enclosed(self) -> bool:
        """True for the scene whose fields are enclosed in balls."""
        return declaration.path() == declaration.home(declaration.SHIPPED[0])

    def _own_constants(self, segment: Linear) -> str:
        """Case of a match by a field's number."""
        modes = (*((1 - segment.level,) if PULSED else ()), segment.contact, segment.drift)
        values = (self.expression(value) for _, value in segment_constants(segment.index))
        return (
            f"        case {segment.index}:  # {segment.mode}\n"
            f"            own = ({', '.join((*map(str, modes), *values))})\n"
        )


def _fields() -> str:
    """Functions of each field's matrices and of their derivatives, and tables of them."""
    names = ", ".join(f'"{parameter}"' for parameter in _VARIED)
    texts = [f"PARAMETERS = ({names})\n"]
    arguments = ", ".join(map(str, _VARIED))
    for segment in SEGMENTS:
        for name, matrix in matrices(segment).items():
            values = {"": _printed(matrix), "_by": f"{{{_by(matrix)}}}"}
            for suffix, value in values.items():
                head = f"def {name}_{segment.name}{suffix}({arguments}):"
                texts.append(f"{head}\n    return {value}\n")
    for name in ("rates", "guards"):
        for suffix in ("", "_by"):
            names = ", ".join(f"{name}_{segment.name}{suffix}" for segment in SEGMENTS)
            texts.append(f"{name.upper()}{suffix.upper()} = ({names})\n")
    return "\n\n".join(texts)


_VARIED = tuple(p for p in PARAMETERS if p is not alpha)
_ABOUT = {
    "IMPACT_PLANES": "Number of the plane of an impact by the stop and the signs of v_c and v_r.",
    "EDGE_PLANES": "Numbers of the planes of the rise and the fall of pulses.",
}


def _printed(matrix: Matrix) -> str:
    """Non-zero entries of a matrix."""
    found = [f"({i}, {j}, {pycode(value)})" for i, j, value in entries(matrix)]
    return f"({', '.join(found)},)" if found else "()"


def _by(matrix: Matrix) -> str:
    """Non-zero entries of a matrix's derivatives, by the parameters that it depends on."""
    slopes = {p: [[sp.diff(value, p) for value in row] for row in matrix] for p in _VARIED}
    return ", ".join(f'"{p}": {_printed(m)}' for p, m in slopes.items() if entries(m))
