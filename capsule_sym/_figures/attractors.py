"""Attractors along a parameter: which fraction of the starts leads to each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule_sym._figures.layout import add_key, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import AREAS, area_colours, blank, describe, share, styled
from capsule_sym._figures.units import named

if TYPE_CHECKING:
    from capsule_sym._attractors.branches import AttractorBranch, ContinuedAttractors

_HATCHES = ("", "/////", ".....", "xxxxx")  # of attractors that share a colour


@styled
def plot_attractors(
    found: ContinuedAttractors, *, width: float = PAGE, axes: Axes | None = None
) -> Figure:
    """Fractions of the starts that lead to each attractor, stacked, along a parameter.

    Each attractor has a colour, for which the key gives its number, its itinerary and the least and
    largest fraction. Marks above are births (filled) and deaths (open) with a located bifurcation.
    Fractions are known at the values of the parameter and drawn as lines between them. White are
    starts that have not settled. Drawn into `axes`, without the key, if they are given. Raises
    InvalidInput as `AttractorBranch.orbit`.
    """
    alone = axes is None
    figure, axes = axes_for(axes, width, max(2.4, 0.5 * width))
    shares = np.zeros((len(found.branches), len(found.values)))
    for row, branch in zip(shares, found.branches, strict=True):
        row[np.searchsorted(found.values, branch.values)] = branch.fractions
    names = [_name(branch) for branch in found.branches]
    labels = [
        f"{branch.number}  {name} {share(branch.fractions.min(), branch.fractions.max())}"
        for branch, name in zip(found.branches, names, strict=True)
    ]
    looks: dict[str, Any] = {"colors": area_colours(figure, names), "edgecolor": "white"}
    looks["hatch"] = [_HATCHES[one.number // len(AREAS) % len(_HATCHES)] for one in found.branches]
    axes.stackplot(found.values, shares, labels=labels, **looks)
    for mark, label, face, level, chosen in (
        ("^", "birth", "black", 1.035, [one.birth for one in found.branches]),
        ("v", "death", "white", 1.085, [one.death for one in found.branches]),
    ):
        values = [one.value for one in chosen if one is not None and np.isfinite(one.value)]
        if values:
            kind: dict[str, Any] = {"color": "black", "markerfacecolor": face, "markersize": 4}
            kind |= {"linestyle": "none", "clip_on": False, "label": label}
            axes.plot(values, np.full(len(values), level), mark, **kind)
    axes.set(xlim=(found.values[0], found.values[-1]), ylim=(0, 1.12))
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.set_xlabel(named(found.name))
    axes.set_ylabel("fraction of the starts")
    if alone:
        late = [blank("not settled")] * bool(found.unsettled.any())
        add_key(figure, handles_of([axes]) + late)
    title = f"Attractors along {found.name}"
    return describe(figure, title, parameters=found.base, starts=found.starts)


def _name(branch: AttractorBranch) -> str:
    """The itinerary of an attractor where most starts lead to it, and the number of others."""
    texts = [text for text, _ in branch.shown]
    others = len({*texts}) - 1
    more = f" and {others} other{'s' * (others > 1)}" * bool(others)
    return f"{texts[int(np.argmax(branch.fractions))]}{more}"
