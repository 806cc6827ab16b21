"""The figure of a result, drawn by the function for its class."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from capsule_sym import _imported  # type: ignore[attr-defined]
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(result: Any, **options: Any) -> Figure:
    """The figure that shows a result at a glance.

    In the main thread it is pyplot's current figure; a notebook shows it once.

    Parameters
    ----------
    result : result of a function of the package
        A trajectory or an orbit gives its displacements and phase portrait, a branch its
        bifurcation diagram. A fit gives its residuals, a front its curve, tolerances the spread.
        `ContinuedAttractors` give their fractions, stacked along the parameter; `Attractors` have
        no figure. A shock gives both motions, and the distance of two runs from the first one; a
        pulse the drive, x_r and x_c over time. Results of a sweep over two parameters give its
        chart, those of a basin its attractors.
    **options : optional
        Options of the function that draws it: `plot_motion`, `plot_diagram`, `plot_residuals`,
        `plot_front`, `plot_tolerances`, `plot_chart` or `plot_basin`. `ContinuedAttractors` and a
        shock take `width` and `axes`, a pulse `width` and `figure`; a shock also a `device`, whose
        units it then has.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For any other result, for other options, and as the function that draws it.

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
    for name in [one.__name__ for one in type(result).__mro__]:
        if name == "Dataset":
            home, draw = "sweeps", "plot_basin" if "attractor" in result else "plot_chart"
        elif name in _DRAWN:
            home, draw = _DRAWN[name]
        else:
            continue
        found: Any = _imported("capsule_sym.figures", f"_figures.{home}", draw)
        drawn: Figure = found(result, **options)
        return drawn
    allowed = f"one of {', '.join(_DRAWN)}, or the results of a sweep or a basin"
    raise InvalidInput("result", type(result).__name__, allowed)


_DRAWN = {
    **dict.fromkeys(("Trajectory", "Orbit"), ("portraits", "plot_motion")),
    "Branch": ("diagrams", "plot_diagram"),
    "Fit": ("design", "plot_residuals"),
    "Front": ("design", "plot_front"),
    "ContinuedAttractors": ("attractors", "plot_attractors"),
    "Shock": ("shocks", "plot_shock"),
    "Pulse": ("pulses", "plot_pulse"),
    "Tolerances": ("tolerances", "plot_tolerances"),
}
"""Modules and functions that draw results, by the names of their classes."""
