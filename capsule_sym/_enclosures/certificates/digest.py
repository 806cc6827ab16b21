"""Digest of code that proves, independent of its place.

Comments, docstrings and the modules from which names are imported are no part of it, so that moving
a module leaves a proof valid, and changing an operator, number or name does not.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from hashlib import sha256
from importlib import import_module
from inspect import getsource
from textwrap import dedent
from types import ModuleType
from typing import Any

_ROOT, _HOME = __name__.partition(".")[0], __name__.rsplit(".", 2)[0]
_SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef)


def closure(module: ModuleType) -> tuple[ModuleType, ...]:
    """A module and the modules of this package that it uses."""
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
            if isinstance(node, ast.ImportFrom) and f"{node.module}".startswith(f"{_HOME}.")
        ]
    return tuple(found.values())


def digest(code: Iterable[Any]) -> str:
    """Digest of modules, classes and functions, in any order."""
    single = (sha256(_said(ast.parse(dedent(getsource(one)))).encode()) for one in code)
    return sha256("".join(sorted(one.hexdigest() for one in single)).encode()).hexdigest()


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
    return isinstance(node, ast.ImportFrom) and f"{node.module}".partition(".")[0] == _ROOT
