"""Pictures of trajectories, orbits and branches, and of the whole case study.

The functions draw results and compute none; each gives a matplotlib figure, or draws into axes.
They are imported on first use, and so is matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HOME = {
    "animate": "animation",
    "around": "events",
    "basin": "sweeps",
    "bifurcations": "branches",
    "chart": "charts",
    "diagram": "diagrams",
    "displacements": "portraits",
    "energies": "energy",
    "fig1": "device",
    "fig2": "statespace",
    "fig3": "switching",
    "fig4": "switching",
    "fig5": "switching",
    "fig6": "evolution",
    "fig7": "panels",
    "itineraries": "evolution",
    "margins": "guards",
    "motion": "portraits",
    "pareto": "sweeps",
    "phase_portrait": "portraits",
    "save": "style",
    "styled": "style",
    "work_precision": "precision",
}

__all__ = [*_HOME, "plot"]


def plot(result: Any, **options: Any) -> Figure:
    """The figure that shows a result at a glance.

    A `Trajectory` or an `Orbit` gives its displacements and phase portrait, a `Branch` the
    bifurcation diagram. Options are those of `motion` and `bifurcations`. Raises InvalidInput for
    anything else.
    """
    from capsule_sym._errors import InvalidInput
    from capsule_sym._figures.branches import bifurcations
    from capsule_sym._figures.portraits import motion
    from capsule_sym._map import Trajectory
    from capsule_sym._orbits.continuation.continuation import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit
    from capsule_sym._study.data import branch_record

    if isinstance(result, Trajectory | Orbit):
        return motion(result, **options)
    if isinstance(result, Branch):
        return bifurcations(branch_record(result), **options)
    raise InvalidInput("result", type(result).__name__, "a Trajectory, an Orbit or a Branch")


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
