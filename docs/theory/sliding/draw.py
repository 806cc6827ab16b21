"""The line of stick in the plane of force and velocity, with an orbit."""

import numpy as np
from matplotlib.figure import Figure

from capsule_sym import Parameters, simulate
from capsule_sym.figures import figure_style


@figure_style()
def draw(width: float = 6.6) -> Figure:
    """Draw an orbit of the case study, the stick, and the directions of both drifts."""
    p = Parameters(alpha=1.2)
    run = simulate(p, periods=200)
    x_r, v_r, v_c = run(np.linspace(199, 200, 3000) * p.period).T
    force = x_r + 2 * p.zeta * v_r + p.beta * np.maximum(x_r - p.delta, 0)
    figure = Figure(figsize=(width, 3), layout="constrained")
    axes = figure.subplots()
    axes.plot(force, v_c, "0.4", lw=1)
    axes.plot([-p.f_b, p.f_b], [0, 0], "C0", lw=4, label="stick")
    for x in np.linspace(-0.6, 0.6, 5):
        for side in (1, -1):
            tip = side * 0.25 + 0.4 * (x - side * p.f_b) / p.gamma
            axes.annotate("", (x, tip), (x, side * 0.25), arrowprops={"arrowstyle": "->"})
    axes.set(xlabel="force $P$", ylabel="velocity $v_c$", xlim=(-3.3, 3.3), ylim=(-0.35, 0.85))
    axes.legend()
    return figure
