"""Results that the figures of the paper draw: its plane of alpha and gamma, bundles of runs."""

from __future__ import annotations

from functools import cache
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from capsule_sym import Parameters, continue_bifurcation, run_sweep, simulate
from capsule_sym.inputs import Axis, SceneParameters, Sweep
from capsule_sym.results import Trajectory, open_results
from paper.study.motions import Track, followed

if TYPE_CHECKING:
    from paper.study.sections import Section

ALPHA, GAMMA = (0.005, 2.0), (1.5, 5.0)
"""Ranges of the plane in which the motions of the case study are charted."""

_STEPS = 30  # steps along a branch that is continued for its bifurcations only
_CELLS = 200, 140  # of the chart


@cache
def plane_curves(track: Track, parameters: SceneParameters) -> Any:
    """Bifurcations of the branch in alpha as curves in alpha and gamma.

    Plain data as of `capsule-sym curve --json`. The branch begins with the motion from rest at
    the low end of the first range, or at the high end if that motion does not become periodic.
    """
    from capsule_sym._orbits.interface import curve_record

    found = followed(parameters, "alpha", ALPHA, _STEPS).bifurcations
    return [
        curve_record(continue_bifurcation(one, "gamma", (ALPHA, GAMMA)))
        for one in track(found, "Following the curves", len(found))
    ]


def plane_cells(parameters: SceneParameters, cells: tuple[int, int] = _CELLS) -> Any:
    """Itineraries of the motions from rest at the cells of the plane, as `open_results` gives."""
    ends = zip(("alpha", "gamma"), (ALPHA, GAMMA), cells, strict=True)
    axes = tuple(Axis.linear(name, *both, count) for name, both, count in ends)
    with TemporaryDirectory() as folder:
        run_sweep(Sweep(axes, parameters), f"{folder}/cells")
        return open_results(f"{folder}/cells").load()


def bundle(section: Section, parameters: Parameters) -> list[Trajectory]:
    """Runs of one period from the rim of a section's window."""
    starts = section.starts(parameters).tolist()
    return [simulate(parameters, start, section.phase, periods=1) for start in starts]
