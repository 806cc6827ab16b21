"""Many runs at once, with their kept results in one array and the offsets of the runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from numbers import Integral
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput, Status, check_one_of, counted
from capsule_sym._map.backend import NumpyBackend, default_backend
from capsule_sym._map.checks import LARGEST_STATE, check_count
from capsule_sym._map.keep import STROBE, check_memory
from capsule_sym._map.labelled import Labelled, lock
from capsule_sym._map.native import core
from capsule_sym._map.reference import Run, step, write
from capsule_sym._map.result import brief
from capsule_sym._map.simulate import run as run_one
from capsule_sym._map.simulate import watch_of
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._native import Watch
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters, as_scene

_MOST_AT_ONCE = 8192  # periods whose states the lanes write; more are kept piece by piece
_SIDE_BY_SIDE = 8  # runs that a thread should have at least
_FINISHED = np.array([Status.FINISHED.value], "<U16")
_Result = TypeVar("_Result")


@dataclass(frozen=True, eq=False)
class Trajectories(Labelled):
    """Result of many runs of the exact map: final states, statuses, and kept data.

    `kept[offsets[i]:offsets[i + 1]]` are the stroboscopic states of run i, and `self[i]` gives
    them; none if only final states are kept. Each `status` is the text of a `Status`. All
    quantities are dimensionless, and all arrays read-only.
    """

    parameters: NDArray[np.float64]
    """Rows of the parameters, shape (n, 7) in the paper's scene."""
    states: NDArray[np.float64]
    """Final states, shape (n, 3)."""
    advances: NDArray[np.float64]
    """Displacements of the capsules over the runs (changes of x_c), shape (n,)."""
    periods: NDArray[np.int64]
    """Whole excitation periods completed, shape (n,)."""
    status: NDArray[np.str_]
    """Text of the `Status` of each run, shape (n,)."""
    offsets: NDArray[np.int64]
    """Offsets of the runs in `kept`, followed by its length, shape (n + 1,)."""
    kept: NDArray[np.float64]
    """Stroboscopic states of all runs, one after another, shape (offsets[n], 3)."""
    scene: Scene = CAPSULE
    """Scene of the parameters."""

    def __post_init__(self) -> None:
        lock(self)

    def __len__(self) -> int:
        return len(self.parameters)

    def __getitem__(self, index: int) -> NDArray[np.float64]:
        if not isinstance(index, Integral) or isinstance(index, bool):
            raise InvalidInput("index", index, "a whole number")
        place = range(len(self))[index]
        first, last = self.offsets[place : place + 2].tolist()
        return self.kept[first:last]

    def __repr__(self) -> str:
        done, runs = int(self.success.sum()), counted(len(self), "run")
        return brief(self, f"{done} of {runs} finished")

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Runs as columns (n,): parameters, final state, advance, periods and status."""
        facts = self.scene.facts
        values = [*self.parameters.T, *self.states.T]
        known = zip(facts.PARAMETERS + facts.STATE, values, strict=True)
        ends = {"advance": self.advances, "periods": self.periods, "status": self.status}
        return {**dict(known), **ends}

    @property
    def success(self) -> NDArray[np.bool_]:
        """True for runs that finished all their periods, shape (n,)."""
        return np.equal(self.status, Status.FINISHED.value)


def simulate_many(
    parameters: Sequence[SceneParameters] | NDArray[np.float64],
    states: ArrayLike = (0.0, 0.0, 0.0),
    phases: ArrayLike = 0.0,
    periods: int = 100,
    *,
    keep: str = "final",
    max_segments: int | None = None,
    max_open: int = -1,
    max_seconds: float = math.inf,
    threads: int = 1,
    scene: Scene | str | None = None,
) -> Trajectories:
    """Runs of the map for n parameter sets, each as by `simulate`.

    Final and stroboscopic states are computed in vector lanes, and agree with those of single runs
    up to rounding. The lanes need the C core, `max_segments` None, and for stroboscopic states at
    most 8,192 periods. Other runs are computed one by one.

    Parameters
    ----------
    parameters : sequence of n Parameters, or array of shape (n, 7)
        Parameters of one scene, dimensionless, or a NumPy array of their rows. A row has the
        parameters of the scene in their order, 7 in the paper's scene.
    states : array_like of shape (n, 3) or (3,), default (0, 0, 0), each from -1e20 to 1e20
        Start states (x_r, v_r, v_c), dimensionless; one state is that of all runs.
    phases : array_like of shape (n,) or one float, default 0, from 0 to below 2 pi/omega
        Phases at the starts, dimensionless times in the excitation period.
    periods : int, default 100, 1 to 10^12
        Length of each run, in excitation periods from phase 0 on, as in `simulate`.
    keep : {"final", "stroboscopic"}, default "final"
        Kept data: the final states alone, or the stroboscopic states too, as in
        `Trajectory.stroboscopic`. There a run that is computed one by one may have only the last
        states of a segment over very many periods. More than 4 GiB are refused for several runs; a
        single run in the core ends there with the status memory-limit.
    max_segments : int or None, default None, 1 to 10^12
        Largest number of segments of each run; None is that of `simulate`.
    max_open : int, default -1
        Number of switches of each run that the reference map may solve because the core cannot
        decide them. A run with more of them ends with the status segment-limit. A value
        below 0 is no limit. It applies to runs in vector lanes only.
    max_seconds : float, default inf, above 0
        Time limit of all runs together, in seconds of wall time. Runs that did not finish have the
        status time-limit.
    threads : int, default 1, 1 to 10^12
        Number of threads that share the runs.
    scene : Scene, str or None, default None
        Scene of the rows, its name, or its folder if that was loaded before. None is the scene of
        the given Parameters, and the paper's scene for rows.

    Returns
    -------
    Trajectories
        Final states, statuses and stroboscopic states of all runs, as arrays.

    Raises
    ------
    InvalidInput
        For a value that is not allowed, and for Parameters of more than one scene, or of another
        one than `scene`.

    See Also
    --------
    simulate : one run, with its segments as objects.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> runs = cs.simulate_many([cs.Parameters(alpha=0.7), cs.Parameters(alpha=0.9)])
    >>> runs.status.tolist(), runs.states.shape
    (['finished', 'finished'], (2, 3))
    >>> runs.states[1].round(6).tolist()  # (x_r, v_r, v_c) after 100 periods
    [0.971245, 0.388907, 0.172351]
    """
    scene, rows = _rows(parameters, None if scene is None else as_scene(scene))
    count = len(rows)
    check_count("periods", periods)
    check_count("threads", threads)
    if max_segments is not None:
        check_count("max_segments", max_segments)
    watch = watch_of(max_seconds)
    lengths = math.tau / rows[:, scene.facts.PARAMETERS.index("omega")]
    starts, times = _starts(states, count), _times(phases, lengths)
    check_one_of("keep", keep, ("final", "stroboscopic"))
    strobed = keep == "stroboscopic"
    if strobed and count > 1:  # one run ends where the memory is full
        check_memory("periods", periods, STROBE * periods * count)
    chosen = default_backend(scene)

    def one(i: int) -> Trajectory | None:
        if watch.over:
            return None
        p, (x_r, v_r, v_c) = scene.Parameters(*rows[i].tolist()), starts[i].tolist()
        start = (x_r, v_r, v_c), float(times[i]), int(periods)
        return run_one(p, start, keep, max_segments, watch, chosen)

    if chosen == "c" and max_segments is None and (not strobed or periods <= _MOST_AT_ONCE):
        found = _side_by_side(
            scene, rows, starts, times, periods, strobed, watch, threads, max_open
        )
    else:
        found = _one_by_one(starts, shared(one, count, threads, watch), strobed)
    return Trajectories(rows, *found, scene)


def _rows(
    parameters: Sequence[SceneParameters] | NDArray[np.float64], given: Scene | None
) -> tuple[Scene, NDArray[np.float64]]:
    """Scene of parameter sets, and the sets as rows.

    `given` is the scene of an array, by default the paper's; objects must be of it, by default of
    the scene of the first. Raises InvalidInput for others, and for values that are not allowed.
    """
    scene = given or CAPSULE
    if isinstance(parameters, np.ndarray):
        return scene, checked_rows(np.array(parameters, dtype=float, order="C"), scene)
    if not all(isinstance(one, SceneParameters) for one in parameters):
        raise InvalidInput("parameters", parameters, "a list of Parameters, or their rows")
    if len(parameters) and given is None:
        scene = parameters[0].scene
    for one in parameters:
        if one.scene is not scene:
            raise InvalidInput("parameters", one, f"of one scene, here {scene.shown}")
    rows = [[*one.to_dict().values()] for one in parameters]
    return scene, checked_rows(np.array(rows).reshape(-1, len(scene.facts.PARAMETERS)), scene)


def checked_rows(rows: NDArray[np.float64], scene: Scene = CAPSULE) -> NDArray[np.float64]:
    """Rows of a scene's parameters; raises InvalidInput for a shape or value not allowed."""
    names, (low, high) = scene.facts.PARAMETERS, _ranges(scene)
    if rows.ndim != 2 or rows.shape[1] != len(names):
        allowed = f"real numbers of shape (n, {len(names)})"
        raise InvalidInput("parameters", rows.shape, allowed)
    within = (rows >= low) & (rows <= high)
    if not _all(within):
        i, k = np.argwhere(~within)[0].tolist()
        allowed = f"in [{low[k]:.10g}, {high[k]:.10g}] for a run"
        raise InvalidInput(names[k], float(rows[i, k]), allowed)
    return rows


@cache
def _ranges(scene: Scene) -> NDArray[np.float64]:
    """Least and largest values of a scene's parameters, shape (2, n)."""
    return np.array([*scene.facts.RANGES.values()]).T.copy()


def _all(within: NDArray[np.bool_]) -> bool:
    """True if all are true; three times as fast as NumPy's method for short arrays."""
    return int(np.count_nonzero(within)) == within.size


def spread(name: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Values broadcast to this shape, a copy; raises InvalidInput if they have another."""
    spread = np.empty(shape)
    try:
        spread[...] = values
    except (TypeError, ValueError):
        raise InvalidInput(name, values, f"numbers of shape {shape}, or one for all") from None
    return spread


def _starts(states: ArrayLike, count: int) -> NDArray[np.float64]:
    """Start states of runs, shape (n, 3); raises InvalidInput for one that is not allowed."""
    starts = spread("states", states, (count, 3))
    within = abs(starts) <= LARGEST_STATE
    if not _all(within):
        value = tuple(starts[np.argmin(within.all(axis=1))].tolist())
        raise InvalidInput("states", value, f"numbers of size at most {LARGEST_STATE:g}")
    return starts


def _times(phases: ArrayLike, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Start phases of runs, times below these lengths of their periods, shape (n,).

    Raises InvalidInput for one that is not allowed.
    """
    times = spread("phases", phases, lengths.shape)
    within = (times >= 0.0) & (times < lengths)
    if not _all(within):
        worst = int(np.argmin(within))
        must = f"times in [0, 2 pi/omega), here up to {lengths[worst]:.6g}"
        raise InvalidInput("phases", float(times[worst]), must)
    return times


def shared(work: Callable[[int], _Result], count: int, threads: int, watch: Watch) -> list[_Result]:
    """Results of work(0), ..., work(count - 1) by several threads, which Ctrl-C stops."""
    if threads == 1 or count == 1:
        return [work(i) for i in range(count)]
    with ThreadPoolExecutor(threads) as pool:
        try:
            return list(pool.map(work, range(count)))
        except BaseException:
            watch.stop()  # Ctrl-C comes here, where nothing runs
            raise


_Found = tuple[Any, Any, Any, Any, Any, Any]
"""Final states of runs, displacements, periods, statuses, offsets, and stroboscopic states."""


def _one_by_one(
    starts: NDArray[np.float64], runs: list[Trajectory | None], strobed: bool
) -> _Found:
    """Results of runs; None for a run that was not started."""
    finals, advances = starts.copy(), np.zeros(len(runs))
    passed, status = np.zeros(len(runs), np.int64), [Status.TIME_LIMIT.value] * len(runs)
    marks = [np.empty((0, 3))] * len(runs)
    for i, run in enumerate(runs):
        if run is not None:
            finals[i], advances[i] = run.final[1], run.advance
            passed[i], status[i] = run.final[0].period, run.status.value
            marks[i] = run.stroboscopic if strobed else marks[i]
    ends = np.cumsum([0, *map(len, marks)])
    kept = np.concatenate([np.empty((0, 3)), *marks])
    return finals, advances, passed, np.array(status, dtype=np.str_), ends, kept


def _side_by_side(
    scene: Scene,
    rows: NDArray[np.float64],
    starts: NDArray[np.float64],
    phases: NDArray[np.float64],
    periods: int,
    strobed: bool,
    watch: Watch,
    threads: int,
    most: int,
) -> _Found:
    """Final or stroboscopic states by the lanes of the core."""
    binding, count, periods = core(scene), len(rows), int(periods)
    strobe = np.empty((count, periods + 1, 3)) if strobed else None
    if strobe is not None:
        strobe[:, 0] = starts
    records, stops = np.empty(count, binding.records.STATE), np.empty(count, np.int8)
    binding.start_many(rows, starts, phases, records, watch)
    # Dealt in turn, each thread has as many long runs; but each gets enough runs to fill the lanes.
    shares = min(threads, max(1, count // _SIDE_BY_SIDE))

    def run_share(i: int) -> int:
        marks = None if strobe is None else strobe[i:]
        of = rows[i:], records[i:], periods, stops[i:], marks, True, shares, watch
        return int(binding.run_many(*of))

    status = _FINISHED.repeat(count)
    if sum(shared(run_share, shares, shares, watch)):
        for i in np.flatnonzero(stops == binding.OPEN).tolist():
            if watch.over:
                break
            marks = None if strobe is None else strobe[i]
            run = Run(NumpyBackend(scene), scene.Parameters(*rows[i].tolist()), True, watch)
            status[i] = _finish(run, records[i : i + 1].reshape(()), periods, marks, most).value
    passed = records["period"].copy()
    if watch.over:
        status[(passed < periods) & (status == Status.FINISHED.value)] = Status.TIME_LIMIT.value
    ends, kept = np.zeros(count + 1, np.int64), np.empty((0, 3))
    if strobe is not None:
        # Row 0 is a state at phase 0 only of a run that starts there.
        places = np.arange(periods + 1)
        has = (places <= passed[:, None]) & (places >= (phases != 0)[:, None])
        np.cumsum(has.sum(axis=1), out=ends[1:])
        kept = strobe[has]
    finals = np.array([records[name] for name in scene.facts.STATE]).T.copy()
    return finals, records["position"].copy(), passed, status, ends, kept


def _finish(
    run: Run, record: NDArray[np.void], periods: int, strobe: NDArray[np.float64] | None, most: int
) -> Status:
    """Finish a run, with the reference map wherever the core cannot decide a switch.

    It ends where the core cannot decide after `most` such switches, unless that is below 0.
    """
    native = core(run.scene).map([*run.parameters.to_dict().values()])
    run.marks = 0 if strobe is None else periods
    while record["period"] < periods and not run.watch.over:
        if not most:
            return Status.SEGMENT_LIMIT
        most -= 1
        run.segments.clear()
        run.stroboscopic.clear()
        run.stroboscopic_periods.clear()
        run_state = step(run, record, periods)
        if strobe is not None:
            passed = np.array(run.stroboscopic, dtype=float).reshape(-1, 3)
            strobe[run_state.periods - len(passed) + 1 : run_state.periods + 1] = passed
        write(record, run_state)
        if run_state.begin is None:
            return run.ended(run_state, periods, 0)[0]
        native.run(record, periods, strobe=strobe, position=True, watch=run.watch)
    return Status.FINISHED if record["period"] >= periods else Status.TIME_LIMIT
