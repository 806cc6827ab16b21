"""Python without NumPy: formulas for any numbers, tables, records, and facts of parameters."""

from __future__ import annotations

import re
from collections.abc import Iterator
from textwrap import indent
from typing import ClassVar

import sympy as sp
from sympy.printing.pycode import pycode

from capsule_sym._symbolic.model.formulas import edge_planes, impact_planes, places
from capsule_sym._symbolic.model.model import ANY_LEVEL, LEVELS, SEGMENTS
from capsule_sym._symbolic.model.switching import line_transitions, local_maps, surface_transitions
from capsule_sym._symbolic.model.symbols import PARAMETERS, PULSED, alpha, stop
from capsule_sym.codegen._derived import Matrix, entries, matrices
from capsule_sym.codegen._interface import Entry, Interface, members
from capsule_sym.codegen.backends.python import facts
from capsule_sym.codegen.backends.python.spelling import PythonSpelling


class Python(PythonSpelling):
    """Python code of the model besides the kernels."""

    files: ClassVar = {
        "__init__.py": "package.py.in",
        **{
            f"{name}.py": f"{name}.py.in"
            for name in ("switching", "formulas", "interface", "fields", "facts", "parameters")
        },
    }

    def texts(self) -> dict[str, str]:
        """Formulas, tables, records and facts."""
        derived = self.derived
        formulas = (*derived.formulas, *derived.sizes)
        return {
            **super().texts(),
            "formulas": indent(
                "\n".join(self.function(kernel, "Any") for kernel in formulas), "    "
            ),
            "own_stop": str(stop),
            "friction_bounds": " + ".join(f"c.{name}" for name in derived.bounds),
            "units": "\n".join(f"    {name} = {number}" for name, number in derived.units.items()),
            "table": facts.assigned(_table(), _ABOUT),
            **facts.texts(),
            "fields": _fields(),
            "enums": "\n\n".join(map(_enum, derived.interface.enums)),
            "dtypes": "\n\n".join(_dtype(s, derived.interface) for s in derived.interface.structs),
        }


def _table() -> dict[str, object]:
    """Switching table, and other tables by signs."""
    return {
        "TRANSITIONS": _transitions(),
        "LOCAL_MAPS": frozenset(_local_maps()),
        "PLACES": places(),
        "IMPACT_PLANES": impact_planes(),
        "EDGE_PLANES": edge_planes(),
    }


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


def _enum(enum: Entry) -> str:
    """Enumeration, and the names of its values."""
    rows = "".join(
        f"    {name.upper().replace('-', '_')} = {value}\n"
        for value, name in enumerate(enum["values"])
    )
    title = enum["name"].title().replace("_", "")
    words = "".join(f'    "{name}",\n' for name in enum["values"])
    several = re.sub("s$", "se", re.sub("y$", "ie", enum["name"])).upper()
    return (
        f'class {title}(IntEnum):\n    """{enum["doc"]}"""\n\n{rows}\n\n{several}S = (\n{words})\n'
    )


def _dtype(struct: Entry, interface: Interface) -> str:
    """Dtype of a struct."""
    rows = "".join(
        f'        ("{name}", "{_DTYPES[kind]}"{shape}),\n'
        for name, kind, length in members(struct)
        for shape in (f", {interface.number(length)}" if length else "",)
    )
    name = struct["name"].upper()
    return f"{name} = np.dtype(\n    [\n{rows}    ],\n    align=True,\n)\n"


_DTYPES = {"double": "f8", "int64_t": "i8", "int32_t": "i4"}
_VARIED = tuple(p for p in PARAMETERS if PULSED or p is not alpha)
_ABOUT = {
    "TRANSITIONS": "Target fields of a source field at a surface, line or corner point.",
    "LOCAL_MAPS": "Every local map as target plane, field and source plane.",
    "PLACES": "Surface, line or corner point by the signs of v_c, the gap and v_r, and P's level.",
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


def _transitions() -> dict[tuple[int, str], tuple[int, ...]]:
    """Target fields of each source field at each surface, line and corner point."""
    targets: dict[tuple[int, str], set[int]] = {}
    for surface in surface_transitions():
        targets.setdefault((surface.source, surface.surface), set()).add(surface.target)
    for line in line_transitions():
        targets.setdefault((line.source, line.line), set()).add(line.target)
    kinds = len(ANY_LEVEL)
    of_all = {
        (source + kinds * level, place): tuple(field + kinds * level for field in sorted(fields))
        for (source, place), fields in targets.items()
        for level in range(len(LEVELS))
    }
    return {key: of_all[key] for key in sorted(of_all, key=_place_order)}


def _local_maps() -> Iterator[tuple[str, int, str]]:
    """Local maps as target, field and source; of pulses, those of each level and of their edges.

    A field of a level may begin on the edge that leads to it, and end on the other one.
    """
    maps = [(int(m.target[1:]), m.field, int(m.source[1:])) for m in local_maps()]
    kinds, edges = len(ANY_LEVEL), edge_planes()
    more = len(SEGMENTS) - kinds
    for level in range(len(LEVELS)):

        def number(plane: int, of: int = kinds * level) -> int:
            return plane + (of if plane <= kinds else more)

        found = {(number(t), f + kinds * level, number(s)) for t, f, s in maps}
        if edges:
            begins, ends = edges[level], edges[1 - level]
            found |= {(ends, field, source) for _, field, source in found}
            found |= {(target, field, begins) for target, field, _ in found}
        yield from ((f"Σ{target}", field, f"Σ{source}") for target, field, source in found)


def _place_order(key: tuple[int, str]) -> tuple[str, int, int]:
    source, place = key
    return {"S": "0", "L": "1", "O": "2"}[place[0]], int(place[1:]), source
