"""Digest of code that proves and of the libraries that it uses, independent of its place.

Comments, docstrings and the modules from which names are imported are no part of it, so that moving
a module leaves a proof valid, and changing an operator, number or name does not.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from hashlib import sha256
from importlib import import_module
from importlib.metadata import version
from inspect import getsource
from textwrap import dedent
from types import ModuleType
from typing import Any

import flint

_LIBRARIES = ("numpy", "python-flint")
_ROOTS = "capsule_sym", "paper"
_PROVING = (
    "capsule_sym._enclosures.",
    "capsule_sym._orbits.shooting.changes",
    "capsule_sym._orbits.shooting.itinerary",
    "capsule_sym.generated.capsule.",
    "paper.proofs.",
)
_SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef)


def closure(module: ModuleType) -> tuple[ModuleType, ...]:
    """A module and those of proofs that it uses, with the model's facts and itineraries."""
    found: dict[str, ModuleType] = {}
    waiting = [module.__name__]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found[name] = import_module(name)
        waiting += [
            str(node.module)
            for node in ast.walk(ast.parse(getsource(found[name])))
            if isinstance(node, ast.ImportFrom) and f"{node.module}".startswith(_PROVING)
        ]
    return tuple(found.values())


def digest(code: Iterable[Any]) -> str:
    """Digest of modules, classes and functions, in any order, and of the libraries' versions."""
    single = (sha256(_said(ast.parse(dedent(getsource(one)))).encode()) for one in code)
    whole = [*sorted(one.hexdigest() for one in single), *map(" ".join, libraries().items())]
    return sha256("".join(whole).encode()).hexdigest()


def libraries() -> dict[str, str]:
    """Versions of the libraries with which balls and bounds are computed."""
    return {"FLINT": flint.__FLINT_VERSION__, **{one: version(one) for one in _LIBRARIES}}


def other_libraries(held: Mapping[str, str]) -> str:
    """Libraries of which a file has other versions, as text; empty if there is none."""
    told = libraries() | {**held}  # a TypeError if it is no mapping
    others = (
        f"{one} {told[one]}, not {now}" for one, now in libraries().items() if told[one] != now
    )
    return " and ".join(others)


def _said(node: Any) -> str:
    """Syntax tree as text, independent of the version of Python."""
    if isinstance(node, list):
        own = [one for one in node if _of_the_project(one)]
        names = sorted(_said(alias) for one in own for alias in one.names)
        return f"[{','.join(names + [_said(one) for one in node if one not in own])}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = {name: value for name, value in ast.iter_fields(node) if value not in (None, [])}
    if isinstance(node, _SCOPES) and ast.get_docstring(node) is not None:
        fields["body"] = node.body[1:]
    return f"{type(node).__name__}({','.join(f'{k}={_said(v)}' for k, v in fields.items())})"


def _of_the_project(node: Any) -> bool:
    return isinstance(node, ast.ImportFrom) and f"{node.module}".partition(".")[0] in _ROOTS
