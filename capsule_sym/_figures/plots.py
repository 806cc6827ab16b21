"""The figure of a result: what `plot` draws of each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(result: Any, **options: Any) -> Figure:
    """The figure that shows a result at a glance.

    A `Trajectory` or an `Orbit` gives its displacements and phase portrait, a `Branch` the
    bifurcation diagram. Options are those of `plot_motion` and `plot_bifurcations`. Raises
    InvalidInput for anything else.
    """
    from capsule_sym._errors import InvalidInput
    from capsule_sym._figures.branches import plot_bifurcations
    from capsule_sym._figures.portraits import plot_motion
    from capsule_sym._map import Trajectory
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit
    from capsule_sym._study.data import branch_record

    if isinstance(result, Trajectory | Orbit):
        return plot_motion(result, **options)
    if isinstance(result, Branch):
        return plot_bifurcations(branch_record(result), **options)
    raise InvalidInput("result", type(result).__name__, "a Trajectory, an Orbit or a Branch")
