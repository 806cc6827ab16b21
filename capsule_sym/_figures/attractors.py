"""Attractors along a parameter: which fraction of the starts leads to each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from capsule_sym._figures.layout import add_key, axes_for
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import AREAS, LABELS, blank, describe, readable, styled

if TYPE_CHECKING:
    from capsule_sym._attractors.branches import ContinuedAttractors

_NAMED = 0.08  # fraction from which on an area has its number
_NARROW = 0.01  # share of the axis over which it goes then
_LARGE = 0.7  # share of an area's greatest height above which it may stand
_HATCHES = (None, "/////", ".....", "xxxxx")  # of attractors that share a colour
_Values = NDArray[np.float64]


@styled
def plot_attractors(
    found: ContinuedAttractors, *, width: float = PAGE, axes: Axes | None = None
) -> Figure:
    """The fractions of starts that lead to each attractor, stacked, along a parameter.

    `found` is what `continue_attractors` gives. Each attractor has a colour and its number; marks
    above are births (filled) and deaths (open) at the bifurcations of their branches, where
    fractions jump. White are starts that have not settled. Drawn into `axes` if they are given.
    """
    alone = axes is None
    figure, axes = axes_for(axes, width, max(2.4, 0.5 * width))
    places, shares = _columns(found)
    below = np.zeros(len(places))
    fine = np.linspace(found.values[0], found.values[-1], 401)
    for branch in found.branches:
        turn, place = divmod(branch.number, len(AREAS))
        colour, hatch = AREAS[place], _HATCHES[turn % len(_HATCHES)]
        fractions = np.zeros(len(found.values))
        fractions[np.searchsorted(found.values, branch.values)] = branch.fractions
        height = shares @ fractions
        looks: dict[str, Any] = {"facecolor": colour, "edgecolor": readable(colour), "linewidth": 0}
        axes.fill_between(places, below, below + height, hatch=hatch, **looks)
        heights = np.interp(fine, places, height)
        large = np.flatnonzero(heights >= _LARGE * heights.max())
        most = int(large[abs(fine[large] - fine[large].mean()).argmin()])
        wide = np.ptp(branch.values) >= _NARROW * np.ptp(found.values)
        if heights[most] >= _NAMED and wide:
            middle = np.interp(fine[most], places, below + height / 2)
            text: dict[str, Any] = {"ha": "center", "va": "center", "color": readable(colour)}
            axes.text(_inward(fine, most), middle, str(branch.number), **text)
        below = below + height
    for mark, label, face, level, chosen in (
        ("^", "birth", "black", 1.035, [one.birth for one in found.branches]),
        ("v", "death", "white", 1.085, [one.death for one in found.branches]),
    ):
        values = [one.value for one in chosen if one is not None and np.isfinite(one.value)]
        if values:
            kind: dict[str, Any] = {
                "color": "black",
                "markerfacecolor": face,
                "markersize": 4,
                "clip_on": False,
                "label": label,
            }
            axes.plot(values, np.full(len(values), level), mark, linestyle="none", **kind)
    axes.set_xlim(found.values[0], found.values[-1])
    axes.set_ylim(0, 1.12)
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.set_xlabel(LABELS.get(found.name, found.name))
    axes.set_ylabel("fraction of the starts")
    if alone:
        handles = axes.get_legend_handles_labels()[0]
        if found.unsettled.any():
            handles = [*handles, blank("not settled")]
        if handles:
            add_key(figure, handles)
    title = f"Attractors along {found.name}"
    return describe(figure, title, parameters=found.base, starts=found.starts)


def _columns(found: ContinuedAttractors) -> tuple[_Values, _Values]:
    """Places along the axis, and the shares of the values' fractions there, (k, m).

    Fractions are drawn as lines from value to value; where attractors are born or die in between,
    those of both values reach to the first bifurcation.
    """
    values = found.values
    events = sorted(one.value for one in found.changes if np.isfinite(one.value))
    places, shares = [], []
    eye = np.eye(len(values))
    for i, value in enumerate(values):
        places.append(value)
        shares.append(eye[i])
        inside = [at for at in events if i + 1 < len(values) and value < at < values[i + 1]]
        if inside:
            places += [inside[0], inside[0]]
            shares += [eye[i], eye[i + 1]]
    return np.array(places), np.array(shares)


def _inward(places: _Values, at: int) -> float:
    """A place for a number, away from the ends of the axis."""
    room = 0.02 * (places[-1] - places[0])
    return float(np.clip(places[at], places[0] + room, places[-1] - room))
