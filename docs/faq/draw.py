"""Distance of two chaotic runs that start beside each other."""

import numpy as np
from matplotlib.figure import Figure

from capsule_sym import Parameters, simulate
from capsule_sym.figures import figure_style


@figure_style()
def draw() -> Figure:
    """Draw the distance of the states, once a period."""
    p = Parameters(alpha=0.3, omega=0.55, delta=0.3, zeta=0.05, beta=25.0, gamma=6.0)
    times = p.period * np.arange(201)
    one, other = (simulate(p, (x, 0.0, 0.0), periods=200)(times) for x in (0.1, 0.1 + 1e-12))
    figure = Figure(figsize=(3.6, 2.4), layout="constrained")
    axes = figure.subplots()
    axes.semilogy(np.linalg.norm(one - other, axis=1))
    axes.set(xlabel="excitation period", ylabel="distance of the states")
    return figure
