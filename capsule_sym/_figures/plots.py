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

    It is pyplot's current figure; a notebook shows it once.

    Parameters
    ----------
    result : Trajectory, Orbit, Branch, Fit, Front, ContinuedAttractors, Shock, Pulse or Tolerances
        A trajectory or an orbit gives its displacements and phase portrait, a branch the
        bifurcation diagram, a fit its residuals, and a front its curve. `ContinuedAttractors` give
        their fractions, a shock and a pulse both motions, tolerances the spread.
    **options : optional
        Options of the function that draws it: `plot_motion`, `plot_bifurcations`, `plot_residuals`,
        `plot_front`, `plot_attractors`, `plot_shock`, `plot_pulse` or `plot_tolerances`.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For anything else. Sweeps are drawn by `plot_chart`, `plot_basin` and `plot_pareto`.

    See Also
    --------
    save_figure : file of a figure.
    figure_style : width of figures.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> figure = cs.plot(orbit)
    >>> print([axes.get_ylabel() for axes in figure.axes])
    ['displacements $x_m$, $x_c$', 'relative velocity $v_r$']
    >>> figure = cs.plot(cs.continue_orbit(orbit, "alpha", 1.0))
    >>> print(figure.axes[0].get_ylabel())
    stroboscopic $x_r$
    """
    from capsule_sym._figures.computed import branch_record

    drawn: dict[type[Any], Callable[..., Figure]] = {
        capsule_sym.results.Trajectory: capsule_sym.figures.plot_motion,
        capsule_sym.results.Orbit: capsule_sym.figures.plot_motion,
        capsule_sym.results.Branch: capsule_sym.figures.plot_bifurcations,
        capsule_sym.results.Fit: capsule_sym.figures.plot_residuals,
        capsule_sym.results.Front: capsule_sym.figures.plot_front,
        capsule_sym.results.ContinuedAttractors: capsule_sym.figures.plot_attractors,
        capsule_sym.results.Shock: capsule_sym.figures.plot_shock,
        capsule_sym.results.Pulse: capsule_sym.figures.plot_pulse,
        capsule_sym.results.Tolerances: capsule_sym.figures.plot_tolerances,
    }
    for kind, draw in drawn.items():
        if isinstance(result, kind):
            shown = branch_record(result) if kind is capsule_sym.results.Branch else result
            return draw(shown, **options)
    allowed = ", ".join(
        f"a{'n' * (kind is capsule_sym.results.Orbit)} {kind.__name__}" for kind in drawn
    )
    others = "sweeps are drawn by plot_chart, plot_basin and plot_pareto"
    raise InvalidInput("result", type(result).__name__, f"{allowed}; {others}")
