"""A short contact between two samples."""

import numpy as np
from matplotlib.figure import Figure

from capsule_sym import Parameters, simulate
from capsule_sym.figures import figure_style


@figure_style()
def draw(width: float = 6.6) -> Figure:
    """Draw the gap over time, samples of a fixed step, and both exact switches."""
    p = Parameters(alpha=0.0076)
    run = simulate(p, periods=60)
    (contact,) = (one for one in run.steady().segments if one.mode == "C-S")
    begin = float(contact.start.period * p.period + contact.start.phase)
    end = begin + float(contact.duration)
    times = np.linspace(begin - 2.2, end + 2.2, 400)
    samples = begin - 0.12 + 0.78 * np.arange(-2, 4)
    figure = Figure(figsize=(width, 2.8), layout="constrained")
    axes = figure.subplots()
    axes.axhline(0, color="0.4", lw=0.8)
    axes.plot(times - begin, p.delta - run(times)[:, 0], "C0")
    gaps = p.delta - run(samples)[:, 0]
    axes.plot(samples - begin, gaps, "o", color="C1", label="samples")
    axes.plot([0, end - begin], [0, 0], "s", color="C3", label="switches")
    axes.set(xlabel="time", ylabel="gap δ − $x_r$")
    axes.legend()
    return figure
