"""The plane of rest, with the switches of an orbit on it."""

import numpy as np
from matplotlib.figure import Figure

from capsule_sym import Parameters, solve_orbit
from capsule_sym.figures import figure_style

SURFACES = {
    "S1": (-0.6, 3.2),
    "S2": (-0.6, 0.4),
    "S3": (-2.2, -1.2),
    "S4": (1.3, 0.8),
    "S5": (0.5, -1.8),
    "S6": (0.345, -3.85),
}
LINES = {"L1": (-0.95, 2.6), "L2": (-1.75, 1.5), "L3": (0.62, 0.1), "L4": (0.62, -3.1)}


@figure_style()
def draw(width: float = 6.6) -> Figure:
    """Draw surfaces, lines, and the states at which a segment begins on the plane."""
    p = Parameters(alpha=1.6, delta=0.3, zeta=0.3)
    x = np.array([-3.0, p.delta, 2.0])
    force = x + p.beta * np.maximum(x - p.delta, 0)
    upper, lower = ((bound - force) / (2 * p.zeta) for bound in (p.f_b, -p.f_b))
    figure = Figure(figsize=(width, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.fill_between(x, lower, upper, color="C0", alpha=0.15, lw=0)
    axes.plot(x, upper, "C0", x, lower, "C0")
    axes.axvline(p.delta, color="0.4", ls="--")
    for name, where in SURFACES.items():
        axes.annotate(name, where, color="C0", size=11)
    for name, where in LINES.items():
        axes.annotate(name, where)
    for segment in solve_orbit(p).motion.segments:
        x_r, v_r, v_c = map(float, segment.start_state)
        aside = (-8, 10) if segment.mode.endswith("S") else (-16, -10)
        if abs(v_c) < 1e-12:
            axes.plot(x_r, v_r, "o", color="C3")
            axes.annotate(segment.name, (x_r, v_r), aside, textcoords="offset points", color="C3")
    axes.set(xlim=(-2.6, 1.8), ylim=(-4, 4), xlabel="$x_r$", ylabel="$v_r$")
    return figure
