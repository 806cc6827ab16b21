"""The exact three-dimensional map of a piecewise-linear capsule system with bidirectional drifts.

The public names are imported on first use, so that importing the package costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from capsule_sym.errors import InvalidInput, Outcome, Status
    from capsule_sym.map import Trajectory, simulate
    from capsule_sym.map.many import Trajectories, simulate_many
    from capsule_sym.parameters import Parameters, PhysicalParameters, load_parameters

    __version__: str

__all__ = [
    "InvalidInput",
    "Outcome",
    "Parameters",
    "PhysicalParameters",
    "Status",
    "Trajectories",
    "Trajectory",
    "__version__",
    "load_parameters",
    "simulate",
    "simulate_many",
]

_HOME = {
    "InvalidInput": "errors",
    "Outcome": "errors",
    "Parameters": "parameters",
    "PhysicalParameters": "parameters",
    "Status": "errors",
    "Trajectories": "map.many",
    "Trajectory": "map",
    "load_parameters": "parameters",
    "simulate": "map",
    "simulate_many": "map.many",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("capsule-sym")
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
