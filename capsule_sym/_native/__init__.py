"""Bindings of the compiled cores of scenes, or None without them."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.util import find_spec
from os import listdir
from os.path import isdir
from types import ModuleType

from capsule_sym._errors import CapsuleError
from capsule_sym._native.watch import TimeUp, Watch, check_time, present
from capsule_sym._parameters import CAPSULE, SHIPPED, Scene

__all__ = ["StaleCore", "TimeUp", "Watch", "check_time", "core", "core_of", "live", "present"]


class StaleCore(CapsuleError, ImportError):
    """Raised if the compiled core was built from other kernels or sources than the package's."""


def _check_sources(installed: str) -> None:
    """Refuse a core that was installed with other C sources than those here."""
    from filecmp import cmpfiles

    here = __path__[0]
    present = listdir(installed) if isdir(installed) else ()
    names = [name for name in present if name.endswith((".c", ".h", ".pyx"))]
    _, others, _ = cmpfiles(here, installed, names, shallow=False)
    if others:
        raise StaleCore(
            f"the core in {installed} was compiled from another {min(others)} than that in {here}: "
            "install capsule-sym again, which compiles it"
        )


def _lies_elsewhere(scene: Scene) -> bool:
    """True if the core is where pip installed the package, and Python imports a clone of it."""
    from importlib.metadata import distributions  # loads 50 modules

    installed = next(iter(distributions(name="capsule-sym")), None)
    if installed is None or scene.source not in SHIPPED:
        return False
    folder = str(installed.locate_file(scene.package.replace(".", "/")))
    searched = import_module(scene.package).__path__
    if folder not in searched:
        searched.append(folder)
    if find_spec(f"{scene.package}._core") is None:
        return False
    _check_sources(str(installed.locate_file("capsule_sym/_native")))
    return True


@cache
def core_of(scene: Scene) -> ModuleType | None:
    """Binding of a scene's core; None if it was not compiled.

    Raises StaleCore if it was compiled from other kernels or sources.
    """
    name, again = f"{scene.package}._core", "install capsule-sym again, which compiles it"
    if scene.source not in SHIPPED:
        again = f"`python -m capsule_sym.codegen --scene FILE --out {scene.source} --core`"
    if find_spec(name) is None and not _lies_elsewhere(scene):
        return None
    try:
        module = import_module(name)
    except AssertionError as error:  # of the binding, for a struct of another layout
        raise StaleCore(f"the compiled core has other structs than the package: {again}") from error
    if module.digest() != scene.digest:
        raise StaleCore(
            f"the compiled core has kernels {module.digest()}, the package has {scene.digest}: "
            f"{again}"
        )
    return module


core = core_of(CAPSULE)


def live(scene: Scene = CAPSULE) -> str:
    """Code that computes here: c-avx512, c-avx2 or c-plain, whose last bits differ, or numpy."""
    if (core := core_of(scene)) is None:
        return "numpy"
    return {8: "c-avx512", 4: "c-avx2", 1: "c-plain"}[core.lanes()]
