"""Curves of bifurcations in two parameters, and the points where two conditions meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Stroke

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.labels import name_points
from capsule_sym._figures.layout import add_key, add_words, axes_for, handles_of
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    CURVES,
    DASHES,
    OTHER_CURVE,
    describe,
    draw_points,
    of_records,
    styled,
)
from capsule_sym._figures.units import DIMENSIONLESS, named


@styled
@of_records
def plot_curves(
    record: Mapping[str, Any], *, width: float = PAGE, axes: Axes | None = None
) -> Figure:
    """Curves of bifurcations over two parameters, as `capsule-sym curve --json` gives them.

    A colour is a type; a circle is a point of codimension two, labelled C1, C2, ..., and the key
    below names the curves that meet there. Drawn into `axes`, without the keys, if they are given.
    Raises InvalidInput for a record without curves.
    """
    curves = record["curves"]
    if not curves:
        raise InvalidInput("curves", curves, "one at least")
    first, second = curves[0]["parameters"]
    alone = axes is None
    figure, axes = axes_for(axes, width, 3.3)
    places = dict[tuple[float, float], str]()
    for curve in curves:
        draw_curve(axes, curve, first, second)
        for one in curve["codimension_two"]:
            # A point that two curves have is one point.
            place = round(one[first], 9), round(one[second], 9)
            places.setdefault(place, " and ".join(dict.fromkeys(one["types"])))
    axes.margins(x=0.04, y=0.1)
    axes.set_xlabel(named(first))
    axes.set_ylabel(named(second))
    stand = {place: f"C{number}" for number, place in enumerate(places, 1)}
    if alone:
        add_key(figure, handles_of([axes]), handlelength=DASHES)
        kinds: dict[str, list[str]] = {}
        for place, text in places.items():
            kinds.setdefault(text, []).append(stand[place])
        words = [f"{', '.join(own)}  {text}" for text, own in kinds.items()]
        add_words(figure, [*words, DIMENSIONLESS])
    name_points(axes, [(place, label, "black") for place, label in stand.items()])
    return describe(figure, "Curves of bifurcations")


@of_records
def draw_curve(axes: Axes, curve: Mapping[str, Any], first: str, second: str) -> None:
    """A curve of bifurcations, and its codimension-two points, over two parameters.

    Those of a device are read from "si". Raises InvalidInput for a curve over other parameters, or
    an incomplete one.
    """
    colour, style = CURVES.get(curve["type"], OTHER_CURVE)
    # On a white rim, so that it is seen on dark areas as well.
    axes.plot(
        *np.reshape(_places(curve["points"], first, second), (-1, 2)).T,
        linestyle=style,
        color=colour,
        linewidth=1.2,
        label=curve["type"],
        path_effects=[Stroke(linewidth=2.6, foreground="white"), Stroke()],
    )
    if found := _places(curve["codimension_two"], first, second):
        draw_points(axes, [x for x, _ in found], [y for _, y in found], "codimension-two point")


def _places(
    records: Sequence[Mapping[str, Any]], first: str, second: str
) -> list[tuple[float, float]]:
    found = []
    for record in records:
        si = {name.partition(" [")[0]: value for name, value in record.get("si", {}).items()}
        known = {**si, **record}
        if not {first, second} <= known.keys():
            allowed = f"of {first} and {second}, the parameters of the results"
            raise InvalidInput("curve", list(record)[:2], allowed)
        found.append((known[first], known[second]))
    return found
