"""Wrong switches and errors of SciPy's solve_ivp, over its tolerance."""

from runpy import run_path

import numpy as np
from matplotlib.figure import Figure

from capsule_sym import Parameters, check_switches
from capsule_sym.figures import figure_style


@figure_style("column")
def draw(width: float = 3.6) -> Figure:
    """Run it at its own steps, and at short ones."""
    switches = run_path("solve_ivp.py")["switches"]
    p = Parameters(alpha=0.7)
    end, tolerances = 3 * p.period, [10.0**-k for k in range(2, 9)]
    figure = Figure(figsize=(width, 4.4), layout="constrained")
    left, right = figure.subplots(2, 1)
    for label, step in (("SciPy's own steps", p.period), ("at most T/50", p.period / 50)):
        runs = [switches(0.7, tolerance, end, step) for tolerance in tolerances]
        found = [check_switches(*zip(*run, strict=True), p, end=end) for run in runs]
        wrong = [int(np.isnan(one.errors).sum()) for one in found]
        left.semilogx(tolerances, wrong, "o-", label=label)
    late = [np.nanmax(abs(one.errors)) for one in found]
    right.loglog(tolerances, late, "o-", color="C2", label="switching time")
    own = [one.segment_error for one in found]
    right.loglog(tolerances, own, "s-", color="C3", label="state, a segment")
    left.set(title="missed and invented", xlabel="tolerance", ylim=(-0.2, 3.4))
    right.set(title="largest error, at most T/50", xlabel="tolerance")
    for axes in (left, right):
        axes.legend()
        axes.invert_xaxis()
    return figure
