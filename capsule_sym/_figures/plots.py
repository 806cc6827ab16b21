"""The figure of a result: what `plot` draws of each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import capsule_sym
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(result: Any, **options: Any) -> Figure:
    """The figure that shows a result at a glance.

    A `Trajectory` or an `Orbit` gives its displacements and phase portrait, a `Branch` the
    bifurcation diagram, a `Fit` its residuals, a `Front` and a `Steering` their curves. Options are
    those of `plot_motion`, `plot_bifurcations`, `plot_residuals`, `plot_front` and
    `plot_steering`. Raises InvalidInput for anything else.
    """
    from capsule_sym._map import Trajectory
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit
    from capsule_sym._study.data import branch_record

    if isinstance(result, Trajectory | Orbit):
        return capsule_sym.plot_motion(result, **options)
    if isinstance(result, Branch):
        return capsule_sym.plot_bifurcations(branch_record(result), **options)

    from capsule_sym._design.fit import Fit
    from capsule_sym._design.pareto import Front
    from capsule_sym._design.steering import Steering

    if isinstance(result, Fit):
        return capsule_sym.plot_residuals(result, **options)
    if isinstance(result, Front):
        return capsule_sym.plot_front(result, **options)
    if isinstance(result, Steering):
        return capsule_sym.plot_steering(result, **options)
    allowed = "a Trajectory, an Orbit, a Branch, a Fit, a Front or a Steering"
    others = "sweeps are drawn by plot_chart, plot_basin and plot_pareto"
    raise InvalidInput("result", type(result).__name__, f"{allowed}; {others}")
