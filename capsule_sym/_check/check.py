"""Switches of anyone's integrator beside the exact ones: missed, invented, late, and why."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._check.growth import growth_of_errors
from capsule_sym._check.matching import Pair, matched
from capsule_sym._check.naming import COLUMNS, event_between, named
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map import Trajectory, evaluation, simulate
from capsule_sym._map.backend import backend
from capsule_sym._parameters import SceneParameters

_MOST = 10_000  # switches
_SLACK = 0.125  # of a period of the drive or of the spring: times that are closer may be one
_UNIT = 2.0**-53
_RESTART = 1e-9  # time after a switch within which another is the same one, found again


class Event(NamedTuple):
    """A switch: its time, dimensionless, and the field entered, the field left, or the guard."""

    time: float
    event: str


class Cause(StrEnum):
    """Reason why an integrator misses or invents a switch."""

    #: Its errors, as large as they were before, suffice: a smaller tolerance is needed.
    TOLERANCE = "tolerance"
    #: Its errors are small, and the motion has magnified them to its own size.
    GROWTH = "growth of errors"
    #: Its errors are too small to explain it: the event search passed over it.
    SEARCH = "search"
    #: It found a switch again at the start of the next segment.
    RESTART = "restart"
    #: An earlier difference changed the motion.
    EARLIER = "earlier difference"
    #: There is no switch before from which its errors could be known.
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Difference:
    """Switches in a row that one of two lists does not have."""

    missed: tuple[Event, ...]
    invented: tuple[Event, ...]
    cause: Cause
    gap: float | None
    """Least time between missed switches and their neighbours, which the search has to resolve."""
    needed: float | None
    """Error of a segment's state below which the missed switches are there."""
    agrees_again: float | None
    """Time from which on both lists agree again; None if they do not."""

    @property
    def time(self) -> float:
        """Time of the first switch that is missed or invented."""
        return min(event.time for event in (*self.missed, *self.invented))


@dataclass(frozen=True, eq=False)
class SwitchCheck:
    """Switches of an integrator beside the exact ones; all dimensionless."""

    exact: tuple[Event, ...]
    """The exact switches, by 50 digits, up to where a double can follow the motion."""
    given: tuple[Event, ...]
    """The switches given up to there."""
    pairs: tuple[Pair, ...]
    """Places in both lists, in the order of time; None where a list has no such switch."""
    errors: NDArray[np.float64]
    """Given time less exact time of each pair, nan where one is missing; shape (pairs,)."""
    growth: NDArray[np.float64]
    """Largest shift of each exact switch by errors of size 1, one a segment; shape (exact,)."""
    segment_error: float | None
    """Error that some segment's state has at least, by the switches before the first difference.

    None where there is no such switch.
    """
    horizon: float
    """Time up to which switches are compared; infinite if a double can follow the whole motion."""
    own_horizon: float
    """Time from which on the integrator's own errors have grown to the size of the motion."""
    differences: tuple[Difference, ...]
    used: float | None
    """Tolerance that the integrator had, if it is known."""
    message: str
    """Verdict as a sentence."""

    @property
    def success(self) -> bool:
        """True if no switch up to the horizon is missing or invented."""
        return not self.differences

    @property
    def needed(self) -> float | None:
        """Error of a segment's state below which no switch is missed; None if it is not known."""
        return min((one.needed for one in self.differences if one.needed), default=None)

    @property
    def latest(self) -> tuple[float, Event, float] | None:
        """Largest error of a time before the first difference, its exact switch, and the growth."""
        first = next((k for k, one in enumerate(self.pairs) if None in one), len(self.pairs))
        if not first:
            return None
        k = int(np.argmax(np.abs(self.errors[:first])))
        place = self.pairs[k].true or 0
        return float(self.errors[k]), self.exact[place], float(self.growth[place])

    @property
    def tolerance(self) -> float | None:
        """Tolerance with which no switch would be missed; None if the one used is small enough.

        The error of a segment is assumed to be proportional to the tolerance, and at least equal.
        """
        if not self.used or not self.needed:
            return None
        found = self.needed / max((self.segment_error or 0.0) / self.used, 1.0)
        return found if found <= self.used else None

    def record(self) -> dict[str, Any]:
        """The comparison as a plain record."""
        switches = [
            {
                "event": (self.exact[a] if a is not None else self.given[b or 0]).event,
                "exact": None if a is None else self.exact[a].time,
                "given": None if b is None else self.given[b].time,
                "error": None if a is None or b is None else float(error),
                "growth": None if a is None else float(self.growth[a]),
            }
            for (a, b), error in zip(self.pairs, self.errors, strict=True)
        ]
        differences = [
            {
                "missed": [one._asdict() for one in part.missed],
                "invented": [one._asdict() for one in part.invented],
                "cause": str(part.cause),
                "gap": part.gap,
                "needed": part.needed,
                "agrees_again": part.agrees_again,
            }
            for part in self.differences
        ]
        return {
            "right": self.success,
            "message": self.message,
            "segment_error": self.segment_error,
            "needed": self.needed,
            "tolerance": self.tolerance,
            "horizon": None if self.horizon == math.inf else self.horizon,
            "own_horizon": None if self.own_horizon == math.inf else self.own_horizon,
            "differences": differences,
            "switches": switches,
        }

    def __repr__(self) -> str:
        return f"<SwitchCheck: {self.message}>"


def check_switches(
    times: ArrayLike,
    events: Sequence[object],
    parameters: SceneParameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    *,
    by: str = "entered",
    end: float | None = None,
    resolution: float = 0.0,
    tolerance: float | None = None,
    max_seconds: float = math.inf,
    progress: Callable[[int], object] | None = None,
) -> SwitchCheck:
    """Comparison of an integrator's switches with the exact ones, computed in 50 digits.

    `times` (n,) are the integrator's switching times, ascending, from `phase` on; the drive's angle
    is omega t. `events` names each switch, `by` the field "entered" or "left" (a number, "F5" or
    "C-S"), or by the "guard" (gap, drift, upper, lower, back gap or edge). The run starts at
    `state` (x_r, v_r, v_c) and ends at `end`, by default at the last of the times. `resolution` is
    the uncertainty of the times, such as half a unit of the last digit printed. `tolerance`, that
    of the integrator, is compared with the one that suffices. All quantities are dimensionless.

    Errors are compared with their growth: `growth` is the shift of each switch by an error of the
    segments before it. From `horizon` on no double can follow the motion, and switches are not
    compared. The exact run stops after `max_seconds`; `progress` is called with its whole periods.
    Raises InvalidInput for a value that is not allowed.
    """
    check_one_of("by", by, COLUMNS)
    found = evaluation.real("times", times, "real numbers")
    _check_times(found, phase, resolution)
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0):
        raise InvalidInput("tolerance", tolerance, "finite and > 0")
    scene = parameters.scene
    names = [named(scene, by, event, row) for row, event in enumerate(events, 1)]
    if len(names) != len(found):
        raise InvalidInput("events", len(names), f"one for each time, {len(found)}")
    last = float(found[-1]) if end is None and len(found) else float(phase if end is None else end)
    if not (math.isfinite(last) and last >= max([phase, *found[-1:]])):
        raise InvalidInput("end", last, "finite, and not before the last of the times")
    slack = _SLACK * min(parameters.period, math.tau)
    settings = {"max_segments": 2 * _MOST, "max_seconds": max_seconds, "progress": progress}
    truth, growth, horizon = _truth((parameters, state, phase), last + slack, slack, settings)
    ends = _times(truth)
    exact = tuple(
        Event(float(t), event_between(by, *pair))
        for t, pair in zip(ends, pairwise(truth.segments), strict=True)
    )
    judged = sum(event.time < min(horizon, last + slack) for event in exact)
    exact, growth, ends = exact[:judged], growth[:judged], ends[:judged]
    given = tuple(
        Event(float(t), name) for t, name in zip(found, names, strict=True) if t < horizon
    )
    until = min(last, horizon - slack)
    pairs = matched(_columns(exact), _columns(given), slack, until)
    errors = np.array([_error(pair, ends, given) for pair in pairs])
    why = "no double can follow" if truth.success else f"the exact run stopped: {truth.message}"
    limits = _Limits(horizon, slack, resolution, tolerance, why)
    return _judged(exact, given, pairs, errors, growth, limits)


def _check_times(times: NDArray[np.float64], phase: float, resolution: float) -> None:
    """Raises InvalidInput for times that are not finite, do not ascend, or are too many."""
    if times.ndim != 1 or len(times) > _MOST:
        raise InvalidInput("times", times.shape, f"a column of at most {_MOST} times")
    for row, (before, time) in enumerate(pairwise([phase, *times.tolist()]), 1):
        if not (math.isfinite(time) and time >= before):
            raise InvalidInput(f"time in row {row}", time, f"finite and >= {before!r}")
    if not (math.isfinite(resolution) and resolution >= 0):
        raise InvalidInput("resolution", resolution, "finite and >= 0")


def _truth(
    start: tuple[SceneParameters, Sequence[float], float],
    end: float,
    slack: float,
    settings: dict[str, Any],
) -> tuple[Trajectory, NDArray[np.float64], float]:
    """The run in 50 digits, growth of errors to its switches, and the time to which it counts."""
    period, run = start[0].period, partial(simulate, *start)
    whole = max(1, math.ceil(end / period))
    first = run(periods=whole, max_segments=2 * _MOST)
    size = max(1.0, *(abs(float(x)) for one in first.segments for x in one.end_state))
    lost = _UNIT * size * growth_of_errors(first) >= slack
    horizon = float(_times(first)[int(np.argmax(lost))]) if lost.any() else math.inf
    periods = max(1, math.ceil(min(end, horizon) / period))
    truth = run(periods=periods, backend="mpmath", **settings)
    return truth, growth_of_errors(truth), horizon if truth.success else truth.span[1]


def _times(run: Trajectory) -> NDArray[np.object_]:
    """Times of the switches of a run, (m,), with all its digits."""
    with backend("numpy" if run.backend == "c" else run.backend, run.scene) as numbers:
        period = numbers.full_turn / numbers.number(run.parameters.omega)
        ends = [one.end.period * period + one.end.phase for one, _ in pairwise(run.segments)]
    return np.array(ends, dtype=object)


def _columns(events: Sequence[Event]) -> tuple[NDArray[np.float64], list[str]]:
    return np.array([one.time for one in events], float), [one.event for one in events]


def _error(pair: Pair, ends: NDArray[np.object_], given: Sequence[Event]) -> float:
    if pair.true is None or pair.given is None:
        return math.nan
    return float(given[pair.given].time - ends[pair.true])


class _Limits(NamedTuple):
    horizon: float
    slack: float
    resolution: float
    used: float | None
    why: str


def _judged(
    exact: tuple[Event, ...],
    given: tuple[Event, ...],
    pairs: list[Pair],
    errors: NDArray[np.float64],
    growth: NDArray[np.float64],
    limits: _Limits,
) -> SwitchCheck:
    """The verdict on matched lists."""
    first = next((k for k, pair in enumerate(pairs) if None in pair), len(pairs))
    own = _segment_error(pairs[:first], errors, exact, growth, limits.resolution)
    grown = (own or 0.0) * growth >= limits.slack
    own_end = exact[int(np.argmax(grown))].time if grown.any() else limits.horizon
    groups = [list(group) for _, group in groupby(pairs, key=lambda pair: None in pair)]
    differences = list[Difference]()
    for place, group in enumerate(groups):
        if None not in group[0]:
            continue
        then = groups[place + 1][0].true if place + 1 < len(groups) else None
        again = None if then is None else exact[then].time
        missed = [pair.true for pair in group if pair.true is not None]
        invented = [pair.given for pair in group if pair.given is not None]
        gap, needed = _resolved(missed, exact, growth)
        events = tuple(exact[k] for k in missed), tuple(given[k] for k in invented)
        cause = Cause.EARLIER if differences else _cause(own, limits.used, needed, invented, given)
        if cause is Cause.TOLERANCE and min(one.time for part in events for one in part) >= own_end:
            cause = Cause.GROWTH
        differences.append(Difference(*events, cause, gap, needed, again))
    return SwitchCheck(
        exact,
        given,
        tuple(pairs),
        errors,
        growth,
        own,
        limits.horizon,
        own_end,
        tuple(differences),
        limits.used,
        _message(differences, len(given), limits),
    )


def _segment_error(
    pairs: Sequence[Pair],
    errors: NDArray[np.float64],
    exact: Sequence[Event],
    growth: NDArray[np.float64],
    resolution: float,
) -> float | None:
    """Least error of a segment's state that explains the times of some switches."""
    found = []
    for pair, error in zip(pairs, errors, strict=False):
        assert pair.true is not None
        shown = max(resolution, float(np.spacing(exact[pair.true].time)))
        if 0 < growth[pair.true] < math.inf:
            found.append(max(abs(error) - shown, 0.0) / growth[pair.true])
    return float(max(found)) if found else None


def _resolved(
    missed: Sequence[int], exact: Sequence[Event], growth: NDArray[np.float64]
) -> tuple[float | None, float | None]:
    """Least time beside missed switches, and the error with which two of them would merge.

    Between two zeros that are a time d apart a guard rises to a quarter of its slope times d: an
    error that moves a switch by a quarter of d, to the first order, takes both away.
    """
    beside = {k for one in missed for k in (one - 1, one) if 0 <= k < len(exact) - 1}
    both = {k for k in beside if {k, k + 1} <= set(missed)}
    gaps = {(k, k + 1): exact[k + 1].time - exact[k].time for k in both or beside}
    if not gaps:
        return None, None
    needed = [gap / (4 * growth[list(pair)].max()) for pair, gap in gaps.items()]
    return min(gaps.values()), float(min(needed))


def _cause(
    own: float | None,
    used: float | None,
    needed: float | None,
    invented: Sequence[int],
    given: Sequence[Event],
) -> Cause:
    """Cause of the first difference."""
    if any(k and given[k].time - given[k - 1].time <= _RESTART for k in invented):
        return Cause.RESTART
    if own is None and used is None:
        return Cause.UNKNOWN
    if needed is None or max(own or 0.0, used or 0.0) >= needed:
        return Cause.TOLERANCE
    return Cause.SEARCH


def _message(differences: Sequence[Difference], count: int, limits: _Limits) -> str:
    """The verdict as a sentence."""
    whole = limits.horizon == math.inf
    until = "" if whole else f" before {limits.horizon:.6g}, where {limits.why}"
    if not differences:
        told = "the one switch is" if count == 1 else f"all {count} switches are"
        return f"{told} right{until}"
    missed, invented = (
        sum(len(getattr(one, name)) for one in differences) for name in ("missed", "invented")
    )
    first = differences[0]
    told = f"{missed} missed and {invented} invented{until}; the first at {first.time:.6g}"
    return f"{told}; cause: {first.cause}"
