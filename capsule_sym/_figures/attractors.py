"""Attractors along a parameter: which fraction of the starts leads to each."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from capsule_sym._figures.labels import CENTRED, LETTER, areas_of, fix_layout, widest
from capsule_sym._figures.layout import add_key, axes_for, limit
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    AREAS,
    LABELS,
    area_colours,
    blank,
    describe,
    readable,
    share,
    styled,
)

if TYPE_CHECKING:
    from capsule_sym._attractors.branches import AttractorBranch, Change, ContinuedAttractors

_HATCHES = (None, "/////", ".....", "xxxxx")  # of attractors that share a colour
_Values = NDArray[np.float64]


@styled
def plot_attractors(
    found: ContinuedAttractors, *, width: float = PAGE, axes: Axes | None = None
) -> Figure:
    """Fractions of the starts that lead to each attractor, stacked, along a parameter.

    Each attractor has a colour and its number, for which the key gives the itinerary and the least
    and largest fraction. Marks above are births (filled) and deaths (open) at the bifurcations of
    their branches, where fractions jump. An attractor to which no start leads has no height. White
    are starts that have not settled.

    Parameters
    ----------
    found : ContinuedAttractors
        Attractors along a parameter, as `continue_attractors` gives.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without the key, in place of a new figure: `axes` of one's own.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        For an argument of another type.

    See Also
    --------
    continue_attractors : the computation.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> system = cs.Parameters(omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> box = {"x_r": (-2, 2), "v_r": (-2, 2)}
    >>> along = cs.continue_attractors(system, "alpha", [1.7, 1.75], box, count=20)
    >>> figure = cs.figures.plot_attractors(along)
    >>> print(figure.axes[0].get_ylabel())
    fraction of the starts
    >>> print([text.get_text()[-8:] for text in figure.legends[0].get_texts()])
    ['to 80 %)', '2 (25 %)', '2 (20 %)', 'birth', 'death']
    """
    alone = axes is None
    figure, axes = axes_for(axes, width, max(2.4, 0.5 * width))
    places, heights = _stacked(found)
    names = [_name(branch) for branch in found.branches]
    handles: list[Any] = []
    below = np.zeros(len(places))
    shown = zip(found.branches, names, area_colours(figure, names), heights, strict=True)
    for branch, name, colour, height in shown:
        hatch = _HATCHES[branch.number // len(AREAS) % len(_HATCHES)]
        looks: dict[str, Any] = {"facecolor": colour, "edgecolor": readable(colour), "linewidth": 0}
        fractions = share(branch.fractions.min(), branch.fractions.max())
        looks |= {"hatch": hatch, "label": f"{branch.number}  {name} {fractions}"}
        there = height > 0
        there[1:] |= height[:-1] > 0
        there[:-1] |= height[1:] > 0
        axes.fill_between(places, below, below + height, where=there, **looks)
        handles.append(Patch(**looks))
        below = below + height
    for mark, label, face, level, chosen in (
        ("^", "birth", "black", 1.035, [one.birth for one in found.branches]),
        ("v", "death", "white", 1.085, [one.death for one in found.branches]),
    ):
        values = [_place(one, np.nan) for one in chosen]
        if np.any(np.isfinite(values)):
            kind: dict[str, Any] = {"color": "black", "markerfacecolor": face, "markersize": 4}
            kind |= {"linestyle": "none", "clip_on": False, "label": label}
            axes.plot(values, np.full(len(values), level), mark, **kind)
    limit(axes, (found.values[0], found.values[-1]), (0, 1.12))
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.set_xlabel(LABELS.get(found.name, found.name))
    axes.set_ylabel("fraction of the starts")
    if alone:
        marks = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
        late = [blank("not settled")] * bool(found.unsettled.any())
        add_key(figure, [*handles, *marks, *late])
    drawn, pixel = [one for one in axes.collections if one.get_paths()], fix_layout(axes)
    for area, (place, room) in zip(drawn, widest(axes, areas_of(axes)), strict=True):
        if room >= LETTER * pixel:
            ink, number = readable(area.get_facecolor()[0]), str(area.get_label())
            axes.text(*place, number.split()[0], color=ink, **CENTRED)
    title = f"Attractors along {found.name}"
    return describe(figure, title, parameters=found.base, starts=found.starts)


def _name(branch: AttractorBranch) -> str:
    """The itinerary of an attractor where most starts lead to it, and the number of others."""
    texts = [text for text, _ in branch.shown]
    others = len({*texts}) - 1
    more = f" and {others} other{'s' * (others > 1)}" * bool(others)
    return f"{texts[int(np.argmax(branch.fractions))]}{more}"


def _stacked(found: ContinuedAttractors) -> tuple[_Values, _Values]:
    """Places along the axis, and the height of each attractor there, (n, k).

    Fractions are drawn as lines from value to value. Between two values an attractor ends exactly
    at its birth and at its death; there the others, of which no fraction is known, share the height
    in proportion to their fractions at both values.
    """
    values = found.values
    of = np.zeros((len(found.branches), len(values)))
    for row, branch in zip(of, found.branches, strict=True):
        row[np.searchsorted(values, branch.values)] = branch.fractions
    ends = [(_place(one.birth, -np.inf), _place(one.death, np.inf)) for one in found.branches]
    places, heights = [values[0]], [of[:, 0]]
    for i, (low, high) in enumerate(pairwise(values)):
        inside = sorted({at for both in ends for at in both if low < at < high})
        if inside:
            total = of[:, i : i + 2].sum(axis=0)
            edges = [low, *inside, high]
            for k, (left, right) in enumerate(pairwise(edges)):
                middle = (left + right) / 2
                alive = np.array([birth < middle < death for birth, death in ends])
                at = slice(i + (right == high), i + 2 - (k == 0))  # the value beside, or both
                share = np.where(alive, of[:, at].max(1), 0.0)
                if k > 0 and right < high and share.any():
                    share *= np.interp(middle, [low, high], total) / share.sum()
                places += [left, right]
                heights += [share, share]
        places.append(high)
        heights.append(of[:, i + 1])
    return np.array(places), np.array(heights).T


def _place(change: Change | None, nowhere: float) -> float:
    """Value of a birth or death, if it is known."""
    return change.value if change is not None and np.isfinite(change.value) else nowhere
