"""Backends: for each generated language its spelling and its files."""

from capsule_sym.codegen._backend import Language
from capsule_sym.codegen.backends.c import C
from capsule_sym.codegen.backends.python import Python
from capsule_sym.codegen.backends.shared import Shared

BACKENDS: tuple[type[Language], ...] = (Python, C)
"""Backends of a scene; `Shared` writes what all scenes have in common."""

__all__ = ["BACKENDS", "Language", "Shared"]
