"""Many runs at once, and what is kept of each: one array for all, with the offsets of the runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map.backend import default_backend
from capsule_sym._map.batch import checked_rows, final_states, spread
from capsule_sym._map.checks import check_count, check_start, checked_seconds
from capsule_sym._map.keep import STATE, STROBE, check_memory, checked
from capsule_sym._map.labelled import lock
from capsule_sym._map.segments import SWITCH, Segments, Tangencies, records_of
from capsule_sym._map.simulate import run as run_one
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._native import Watch, core
from capsule_sym._parameters import Parameters
from capsule_sym.generated.interface import SEGMENT

_MOST_AT_ONCE = 8192  # periods whose states the lanes write; more are kept piece by piece


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Many runs of the exact map: where each came to, how it went, and what was kept of it.

    `kept[offsets[i]:offsets[i + 1]]` is what was kept of run i, and `self[i]` gives it: records of
    its segments or switches, its stroboscopic states (3), or its states (x_r, v_r, v_c, x_c) at the
    times asked for (4). All quantities are dimensionless, and all arrays read-only.
    """

    parameters: NDArray[np.float64]
    """Rows of seven parameters, shape (n, 7)."""
    states: NDArray[np.float64]
    """Final states, shape (n, 3)."""
    advances: NDArray[np.float64]
    """Changes of the capsules' positions x_c over the runs, shape (n,)."""
    periods: NDArray[np.int64]
    """Whole excitation periods that were passed, shape (n,)."""
    status: NDArray[np.str_]
    """How each run ended, a `Status`, shape (n,)."""
    what: str
    """What was kept: segments, final, stroboscopic, switches or times."""
    offsets: NDArray[np.int64]
    """Where in `kept` the runs begin, and its length, shape (n + 1,)."""
    kept: NDArray[Any]
    """What was kept of all runs, one after another."""
    tangencies: Tangencies
    """Contacts that did not end a segment, by the index of the segment in `kept`."""

    def __post_init__(self) -> None:
        lock(self)

    def __len__(self) -> int:
        return len(self.parameters)

    def __getitem__(self, index: int) -> Any:
        if isinstance(index, slice | bool):
            raise InvalidInput("index", index, "a whole number")
        place = range(len(self))[index]
        first, last = self.offsets[place : place + 2].tolist()
        part = self.kept[first:last]
        if self.what != "segments":
            return part
        return Segments(part, self.parameters[place, 1], self.tangencies, first)

    def __repr__(self) -> str:
        done = int(self.success.sum())
        return f"<Trajectories: {done} of {len(self)} runs finished, kept {self.what}>"

    @property
    def success(self) -> NDArray[np.bool_]:
        """Which runs came to the end of their periods, shape (n,)."""
        return np.equal(self.status, Status.FINISHED.value)


def simulate_many(
    parameters: Sequence[Parameters] | NDArray[np.float64],
    states: ArrayLike = (0.0, 0.0, 0.0),
    phases: ArrayLike = 0.0,
    periods: int = 100,
    *,
    keep: str | ArrayLike = "final",
    max_segments: int | None = None,
    max_seconds: float = math.inf,
    threads: int = 1,
) -> Trajectories:
    """The runs of n parameter sets, each as `simulate` gives it.

    `parameters` are n `Parameters` or their rows (n, 7), states (n, 3) or (3,), phases (n,) or one;
    `keep` is as in `simulate`, times are the same for all runs. Final and stroboscopic states are
    computed side by side in vector lanes, and agree with those of single runs but for roundings.
    `max_segments` limits the others, `max_seconds` all together. All that is kept takes at most
    4 GiB, of which each run has the same part: it ends with the status memory-limit where that is
    used up, and counts that are sure to take more are refused. All quantities are dimensionless.

    Raises InvalidInput for a value that is not allowed.
    """
    rows = _rows(parameters)
    if core is not None:
        checked_rows(rows)
    check_count("periods", periods)
    check_count("threads", threads)
    if max_segments is not None:
        check_count("max_segments", max_segments)
    watch = Watch(checked_seconds(max_seconds))
    starts, times = spread("states", states, (len(rows), 3)), spread("phases", phases, (len(rows),))
    shortest = 2 * np.pi / rows[:, 1].max() if len(rows) else math.inf
    kept = checked(keep, times.max() if len(rows) else 0.0, periods * shortest)
    what = kept if isinstance(kept, str) else "times"
    if not isinstance(kept, str):
        check_memory("keep", kept, STATE * kept.size * len(rows))
    elif what == "stroboscopic":
        check_memory("periods", periods, STROBE * min(periods, _MOST_AT_ONCE) * len(rows))
    side_by_side = what == "final" or (what == "stroboscopic" and periods <= _MOST_AT_ONCE)
    if side_by_side and core is not None and max_segments is None:
        return _side_by_side(rows, starts, times, periods, what, watch, threads)

    chosen = default_backend()

    def one(i: int) -> Trajectory | None:
        if watch.over:
            return None
        p, phase = Parameters(*rows[i].tolist()), float(times[i])
        start = check_start(p, starts[i].tolist(), phase, periods), phase, int(periods)
        return run_one(p, start, kept, max_segments, watch, chosen, share=len(rows))

    runs: list[Trajectory | None]
    if threads == 1:
        runs = [one(i) for i in range(len(rows))]
    else:
        with ThreadPoolExecutor(threads) as pool:
            try:
                runs = list(pool.map(one, range(len(rows))))
            except BaseException:
                watch.stop()  # Ctrl-C comes here, where nothing runs
                raise
    empty = _empty(kept)
    parts = [empty if run is None else _part(run, what) for run in runs]
    ends = np.cumsum([0, *map(len, parts)])
    finals, advances = starts.copy(), np.zeros(len(rows))
    passed, status = np.zeros(len(rows), np.int64), [Status.TIME_LIMIT.value] * len(rows)
    tangencies: dict[int, Any] = {}
    all_kept = np.empty((ends[-1], *empty.shape[1:]), empty.dtype)
    for i, run in enumerate(runs):
        all_kept[ends[i] : ends[i + 1]] = parts[i]
        runs[i], parts[i] = None, empty  # what is copied takes no room twice
        if run is not None:
            finals[i], advances[i] = run.final[1], run.advance
            passed[i], status[i] = run.final[0].period, run.status.value
            if isinstance(run.kept.segments, Segments):
                found = run.kept.segments.tangencies.items()
                tangencies |= {int(ends[i]) + k: those for k, those in found}
    return Trajectories(
        rows,
        finals,
        advances,
        passed,
        np.array(status, dtype=np.str_),
        what,
        ends,
        all_kept,
        tangencies,
    )


def _rows(parameters: Sequence[Parameters] | NDArray[np.float64]) -> NDArray[np.float64]:
    """The parameter sets as rows, shape (n, 7)."""
    if isinstance(parameters, np.ndarray):
        if parameters.ndim != 2 or parameters.shape[1] != 7 or parameters.dtype.kind not in "iuf":
            raise InvalidInput("parameters", parameters.shape, "real numbers of shape (n, 7)")
        return np.array(parameters, dtype=float, order="C")  # the caller may change theirs
    if isinstance(parameters, Parameters) or not all(
        isinstance(one, Parameters) for one in parameters
    ):
        raise InvalidInput("parameters", parameters, "a sequence of Parameters, or their rows")
    return np.array([[*one.to_dict().values()] for one in parameters]).reshape(-1, 7)


def _empty(kept: str | NDArray[np.float64]) -> NDArray[Any]:
    """What is kept of a run that was not begun."""
    if not isinstance(kept, str):
        return np.full((kept.size, 4), np.nan)
    if kept in ("segments", "switches"):
        return np.empty(0, SEGMENT if kept == "segments" else SWITCH)
    return np.empty((0, 3)) if kept == "stroboscopic" else np.empty(0)


def _part(run: Trajectory, what: str) -> NDArray[Any]:
    """What was kept of a run, as an array."""
    if what == "segments":
        return records_of(run.segments, run.parameters.omega)
    if what == "times":
        states = run.kept.states
        assert states is not None
        return states.reshape(-1, 4)
    if what == "final":
        return np.empty(0)
    return run.switches if what == "switches" else run.stroboscopic


def _side_by_side(
    rows: NDArray[np.float64],
    starts: NDArray[np.float64],
    phases: NDArray[np.float64],
    periods: int,
    what: str,
    watch: Watch,
    threads: int,
) -> Trajectories:
    """Final or stroboscopic states by the lanes of the core."""
    count = len(rows)
    strobe = np.empty((count, periods + 1, 3)) if what == "stroboscopic" else None
    found = final_states(
        rows, starts, phases, periods, strobe=strobe, positions=True, threads=threads, watch=watch
    )
    status = np.full(count, Status.FINISHED.value, dtype="<U16")
    for i in np.flatnonzero(found.stopped).tolist():
        status[i] = Status.TIME_LIMIT.value
        if not watch.over:
            x_r, v_r, v_c = starts[i].tolist()
            start = (x_r, v_r, v_c), float(phases[i]), periods
            again = run_one(Parameters(*rows[i].tolist()), start, "final", None, watch, "c")
            status[i] = again.status.value
    lengths = np.zeros(count, np.int64)
    kept = np.empty(0)
    if strobe is not None:
        # Row 0 is a state at phase 0 only of a run that starts there.
        places = np.arange(periods + 1)
        has = (places <= found.periods[:, None]) & (places >= (phases != 0)[:, None])
        lengths, kept = has.sum(axis=1), strobe[has]
    return Trajectories(
        rows,
        found.states,
        found.positions,
        found.periods,
        status,
        what,
        np.concatenate([[0], np.cumsum(lengths)]),
        kept,
        {},
    )
