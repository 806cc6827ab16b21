"""Python of all scenes: response functions, enumerations and records of the C library."""

from __future__ import annotations

import re
from typing import ClassVar

from capsule_sym.codegen._derived import read
from capsule_sym.codegen._interface import Entry, members
from capsule_sym.codegen.backends.python.spelling import PythonSpelling

_DTYPES = {"double": "f8", "int64_t": "i8", "int32_t": "i4"}


class Shared(PythonSpelling):
    """Python code that does not depend on the scene, beside the folders of all scenes."""

    files: ClassVar = {"basis.py": "basis.py.in", "interface.py": "interface.py.in"}

    def texts(self) -> dict[str, str]:
        """Kernels, enumerations and records."""
        config = read("interface")
        return {
            **super().texts(),
            "kernels": "\n\n".join(map(self.function, self.derived.shared)),
            "enums": "\n\n".join(map(_enum, config["enum"])),
            "counts": "\n".join(f"    {name} = {value}" for name, value in config["count"].items()),
            "records": "\n".join(map(_record, config["struct"])),
        }


def _enum(enum: Entry) -> str:
    """Enumeration, and the names of its values."""
    names = ", ".join(name.upper().replace("-", "_") for name in enum["values"])
    words = ", ".join(f'"{name}"' for name in enum["values"])
    title = enum["name"].title().replace("_", "")
    several = re.sub("s$", "se", re.sub("y$", "ie", enum["name"])).upper()
    return (
        f'class {title}(IntEnum):\n    """{enum["doc"]}"""\n\n'
        f"    {names} = range({len(enum['values'])})\n\n\n{several}S = ({words})\n"
    )


def _record(struct: Entry) -> str:
    """Record of a struct; a member with a fourth entry exists if that count is not 0."""
    rows = []
    for entry in struct["fields"]:
        if entry[1] == "@parameters":
            rows.append('*((name, "f8") for name in facts.PARAMETERS)')
            continue
        for name, kind, length in members({"fields": [entry]}):
            row = f'("{name}", "{_DTYPES[kind]}"{f", {length}" if length else ""})'
            rows.append(f"*[{row}][: {entry[3]}]" if len(entry) > 3 else row)
    return f"        {struct['name'].upper()}=_record({', '.join(rows)}),"
