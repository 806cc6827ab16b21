"""Running a sweep on threads, chunk by chunk."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent import futures
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Any

from capsule_sym._errors import Ended, Status, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._map.result import brief
from capsule_sym._native import Watch, check_time, present
from capsule_sym._processes import deferred, processors
from capsule_sym._sweeps.cells import Block, compute
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._sweeps.results import Held
from capsule_sym._sweeps.store import Store, opened
from capsule_sym._sweeps.sweep import Sweep

MOST_WORKERS = 1024  # more than the one writer keeps busy
_LOOK = 5.0  # seconds between two looks at the time limit; Windows notices Ctrl-C only then

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Summary(Ended):
    """Summary of a run: all cells, cells computed now, damaged parts found, seconds, workers.

    A damaged part is a chunk with a record whose results cannot be read or are incomplete; it is
    computed again. `outcomes` has the number of cells by outcome, over all cells of the store.
    `finished` is False if the run reached its time limit.
    """

    cells: int
    computed: int
    damaged: int
    seconds: float
    workers: int
    outcomes: dict[str, int]
    finished: bool = True

    @property
    def status(self) -> Status:
        """COMPLETE, FAILED if some cell has failed, or TIME_LIMIT if the run did not finish."""
        if not self.finished:
            return Status.TIME_LIMIT
        failed = self.outcomes.get(CellOutcome.FAILED.name.lower(), 0)
        return Status.FAILED if failed else Status.COMPLETE

    @property
    def message(self) -> str:
        """Number of cells of each outcome, the most frequent first."""
        ranked = sorted(self.outcomes.items(), key=lambda item: -item[1])
        told = ", ".join(f"{cells:,} {name.replace('_', ' ')}" for name, cells in ranked if cells)
        if self.finished:
            return told
        return f"time limit reached; continue with --resume: {told or 'no cell yet'}"

    def __repr__(self) -> str:
        return brief(self, f"{counted(self.cells, 'cell')}: {self.message}")

    @property
    def statistics(self) -> dict[str, Any]:
        """All cells, cells computed now, damaged parts, seconds, workers, and cells by outcome."""
        return {name: value for name, value in asdict(self).items() if name != "finished"}

    def periods_per_second_and_core(self, periods: int) -> float:
        """Excitation periods per second and worker: `periods` for each cell that was computed."""
        return self.computed * periods / self.seconds / self.workers


def run_sweep(
    sweep: Sweep,
    store: str | os.PathLike[str],
    *,
    workers: int | None = None,
    resume: bool = False,
    command: str = "",
    progress: Progress = lambda done, total: None,
    max_seconds: float = 6 * SEARCH_SECONDS,
) -> Summary:
    """Run of all cells that a store does not hold yet.

    Each finished chunk is written at once. At most `workers` chunks are in work at a time, so
    memory does not grow with the sweep. An interruption loses at most one chunk per worker. Results
    are the same byte for byte however often a run is stopped and resumed. Finished chunks are kept
    in each case: on an error, on Ctrl-C and after `max_seconds`. The extra `sweep` is needed.

    Parameters
    ----------
    sweep : Sweep
        Cells, length of the runs, and quantities to compute; `read_plan` gives one too.
    store : str or path
        Directory that receives the results. It is new, or with `resume` that of an earlier run.
    workers : int, optional, 1 to 1,024
        Number of chunks in work at a time. The default is the number of processors that this
        process may use.
    resume : bool, default False
        True continues an existing store: missing and damaged chunks are computed.
    command : str, default ""
        Command that the store records.
    progress : callable, optional
        Function that is called with the number of finished cells and that of all cells, by default
        one without effect.
    max_seconds : float, default 3600, above 0
        Time limit, in seconds of wall time; `inf` sets none. Unfinished chunks are then abandoned.

    Returns
    -------
    Summary
        Summary of the run, with `success`, `status`, `message`, `outcomes` (number of cells by
        outcome) and `statistics`. The status is a `Status`: "complete", "failed" if the
        quantities of some cell could not be computed, or "time-limit". `open_results` reads the
        results.

    Raises
    ------
    InvalidInput
        For a value outside its range, and for a store that cannot be used. Such a store exists and
        `resume` is False, or has other content. Or it belongs to another sweep, to other kernels or
        to another core, whose results differ in the last bits; or another run writes to it.
    CapsuleError
        If results cannot be written, as on a full disk.
    KeyboardInterrupt
        On Ctrl-C; its text has the number of cells that are kept.

    See Also
    --------
    open_results : results of a store.
    run_basin : sweep over starts, with the attractor of each cell.
    read_plan : sweep from a TOML file, or its table.

    Examples
    --------
    Progression over 11 amplitudes:

    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> axis = Axis.linear("alpha", 0.5, 1.5, 11)
    >>> sweep = Sweep((axis,), periods=100, compute=("progression",))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary = cs.run_sweep(sweep, f"{folder}/store")
    ...     progression = cs.results.open_results(f"{folder}/store").progression.load()
    >>> print(summary.status, summary.message)
    complete 11 converged
    >>> print(f"{float(progression.sel(alpha=0.7, method='nearest')):.6f}")
    0.411567
    """
    path, count = Path(store), processors() if workers is None else workers
    check_count("workers", count, most=MOST_WORKERS)
    limit = Watch(checked_seconds(max_seconds))
    begin, work, finished = perf_counter(), None, False
    try:
        with limit, opened(path, sweep, resume=resume, command=command) as to:
            work = _Run(to, count, progress)
            work.all()
            to.finish(sweep.further(path))
            finished = True
    except KeyboardInterrupt:
        if work is None:
            raise KeyboardInterrupt(f"no cell was started in {path}") from None
        kept = f"{work.done:,} of {counted(sweep.size, 'cell')} kept in {path}"
        raise KeyboardInterrupt(f"{kept}; continue with --resume") from None
    assert work is not None  # opening a store has no time limit
    seconds, outcomes = perf_counter() - begin, dict(Held(path).tally().outcomes)
    computed = work.done - work.held
    return Summary(sweep.size, computed, work.damaged, seconds, count, outcomes, finished)


class _Run:
    """Run of the chunks that a store lacks, by threads; each is written when it is finished."""

    def __init__(self, store: Store, workers: int, progress: Progress) -> None:
        self.store, self.workers, self.progress = store, workers, progress
        whole, chunks = store.whole, math.prod(store.sweep.chunks)
        self.todo = (index for index in range(chunks) if index not in whole)
        self.damaged = sum(1 for _ in store.held.recorded()) - len(whole)
        self.held = self.done = sum(map(store.sweep.cells_in, whole))
        progress(self.done, store.sweep.size)

    def all(self) -> None:
        """Run chunks until none is left; on an exception threads stop within their chunks."""
        threads, watch = futures.ThreadPoolExecutor(self.workers), Watch()
        under_way: dict[futures.Future[Block], int] = {}
        try:
            while True:
                # No worker has a second chunk queued: an interruption loses one of each at most.
                for index in islice(self.todo, self.workers - len(under_way)):
                    check_time()
                    part = self.store.sweep.part(index)
                    under_way[threads.submit(compute, part, watch)] = index
                if not under_way:
                    break
                wait = min(_LOOK, present().left)
                done = futures.wait(under_way, wait, futures.FIRST_COMPLETED).done
                if not done:
                    check_time()
                for future in done:
                    self._publish(under_way.pop(future), future.result())
        except BaseException:
            watch.stop()
            threads.shutdown(wait=False, cancel_futures=True)
            raise
        threads.shutdown()

    def _publish(self, index: int, block: Block) -> None:
        with deferred():  # an interrupt cannot separate the stored chunks from their count
            self.store.publish(index, block)
            self.done += self.store.sweep.cells_in(index)
        self.progress(self.done, self.store.sweep.size)
