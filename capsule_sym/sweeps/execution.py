"""Running a sweep on anything that speaks `concurrent.futures.Executor`."""

from __future__ import annotations

import math
import os
import signal
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, nullcontext
from multiprocessing import get_context, parent_process
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from capsule_sym.errors import CapsuleError, InvalidInput
from capsule_sym.map.simulate import check_count
from capsule_sym.sweeps.cells import Block, compute
from capsule_sym.sweeps.store import Store, opened
from capsule_sym.sweeps.sweep import Sweep

_KINDS = ("threads", "processes")
_MOST_DEATHS = 3  # of pools in which nothing was finished, before their chunks are blamed

Progress = Callable[[int, int], None]


class Lost(CapsuleError):
    """A chunk could not be computed. What was finished is kept, and the store can be resumed."""


class Summary(NamedTuple):
    """What a run did: cells in all, cells computed now, chunks found damaged, seconds, workers."""

    cells: int
    computed: int
    damaged: int
    seconds: float
    workers: int

    def periods_per_second_and_core(self, periods: int) -> float:
        """Excitation periods that a core ran per second, over the time of the whole run."""
        return self.computed * periods / self.seconds / self.workers


def run(
    sweep: Sweep,
    store: str | os.PathLike[str],
    *,
    executor: str | Executor = "threads",
    workers: int | None = None,
    resume: bool = False,
    command: str = "",
    progress: Progress = lambda done, total: None,
) -> Summary:
    """Runs all cells that a store does not hold yet, each chunk written as it is finished.

    The executor is "threads", "processes", or any `concurrent.futures.Executor`, such as that of
    a Dask client. At most `workers` chunks (by default one per core) are on their way, so that
    memory does not grow with the sweep, and an end at any moment costs at most a chunk per worker.
    `progress` is called with the cells done and their number. `open_results` reads the results.

    Raises InvalidInput for a store that cannot be used (see `opened`), NotWritten on a full disk,
    and Lost for a chunk under which workers die. In every case what is finished is kept.
    """
    count = len(os.sched_getaffinity(0)) if workers is None else workers
    check_count("workers", count)
    if isinstance(executor, str) and executor not in _KINDS:
        raise InvalidInput("executor", executor, f"an executor, or one of {', '.join(_KINDS)}")
    begin = perf_counter()
    with opened(Path(store), sweep, resume=resume, command=command) as to:
        whole, damaged = to.state()
        todo = deque(i for i in range(math.prod(sweep.chunks)) if i not in whole)
        computed = sum(sweep.cells_in(i) for i in todo)
        _Run(to, count, progress, sweep.size - computed).all(todo, executor)
        to.finish()
    return Summary(sweep.size, computed, damaged, perf_counter() - begin, count)


class _Run:
    def __init__(self, store: Store, workers: int, progress: Progress, done: int) -> None:
        self.store, self.workers, self.progress, self.done = store, workers, progress, done
        self.deaths = 0
        progress(done, store.sweep.size)

    def all(self, todo: deque[int], executor: str | Executor) -> None:
        """Runs chunks until none is left, with a new pool where a worker's death broke the old."""
        while todo:
            under_way: dict[Future[Block], int] = {}
            try:
                with self._pool(executor) as pool:
                    try:
                        self._through(pool, todo, under_way)
                    except BaseException:
                        for future in under_way:
                            future.cancel()
                        raise
            except BrokenExecutor as error:
                # All others come first, until only those are left that workers die under.
                lost = sorted(under_way.values())
                todo.extend(lost)
                self.deaths += 1
                if isinstance(executor, Executor) or self.deaths == _MOST_DEATHS:
                    raise Lost(f"a worker died under one of the chunks {lost}: {error}") from error

    def _pool(self, executor: str | Executor) -> AbstractContextManager[Executor]:
        if isinstance(executor, Executor):
            return nullcontext(executor)
        if executor == "threads":
            return ThreadPoolExecutor(self.workers)
        # Spawned, so that no worker holds the store's lock when this process is killed.
        return ProcessPoolExecutor(self.workers, get_context("spawn"), initializer=_follow)

    def _through(
        self, pool: Executor, todo: deque[int], under_way: dict[Future[Block], int]
    ) -> None:
        sweep = self.store.sweep
        while todo or under_way:
            # A chunk is written before its worker gets the next, so that no more than one chunk
            # per worker is ever lost.
            while todo and len(under_way) < self.workers:
                index = todo.popleft()
                try:
                    under_way[pool.submit(compute, sweep.part(index))] = index
                except BaseException:
                    todo.appendleft(index)
                    raise
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                index = under_way[future]
                try:
                    block = future.result()
                except (BrokenExecutor, CancelledError):
                    raise
                except Exception as error:
                    raise Lost(f"chunk {index}: {type(error).__name__}: {error}") from error
                self.store.publish(index, block)
                del under_way[future]
                self.deaths = 0
                self.done += sweep.cells_in(index)
                self.progress(self.done, sweep.size)


def _follow() -> None:
    """A worker leaves Ctrl-C to its parent, and ends when the parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
