"""A pulse of the drive that leads from one attractor to another, over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure, SubFigure

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.layout import add_key, canvas, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import SERIES, STABLE, UNSTABLE, describe, styled
from capsule_sym._figures.units import named
from capsule_sym._parameters import SceneDevice

_TIME = r" $\tau$"  # dimensionless

if TYPE_CHECKING:
    from capsule_sym._attractors.pulse import Pulse


@styled
def plot_pulse(
    pulse: Pulse, *, width: float = PAGE, figure: Figure | SubFigure | None = None
) -> Figure:
    """Force of the drive over time, and below it x_r and x_c.

    The band is the pulse, the line the end of its `transient`. Time is from two excitation periods
    before the pulse to four after the transient. The axes are in SI units if the pulse is that of a
    device, else dimensionless. Drawn into `figure` or a part of one, if it is given. Raises
    InvalidInput for a result without a pulse.
    """
    if not pulse.periods:
        raise InvalidInput("pulse", str(pulse.status), "a pulse that was found")
    columns, (begin, end, arrived) = pulse.columns, pulse.times
    device = isinstance(pulse.system, SceneDevice)
    time, length, force = (f" ({unit})" if device else "" for unit in ("s", "m", "N"))
    page = canvas(figure, width, max(4.2, 0.75 * width), layout="constrained")
    rows = page.subplots(3, sharex=True)
    usual = getattr(pulse.system, pulse.parameter)
    label = f"pulse: {named(pulse.parameter)} {pulse.value:.4g} instead of {usual:.4g}"
    names = {"drive": f"drive{force}", "x_r": f"$x_r${length}", "x_c": f"$x_c${length}"}
    for row, (name, said) in zip(rows, names.items(), strict=True):
        row.axvspan(begin, end, color=SERIES[1], alpha=0.25, linewidth=0, label=label)
        row.axvline(arrived, color=UNSTABLE, linewidth=0.8, label="end reached")
        row.plot(columns["time"], columns[name], color=STABLE)
        row.set_ylabel(said)
    add_key(page, handles_of(rows[:1]))
    rows[-1].set_xlabel(f"time{time if device else _TIME} since the pulse begins")
    rows[-1].set_xlim(columns["time"][0], columns["time"][-1])
    return describe(page, "A pulse of the drive from one attractor to another")
