"""Executors of chunks: threads, a Dask cluster or another, and how each is stopped.

On a cluster abandoned chunks are stopped, and a warning reports why a run waits.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from threading import Event, Thread
from typing import Any

from capsule_sym._errors import CapsuleError, InvalidInput
from capsule_sym._native import Watch
from capsule_sym._processes import undisturbed
from capsule_sym._sweeps.cells import Block, compute
from capsule_sym._sweeps.sweep import Sweep

PATIENCE = 5.0
"""Seconds without a finished chunk after which a pool checks its executor."""
_CONNECTING = 10  # seconds to connect to an address
_ANSWERING = 5  # seconds to wait for an answer of the scheduler
_LOOKING = 0.2  # seconds between two checks that a chunk is still wanted
_SILENT = logging.CRITICAL + 1

_log = logging.getLogger(__name__)


class Lost(CapsuleError):
    """Raised if a chunk cannot be computed. Finished chunks are kept; the store can be resumed."""


class Pool:
    """An executor of chunks."""

    def __init__(self, executor: Executor) -> None:
        self.executor = executor

    def submit(self, part: Sweep) -> Future[Block]:
        """Submit a chunk."""
        return self.executor.submit(compute, part)

    def waited(self) -> None:
        """Called if no chunk has finished for some time."""

    def lost(self) -> CapsuleError:
        """Error for a future that was cancelled by the executor."""
        return Lost("the executor cancelled a chunk")


class _Threads(Pool):
    """Threads of this process, which stop within a chunk."""

    def __init__(self, workers: int) -> None:
        super().__init__(ThreadPoolExecutor(workers))
        self.watch = Watch()

    def submit(self, part: Sweep) -> Future[Block]:
        return self.executor.submit(compute, part, self.watch)

    def abandon(self) -> None:
        """Stop without waiting for unfinished chunks."""
        self.watch.stop()
        self.executor.shutdown(wait=False, cancel_futures=True)


class DaskPool(Pool):
    """Executor of a Dask client."""

    def __init__(self, executor: Any) -> None:
        super().__init__(executor)
        self.client, self.given = executor._client, executor.submit
        self.said = ""

    def submit(self, part: Sweep) -> Future[Block]:
        """Submit a chunk; raises Lost if the client has lost its scheduler."""
        try:
            # Not pure: a later run of the same chunk is a new task.
            future: Future[Block] = self.given(compute_while_wanted, part, pure=False)
        except Exception as error:
            raise self.lost() from error
        return future

    def lost(self) -> CapsuleError:
        """Error for a future that was cancelled by the executor."""
        return Lost(
            "the connection to the Dask scheduler is lost; finished cells are kept; "
            "continue with --resume"
        )

    def waited(self) -> None:
        """Log, once, the reason for waiting if it is not the chunks."""
        try:
            count = len(self.client.sync(self.client.scheduler.ncores, callback_timeout=_ANSWERING))
            saying = "" if count else "waiting: the Dask cluster has no workers"
        except Exception:  # of many kinds; the futures report a lost connection
            saying = "waiting: the Dask scheduler does not answer"
        if saying and saying != self.said:
            _log.warning("%s; Ctrl-C ends the run and keeps finished chunks", saying)
        self.said = saying


def compute_while_wanted(part: Sweep) -> Block:
    """Results of a chunk in a worker, which gives up if nobody waits for them any more."""
    distributed: Any = import_module("distributed")
    worker = distributed.get_worker()
    key, watch, done = worker.get_current_task(), Watch(), Event()

    def look() -> None:
        while not done.wait(_LOOKING):
            task = worker.state.tasks.get(key)
            if task is None or task.state != "executing":
                watch.stop()

    Thread(target=look, daemon=True).start()
    try:
        return compute(part, watch)
    finally:
        done.set()


@contextmanager
def pool_of(executor: Executor | None, workers: int) -> Iterator[Pool]:
    """Pool around a given executor, which stays open, or of threads.

    On an exception, such as an interrupt, threads do not wait for unfinished chunks.
    """
    if executor is not None:
        dask = type(executor).__module__.partition(".")[0] == "distributed"
        yield DaskPool(executor) if dask else Pool(executor)
        return
    pool = _Threads(workers)
    try:
        yield pool
    except BaseException:
        pool.abandon()
        raise
    pool.executor.shutdown()


@contextmanager
def client_of(address: str, workers: int | None) -> Iterator[Any]:
    """Client of the Dask scheduler at an address, or of a new local cluster for "local".

    Logs of Dask are silenced in this process; errors are raised as exceptions. Raises InvalidInput
    if no scheduler answers within seconds.
    """
    distributed: Any = import_module("distributed")
    for name in ("distributed", "distributed.client", "distributed.nanny", "asyncio", "tornado"):
        logging.getLogger(name).setLevel(_SILENT)
    with ExitStack() as stack:
        if address == "local":
            with undisturbed():  # processes started later inherit this
                cluster = stack.enter_context(
                    distributed.LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        dashboard_address="127.0.0.1:0",  # without a port it takes 8787, or warns
                        silence_logs=_SILENT,
                    )
                )
            # Its hook into the garbage collection would swallow a Ctrl-C.
            import_module("distributed.gc").disable_gc_diagnosis()
            yield stack.enter_context(distributed.Client(cluster))
            return
        try:
            client = distributed.Client(address, timeout=_CONNECTING)
        except Exception as error:  # of many kinds, one for each part of an address
            allowed = f"the address of a Dask scheduler that answers within {_CONNECTING} s"
            raise InvalidInput("dask", address, allowed) from error
        yield stack.enter_context(client)
