"""Sweeps that the tests share, and how a store is compared byte for byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from capsule_sym.inputs import Axis, Sweep


def chart(rows: int = 12, columns: int = 10, **settings: Any) -> Sweep:
    """A small chart over alpha and gamma, in chunks that leave a remainder on both axes."""
    settings = {
        "periods": 40,
        "compute": ("itinerary", "progression", "final"),
        "chunk": (min(5, rows), min(4, columns)),
        **settings,
    }
    axes = (Axis.linear("alpha", 0.01, 2.0, rows), Axis.log("gamma", 1.0, 5.0, columns))
    return Sweep(axes, **settings)


def contents(store: Path) -> dict[str, bytes]:
    """All files of a store by their paths."""
    files = (path for path in store.rglob("*") if path.is_file())
    return {str(path.relative_to(store)): path.read_bytes() for path in files}
