"""The exact three-dimensional map of a piecewise-linear capsule system with bidirectional drifts.

The public names are imported on first use, so that importing the package costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from capsule_sym._errors import InvalidInput, Outcome, Status
    from capsule_sym._map import Trajectory, simulate
    from capsule_sym._map.many import Trajectories, simulate_many
    from capsule_sym._parameters import Parameters, PhysicalParameters, load_parameters

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
    "InvalidInput": "_errors",
    "Outcome": "_errors",
    "Parameters": "_parameters",
    "PhysicalParameters": "_parameters",
    "Status": "_errors",
    "Trajectories": "_map.many",
    "Trajectory": "_map",
    "load_parameters": "_parameters",
    "simulate": "_map",
    "simulate_many": "_map.many",
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
