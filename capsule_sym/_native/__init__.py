"""Compiled cores of scenes; None for a scene without one."""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from os.path import dirname, isfile, join
from typing import Any

from capsule_sym._compile import CORE, kept, opened
from capsule_sym._errors import CapsuleError
from capsule_sym._native.watch import TimeUp, Watch, check_time, present
from capsule_sym._parameters import CAPSULE, SHIPPED, Scene

__all__ = ["StaleCore", "TimeUp", "Watch", "check_time", "core", "core_of", "live", "present"]


class StaleCore(CapsuleError, ImportError):
    """Raised if a compiled core is of other kernels, or cannot be loaded."""


def _opened(binding: Any, path: str, scene: Scene) -> Any:
    """Core in a library; raises StaleCore if that is no core, or one of other kernels."""
    again = "install capsule-sym again, which compiles it"
    if scene.source not in SHIPPED:
        again = f"`python -m capsule_sym.codegen --scene FILE --out {scene.source} --core`"
    try:
        library = opened(path)
        table = library.capsule_core
        table.restype = ctypes.c_void_p
        core = binding.Core(table(), scene.records, library)
        if core.digest() != scene.digest:
            raise ValueError(f"kernels {core.digest()}, the package has {scene.digest}")
    except (OSError, AttributeError) as error:
        raise StaleCore(f"{path} is no core for this machine ({error}): {again}") from error
    except ValueError as error:
        raise StaleCore(f"the core {path} has {error}: {again}") from error
    return core


@cache
def core_of(scene: Scene) -> Any:
    """Core of a scene; None if there is none. That of a shipped scene is compiled at its first use.

    None also without the binding, and if a shipped scene cannot be compiled. Raises StaleCore if it
    was compiled from other kernels, or cannot be loaded here.
    """
    if find_spec(name := f"{__name__}._binding") is None:
        return None
    binding: Any = import_module(name)
    path = join(scene.source, CORE)
    if scene.source in SHIPPED:
        path = join(dirname(dirname(binding.__file__)), "generated", scene.source, CORE)
        if not isfile(path):
            path = kept(scene.source, join(dirname(str(scene.facts.__file__)), "c"))
    return _opened(binding, path, scene) if isfile(path) else None


core = core_of(CAPSULE)


def live(scene: Scene = CAPSULE) -> str:
    """Code that computes here: c-avx512, c-avx2, c-plain or numpy; their last bits differ.

    c-avx2 is the name of four lanes, also on ARM.
    """
    if (core := core_of(scene)) is None:
        return "numpy"
    return {8: "c-avx512", 4: "c-avx2", 1: "c-plain"}[core.lanes()]
