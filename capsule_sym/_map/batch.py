"""Many runs at once by the C core: what is asked for is computed, and nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput, Stopped
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._map.checks import LARGEST_STATE, check_count, check_start
from capsule_sym._map.escalation import Run, step, write
from capsule_sym._map.evaluation import borrowed, give_back
from capsule_sym._map.native import core
from capsule_sym._native import Watch
from capsule_sym._parameters import Parameters
from capsule_sym.generated.facts import PARAMETERS, RANGES

_SIDE_BY_SIDE = 8
_row = attrgetter(*PARAMETERS)
_LOW, _HIGH = np.array([*RANGES.values()]).T.copy()
_STATES = np.full(3, -LARGEST_STATE), np.full(3, LARGEST_STATE)


class Finals(NamedTuple):
    """Where runs came to: states (n, 3), capsule positions (n,), and after how many periods (n,).

    `stopped` tells which runs did not finish.
    """

    states: NDArray[np.float64]
    positions: NDArray[np.float64]
    stopped: NDArray[np.bool_]
    periods: NDArray[np.int64]

    @property
    def success(self) -> NDArray[np.bool_]:
        """Which runs came to the end of their periods, shape (n,)."""
        return ~self.stopped


def parameter_rows(base: Parameters, **columns: ArrayLike) -> NDArray[np.float64]:
    """Rows of seven parameters, shape (n, 7): the base with some of them replaced by arrays (n,).

    Raises InvalidInput for a name or a value that is not allowed.
    """
    base.replace(**dict.fromkeys(columns, 1.0))
    values = dict(zip(columns, np.broadcast_arrays(*columns.values()), strict=True))
    count = max((v.size for v in values.values()), default=1)
    rows = np.tile(np.array(list(base.to_dict().values())), (count, 1))
    for name, column in values.items():
        rows[:, PARAMETERS.index(name)] = column
    return checked_rows(rows)


def final_states(
    parameters: NDArray[np.float64],
    states: ArrayLike = (0.0, 0.0, 0.0),
    phases: ArrayLike = 0.0,
    periods: int = 100,
    *,
    strobe: NDArray[np.float64] | None = None,
    positions: bool = False,
    threads: int = 1,
    watch: Watch | None = None,
) -> Finals:
    """Final states of the runs of rows of parameters (n, 7), after whole excitation periods.

    States (n, 3) or (3,) and phases (n,) or one are where the runs start, as in `simulate`.
    Memory does not depend on `periods`, unless `strobe`, an array (n, periods + 1, 3), is given
    to receive the states at the ends of the periods (row 0 is the start). Positions are followed,
    and cost, only if asked for, and are nan otherwise. All quantities are dimensionless.

    Runs that a `watch` stops are where they came to by then, and are told by `stopped`.

    Raises InvalidInput for a value that is not allowed.
    """
    rows = checked_rows(np.ascontiguousarray(parameters, dtype=float))
    count = len(rows)
    check_count("periods", periods)
    check_count("threads", threads)
    starts, times = spread("states", states, (count, 3)), spread("phases", phases, (count,))
    if at := core().outside(starts, *_STATES):
        value = tuple(starts[at[0]].tolist())
        raise InvalidInput("states", value, f"numbers of size at most {LARGEST_STATE:g}")
    if count == 1 and strobe is None and watch is None and not positions:
        phase = float(times[0])
        if 0.0 <= phase < 2 * np.pi / rows[0, 1]:
            found = _alone(rows[0].tolist(), starts[0].tolist(), phase, periods)
            if found is not None:
                one = np.array([periods])
                return Finals(np.array([found]), np.array([np.nan]), np.zeros(1, bool), one)
    if strobe is not None:
        if strobe.shape != (count, periods + 1, 3) or strobe.dtype != np.float64:
            raise InvalidInput(
                "strobe", strobe.shape, f"float64 of shape {(count, periods + 1, 3)}"
            )
        strobe[:, 0] = starts
    records = np.empty(count, core().STATE)
    stops = np.empty(count, np.int8)
    watch = watch or Watch()
    if not core().start_many(rows, starts, times, records, watch):
        raise InvalidInput("phases", phases, "times in [0, 2 pi/omega)")

    # Dealt out like cards, threads have as many long runs each; but enough runs in each to be taken
    # side by side.
    shares = min(threads, max(1, count // _SIDE_BY_SIDE))

    def run_share(i: int) -> int:
        marks = None if strobe is None else strobe[i:]
        return int(
            core().run_many(
                rows[i:], records[i:], periods, stops[i:], marks, positions, shares, watch
            )
        )

    if shares == 1:
        still_open = run_share(0)
    else:
        with ThreadPoolExecutor(shares) as pool:
            try:
                still_open = sum(pool.map(run_share, range(shares)))
            except BaseException:
                watch.stop()  # Ctrl-C comes here, where nothing runs
                raise
    for i in np.flatnonzero(stops == core().OPEN).tolist() if still_open else ():
        marks = None if strobe is None else strobe[i]
        run = Run(NumpyBackend(), Parameters(*rows[i].tolist()), True, watch)
        _finish(run, records[i : i + 1].reshape(()), periods, marks, positions, watch)
    reached = np.empty((count, 3))
    for k, name in enumerate(("x_r", "v_r", "v_c")):
        reached[:, k] = records[name]
    where = records["position"].copy() if positions else np.full(count, np.nan)
    passed = records["period"].copy()
    return Finals(reached, where, passed < periods, passed)


def _alone(
    parameters: Iterable[float], state: Iterable[float], phase: float, periods: int
) -> tuple[float, float, float] | None:
    """Where one run comes to, by a map whose tables this thread keeps for runs like it."""
    core()
    native = borrowed(parameters)
    found = native.final(*state, phase, periods)
    give_back(native)
    return found  # type: ignore[no-any-return]


def final_state(
    parameters: Parameters,
    state: tuple[float, float, float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 100,
) -> tuple[float, float, float]:
    """The final state of one run, as `simulate` gives it, in constant memory.

    Raises InvalidInput for a value that is not allowed, and Stopped where the run came to no end.
    """
    values = check_start(parameters, state, phase, periods)
    found = _alone(_row(parameters), values, phase, periods)
    if found is None:
        run = Run(NumpyBackend(), parameters, escalate=True)
        record = core().Map(np.array(_row(parameters))).state_at(*values, phase)
        _finish(run, record, periods, None, False)
        if record["period"] < periods:
            raise Stopped(int(record["period"]), periods)
        return float(record["x_r"]), float(record["v_r"]), float(record["v_c"])
    return found


def _finish(
    run: Run,
    record: NDArray[np.void],
    periods: int,
    strobe: NDArray[np.float64] | None,
    positions: bool,
    watch: Watch | None = None,
) -> None:
    """Takes a run on by the reference map wherever the core leaves a switch open."""
    native = core().Map(np.array(list(run.parameters.to_dict().values())))
    run.marks = 0 if strobe is None else periods
    while record["period"] < periods and not (watch and watch.over):
        run.segments.clear()
        run.stroboscopic.clear()
        run.stroboscopic_periods.clear()
        run_state = step(run, record, periods)
        if strobe is not None:
            passed = np.array(run.stroboscopic, dtype=float).reshape(-1, 3)
            strobe[run_state.periods - len(passed) + 1 : run_state.periods + 1] = passed
        write(record, run_state)
        if run_state.begin is None:
            return
        native.run(record, periods, strobe=strobe, position=positions, watch=watch)


def checked_rows(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows of parameters; raises InvalidInput for a shape or a value that is not allowed."""
    if rows.ndim != 2 or rows.shape[1] != len(PARAMETERS):
        raise InvalidInput("parameters", rows.shape, "an array of shape (n, 7)")
    if at := core().outside(rows, _LOW, _HIGH):
        name = PARAMETERS[at[1]]
        low, high = RANGES[name]
        raise InvalidInput(name, float(rows[at]), f"in [{low:g}, {high:g}] for a run")
    return rows


def spread(name: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """The values as an array of this shape, by the rules of broadcasting."""
    spread = np.empty(shape)
    try:
        spread[...] = values
    except (TypeError, ValueError):
        raise InvalidInput(name, values, f"numbers of shape {shape}, or one for all") from None
    return spread
