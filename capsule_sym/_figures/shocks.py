"""A motion, its minimal shock, and runs after a smaller and a larger shock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.layout import across, add_key, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import SERIES, STABLE, describe, styled
from capsule_sym._figures.units import Units
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import SceneDevice

if TYPE_CHECKING:
    from capsule_sym._attractors.shock import Shock

_POINTS = 4000  # of a closed curve


@styled
def plot_shock(
    shock: Shock,
    *,
    width: float = PAGE,
    axes: Sequence[Axes] | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """A motion, its minimal shock, and the runs from either side of it.

    The phase portrait has an arrow from the motion to the state after the shock, and the motion
    that it is lost to, if that is known. Beside it, or below on a narrow figure, is the distance of
    two runs from the motion's nearest state at phase 0, once an excitation period. They begin with
    shocks smaller and larger by 0.1 %. Of a minimal shock the first comes back, and the second is
    lost. Drawn into two `axes`, without the legend, if they are given. The portrait is in SI units
    if the `device` of the motion is given. Raises InvalidInput if no shock was found, and for a
    device that cannot have the motion.
    """
    if shock.start is None or shock.state is None:
        raise InvalidInput("shock", shock, "one with a knock that loses the motion")
    side = across(width, 2.4, 2)
    figure, (left, right) = axes_for(axes, width, 2.9 * (3 - side), nrows=3 - side, ncols=side)
    units = Units.of_motion(device, shock.orbit.parameters)
    scales = np.array([units.scale("x_r"), units.scale("v_r")])
    shown: list[tuple[Orbit | None, dict[str, Any]]] = [
        (shock.attractor, {"color": SERIES[4], "label": "where it is lost to"}),
        (shock.orbit, {"color": STABLE, "label": "motion"}),
    ]
    for orbit, looks in shown:
        if orbit is not None:
            run = whole_orbit(orbit).trajectory()
            states = run(np.linspace(*run.span, _POINTS))[:, :2]
            left.plot(*(states * scales).T, **looks)
    begin, end = (state[:2] * scales for state in (shock.start, shock.state))
    left.annotate("", end, begin, arrowprops={"arrowstyle": "->", "linewidth": 1.4}, zorder=5)
    left.plot(*end, "o", color="black", markersize=3.5, zorder=6, label="minimal shock")
    left.set_xlabel(units.label("x_r"))
    left.set_ylabel(units.label("v_r"))
    marks = stroboscopic(whole_orbit(shock.orbit))
    said = ("knock smaller by 0.1 %", "knock larger by 0.1 %")
    for run, colour, label in zip(shock.runs, (STABLE, SERIES[4]), said, strict=True):
        states = np.array(run.stroboscopic, dtype=float)
        apart = np.linalg.norm(states[:, None] - marks, axis=2).min(axis=1)
        right.semilogy(run.stroboscopic_periods, apart, ".-", color=colour, label=label)
    right.set_xlabel("excitation periods")
    right.set_ylabel("distance from the motion" + " (dimensionless)" * (device is not None))
    if axes is None:
        add_key(figure, handles_of((left, right)))
    return describe(figure, "Minimal shock of a motion", parameters=shock.orbit.parameters)
