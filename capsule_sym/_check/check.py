"""Switches of anyone's integrator beside the exact ones: missed, invented, late, and why."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._check.growth import growth_of_errors
from capsule_sym._check.matching import matched
from capsule_sym._check.switch_check import Cause, Difference, Entered, SwitchCheck
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory, evaluation, simulate
from capsule_sym._map.backend import backend
from capsule_sym._map.labelled import package
from capsule_sym._parameters import Scene, SceneParameters

if TYPE_CHECKING:
    from pandas import DataFrame

_MOST = 10_000  # switches, which the table of the comparison has room for
_SLACK = 0.125  # of a period of the drive or of the spring: times that are closer may be one
_UNIT = 2.0**-53  # relative rounding of a double
_SETUP = 1e6  # error of a segment over the tolerance, which no tolerance explains


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
    compared. The exact run stops after `max_seconds` or 20,000 segments. Switches are then
    compared up to there: `message` has the time, and `success` is that of these switches alone.

    A switch counts as found if its time is wrong by at most an eighth of a period, if no other
    switch of the same kind is nearer, and if such pairs have the same order in both lists. The
    period is that of the drive or of the mass on its spring, whichever is shorter.

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
        Time at which the run ends, dimensionless. The default is the last of the times, or `phase`
        without times.
    resolution : float, default 0, finite and not negative
        Uncertainty of the times, dimensionless, such as half a unit of the last digit printed.
    tolerance : float, optional, finite and above 0
        Tolerance of the integrator, a number without unit. It is compared with the one that
        suffices.
    max_seconds : float, default inf, above 0
        Time limit of the exact run, in seconds of wall time. A run in doubles comes before it.
    progress : callable, optional
        Function that is called with the number of whole periods of the exact run.

    Returns
    -------
    SwitchCheck
        `success` is False if a switch is missed or invented; `differences` has these with their
        cause. `switches`, `errors`, `segment_error` and `tolerance` give the sizes. All are
        dimensionless.

    Raises
    ------
    InvalidInput
        For a value outside its range, times that do not ascend, an unknown field, and events that
        are not as many as the times.

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
    size, growth = abs(first.records["end"]).max(initial=1.0), growth_of_errors(first)
    lost = np.flatnonzero(_UNIT * size * growth >= slack)
    horizon = float(_times(first)[lost[0]]) if len(lost) else math.inf
    settings |= {"max_seconds": max_seconds, "progress": progress, "backend": "mpmath"}
    truth = simulate(*start, periods=_periods(min(until, horizon), parameters), **settings)
    why = "no double can follow"
    if not truth.success:
        horizon, why = truth.span[1], f"the exact run ends ({truth.status})"
    table = package("pandas").DataFrame
    entered = np.array([one.name for one in truth.segments[1:]], str)
    exact = table({"exact": np.array(_times(truth), float), "event": entered})
    exact = exact[exact["exact"] < min(horizon, until)]
    exact = exact.assign(growth=growth[: len(exact)])
    own = table({"given": found, "event": np.array(names, str)})
    own = own[own["given"] < horizon]
    rows = matched(exact, own, slack, min(last, horizon - slack))
    error = _segment_error(rows, resolution)
    differences = tuple(_differences(rows, exact, error, tolerance))
    message = _message(differences, len(own), horizon, why)
    switches = rows[["event", "exact", "given", "growth"]]
    return SwitchCheck(switches, error, horizon, differences, tolerance, message)


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
    """Raises InvalidInput for times or a resolution that are not allowed.

    Times are finite, ascending from the phase on, and at most 10,000; a resolution is finite and
    not below 0.
    """
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


def _times(run: Trajectory) -> list[Any]:
    """Times of the switches of a run, with all its digits."""
    with backend("numpy" if run.backend == "c" else run.backend, run.scene) as numbers:
        period = numbers.full_turn / numbers.number(run.parameters.omega)
        return [one.end.period * period + one.end.phase for one, _ in pairwise(run.segments)]


def _differences(
    rows: DataFrame, exact: DataFrame, error: float | None, used: float | None
) -> Iterator[Difference]:
    """Differences of matched lists, by the error of a segment and the tolerance, if known."""
    first, alone = True, rows[["exact", "given"]].isna().any(axis=1)
    for _, group in rows[alone].groupby((~alone).cumsum()[alone]):
        missed, invented = group[group["given"].isna()], group[group["exact"].isna()]
        gap, needed = _resolved(missed["place"].astype(int).tolist(), exact)
        cause = _cause(error, used, needed) if first else Cause.EARLIER
        true = tuple(map(Entered, missed["exact"].tolist(), missed["event"]))
        own = tuple(map(Entered, invented["given"].tolist(), invented["event"]))
        yield Difference(true, own, cause, gap, needed)
        first = False


def _segment_error(rows: DataFrame, resolution: float) -> float | None:
    """Least error of a segment's state that explains the times before the first difference."""
    alone, growth = rows[["exact", "given"]].isna().any(axis=1), rows["growth"]
    before = rows[~alone.cummax() & (growth > 0) & (growth < math.inf)]
    shown = np.maximum(resolution, np.spacing(before["exact"]))
    error = (abs(before["given"] - before["exact"]) - shown).clip(lower=0.0) / before["growth"]
    return float(error.max()) if len(error) else None


def _resolved(missed: Sequence[int], exact: DataFrame) -> tuple[float | None, float | None]:
    """Least time beside missed switches, and the error with which two of them would merge.

    Between two zeros that are a time d apart a guard rises to a quarter of its slope times d: an
    error that moves a switch by a quarter of d, to the first order, takes both away.
    """
    beside = {k for one in missed for k in (one - 1, one) if 0 <= k < len(exact) - 1}
    first = [*({k for k in beside if {k, k + 1} <= set(missed)} or beside)]
    if not first:
        return None, None
    times, growth = exact[["exact", "growth"]].to_numpy().T
    after = np.array(first) + 1
    gaps = times[after] - times[first]
    return float(gaps.min()), float((gaps / (4 * np.maximum(growth[first], growth[after]))).min())


def _cause(own: float | None, used: float | None, needed: float | None) -> Cause:
    """Cause of the first difference."""
    if own and used and own > _SETUP * used:
        return Cause.SETUP
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
