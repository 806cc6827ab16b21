"""Errors of two forms of the flow near resonance."""

from functools import cache

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from capsule_sym import Parameters, simulate
from capsule_sym.figures import figure_style


@cache
def errors() -> NDArray[np.float64]:
    """Distances from resonance, and errors of both forms after ten periods."""
    rows = []
    for distance in 10.0 ** -np.arange(1, 9):
        p = Parameters(alpha=1e-3, omega=1 - distance, zeta=0.0, delta=100.0)
        exact, here = (
            float(simulate(p, periods=10, backend=name, keep="final").final[1][1])
            for name in ("mpmath", "numpy")
        )
        time = 10 * p.period
        textbook = p.alpha * (np.sin(time) - p.omega * np.sin(p.omega * time)) / (1 - p.omega**2)
        rows.append((distance, *(abs(one / exact - 1) + 1e-17 for one in (textbook, here))))
    return np.transpose(rows)


@figure_style()
def draw(width: float = 6.6) -> Figure:
    """Draw the error of the velocity over the distance from resonance."""
    distances, textbooks, heres = errors()
    figure = Figure(figsize=(width, 3), layout="constrained")
    axes = figure.subplots()
    axes.loglog(distances, textbooks, "o-", color="C3", label="textbook form")
    axes.loglog(distances, heres, "o-", color="C0", label="this map")
    axes.set(xlabel="distance from resonance, 1 − ω", ylabel="relative error", ylim=(1e-18, 1e-6))
    axes.legend()
    return figure
