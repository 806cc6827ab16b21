"""The figure of a result: what `plot` draws of each kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import capsule_sym
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(result: Any, **options: Any) -> Figure:
    """The figure that shows a result at a glance.

    A `Trajectory` or an `Orbit` gives its displacements and phase portrait, a `Branch` the
    bifurcation diagram, a `Fit` its residuals, a `Front` its curve, `ContinuedAttractors` their
    fractions, a `Shock` and a `Pulse` both motions, `Tolerances` the spread. Options are those of
    `plot_motion`, `plot_bifurcations`, `plot_residuals`, `plot_front`, `plot_attractors`,
    `plot_shock`, `plot_pulse` and `plot_tolerances`. Raises InvalidInput for anything else.
    """
    from capsule_sym._figures.computed import branch_record

    drawn: dict[type[Any], Callable[..., Figure]] = {
        capsule_sym.Trajectory: capsule_sym.plot_motion,
        capsule_sym.Orbit: capsule_sym.plot_motion,
        capsule_sym.Branch: capsule_sym.plot_bifurcations,
        capsule_sym.Fit: capsule_sym.plot_residuals,
        capsule_sym.Front: capsule_sym.plot_front,
        capsule_sym.ContinuedAttractors: capsule_sym.plot_attractors,
        capsule_sym.Shock: capsule_sym.plot_shock,
        capsule_sym.Pulse: capsule_sym.plot_pulse,
        capsule_sym.Tolerances: capsule_sym.plot_tolerances,
    }
    for kind, draw in drawn.items():
        if isinstance(result, kind):
            shown = branch_record(result) if kind is capsule_sym.Branch else result
            return draw(shown, **options)
    allowed = ", ".join(f"a{'n' * (kind is capsule_sym.Orbit)} {kind.__name__}" for kind in drawn)
    others = "sweeps are drawn by plot_chart, plot_basin and plot_pareto"
    raise InvalidInput("result", type(result).__name__, f"{allowed}; {others}")
