"""The map in C, if it was compiled: `core` is its binding, or None on an install without it."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from os import listdir
from types import ModuleType

from capsule_sym._errors import CapsuleError
from capsule_sym._native.watch import TimeUp, Watch, check_time, present
from capsule_sym.generated.capsule.py import DIGEST

__all__ = ["StaleCore", "TimeUp", "Watch", "check_time", "core", "live", "present"]


class StaleCore(CapsuleError, ImportError):
    """The compiled core was built from other kernels or sources than those of the package."""


def _check_sources(here: str, installed: str) -> None:
    """Refuses a core that is installed with other sources in C than those here."""
    from filecmp import cmpfiles

    names = [name for name in listdir(installed) if name.endswith((".c", ".h", ".pyx"))]
    _, others, _ = cmpfiles(here, installed, names, shallow=False)
    if others:
        raise StaleCore(
            f"the core in {installed} was compiled from another {min(others)} than that in {here}: "
            "install capsule-sym again, so that it is compiled anew"
        )


def _load() -> ModuleType | None:
    name = f"{__name__}._core"
    if find_spec(name) is None:
        # Python that was started in a clone imports the clone; its core is where pip installed it.
        from importlib.metadata import distributions  # loads 50 modules

        installed = next(iter(distributions(name="capsule-sym")), None)
        folder = installed and str(installed.locate_file("capsule_sym/_native"))
        if folder and folder not in __path__:
            __path__.append(folder)
        if find_spec(name) is None:
            return None
        _check_sources(*__path__)
    try:
        module = import_module(name)
    except AssertionError as error:  # of the binding, for a struct of another layout
        raise StaleCore(
            "the compiled core has other structs than the package: "
            "install capsule-sym again, so that it is compiled anew"
        ) from error
    if module.digest() != DIGEST:
        raise StaleCore(
            f"the compiled core has kernels {module.digest()}, the package has {DIGEST}: "
            "install capsule-sym again, so that it is compiled anew"
        )
    return module


core = _load()


def live() -> str:
    """What computes here: c-avx512, c-avx2 or c-plain, whose last bits differ, or numpy."""
    if core is None:
        return "numpy"
    return {8: "c-avx512", 4: "c-avx2", 1: "c-plain"}[core.lanes()]
