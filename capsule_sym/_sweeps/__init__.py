"""Sweeps: many runs of the map as one labelled, resumable result, on one core or a cluster.

The public names are imported on first use: what they need is an extra of its own.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from capsule_sym._sweeps.axes import Axis
    from capsule_sym._sweeps.basin import run_basin
    from capsule_sym._sweeps.execution import run
    from capsule_sym._sweeps.plan import load_sweep, read_plan
    from capsule_sym._sweeps.refinement import refine
    from capsule_sym._sweeps.results import open_results
    from capsule_sym._sweeps.sweep import Sweep

__all__ = [
    "Axis",
    "Sweep",
    "load_sweep",
    "open_results",
    "read_plan",
    "refine",
    "run",
    "run_basin",
]

_HOME = {
    "Axis": "axes",
    "Sweep": "sweep",
    "load_sweep": "plan",
    "open_results": "results",
    "read_plan": "plan",
    "refine": "refinement",
    "run": "execution",
    "run_basin": "basin",
}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
