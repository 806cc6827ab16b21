"""Fields in the order of time, against the excitation amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import SequenceMatcher
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.arcs import Arc, Motion, cycle, is_periodic, phase_zero
from capsule_sym._figures.branches import Record, axis_label, in_units, name_bifurcations, units_of
from capsule_sym._figures.computed import orbit_of
from capsule_sym._figures.labels import CENTRED, LETTER, areas_of, fix_layout, widest
from capsule_sym._figures.layout import add_key, axes_for, limit
from capsule_sym._figures.portraits import field_handles
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    SEAMLESS,
    Colours,
    blank,
    describe,
    field_colour,
    of_records,
    readable,
    styled,
)
from capsule_sym._figures.units import Units
from capsule_sym._parameters import Scene, SceneDevice


@styled
@of_records
def plot_itineraries(
    motions: Sequence[Motion],
    record: Record,
    *,
    colours: Colours = "safe",
    width: float = PAGE,
    axes: Axes | None = None,
    device: SceneDevice | None = None,
) -> Figure:
    """Acting field by phase against alpha, with the exact bifurcations of a branch named.

    Motions are sorted by alpha. Switches are joined from motion to motion, through the orbits of
    the bifurcations between them. Around a run that does not end in a steady motion it stays white.

    Parameters
    ----------
    motions : sequence of Trajectory or Orbit
        Motions at several values of alpha, one or more.
    record : mapping of str
        Branch in alpha as plain data, as `read_branch` gives. It needs `parameter`, `points` with
        their `value`, and `bifurcations`.
    colours : {"safe", "paper"}, default "safe"
        Colours of the segments: safe for colour-blind readers, or those of Fig. 7 of the paper.
    width : float, default 7, above 0
        Width of a new figure, a number of inches. Within `figure_style` the default is its width.
    axes : Axes of Matplotlib, optional
        Place to draw into, without labels of bifurcations, in place of a new figure: `axes` of
        one's own.
    device : PhysicalParameters, optional
        Device whose motions they are; the figure is then over its amplitude in SI units.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InvalidInput
        If `motions` is empty, and for a record that lacks something. Also for a device of another
        scene, frequency, mass ratio or friction bound than that of the motions.

    See Also
    --------
    plot_bifurcations : states along the branch.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> motions = [cs.solve_orbit(cs.Parameters(alpha=alpha)) for alpha in (0.7, 0.8, 0.9)]
    >>> points = [{"value": motion.parameters.alpha} for motion in motions]
    >>> record = {"parameter": "alpha", "points": points, "bifurcations": []}
    >>> figure = cs.figures.plot_itineraries(motions, record)
    >>> print([text.get_text() for text in figure.legends[0].get_texts()])
    ['$F_{1}$ NC-FD', '$F_{2}$ NC-S', '$F_{4}$ C-FD', '$F_{5}$ C-S']
    """
    alone = axes is None
    figure, axes = axes_for(axes, width, 2.9)
    units = units_of(record, device)
    if not len(motions):
        raise InvalidInput("motions", motions, "one motion or more")
    for motion in motions:
        Units.of_motion(device, motion.parameters)
    record = in_units(record, units)
    draw_itineraries(motions, axes, colours, units, record["bifurcations"])
    axes.set_xlabel(axis_label(record, units))
    for one in record["bifurcations"]:
        axes.axvline(one["value"], color="white", linewidth=0.6)
    if alone:
        handles: list[Any] = [*field_handles(figure, colours, motions[0].parameters.scene)]
        if not all(map(is_periodic, motions)):
            handles.append(blank("not settled"))
        add_key(figure, handles)
        name_bifurcations(record, axes, units)
        _name_fields(axes, colours, motions[0].parameters.scene)
    return describe(figure, "Which field acts when", parameters=motions[0].parameters)


_EMPTY = 1e-9  # excitation periods
_JUMP = 0.2  # excitation periods by which a switch moves between neighbouring motions, if they jump


def _name_fields(axes: Axes, colours: Colours, scene: Scene) -> None:
    """The name of each field in its area, where it has most room within it and between lines."""
    pixel = fix_layout(axes)
    for area, (place, room) in zip(axes.collections, widest(axes, areas_of(axes)), strict=True):
        if room >= LETTER * pixel:
            name = str(area.get_label())
            colour = field_colour(int(name[1:]), colours, scene)
            patch = {"facecolor": colour, "edgecolor": "none", "pad": 0.8}  # a line may cross it
            axes.text(*place, f"$F_{{{name[1:]}}}$", color=readable(colour), bbox=patch, **CENTRED)


_Column = list[tuple[int, float, float]]
"""Fields of a motion over time, each from a phase to a phase."""


def draw_itineraries(
    motions: Sequence[Motion],
    axes: Axes,
    colours: Colours = "safe",
    units: Units | None = None,
    found: Sequence[Record] = (),
) -> None:
    """The phase of the excitation upwards, alpha to the right: an area for the runs of each field.

    Switches are joined from motion to motion, through the orbits of the bifurcations `found`
    between them. Where motions jump, the areas end at a bifurcation or halfway. All are drawn over
    the excitation periods of the longest motion; around a run that does not end in a steady motion
    it stays white.
    """
    motions = sorted(motions, key=lambda m: m.parameters.alpha)
    units, scene = units or Units(), motions[0].parameters.scene
    cycles = [cycle(motion) if is_periodic(motion) else [] for motion in motions]
    longest = max((_turns(one) for one in cycles if one), default=1)
    nodes = [
        (motion.parameters.alpha, _column(drawn, longest))
        for motion, drawn in zip(motions, cycles, strict=True)
    ]
    ends = float(nodes[0][0]), float(nodes[-1][0])
    orbits = [orbit_of(one) for one in found if "orbit" in one]
    within = [one for one in orbits if ends[0] < one.parameters.alpha < ends[1]]
    cuts = [one.parameters.alpha for one in within]
    for one in within:
        alpha, exact = one.parameters.alpha, _column(cycle(one), longest)
        k = next(k for k, (at, _) in enumerate(nodes) if at > alpha)
        # On one side a segment of duration 0 divides another, on the other side it does not exist.
        alike = exact, _undivided(exact)
        before = next((one for one in alike if _joined(nodes[k - 1][1], one)), None)
        after = next((one for one in alike if _joined(one, nodes[k][1])), None)
        if before and after:  # a motion from rest may be on another branch
            nodes[k:k] = [(alpha, before), (alpha, after)]
    areas: dict[int, list[list[tuple[float, float]]]] = {field: [] for field in scene.facts.FIELDS}
    for (left, before), (right, after) in pairwise(nodes):
        if left == right:
            continue
        joined = _joined(before, after)
        inside = [at for at in cuts if left < at < right] if before and after else []
        middle = inside[0] if inside else (left + right) / 2
        pieces: list[tuple[float, float, Any]] = [(left, right, joined)]
        if joined is None:
            pieces = [
                (begin, end, [(field, (low, low), (high, high)) for field, low, high in column])
                for begin, end, column in ((left, middle, before), (middle, right, after))
            ]
        for begin, end, parts in pieces:
            x = units.scale("alpha") * np.array([begin, end])
            for field, lows, highs in parts:
                outline = zip((x[0], x[1], x[1], x[0]), (*lows, *highs[::-1]), strict=True)
                areas[field].append(list(outline))
    for field, corners in areas.items():
        if corners:
            colour = field_colour(field, colours, scene)
            axes.add_collection(
                PolyCollection(corners, color=colour, label=f"F{field}", **SEAMLESS)
            )
    low, high = (units.scale("alpha") * end for end in ends)
    limit(axes, (low, high), (0, longest))
    axes.set_xlabel(units.label("alpha"))
    axes.set_ylabel(r"phase $\omega\tau/2\pi$")


def _turns(drawn: Sequence[Arc]) -> int:
    return round(float(drawn[-1].time[-1] - drawn[0].time[0]))


def _column(drawn: Sequence[Arc], longest: int) -> _Column:
    """A motion over as many excitation periods as the longest one, without empty segments."""
    return [
        (arc.field, turn + arc.time[0] - first, min(turn + arc.time[-1] - first, longest))
        for first in [phase_zero(drawn) if drawn else 0]
        for turn in range(0, longest, _turns(drawn) if drawn else longest)
        for arc in drawn
        if turn + arc.time[0] - first < longest and np.ptp(arc.time) > _EMPTY
    ]


def _undivided(column: _Column) -> _Column:
    """A column in which neighbours of one field are one."""
    each = (list(part) for _, part in groupby(column, key=lambda one: one[0]))
    return [(part[0][0], part[0][1], part[-1][2]) for part in each]


def _joined(before: _Column, after: _Column) -> list[tuple[int, Any, Any]] | None:
    """Segments with their phases in two motions; None where a motion jumps to the other.

    A segment that only one of them has shrinks to a switch of the other.
    """
    if not (before and after):
        return None
    same = SequenceMatcher(None, [f for f, *_ in before], [f for f, *_ in after], autojunk=False)
    found: list[tuple[int, Any, Any]] = []
    i = j = 0
    for block in same.get_matching_blocks():
        here = after[j][1] if j < len(after) else after[-1][2]
        found += [(field, (low, here), (high, here)) for field, low, high in before[i : block.a]]
        there = before[block.a][1] if block.a < len(before) else before[-1][2]
        found += [(field, (there, low), (there, high)) for field, low, high in after[j : block.b]]
        i, j = block.a + block.size, block.b + block.size
        pairs = zip(before[block.a : i], after[block.b : j], strict=True)
        found += [(a[0], (a[1], b[1]), (a[2], b[2])) for a, b in pairs]
    moved = max(abs(b - a) for _, *ends in found for a, b in ends)
    lost = sum(
        abs(h[0] - low[0] - h[1] + low[1])
        for _, low, h in found
        if 0.0 in (h[0] - low[0], h[1] - low[1])
    )
    return found if max(moved, lost) < _JUMP else None
