"""Events of Figs. 8 and 9: printed amplitudes, exact ones, and states near their lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from capsule_sym import Parameters
from capsule_sym._figures.arcs import Arc
from capsule_sym._figures.interface import Array
from capsule_sym._map.interface import NumpyBackend
from capsule_sym.results import Bifurcation
from paper.printed import read


class Event(NamedTuple):
    """A bifurcation of Figs. 8 and 9: its name, its line, and the field that meets the line.

    `alphas` are the printed amplitudes of the trajectories, in increasing order; `middle` is the
    printed bifurcation value among them. `zoom` is the size of the magnified view relative to the
    whole.
    """

    name: str
    line: str
    field: int
    alphas: tuple[float, ...]
    middle: float
    zoom: float


def _event(name: str, zoom: float) -> Event:
    """Event of a caption."""
    entry = read()[f"figure.{name}"]
    middle = float(entry["alpha"])
    alphas = sorted([middle, *(float(alpha) for alpha, _ in entry["beside"])])
    line = entry["meets"].partition("^")[0]
    return Event(entry["event"], line, entry["field"], tuple(alphas), middle, zoom)


CROSSINGS = (_event("8.a", 0.22), _event("8.c", 0.22))
"""Events of Fig. 8."""


SLIDINGS = (
    *(_event("9.a", 0.22), _event("9.b", 0.22)),
    *(_event("9.c", 0.06), _event("9.d", 0.12)),
)
"""Events of Fig. 9."""


def exact(
    events: Sequence[Event], bifurcations: Sequence[Bifurcation]
) -> list[tuple[Event, Bifurcation | None]]:
    """Events moved to their exact values, each with its bifurcation of a branch.

    The amplitudes keep their distances from the middle. An event that is not on the branch is
    unchanged, with None.
    """
    found = []
    for event in events:
        same = [
            one
            for one in bifurcations
            if one.type == event.name and one.line.split("^")[0] == event.line
        ]
        nearest = min(same, key=lambda one: abs(one.value - event.middle), default=None)
        if nearest:
            middle = nearest.value
            alphas = tuple(
                middle if alpha == event.middle else middle + alpha - event.middle
                for alpha in event.alphas
            )
            event = event._replace(alphas=alphas, middle=middle)
        found.append((event, nearest))
    return found


def nearest(drawn: Sequence[Arc], event: Event, parameters: Parameters) -> Array:
    """State, shape (3,), of the event's field among the drawn ones that is nearest to its line."""
    candidates = np.concatenate(
        [np.column_stack(arc.states) for arc in drawn if arc.field == event.field]
    )
    x_r, v_r, v_c = candidates.T
    p = parameters
    free, pressed = (
        NumpyBackend().constants(field, p).force(x_r, x_r - p.delta, v_r) for field in (2, 5)
    )
    misses = {
        "L2": free + p.f_b,
        "L3": pressed - p.f_b,
        "L6": np.where(v_r > 0, x_r - p.delta, np.inf),
        "L7": np.where(v_r < 0, x_r - p.delta, np.inf),
    }
    best: Array = candidates[np.argmin(np.hypot(v_c, misses[event.line]))]
    return best
