"""Error and processor time of each tool, from `speed.csv`."""

import csv
from pathlib import Path

from matplotlib.figure import Figure

from capsule_sym.figures import figure_style


@figure_style()
def draw(width: float = 5.4) -> Figure:
    """Draw a circle for each tool, open if it missed or invented a switch."""
    with Path("speed.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    figure = Figure(figsize=(width, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log", xlim=(1, 2e6), ylim=(1e-16, 1e-1))
    axes.set(xlabel="processor time (µs a period)", ylabel="error of the final state")
    for row in rows:
        x, y, wrong = float(row["microseconds"]), float(row["error"]), int(row["wrong"])
        axes.plot(x, y, "o", color="C3" if wrong else "C0", fillstyle="none" if wrong else "full")
        below = -10 if row["tool"].startswith("heyoka") else -2
        axes.annotate(row["tool"], (x, y), (6, below), textcoords="offset points")
    return figure
