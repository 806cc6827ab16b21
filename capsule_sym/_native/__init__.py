"""The map in C, if it was compiled: `core` is its binding, or None on an install without it."""

from __future__ import annotations

from types import ModuleType

from capsule_sym.errors import CapsuleError
from capsule_sym.generated.py import DIGEST


class StaleCore(CapsuleError, ImportError):
    """The compiled core was built from other kernels than the ones beside it."""


def _load() -> ModuleType | None:
    try:
        from capsule_sym._native import _core  # type: ignore[attr-defined]
    except ImportError:
        return None
    if _core.digest() != DIGEST:
        raise StaleCore(
            f"the compiled core has kernels {_core.digest()}, the package has {DIGEST}: "
            "install capsule-sym again, so that it is compiled anew"
        )
    module: ModuleType = _core
    return module


core = _load()
