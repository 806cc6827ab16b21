"""Results that the figures of the paper draw: its plane of alpha and gamma, bundles of runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym import InvalidInput, Parameters, simulate
from capsule_sym._figures.interface import (
    Plane,
    Region,
    Track,
    followed,
    regions,
    steady_run,
)
from capsule_sym.inputs import SceneParameters
from capsule_sym.results import Trajectory

if TYPE_CHECKING:
    from paper.study.sections import Section

PLANE = Plane("alpha", "gamma", (0.005, 2.0), (1.5, 5.0))
"""Plane in which the motions of the case study are charted."""

_STEPS = 30  # steps along a branch that is continued for its bifurcations only
_ACROSS = 20  # grid points along each side of a chart at which motions are run


@cache
def plane_curves(track: Track, parameters: SceneParameters, plane: Plane) -> Any:
    """Bifurcations of the branch in the plane's first parameter as curves in both.

    Plain data as of `capsule-sym curve --json`. The branch begins with the motion from rest at
    the low end of the first range, or at the high end if that motion does not become periodic.
    """
    from capsule_sym import continue_bifurcation
    from capsule_sym._orbits.interface import curve_record

    found = followed(parameters, plane.first, plane.x, _STEPS).bifurcations
    return [
        curve_record(continue_bifurcation(one, plane.second, (plane.x, plane.y)))
        for one in track(found, "Following the curves", len(found))
    ]


def plane_regions(track: Track, parameters: SceneParameters, plane: Plane) -> list[Region]:
    """Regions between the `plane_curves`.

    Their itineraries come from the steady motions from rest at one point of each region and at
    the points of a grid.
    """
    cut = regions.patches(plane, plane_curves(track, parameters, plane))
    places = samples(plane, cut, _ACROSS)
    found = [
        (number, _itinerary(parameters.replace(**{plane.first: x, plane.second: y})))
        for number, x, y in track(places, "Settling motions", len(places))
    ]
    return by_samples(plane, cut, found)


def samples(plane: Plane, cut: Sequence[Any], across: int) -> list[tuple[int, float, float]]:
    """Points within the patches, one of each and those of a grid, with the patch's number."""
    import shapely

    side = (np.arange(across) + 0.5) / across
    grid = np.column_stack([v.ravel() for v in np.meshgrid(side, side)])
    found = []
    for number, patch in enumerate(cut):
        inner = patch.buffer(-0.2 / across)
        middle = shapely.point_on_surface(patch)
        inside = grid[shapely.contains_xy(inner, *grid.T)]
        points = plane.back([(middle.x, middle.y), *inside])
        found += [(number, float(x), float(y)) for x, y in points]
    return found


def by_samples(plane: Plane, cut: Sequence[Any], found: Sequence[tuple[int, str]]) -> list[Region]:
    """Patches as regions, each with the itinerary of most of its samples."""
    itineraries: dict[int, Counter[str]] = {}
    for number, itinerary in found:
        itineraries.setdefault(number, Counter())[itinerary] += 1
    return [
        regions.region_of(plane, patch, itineraries[number].most_common(1)[0][0])
        for number, patch in enumerate(cut)
        if number in itineraries
    ]


def _itinerary(parameters: SceneParameters) -> str:
    """Itinerary of the steady motion from rest; empty if it does not become steady."""
    try:
        steady = steady_run(parameters).steady()
    except InvalidInput:
        return ""
    return " ".join(steady.itinerary) if steady else ""


def bundle(section: Section, parameters: Parameters) -> list[Trajectory]:
    """Runs of one period from the rim of a section's window."""
    starts = section.starts(parameters).tolist()
    return [simulate(parameters, start, section.phase, periods=1) for start in starts]
