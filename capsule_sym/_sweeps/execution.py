"""Running a sweep on any `concurrent.futures.Executor`."""

from __future__ import annotations

import math
import os
import pickle
from collections.abc import Callable, Iterator
from concurrent import futures
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from secrets import token_hex
from time import perf_counter
from typing import Any

from capsule_sym._errors import CapsuleError, Ended, Status, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._map.result import brief
from capsule_sym._native import TimeUp, Watch, check_time, present
from capsule_sym._parameters import load
from capsule_sym._processes import deferred, processors
from capsule_sym._sweeps.cells import Block, compute
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._sweeps.results import Held
from capsule_sym._sweeps.store import Store, opened
from capsule_sym._sweeps.sweep import Sweep

MOST_WORKERS = 1024  # more than the one writer keeps busy
_LOOK = 5.0  # seconds between two looks at the time limit; Windows notices Ctrl-C only then
_MOST_FAILED = 3  # chunks, after which a run ends without the others

Progress = Callable[[int, int], None]
Submit = Callable[[Sweep], futures.Future[Block]]


class Lost(CapsuleError):
    """Raised if a chunk cannot be computed. Finished chunks are kept; the store can be resumed."""


@dataclass(frozen=True)
class Summary(Ended):
    """Summary of a run: all cells, cells computed now, damaged parts found, seconds, workers.

    A damaged part is a chunk or a file beside the chunks; each is computed or written again.
    `outcomes` has the number of cells by outcome, over all cells of the store.
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
        """Excitation periods per second and core, over the time of the whole run."""
        return self.computed * periods / self.seconds / self.workers


def run_sweep(
    sweep: Sweep,
    store: str | os.PathLike[str],
    *,
    executor: futures.Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    any_core: bool = False,
    command: str = "",
    progress: Progress = lambda done, total: None,
    max_seconds: float = 6 * SEARCH_SECONDS,
) -> Summary:
    """Run of all cells that a store does not hold yet.

    Each finished chunk is written at once. At most `workers` chunks are in work at a time, so
    memory does not grow with the sweep. An interruption loses at most one chunk per worker. Results
    are the same byte for byte however often a run is stopped and resumed; with `any_core` this no
    longer holds. Finished chunks are kept in each case: on an error, on Ctrl-C and after
    `max_seconds`.

    Parameters
    ----------
    sweep : Sweep
        Cells, length of the runs, and quantities to compute. `load_sweep` and `read_plan` give one
        too.
    store : str or path
        Directory that receives the results. It is new, or with `resume` that of an earlier run.
    executor : concurrent.futures.Executor, optional
        Executor that computes the chunks, such as that of a Dask client. `capsule_sym` can be
        imported in its processes. By default threads of this process compute them.
    workers : int, optional, 1 to 1,024
        Number of chunks in work at a time. The default is the number of processors that this
        process may use.
    resume : bool, default False
        True continues an existing store: missing and damaged chunks are computed.
    any_core : bool, default False
        True allows to resume with another core than that of the first run. Results of two cores
        differ in the last bits.
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
        `resume` is False, or has other content. Or it belongs to another sweep or to other kernels,
        or is in use by another run. One of another core needs `any_core`.
    CapsuleError
        If results cannot be written, as on a full disk. If the executor could not compute some
        chunks: after all others, after three such chunks, or at once if it is broken.
    KeyboardInterrupt
        On Ctrl-C; its text has the number of cells that are kept.

    See Also
    --------
    open_results : results of a store.
    run_basin : sweep over starts, with the attractor of each cell.
    load_sweep : sweep from a TOML file.

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
    to_store = opened(path, sweep, resume=resume, command=command, any_core=any_core)
    try:
        with limit, to_store as to:
            damaged = len(to.check.chunks) + len(to.check.files)
            work = _Run(to, count, progress)
            work.all(executor)
            to.finish(sweep.further(path))
            finished = True
    except KeyboardInterrupt:
        if work is None:
            raise KeyboardInterrupt(f"no cell was started; {path} is unchanged") from None
        kept = f"{work.done:,} of {counted(sweep.size, 'cell')} kept in {path}"
        raise KeyboardInterrupt(f"{kept}; continue with --resume") from None
    assert work is not None  # opening a store has no time limit
    seconds, outcomes = perf_counter() - begin, dict(Held(path).tally().outcomes)
    return Summary(sweep.size, work.done - work.held, damaged, seconds, count, outcomes, finished)


class _Run:
    """Run of the chunks that a store lacks, each written when it is finished."""

    def __init__(self, store: Store, workers: int, progress: Progress) -> None:
        self.store, self.workers, self.progress = store, workers, progress
        whole, chunks = store.check.whole, math.prod(store.sweep.chunks)
        self.todo = (index for index in range(chunks) if index not in whole)
        self.held = sum(map(store.sweep.cells_in, whole))
        self.done = self.held
        self.under_way: dict[futures.Future[Block], int] = {}
        self.failed: dict[int, str] = {}
        progress(self.done, store.sweep.size)

    def all(self, executor: futures.Executor | None) -> None:
        """Run chunks until none is left; raises Lost if some failed."""
        with _submitting(executor, self.workers) as submit:
            try:
                while self._give(submit):
                    self._take()
            except BaseException:
                for future in self.under_way:
                    future.cancel()
                raise
        if self.failed:
            raise self._lost()

    def _give(self, submit: Submit) -> bool:
        """Submit a chunk to each free worker; returns False if none is under way.

        No worker has a second chunk queued, so that at most one chunk per worker is lost.
        """
        for index in islice(self.todo, self.workers - len(self.under_way)):
            check_time()
            try:
                self.under_way[submit(self.store.sweep.part(index))] = index
            except futures.BrokenExecutor as error:
                self.failed[index] = _reason(error)
                raise self._lost() from error
        return bool(self.under_way)

    def _take(self) -> None:
        """Write finished chunks; raises Lost if an executor is broken, or many chunks failed."""
        done = futures.wait(
            self.under_way, min(_LOOK, present().left), futures.FIRST_COMPLETED
        ).done
        if not done:
            check_time()
        for future in done:
            index = self.under_way[future]
            try:
                block = future.result()
            except TimeUp:
                raise
            except futures.CancelledError as error:
                raise Lost("the executor cancelled a chunk; continue with --resume") from error
            except Exception as error:
                self.failed[self.under_way.pop(future)] = _reason(error)
                if isinstance(error, futures.BrokenExecutor) or len(self.failed) == _MOST_FAILED:
                    raise self._lost() from error
                continue
            with deferred():  # an interrupt cannot separate the stored chunks from their count
                self.store.publish(index, block)
                del self.under_way[future]
                self.done += self.store.sweep.cells_in(index)
            self.progress(self.done, self.store.sweep.size)

    def _lost(self) -> Lost:
        return Lost("; ".join(f"chunk {index}: {told}" for index, told in self.failed.items()))


@contextmanager
def _submitting(executor: futures.Executor | None, workers: int) -> Iterator[Submit]:
    """Submission of chunks to a given executor, which stays open, or to threads of this process.

    On an exception, such as an interrupt, threads stop within their chunks.
    """
    if executor is not None:
        yield partial(_send, executor)
        return
    threads, watch = futures.ThreadPoolExecutor(workers), Watch()
    try:
        yield lambda part: threads.submit(compute, part, watch)
    except BaseException:
        watch.stop()
        threads.shutdown(wait=False, cancel_futures=True)
        raise
    threads.shutdown()


def _send(executor: futures.Executor, part: Sweep) -> futures.Future[Block]:
    """Chunk of an executor, which may be another process; the caller has loaded the scene.

    No two calls have equal arguments: Dask takes such calls for one, which it may have cancelled.
    """
    source, pickled = part.parameters.scene.source, pickle.dumps(part)
    return executor.submit(_in_scene, compute, source, pickled, token_hex(8))


def _in_scene(work: Callable[[Sweep], Block], source: str, part: bytes, once: str) -> Block:
    load(source)
    return work(pickle.loads(part))


def _reason(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
