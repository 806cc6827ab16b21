"""Settings of continuations: lengths of steps and tolerances, each with its unit and its price."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.checks import check_count, checked_seconds, is_real
from capsule_sym._native import Watch
from capsule_sym._parameters import Scene

_MOST_STEPS = 5_000  # that may be asked for


def _real(default: float | tuple[float, ...], most: float) -> Any:
    """A setting above 0, or several, and at most so large."""
    return field(default=default, metadata={"most": most, "whole": False, "least": 0.0})


def _whole(default: int | tuple[int, ...], most: int, least: int = 1) -> Any:
    """A whole number, or several."""
    return field(default=default, metadata={"most": most, "whole": True, "least": least})


@dataclass(frozen=True, kw_only=True)
class ContinuationSettings:
    """Lengths of steps and tolerances of continuations; dimensionless.

    A length is one of u: state, forcing angle (radians) and durations of an orbit, and each
    parameter that varies as a share of its range. Raises InvalidInput for a value out of its range.
    """

    first_step: float = _real(1e-2, 10.0)
    """Length of the first step, and of that after an event. Larger: steps that have to be halved
    where the next event is near."""
    least_step: float = _real(1e-8, 1.0)
    """Length below which no step is tried. Larger: branches end sooner where they turn sharply."""
    largest_step: float = _real(0.2, 100.0)
    """Length of the largest step. Larger: fewer points, and events may be missed."""
    largest_share: float = _real(0.02, 1.0)
    """Growth of that length with the largest entry of u beyond `slow_size`. Larger: fewer points of
    slow motions, whose durations are long, and events may be missed."""
    slow_size: float = _real(50.0, 1e6)
    """Entry of u, such as a duration, from which on steps are longer. Larger: more points of slow
    motions."""
    least_cosine: float = _real(0.95, 1.0)
    """Least cosine of the angle between tangents before and after a step. Larger: more points."""
    newton_steps: int = _whole(8, 100)
    """Most steps of Newton's method to a point. Larger: longer steps, and a risk that they lead to
    another branch."""
    newton_tolerance: float = _real(1e-10, 1e-3)
    """Newton step over the size of u that ends the method; its square is left as error. Larger:
    points that are less exact."""
    residual_tolerance: float = _real(1e-13, 1e-3)
    """Largest entry of the residual over the size of u, above which Newton's method goes on.
    Larger: points that are less exact, next to a segment of duration 0 above all."""
    rounding_step: float = _real(1e-6, 1e-3)
    """The same, where the residual is rounding already. Larger: points that are less exact."""
    least_searched_step: float = _real(1e-5, 10.0)
    """Length above which a step is searched for two bifurcations of one type that leave no change
    of sign. Larger: pairs of bifurcations may be missed."""
    clear_share: float = _real(0.1, 1.0)
    """Share of a test function's, or of the parameter's slope's, values at the ends of a step above
    which their cubic is taken to stay away from 0. Larger: more points, fewer pairs are missed."""
    small_test: float = _real(0.3, 1e6)
    """Value of a test function below which it may vanish twice in a step. Larger: more points."""
    least_return: float = _real(0.25, 1.0)
    """Least share of a step that turns back to the border of the range from which it comes. Larger:
    more points there."""
    same_share: float = _real(1e-7, 1e-2)
    """Share of a step within which inequalities fail together, as one event. Larger: events that
    are near each other may be taken for one."""
    before_share: float = _real(1e-3, 0.5)
    """Share of a step before an event at which all other inequalities have to hold. Larger: more
    points near a second event, which is missed the less."""
    before_lengths: tuple[float, ...] = _real((1e-6, 1e-8), 1.0)
    """The same as lengths, where these are nearer to the event."""
    share_error: float = _real(0.1, 1.0)
    """Share of a step by which its ends may mislead about where an inequality fails. Larger: fewer
    steps that are halved, and the first event may be missed where it is not located."""
    outside_share: float = _real(1e-6, 0.1)
    """Share of a step by which an event may seem to be beyond its ends. Larger: one that is not on
    the way may be found."""
    zero_halvings: int = _whole(8, 100)
    """Halvings of a step for a guess of where a test function vanishes. Larger: more computing, and
    fewer bifurcations that are not solved."""
    neighbour_step: float = _real(1e-4, 1.0)
    """Distance from an event at which its two sides are looked at. Larger: less exact multipliers
    on both sides, and another event may lie in between."""
    neighbour_shares: tuple[float, ...] = _real((1.0, 0.1, 1e-2, 1e-3), 1.0)
    """Shares of it that are tried, the next one where another event is nearer."""
    crossing_step: float = _real(1e-3, 1.0)
    """Distance from a point at which the curves that cross there are told apart. Larger: they may
    bend away."""
    crossing_ratio: float = _real(1e-9, 1e-2)
    """Least over largest singular value at which two curves cross. Larger: more directions are
    tried where one curve passes."""
    crossing_directions: int = _whole(16, 1000)
    """Directions that are tried at a crossing. Larger: more computing, and no curve is missed."""
    doubled_distances: tuple[float, ...] = _real((1e-3, 3e-3, 1e-2, 3e-4, 1e-4), 1.0)
    """Distances from an orbit that doubles at which the doubled one is sought, in this order."""
    fold_distances: tuple[float, ...] = _real((3e-2, 1e-2, 1e-1), 1.0)
    """The same for the fold of doubled orbits beside a generalized period doubling."""
    fold_tolerance: float = _real(1e-6, 1e-3)
    """The Newton step that ends the search of that fold; rounding moves it along its curve."""
    least_duration: float = _real(1e-6, 1e-2)
    """Least duration, beside a codimension-two point, of a segment that has the duration 0 there.
    Larger: the other curve is missed where it leaves slowly."""
    closed_distance: float = _real(1e-6, 1e-2)
    """Distance from its first point at which a curve is closed. Larger: curves that pass near it
    may be taken for closed."""
    singular_uncertainty: float = _real(1e-8, 1.0)
    """Uncertainty of a codimension-two point from which on its equations are taken for singular,
    and those of a degenerate point are tried. Larger: points near one are less exact."""
    degenerate_distance: float = _real(0.1, 10.0)
    """Distance from the end of a curve within which a degenerate point is sought. Larger: one that
    is not on the curve may be found."""
    resonance_tolerance: float = _real(1e-6, 1e-2)
    """Derivative of the characteristic polynomial at a multiplier 1 or -1 below which it is a
    double one. Larger: other points are taken for resonances."""
    most_points: int = _whole(20_000, 1_000_000)
    """Points at which a branch ends. Larger: more time and memory."""
    most_curve_points: int = _whole(5_000, 1_000_000)
    """Points at which each half of a curve of bifurcations ends. Larger: more time and memory."""
    settled_distance: float = _real(1e-6, 1e-2)
    """Distance from an orbit, over its size, at which a run of a box has settled on it. Larger:
    fewer periods, and orbits near each other may be taken for one."""
    settling_rounds: int = _whole(3, 20)
    """Rounds in which runs that have not settled go on, twice as long each. Larger: more time."""
    settling_trials: int = _whole(12, 1000)
    """Runs whose end is looked at in a round, of those on no known orbit. Larger: more time, and
    fewer attractors are missed."""
    same_distance: float = _real(1e-7, 1e-2)
    """Distance of states within which two orbits of a box are one. Larger: orbits may be missed."""
    seed_periods: tuple[int, ...] = _whole((0, 1, 2, 4, 8, 16), 10_000, least=0)
    """Excitation periods after which the state of a run is a guess for Newton's method. More of
    them: more time, and fewer unstable orbits are missed."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value, many = getattr(self, one.name), isinstance(one.default, tuple)
            entries = (value,)
            if many:
                entries = tuple(value) if isinstance(value, list | tuple | np.ndarray) else ()
            if not entries or not all(_allowed(entry, **one.metadata) for entry in entries):
                raise InvalidInput(one.name, value, _range(many, **one.metadata))
            plain = tuple(int(n) if one.metadata["whole"] else float(n) for n in entries)
            object.__setattr__(self, one.name, plain if many else plain[0])
        if list(self.seed_periods) != sorted(set(self.seed_periods)):
            raise InvalidInput("seed_periods", self.seed_periods, "ascending, each once")
        if self.least_step > self.first_step:
            raise InvalidInput(
                "least_step", self.least_step, f"first_step, {self.first_step:g}, at most"
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
    """Raises InvalidInput unless this is a number of steps that a path may be asked to take."""
    check_count("points", points, 1, _MOST_STEPS)


@contextmanager
def computing(
    points: int, settings: ContinuationSettings, max_seconds: float, scene: Scene
) -> Iterator[tuple[Backend, Watch]]:
    """The number system of a continuation, and its limit; raises InvalidInput for these arguments.

    The limit holds within `with limit:`.
    """
    check_points(points)
    if not isinstance(settings, ContinuationSettings):
        raise InvalidInput("settings", settings, "ContinuationSettings")
    limit = Watch(checked_seconds(max_seconds))
    with backend("numpy", scene) as numbers, np.errstate(all="ignore"):
        yield numbers, limit
