"""The C library's enumerations and records, for C, for its binding and for Python."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from capsule_sym._symbolic.model.formulas import impact_planes
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import PARAMETERS, STATE
from capsule_sym.codegen._blocks import flow_parameters

Entry = dict[str, Any]

_DTYPES = {"double": "f8", "int64_t": "i8", "int32_t": "i4"}


def _constant(value: str) -> str:
    return f"CAPSULE_{value.upper().replace('-', '_')}"


def read(config: Entry) -> Entry:
    """The interface with the model's counts and parameters in it."""
    config["count"] = {
        "parameter": str(len(PARAMETERS)),
        "run_parameter": str(len([p for p in PARAMETERS if p not in flow_parameters()])),
        "state": str(len(STATE)),
        "field": str(len(SEGMENTS)),
        "plane": str(max(impact_planes().values())),
        **config["count"],
    }
    for struct in config["struct"]:
        for entry in struct["fields"]:
            entry[1] = entry[1].replace("@parameters", ", ".join(map(str, PARAMETERS)))
    return config


def _spelt(length: str, config: Entry) -> str:
    """A length in counts, as C spells it."""
    return re.sub(
        r"[a-z]+",
        lambda word: f"CAPSULE_{word[0].upper()}_COUNT" if word[0] in config["count"] else word[0],
        length,
    )


def _number(length: str, config: Entry) -> int:
    """A length in counts as a number."""
    numbers: dict[str, int] = {}
    for name, value in config["count"].items():
        numbers[name] = eval(value, {}, numbers)
    return int(eval(length, {}, numbers))


def _fields(struct: Entry) -> Iterator[tuple[str, str, str]]:
    """Name, C type and length (empty for a scalar) of every field."""
    for kind, names, _ in struct["fields"]:
        for name in names.split(", "):
            bare, length = re.fullmatch(r"(\w+)(?:\[(.+)\])?", name).groups()  # type: ignore[union-attr]
            yield bare, kind, length or ""


def _c_counts(config: Entry) -> str:
    """Counts, positions of parameters, and lists of them for macros."""
    rows = ""
    for name, value in config["count"].items():
        spelt = value if value.isdigit() else f"({_spelt(value, config)})"
        rows += f"#define CAPSULE_{name.upper()}_COUNT {spelt}\n"
    positions = "".join(f"    CAPSULE_{str(p).upper()}_AT,\n" for p in PARAMETERS)
    flow = flow_parameters()
    lists = {
        "PARAMETERS": PARAMETERS,
        "FLOW_PARAMETERS": [p for p in PARAMETERS if p in flow],
        "RUN_PARAMETERS": [p for p in PARAMETERS if p not in flow],
        "POSITIVE_PARAMETERS": [p for p in PARAMETERS if p.is_positive],
        "NOT_NEGATIVE_PARAMETERS": [p for p in PARAMETERS if p.is_nonnegative],
    }
    text = f"/* How many there are. */\n{rows}\n/* Positions of the parameters. */\n"
    text += f"enum {{\n{positions}}};\n\n"
    text += (
        "/* `of` of each parameter; of those that a linear flow depends on, and of the others; of\n"
    )
    text += "   those that are above 0, and of those that are not below it. */\n"
    for name, several in lists.items():
        text += f"#define CAPSULE_{name}(of) \\\n    {' '.join(f'of({p})' for p in several)}\n"
    return text


def c_interface(config: Entry) -> str:
    """Counts, enumerations, structs, and the offsets of their fields."""
    parts = [_c_counts(config)]
    for enum in config["enum"]:
        rows = "".join(
            f"    {_constant(name)}, /* {doc} */\n" for name, doc in enum["values"].items()
        )
        parts.append(f"/* {enum['doc']} */\ntypedef enum {{\n{rows}}} capsule_{enum['name']};\n")
    for struct in config["struct"]:
        rows = "".join(
            f"    {kind} {_spelt_all(names, config)};{f' /* {doc} */' if doc else ''}\n"
            for kind, names, doc in struct["fields"]
        )
        name = f"capsule_{struct['name']}"
        offsets = "".join(f"    offsetof({name}, {field}), \\\n" for field, _, _ in _fields(struct))
        parts.append(
            f"/* {struct['doc']} */\ntypedef struct {{\n{rows}}} {name};\n"
            f"#define {name.upper()}_LAYOUT {{ \\\n{offsets}    sizeof({name})}}\n"
        )
    return "\n".join(parts)


def _spelt_all(names: str, config: Entry) -> str:
    return re.sub(r"\[(.+?)\]", lambda found: f"[{_spelt(found[1], config)}]", names)


def cython_interface(config: Entry, header: str) -> str:
    """The same for the binding, with what a header declares, and checks of the dtypes."""
    text = "cdef enum:\n"
    for name, value in config["count"].items():
        text += f"    CAPSULE_{name.upper()}_COUNT = {_number(value, config)}\n"
    text += '\ncdef extern from "capsule_interface.h" nogil:\n'
    for enum in config["enum"]:
        text += f"    ctypedef int capsule_{enum['name']}\n"
    for struct in config["struct"]:
        text += f"    ctypedef struct capsule_{struct['name']}:\n"
        for kind, names, _ in struct["fields"]:
            text += f"        {kind} {_spelt_all(names, config)}\n"
    text += f"\n{_cython_functions(header)}\ncdef extern from *:\n    '''\n"
    for struct in config["struct"]:
        name = f"capsule_{struct['name']}"
        text += f"    static const size_t {name}_layout[] = {name.upper()}_LAYOUT;\n"
    text += "    '''\n"
    for struct in config["struct"]:
        text += f"    const size_t capsule_{struct['name']}_layout[]\n"
    text += "\n\n"
    for struct in config["struct"]:
        dtype, name = struct["name"].upper(), f"capsule_{struct['name']}_layout"
        count = len(list(_fields(struct)))
        text += f"{dtype} = interface.{dtype}\n"
        text += f"assert [{dtype}.fields[name][1] for name in {dtype}.names] == "
        text += f"[{name}[i] for i in range({count})]\n"
        text += f"assert {dtype}.itemsize == {name}[{count}]\n"
    return text


def _cython_functions(header: str) -> str:
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


def python_interface(config: Entry) -> str:
    """The same as enumerations and dtypes of Python."""
    parts = []
    for enum in config["enum"]:
        rows = "".join(
            f"    {name.upper().replace('-', '_')} = {value}\n"
            for value, name in enumerate(enum["values"])
        )
        title = enum["name"].title().replace("_", "")
        parts.append(f'class {title}(IntEnum):\n    """{enum["doc"]}"""\n\n{rows}')
        words = "".join(f'    "{name}",\n' for name in enum["values"])
        several = re.sub("s$", "se", re.sub("y$", "ie", enum["name"])).upper()
        parts.append(f"{several}S = (\n{words})\n")
    for struct in config["struct"]:
        rows = "".join(
            f'        ("{name}", "{_DTYPES[kind]}"{shape}),\n'
            for name, kind, length in _fields(struct)
            for shape in (f", {_number(length, config)}" if length else "",)
        )
        dtype = struct["name"].upper()
        parts.append(f"{dtype} = np.dtype(\n    [\n{rows}    ],\n    align=True,\n)\n")
    return "\n\n".join(parts)
