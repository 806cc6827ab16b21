"""The generated tree: every target's files, from the kernels and the templates."""

from __future__ import annotations

import ast
import hashlib
import json
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from string import Template
from typing import Any

import sympy as sp

from capsule_sym._symbolic.model import declaration, jacobian
from capsule_sym._symbolic.model.formulas import Formula, formulas
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import PARAMETERS, omega
from capsule_sym.codegen import COMMAND, INPUTS
from capsule_sym.codegen._blocks import blocks, segment_constants
from capsule_sym.codegen._facts import (
    page_facts,
    python_device,
    python_facts,
    python_fields,
    python_relations,
)
from capsule_sym.codegen._fields import field_texts
from capsule_sym.codegen._interface import c_interface, cython_interface, python_interface, read
from capsule_sym.codegen._lower import Kernel, lower, wrapped
from capsule_sym.codegen._printers import LANGUAGES, Language
from capsule_sym.codegen._rounding import CIRCULAR_UNITS, units
from capsule_sym.codegen._tables import c_classification, table_text

_PACKAGE = Path(__file__).resolve().parents[1]
_HEADER = _PACKAGE / "_native" / "capsule.h"

_PARAMETER_NAMES = tuple(map(str, PARAMETERS))
_SEGMENT_NAMES = ("m", "kappa", "push", "friction", "sigma", "K")
_CONSTANT_NAMES = (
    *_PARAMETER_NAMES,
    *("contact", "drift"),
    *_SEGMENT_NAMES,
    *("q", "nu", "slow", "Z2", "resonant", "fast", "rate"),
)


def _modules(path: Path, seen: set[Path]) -> set[Path]:
    """The package's own modules that a module is derived from, itself included."""
    seen.add(path)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
            "capsule_sym."
        ):
            continue
        base = _PACKAGE.joinpath(*(node.module or "").split(".")[1:])
        candidates = [base.with_suffix(".py"), *(base / f"{alias.name}.py" for alias in node.names)]
        for candidate in candidates:
            if candidate.is_file() and candidate not in seen:
                _modules(candidate, seen)
    return seen


def digest() -> str:
    """Digest of everything the generated text depends on: inputs, derivations, SymPy's version."""
    hasher = hashlib.sha256(sp.__version__.encode())
    inputs = [path for path in INPUTS.rglob("*") if path.is_file()]
    sources = _modules(Path(__file__), set()) | set(inputs)
    hasher.update(declaration.path().read_bytes())
    for path in sorted(sources, key=lambda p: p.relative_to(_PACKAGE.parent).as_posix()):
        hasher.update(path.relative_to(_PACKAGE.parent).as_posix().encode())
        hasher.update(path.read_bytes())
    return hasher.hexdigest()[:16]


def _formula(formula: Formula) -> Kernel:
    names = tuple(str(argument) for argument in formula.arguments)
    results = [(sp.Symbol(f"_{name}"), value) for name, value in formula.results]
    returns = tuple(f"_{name}" for name, _ in formula.results)
    single, constants = len(returns) == 1, frozenset(_CONSTANT_NAMES)
    kernel = lower(formula.name, formula.doc, results, names, returns, constants, single=single)
    # The results themselves, not names for them.
    steps = dict(kernel.steps)
    plain = tuple(str(name).removeprefix("_") for name in returns)
    values = tuple(steps.pop(name) for name in returns)
    made = replace(kernel, steps=tuple(steps.items()), results=values, returns=plain, typed=True)
    return replace(made, array=formula.array)


def _units(derived: Sequence[Formula]) -> dict[str, int]:
    """Names and numbers of the roundings of all formulas that have a size."""
    given = dict.fromkeys(("cos_theta", "sin_theta"), CIRCULAR_UNITS)
    for segment in SEGMENTS:
        for name, value in segment_constants(segment.index):
            block = [(sp.Symbol("_value"), value)]
            kernel = lower(str(name), "", block, _PARAMETER_NAMES, ("_value",), frozenset())
            given[str(name)] = max(given.get(str(name), 0), units(kernel, {}) - 1)
    found = {}
    for formula in derived:
        if formula.sized:
            kernel = _formula(formula)
            for argument in formula.carried:
                found[f"{formula.name}_{argument}_units"] = units(kernel, given, str(argument))
            if not formula.carried:
                found[f"{formula.name}_units"] = units(kernel, given)
    return {name.upper(): number for name, number in found.items()}


def _kernels(config: dict[str, Any]) -> dict[str, list[Kernel]]:
    """The kernels of each language."""
    order = int(config["jet_order"])
    derivations = blocks(order)
    constants = frozenset(_CONSTANT_NAMES)
    kernels: dict[str, list[Kernel]] = {
        target["language"]: [] for target in config["target"] if target["language"] != "page"
    }
    for entry in config["kernel"]:
        block = derivations[entry.get("block", entry["name"])]()
        returns = entry["returns"]
        if returns[0].startswith("@"):
            hidden = ("drive",)
            returns = [str(target) for target, _ in block if not str(target).startswith(hidden)]
        columns = ", ".join(map(str, jacobian.COLUMNS))
        doc = entry["doc"].replace("@jacobian_columns", columns)
        arguments = tuple(entry["arguments"])
        kernel = lower(entry["name"], doc, block, arguments, tuple(returns), constants)
        for language in entry.get("languages", kernels):
            kernels[language].append(kernel)
    return kernels


def _segment_texts(language: Language) -> str:
    """The functions that give each segment's constants from the parameters."""
    python = language.comment == "#"
    texts = []
    for segment in SEGMENTS:
        results = [language.expression(value) for _, value in segment_constants(segment.index)]
        if python:
            arguments = ", ".join(_PARAMETER_NAMES)
            texts.append(
                f"def _constants_{segment.name}({arguments}):\n"
                f'    """m, kappa, push, friction, sigma and K of {segment.mode}."""\n'
                f"    return ({', '.join(results)})\n"
            )
        elif language.comment == "%":
            texts.append(
                f"    case {segment.index} % {segment.mode}\n"
                f"        c.contact = {int(segment.contact)}; c.drift = {segment.drift};\n"
                + "".join(
                    f"        c.{name} = {result};\n"
                    for name, result in zip(_SEGMENT_NAMES, results, strict=True)
                )
            )
        else:
            assigned = "".join(
                f"        c->{name} = {result};\n"
                for name, result in zip(_SEGMENT_NAMES, results, strict=True)
            )
            texts.append(
                f"    case {segment.index}: /* {segment.mode} */\n"
                f"        c->contact = {int(segment.contact)};\n"
                f"        c->drift = {segment.drift};\n{assigned}        break;\n"
            )
    if not python:
        return "".join(texts)
    names = ", ".join(f"_constants_{segment.name}" for segment in SEGMENTS)
    modes = ", ".join(f"({int(g.contact)}, {g.drift})" for g in SEGMENTS)
    texts.append(f"_CONSTANTS = ({names})\n_MODES = ({modes})  # contact, drift\n")
    return "\n\n".join(texts)


def _used_parameters(language: Language) -> str:
    """What C's function of the constants names of its parameters."""
    values = [value for segment in SEGMENTS for _, value in segment_constants(segment.index)]
    used = {omega}.union(*(value.free_symbols for value in values))
    names = (p.name for p in PARAMETERS if p in used)
    return "\n".join(f"    const double {name} = p->{name};" for name in names)


def _field_constants() -> str:
    """Assignments of each field's constants over any number type, from those of its parameters."""
    text, language = "", LANGUAGES["real"]
    for one in SEGMENTS:
        values = [(n, v.xreplace(_OWN)) for n, v in segment_constants(one.index)]
        lines = [f"c->contact = num({float(one.contact)});", f"c->drift = num({float(one.drift)});"]
        lines += [f"c->{name} = {language.expression(value)};" for name, value in values]
        body = "".join(f"        {line}\n" for line in lines)
        text += f"    case {one.index}: /* {one.mode} */\n{body}        break;\n"
    return text


_OWN = {symbol: sp.Symbol(f"c->{symbol}") for symbol in PARAMETERS}


def _fill(template: str, values: dict[str, str]) -> str:
    partials = {path.name.split(".")[0]: path for path in INPUTS.glob("templates/*.part.in")}
    parts = {name: Template(path.read_text()).substitute(values) for name, path in partials.items()}
    return Template((INPUTS / "templates" / template).read_text()).substitute(values | parts)


def render() -> dict[str, str]:
    """The text of every generated file by its path below `generated/`."""
    config = tomllib.loads((INPUTS / "kernels.toml").read_text(encoding="utf-8"))
    by_language = _kernels(config)
    derived = formulas()
    inline = [_formula(f) for f in derived]
    sizes = [_formula(f.size) for f in derived if f.sized]
    roundings = _units(derived)
    operations: dict[str, int] = {}
    interface = read(tomllib.loads((INPUTS / "interface.toml").read_text(encoding="utf-8")))
    stamp = digest()
    friction_bounds = sorted({str(bound) for bound in declaration.chosen().bounds.values()})
    header = (
        f"Generated by `{COMMAND}` with SymPy {sp.__version__}; do not edit.\n\n"
        f"Inputs: digest {stamp}."
    )
    files = {"__init__.py": f'"""{header}"""\n'}
    for target in config["target"]:
        language = LANGUAGES[target["language"]]
        kernels = [] if target["language"] == "page" else by_language[target["language"]]
        operations |= {kernel.name: kernel.operations for kernel in [*kernels, *inline, *sizes]}
        values = {
            "header": header,
            "marked_header": "\n".join(f"{language.comment} {row}" for row in header.split("\n\n")),
            "digest": stamp,
            "jet_order": str(config["jet_order"]),
            "series_terms": str(config["series_terms"]),
            "jacobian_columns": ", ".join(f'"{column}"' for column in jacobian.COLUMNS),
            "constants_fields": "\n".join(f"    {name}: float" for name in _CONSTANT_NAMES),
            "c_fields": "\n    ".join(
                f"double {name};" for name in _CONSTANT_NAMES if name != "resonant"
            ),
            "segment_constants": _segment_texts(language),
            "parameters": ", ".join(_PARAMETER_NAMES),
            "p_parameters": ", ".join(f"p.{name}" for name in _PARAMETER_NAMES),
            "used_parameters": _used_parameters(language),
            "table": table_text(language),
            "fields": field_texts(language),
            "kernels": "\n\n".join(kernel.text(language) for kernel in kernels),
            "margin": next(kernel for kernel in inline if kernel.name == "margin_at").text(language)
            if language.comment == "%"
            else "",
            "formulas": "\n\n".join(kernel.text(language) for kernel in [*inline, *sizes])
            if language.comment == "#"
            else "",
            "units": "\n".join(f"{name} = {number}" for name, number in roundings.items()),
            "c_units": ", ".join(f"{name} = {number}" for name, number in roundings.items()),
            "real_formulas": "\n".join(kernel.text(LANGUAGES["real"]) for kernel in inline),
            "bound_formulas": "\n".join(kernel.text(LANGUAGES["bound"]) for kernel in sizes),
            "field_constants": _field_constants(),
            "friction_bounds": "(" + " + ".join(f"(c)->{b}" for b in friction_bounds) + ")",
            "python_friction_bounds": " + ".join(f"c.{b}" for b in friction_bounds),
            "facts": python_facts(),
            "parameter_fields": python_fields(),
            "device_fields": python_device(),
            "relations": python_relations(),
            "page_facts": page_facts(),
            "classification": c_classification(),
            "c_interface": c_interface(interface),
            "python_interface": python_interface(interface),
        }
        headers = _fill("kernels.h.in", values), _HEADER.read_text(encoding="utf-8")
        values["cython_interface"] = cython_interface(interface, "".join(headers))
        for path, template in target["files"].items():
            text = _fill(template, values)
            marks = (" ...", "%") if language.comment == "%" else ()
            files[path] = text if path.endswith((".pxi", ".ts")) else wrapped(text, *marks)
    manifest = {
        "command": COMMAND,
        "sympy": sp.__version__,
        "digest": stamp,
        "operations": operations,
        "files": {
            path: hashlib.sha256(text.encode()).hexdigest() for path, text in sorted(files.items())
        },
    }
    files["manifest.json"] = json.dumps(manifest, indent=2) + "\n"
    return files
