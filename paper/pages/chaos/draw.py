"""Figure of the sets of the horseshoe, a long run, and the images of the sets one period later."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from capsule_sym import Parameters, simulate, simulate_many
from capsule_sym._figures.interface import styled
from paper.proofs.horseshoe import kept

_SIDE, _ONE = np.linspace(-1, 1, 101), np.ones(101)
_AROUND = np.array([[*_SIDE, *_ONE, *-_SIDE, *-_ONE], [*_ONE, *-_SIDE, *-_ONE, *_SIDE]])


@styled
def draw(width: float = 6.6) -> Figure:
    """Figure of the kept sets: above on a long run, below with their images."""
    given = kept()
    system = Parameters(**{name: float(text) for name, text in given["parameters"].items()})
    dots = np.array(simulate(system, periods=4000).stroboscopic)[200:]
    figure = Figure(figsize=(width, 8), layout="constrained")
    whole, image = figure.subplots(2, 1, sharex=True)
    for number, one in enumerate(given["sets"]):
        centre, *sides = (np.array(one[name], float) for name in ("centre", "unstable", "stable"))
        edge = centre + _AROUND.T @ sides
        starts = np.column_stack([edge, np.zeros(len(edge))])
        ends = simulate_many([system] * len(edge), starts, periods=1).states
        for axes in (whole, image):
            axes.fill(*edge.T, color=f"C{number}", alpha=0.35, lw=0)
            axes.annotate(f"{number + 1}", edge[50], (-3, 9), textcoords="offset points")
        image.fill(*ends[:, :2].T, color=f"C{number}", lw=1.2)
    whole.plot(*dots[:, :2].T, ".", ms=1, color="0.5", zorder=0)
    whole.set(title="the sets, and a long run", ylabel="$v_r$")
    image.set(title="the sets, and their images one period later", xlabel="$x_r$", ylabel="$v_r$")
    return figure
