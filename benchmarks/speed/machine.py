"""Machine on which a study ran: processor, and versions of all compared packages."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from capsule_sym.generated.capsule import DIGEST

_PACKAGES = ("capsule-sym", "numpy", "scipy", "mpmath", "gmpy2", "heyoka", "scikit-sundae")


def machine() -> dict[str, str | int | None]:
    """Processor, number of logical cores, and operating system."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def versions() -> dict[str, str | None]:
    """Versions of Python, the packages (None if absent) and the generated kernels."""
    found: dict[str, str | None] = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return found | {"generated": DIGEST}
