"""Cython: declarations of the C library for the binding."""

import re
from pathlib import Path
from typing import ClassVar

from capsule_sym.codegen._backend import Backend
from capsule_sym.codegen._derived import CONSTANTS
from capsule_sym.codegen._interface import Entry, Interface
from capsule_sym.codegen.backends.c import C

_LIBRARY = Path(__file__).resolve().parents[3] / "_native" / "capsule.h"


class Cython(Backend):
    """Declarations from the interface and from the C headers."""

    comment = "#"
    files: ClassVar = {"c/capsule_interface.pxi": "interface.pxi.in"}

    def texts(self) -> dict[str, str]:
        """Counts as numbers, structs, functions, and the layout of structs."""
        interface = self.derived.interface
        headers = C(self.derived).written()["c/capsule_kernels.h"], _LIBRARY.read_text("utf-8")
        counts = {name: interface.number(length) for name, length in interface.counts.items()}
        names = [struct["name"] for struct in interface.structs]
        return {
            **super().texts(),
            "counts": "\n".join(f"    CAPSULE_{n.upper()}_COUNT = {v}" for n, v in counts.items()),
            "enums": "\n".join(f"    ctypedef int capsule_{e['name']}" for e in interface.enums),
            "structs": "".join(_struct(struct, interface) for struct in interface.structs),
            "functions": _functions("".join(headers)),
            "layouts": "\n".join(
                f"    static const size_t capsule_{n}_layout[] = CAPSULE_{n.upper()}_LAYOUT;"
                for n in names
            ),
            "constants": ", ".join(
                _KINDS.get(name, "{}").format(f"c.{name}") for name in CONSTANTS
            ),
            "offsets": "\n".join(f"    const size_t capsule_{n}_layout[]" for n in names),
            "checks": "\n".join(
                f"{n.upper()} = _checked(records.{n.upper()}, capsule_{n}_layout)" for n in names
            ),
        }


_KINDS = {"resonant": "bool({})"} | dict.fromkeys(("high", "contact", "drift"), "int({})")


def _struct(struct: Entry, interface: Interface) -> str:
    fields = (
        f"        {kind} {interface.spelt_all(names)}\n" for kind, names, _ in struct["fields"]
    )
    return f"    ctypedef struct capsule_{struct['name']}:\n{''.join(fields)}"


def _functions(header: str) -> str:
    """Enumerations, structs and functions of the library's headers, for the binding."""
    text = re.sub(r"/\*.*?\*/|\brestrict ", "", header, flags=re.DOTALL)
    out = 'cdef extern from "capsule.h" nogil:\n'
    for name in re.findall(r"typedef enum \{[^{}]*\} (\w+);", text):
        out += f"    ctypedef int {name}\n"
    for body, name in re.findall(r"typedef struct \{([^{}]*)\} (\w+);", text):
        fields = [" ".join(field.split()) for field in body.split(";") if field.strip()]
        out += f"    ctypedef struct {name}:\n"
        for field in fields:
            called = " noexcept nogil" if re.search(r"\)\(.*\)$", field) else ""
            out += "" if field.startswith("capsule_table") else f"        {field}{called}\n"
    for name in re.findall(r"^\} (\w+);", text, re.MULTILINE):
        if f" {name}:" not in out:  # of structs in it, which the binding does not open
            out += f"    ctypedef struct {name}:\n        pass\n"
    for result, name, given in re.findall(
        r"^(?:static inline )?(\w[\w *]*?)(capsule_\w+)\(([^;{]*?)\)[;\n]", text, re.MULTILINE
    ):
        arguments = "" if given == "void" else " ".join(given.split())
        out += f"    {result}{name}({arguments})\n"
    return out
