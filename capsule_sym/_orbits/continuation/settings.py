"""Settings of continuations: step lengths and tolerances, and the effect of larger values."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from capsule_sym._arguments import checked
from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.checks import check_count, checked_seconds, is_real
from capsule_sym._native import Watch
from capsule_sym._parameters import Scene

_MOST_STEPS = 5_000  # largest number of steps that a caller may ask for


def _real(default: float | tuple[float, ...], most: float) -> Any:
    """Setting, or several, above 0 and at most `most`."""
    return field(default=default, metadata={"most": most, "whole": False, "least": 0.0})


def _whole(default: int, most: int) -> Any:
    """Integer setting."""
    return field(default=default, metadata={"most": most, "whole": True, "least": 1})


@partial(checked, types=False)
@dataclass(frozen=True, kw_only=True)
class ContinuationSettings:
    """Step lengths and tolerances of continuations; dimensionless.

    A length is measured in u: state, forcing angle (radians) and durations of an orbit, and each
    varied parameter as a share of its range. All fields are given by name.

    Parameters
    ----------
    first_step : float, dimensionless, default 1e-2, above 0 and at most 10
        Length of the first step, and of the first after an event. Larger: more halved steps.
    least_step : float, dimensionless, default 1e-8, above 0 and at most 1
        Least length of a step. Larger: branches end sooner at sharp turns.
    largest_step : float, dimensionless, default 0.2, above 0 and at most 100
        Largest length of a step. Larger: fewer points, and events may be missed.
    largest_share : float, dimensionless, default 0.02, above 0 and at most 1
        Growth of the largest length with the largest entry of u beyond `slow_size`. Larger: fewer
        points of slow motions, whose durations are long, and events may be missed.
    slow_size : float, dimensionless, default 50.0, above 0 and at most 1e6
        Entry of u, such as a duration, above which steps grow. Larger: more points.
    least_cosine : float, dimensionless, default 0.95, above 0 and at most 1
        Least cosine of the angle between tangents before and after a step. Larger: more points.
    newton_steps : int, default 8, 1 to 100
        Largest number of Newton steps to a point. Larger: longer steps may leave the branch.
    newton_tolerance : float, dimensionless, default 1e-10, above 0 and at most 1e-3
        Newton step over the size of u that ends the iteration; the error is its square. Larger:
        less exact points.
    residual_tolerance : float, dimensionless, default 1e-13, above 0 and at most 1e-3
        Residual over the size of u above which Newton's method continues. Larger: less exact
        points, mostly next to a segment of duration 0.
    rounding_step : float, dimensionless, default 1e-6, above 0 and at most 1e-3
        The same, if the residual is already rounding. Larger: less exact points.
    least_searched_step : float, dimensionless, default 1e-5, above 0 and at most 10
        Length above which a step is tested for two bifurcations of one type without a sign change.
        Larger: pairs of bifurcations may be missed.
    clear_share : float, dimensionless, default 0.1, above 0 and at most 1
        Share of the values at the ends of a step above which a cubic counts as nonzero. The cubic
        is that of a test function, or of the parameter's slope. Larger: more points, fewer missed
        pairs.
    small_test : float, dimensionless, default 0.3, above 0 and at most 1e6
        Value of a test function below which it may vanish twice in a step. Larger: more points.
    least_return : float, dimensionless, default 0.25, above 0 and at most 1
        Least share of a step that turns back to the border of the range from which it comes.
        Larger: more points there.
    same_share : float, dimensionless, default 1e-7, above 0 and at most 1e-2
        Share of a step within which failing inequalities count as one event. Larger: two close
        events may count as one.
    before_share : float, dimensionless, default 1e-3, above 0 and at most 0.5
        Share of a step before an event at which all other inequalities have to hold. Larger: more
        points near a second event, which is missed less often.
    before_lengths : sequence of float, default (1e-6, 1e-8), each in (0, 1]
        The same as absolute lengths, where these are shorter. Dimensionless.
    share_error : float, dimensionless, default 0.1, above 0 and at most 1
        Error, as a share of a step, of the estimate of where an inequality fails. Larger: fewer
        halved steps; the first event may be missed if it is not located.
    outside_share : float, dimensionless, default 1e-6, above 0 and at most 0.1
        Share of a step by which an event may lie beyond its ends. Larger: an event outside the step
        may be found.
    zero_halvings : int, default 8, 1 to 100
        Halvings of a step in the search for a zero of a test function. Larger: longer computation,
        fewer unsolved bifurcations.
    neighbour_step : float, dimensionless, default 1e-4, above 0 and at most 1
        Distance from an event at which its two sides are evaluated. Larger: less exact multipliers
        on both sides, and another event may lie in between.
    neighbour_shares : sequence of float, default (1.0, 0.1, 1e-2, 1e-3), each in (0, 1]
        Shares of `neighbour_step` to try; a smaller one is used if another event is near.
        Dimensionless.
    crossing_step : float, dimensionless, default 1e-3, above 0 and at most 1
        Distance from a crossing at which its curves are separated. Larger: they may bend away.
    crossing_ratio : float, dimensionless, default 1e-9, above 0 and at most 1e-2
        Ratio of the least to the largest singular value below which two curves cross. Larger: more
        directions are tried where only one curve passes.
    crossing_directions : int, default 16, 1 to 1,000
        Number of directions tried at a crossing. Larger: longer computation, fewer missed curves.
    doubled_distances : sequence of float, default (1e-3, 3e-3, 1e-2, 3e-4, 1e-4), each in (0, 1]
        Distances from an orbit at which its doubled orbit is sought, in this order. Dimensionless.
    fold_distances : sequence of float, default (3e-2, 1e-2, 1e-1), each in (0, 1]
        The same for the fold of doubled orbits beside a generalized period doubling. Dimensionless.
    fold_tolerance : float, dimensionless, default 1e-6, above 0 and at most 1e-3
        Newton step that ends the search of that fold, which rounding moves along its curve.
    least_duration : float, dimensionless, default 1e-6, above 0 and at most 1e-2
        Least duration, beside a codimension-two point, of a segment of duration 0 at the point.
        Larger: the other curve is missed if it leaves slowly.
    closed_distance : float, dimensionless, default 1e-6, above 0 and at most 1e-2
        Distance from its first point at which a curve is closed. Larger: curves that pass near
        their first point may count as closed.
    singular_uncertainty : float, dimensionless, default 1e-8, above 0 and at most 1
        Uncertainty of a codimension-two point above which its equations count as singular. The
        equations of a degenerate point are then tried. Larger: less exact points near one.
    degenerate_distance : float, dimensionless, default 0.1, above 0 and at most 10
        Distance from the end of a curve within which a degenerate point is sought. Larger: a point
        off the curve may be found.
    resonance_tolerance : float, dimensionless, default 1e-6, above 0 and at most 1e-2
        Derivative of the characteristic polynomial at a multiplier 1 or -1 below which it is
        double. Larger: other points count as resonances.
    most_points : int, default 20,000, 1 to 1,000,000
        Largest number of points of a branch. Larger: more time and memory.
    most_curve_points : int, default 5,000, 1 to 1,000,000
        Largest number of points of each half of a curve. Larger: more time and memory.

    Raises
    ------
    InvalidInput
        For a value out of its range, an empty sequence, and a `least_step` above `first_step`.

    See Also
    --------
    continue_orbit, continue_bifurcation : functions with these `settings`.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> fine = cs.inputs.ContinuationSettings(largest_step=0.05, least_cosine=0.99)
    >>> print(fine)
    ContinuationSettings(largest_step=0.05, least_cosine=0.99)
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> usual, many = (
    ...     cs.continue_orbit(orbit, "alpha", 0.92, points=4, settings=one)
    ...     for one in (cs.inputs.ContinuationSettings(), fine)
    ... )
    >>> print(many.status, len(many.points) > len(usual.points))
    reached True
    """

    first_step: float = _real(1e-2, 10.0)
    least_step: float = _real(1e-8, 1.0)
    largest_step: float = _real(0.2, 100.0)
    largest_share: float = _real(0.02, 1.0)
    slow_size: float = _real(50.0, 1e6)
    least_cosine: float = _real(0.95, 1.0)
    newton_steps: int = _whole(8, 100)
    newton_tolerance: float = _real(1e-10, 1e-3)
    residual_tolerance: float = _real(1e-13, 1e-3)
    rounding_step: float = _real(1e-6, 1e-3)
    least_searched_step: float = _real(1e-5, 10.0)
    clear_share: float = _real(0.1, 1.0)
    small_test: float = _real(0.3, 1e6)
    least_return: float = _real(0.25, 1.0)
    same_share: float = _real(1e-7, 1e-2)
    before_share: float = _real(1e-3, 0.5)
    before_lengths: tuple[float, ...] = _real((1e-6, 1e-8), 1.0)
    share_error: float = _real(0.1, 1.0)
    outside_share: float = _real(1e-6, 0.1)
    zero_halvings: int = _whole(8, 100)
    neighbour_step: float = _real(1e-4, 1.0)
    neighbour_shares: tuple[float, ...] = _real((1.0, 0.1, 1e-2, 1e-3), 1.0)
    crossing_step: float = _real(1e-3, 1.0)
    crossing_ratio: float = _real(1e-9, 1e-2)
    crossing_directions: int = _whole(16, 1000)
    doubled_distances: tuple[float, ...] = _real((1e-3, 3e-3, 1e-2, 3e-4, 1e-4), 1.0)
    fold_distances: tuple[float, ...] = _real((3e-2, 1e-2, 1e-1), 1.0)
    fold_tolerance: float = _real(1e-6, 1e-3)
    least_duration: float = _real(1e-6, 1e-2)
    closed_distance: float = _real(1e-6, 1e-2)
    singular_uncertainty: float = _real(1e-8, 1.0)
    degenerate_distance: float = _real(0.1, 10.0)
    resonance_tolerance: float = _real(1e-6, 1e-2)
    most_points: int = _whole(20_000, 1_000_000)
    most_curve_points: int = _whole(5_000, 1_000_000)

    def __repr__(self) -> str:
        known = ((one.name, getattr(self, one.name), one.default) for one in fields(self))
        changed = (f"{name}={value}" for name, value, default in known if value != default)
        return f"ContinuationSettings({', '.join(changed)})"

    def __post_init__(self) -> None:
        for one in fields(self):
            value, many = getattr(self, one.name), isinstance(one.default, tuple)
            entries = (value,)
            if many:
                listed = isinstance(value, list | tuple | np.ndarray) and getattr(
                    value, "ndim", True
                )
                entries = tuple(value) if listed else ()
            if not entries or not all(_allowed(entry, **one.metadata) for entry in entries):
                raise InvalidInput(one.name, value, _range(many, **one.metadata))
            plain = tuple(int(n) if one.metadata["whole"] else float(n) for n in entries)
            object.__setattr__(self, one.name, plain if many else plain[0])
        if self.least_step > self.first_step:
            raise InvalidInput(
                "least_step", self.least_step, f"at most first_step = {self.first_step:g}"
            )


def _allowed(value: Any, *, least: float, most: float, whole: bool) -> bool:
    if whole:
        known = isinstance(value, int | np.integer) and not isinstance(value, bool)
        return bool(known and least <= value <= most)
    return is_real(value) and least < value <= most


def _range(many: bool, *, least: float, most: float, whole: bool) -> str:
    allowed = f"from {least} to {most}" if whole else f"above {least:g} and at most {most:g}"
    kind = "whole number" if whole else "number"
    return f"one {kind} or more, each {allowed}" if many else f"a {kind} {allowed}"


DEFAULT = ContinuationSettings()


def check_points(points: int) -> None:
    """Raises InvalidInput unless this is an allowed number of steps."""
    check_count("points", points, 1, _MOST_STEPS)


@contextmanager
def computing(
    points: int, settings: ContinuationSettings, max_seconds: float, scene: Scene
) -> Iterator[tuple[Backend, Watch]]:
    """Numbers of a continuation, and its time limit; raises InvalidInput for these arguments.

    The limit holds within `with limit:`.
    """
    check_points(points)
    limit = Watch(checked_seconds(max_seconds))
    with backend("numpy", scene) as numbers, np.errstate(all="ignore"):
        yield numbers, limit
