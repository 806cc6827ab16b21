"""Switches of anyone's integrator beside the exact ones: missed, invented, late, and why."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from itertools import groupby, pairwise, zip_longest
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._check.growth import growth_of_errors
from capsule_sym._check.matching import Pair, matched
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory, evaluation, simulate
from capsule_sym._map.backend import backend
from capsule_sym._map.result import brief
from capsule_sym._parameters import Scene, SceneParameters

_MOST = 10_000  # switches
_SLACK = 0.125  # of a period of the drive or of the spring: times that are closer may be one
_UNIT = 2.0**-53
_SETUP = 1e6  # error of a segment over the tolerance, which no tolerance explains
_RESTART = 1e-9  # time after a switch within which another is the same one, found again


@dataclass(frozen=True)
class Entered:
    """A switch: its time, dimensionless, and the field entered."""

    time: float
    event: str


class Cause(StrEnum):
    """Reason why an integrator misses or invents a switch."""

    #: Its errors, as large as they were before, suffice: a smaller tolerance is needed.
    TOLERANCE = "tolerance"
    #: Its errors are small, and the motion has magnified them to its own size.
    GROWTH = "growth of errors"
    #: Its errors are far above its tolerance: it does not locate switches within a step, or has
    #: other parameters, units, equations or start.
    SETUP = "set-up"
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

    missed: tuple[Entered, ...]
    invented: tuple[Entered, ...]
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

    exact: tuple[Entered, ...]
    """The exact switches, by 50 digits, up to where a double can follow the motion."""
    given: tuple[Entered, ...]
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
    def latest(self) -> tuple[float, Entered, float] | None:
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
        if not self.used or not self.needed or self.differences[0].cause is Cause.SETUP:
            return None
        found = self.needed / max((self.segment_error or 0.0) / self.used, 1.0)
        return found if found <= self.used else None

    def record(self) -> dict[str, Any]:
        """The comparison as a plain record."""
        switches = []
        for (a, b), error in zip(self.pairs, self.errors.tolist(), strict=True):
            true = None if a is None else self.exact[a]
            given = None if b is None else self.given[b]
            switches.append(
                {
                    "event": getattr(true or given, "event", None),
                    "exact": true and true.time,
                    "given": given and given.time,
                    "error": error if true and given else None,
                    "growth": None if a is None else float(self.growth[a]),
                }
            )
        names = ("message", "segment_error", "needed", "tolerance")
        return {
            "right": self.success,
            **{name: getattr(self, name) for name in names},
            "horizon": None if self.horizon == math.inf else self.horizon,
            "own_horizon": None if self.own_horizon == math.inf else self.own_horizon,
            "differences": [asdict(one) for one in self.differences],
            "switches": switches,
        }

    def __repr__(self) -> str:
        return brief(self, self.message)


def check_switches(
    times: ArrayLike,
    events: Sequence[object],
    parameters: SceneParameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    *,
    end: float | None = None,
    resolution: float = 0.0,
    tolerance: float | None = None,
    max_seconds: float = math.inf,
    progress: Callable[[int], object] | None = None,
) -> SwitchCheck:
    """Comparison of an integrator's switches with the exact ones, computed in 50 digits.

    Errors are compared with their growth: `growth` is the shift of each switch by an error of the
    segments before it. From `horizon` on no double can follow the motion, and switches are not
    compared. The exact run stops after `max_seconds`; switches are then compared up to there.

    A switch counts as found if its time is wrong by less than an eighth of a period. It is the
    period of the drive or of the mass on its spring, whichever is shorter.

    Parameters
    ----------
    times : array_like of shape (n,), ascending, at most 10,000
        Switching times of the integrator from `phase` on, dimensionless. The drive's angle is omega
        t.
    events : sequence of int or str, shape (n,)
        Field entered at each switch: a number, "F5" or "C-S".
    parameters : Parameters or SceneParameters
        Parameters of the capsule or of a scene, dimensionless.
    state : sequence of float, shape (3,), default (0, 0, 0), each of size at most 1e20
        Start state (x_r, v_r, v_c), dimensionless.
    phase : float, default 0, from 0 to below 2 pi/omega
        Phase of the start: a time in the excitation period, dimensionless.
    end : float, optional, not before the last of the times
        Time at which the run ends, dimensionless. The default is the last of the times.
    resolution : float, default 0, finite and not negative
        Uncertainty of the times, dimensionless, such as half a unit of the last digit printed.
    tolerance : float, optional, finite and above 0
        Tolerance of the integrator, a number without unit. It is compared with the one that
        suffices.
    max_seconds : float, default inf, above 0
        Time limit of the exact run, in seconds of wall time.
    progress : callable, optional
        Function that is called with the number of whole periods of the exact run.

    Returns
    -------
    SwitchCheck
        `success` is False if a switch is missed or invented; `differences` has these with their
        cause. `errors`, `growth`, `segment_error` and `tolerance` give the sizes. All are
        dimensionless.

    Raises
    ------
    InvalidInput
        For a value outside its range, times that do not ascend, and an unknown field.

    See Also
    --------
    read_switches : switches of a CSV file.
    simulate : the exact run.

    Examples
    --------
    The second switch of a run is left out:

    >>> import capsule_sym as cs
    >>> p = cs.Parameters(alpha=0.7)
    >>> run = cs.simulate(p, periods=1)
    >>> times = [float(one.end.phase) for one in run.segments[:-1]]
    >>> fields = [one.name for one in run.segments[1:]]
    >>> print([f"{name} at {time:.4f}" for name, time in zip(fields[:3], times)])
    ['F5 at 0.2410', 'F4 at 1.5105', 'F5 at 1.8521']
    >>> found = cs.check_switches(times[:1] + times[2:], fields[:1] + fields[2:], p)
    >>> print(found.success, found.message)
    False 1 missed and 0 invented; the first at 1.51054; cause: search
    """
    found = evaluation.real("times", times, "real numbers")
    _check_times(found, phase, resolution)
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0):
        raise InvalidInput("tolerance", tolerance, "finite and > 0")
    names = [_named(parameters.scene, event, row) for row, event in enumerate(events, 1)]
    if len(names) != len(found):
        raise InvalidInput("events", len(names), f"one for each time, {len(found)}")
    last = float(found[-1]) if end is None and len(found) else float(phase if end is None else end)
    if not (math.isfinite(last) and last >= max([phase, *found[-1:]])):
        raise InvalidInput("end", last, "finite, and not before the last of the times")
    slack = _SLACK * min(parameters.period, math.tau)
    start, until = (parameters, state, phase), last + slack
    # The run in doubles gives the time up to which they can follow the motion.
    settings: dict[str, Any] = {"max_segments": 2 * _MOST}
    first = simulate(*start, periods=_periods(until, parameters), **settings)
    size = max(1.0, *(abs(float(x)) for one in first.segments for x in one.end_state))
    horizon = _first(_UNIT * size * growth_of_errors(first) >= slack, _times(first))
    settings |= {"max_seconds": max_seconds, "progress": progress, "backend": "mpmath"}
    truth = simulate(*start, periods=_periods(min(until, horizon), parameters), **settings)
    why = "no double can follow"
    if not truth.success:
        horizon, why = truth.span[1], f"the exact run stopped: {truth.message}"

    ends = _times(truth)
    judged = sum(float(time) < min(horizon, until) for time in ends)
    ends, growth = ends[:judged], growth_of_errors(truth)[:judged]
    exact = tuple(Entered(float(t), s.name) for t, s in zip(ends, truth.segments[1:], strict=False))
    timed = zip(found.tolist(), names, strict=True)
    given = tuple(Entered(time, name) for time, name in timed if time < horizon)
    pairs = matched(_columns(exact), _columns(given), slack, min(last, horizon - slack))
    errors = np.array([_error(pair, ends, given) for pair in pairs])
    own = _segment_error(pairs, errors, exact, growth, resolution)
    grown = (own or 0.0) * growth >= slack
    own_horizon = exact[int(np.argmax(grown))].time if grown.any() else horizon
    differences = _differences(exact, given, pairs, growth, (own, tolerance), own_horizon)
    message = _message(differences, len(given), horizon, why)
    rest = own, horizon, own_horizon, tuple(differences), tolerance, message
    return SwitchCheck(exact, given, tuple(pairs), errors, growth, *rest)


def _named(scene: Scene, event: object, row: int) -> str:
    """The field entered at a switch, as "F5"."""
    text = str(event).strip().upper()
    modes, fields = list(map(str, scene.facts.MODES)), [f"F{k}" for k in scene.facts.FIELDS]
    if (field := f"F{text.removeprefix('F')}") in fields:
        return field
    if text in modes:
        return fields[modes.index(text)]
    allowed = ", ".join(f"{field} or {mode}" for field, mode in zip(fields, modes, strict=True))
    raise InvalidInput(f"entered in row {row}", event, f"one of {allowed}")


def _check_times(times: NDArray[np.float64], phase: float, resolution: float) -> None:
    """Raises InvalidInput for times that are not finite, do not ascend, or are too many."""
    if times.ndim != 1 or len(times) > _MOST:
        raise InvalidInput("times", times.shape, f"a column of at most {_MOST} times")
    for row, (before, time) in enumerate(pairwise([phase, *times.tolist()]), 1):
        if not (math.isfinite(time) and time >= before):
            raise InvalidInput(f"time in row {row}", time, f"finite and >= {before!r}")
    if not (math.isfinite(resolution) and resolution >= 0):
        raise InvalidInput("resolution", resolution, "finite and >= 0")


def _periods(end: float, parameters: SceneParameters) -> int:
    """Number of whole periods of the drive up to a time, at least one."""
    return max(1, math.ceil(end / parameters.period))


def _first(there: NDArray[np.bool_], times: NDArray[np.object_]) -> float:
    """First of the times at which something is there; infinite if it never is."""
    return float(times[int(np.argmax(there))]) if there.any() else math.inf


def _times(run: Trajectory) -> NDArray[np.object_]:
    """Times of the switches of a run, (m,), with all its digits."""
    with backend("numpy" if run.backend == "c" else run.backend, run.scene) as numbers:
        period = numbers.full_turn / numbers.number(run.parameters.omega)
        ends = [one.end.period * period + one.end.phase for one, _ in pairwise(run.segments)]
    return np.array(ends, dtype=object)


def _columns(events: Sequence[Entered]) -> tuple[NDArray[np.float64], list[str]]:
    return np.array([one.time for one in events], float), [one.event for one in events]


def _differences(
    exact: tuple[Entered, ...],
    given: tuple[Entered, ...],
    pairs: list[Pair],
    growth: NDArray[np.float64],
    known: tuple[float | None, float | None],
    own_horizon: float,
) -> list[Difference]:
    """Differences of matched lists, by the error of a segment and the tolerance if `known`."""
    found = list[Difference]()
    groups = [list(group) for _, group in groupby(pairs, key=lambda pair: None in pair)]
    for group, after in zip_longest(groups, groups[1:]):
        if None not in group[0]:
            continue
        then = after[0].true if after else None
        again = None if then is None else exact[then].time
        missed = [pair.true for pair in group if pair.true is not None]
        invented = [pair.given for pair in group if pair.given is not None]
        gap, needed = _resolved(missed, exact, growth)
        events = tuple(exact[k] for k in missed), tuple(given[k] for k in invented)
        cause = Cause.EARLIER if found else _cause(known, needed, invented, given)
        if cause is Cause.TOLERANCE and min(e.time for part in events for e in part) >= own_horizon:
            cause = Cause.GROWTH
        found.append(Difference(*events, cause, gap, needed, again))
    return found


def _error(pair: Pair, ends: NDArray[np.object_], given: Sequence[Entered]) -> float:
    if pair.true is None or pair.given is None:
        return math.nan
    return float(given[pair.given].time - ends[pair.true])


def _segment_error(
    pairs: Sequence[Pair],
    errors: NDArray[np.float64],
    exact: Sequence[Entered],
    growth: NDArray[np.float64],
    resolution: float,
) -> float | None:
    """Least error of a segment's state that explains the times before the first difference."""
    found = []
    for pair, error in zip(pairs, errors, strict=True):
        if pair.true is None or pair.given is None:
            break
        shown = max(resolution, float(np.spacing(exact[pair.true].time)))
        if 0 < growth[pair.true] < math.inf:
            found.append(max(abs(error) - shown, 0.0) / growth[pair.true])
    return float(max(found)) if found else None


def _resolved(
    missed: Sequence[int], exact: Sequence[Entered], growth: NDArray[np.float64]
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
    known: tuple[float | None, float | None],
    needed: float | None,
    invented: Sequence[int],
    given: Sequence[Entered],
) -> Cause:
    """Cause of the first difference."""
    own, used = known
    if own and used and own > _SETUP * used:
        return Cause.SETUP
    if any(k and given[k].time - given[k - 1].time <= _RESTART for k in invented):
        return Cause.RESTART
    if own is None and used is None:
        return Cause.UNKNOWN
    if needed is None or max(own or 0.0, used or 0.0) >= needed:
        return Cause.TOLERANCE
    return Cause.SEARCH


def _message(differences: Sequence[Difference], count: int, horizon: float, why: str) -> str:
    """The verdict as a sentence."""
    until = "" if horizon == math.inf else f" before {horizon:.6g}, where {why}"
    if not differences:
        told = "the one switch is" if count == 1 else f"all {count} switches are"
        return f"{told} right{until}"
    missed = sum(len(one.missed) for one in differences)
    invented = sum(len(one.invented) for one in differences)
    first = differences[0]
    told = f"{missed} missed and {invented} invented{until}; the first at {first.time:.6g}"
    return f"{told}; cause: {first.cause}"
