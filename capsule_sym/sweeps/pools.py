"""What computes chunks: threads, processes, or an executor that is given; how it is stopped."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from capsule_sym.errors import CapsuleError
from capsule_sym.sweeps.cells import Block, compute
from capsule_sym.sweeps.sweep import Sweep

KINDS = ("threads", "processes")
PATIENCE = 5.0
"""Seconds without a finished chunk after which a pool is asked how it is."""


class Lost(CapsuleError):
    """A chunk could not be computed. What was finished is kept, and the store can be resumed."""


class Pool:
    """An executor to which chunks are given."""

    def __init__(self, executor: Executor) -> None:
        self.executor = executor

    def submit(self, part: Sweep) -> Future[Block]:
        """Has a chunk computed."""
        return self.executor.submit(compute, part)

    def waited(self) -> None:
        """Called when nothing was finished for some time."""


class _Threads(Pool):
    def __init__(self, workers: int) -> None:
        super().__init__(ThreadPoolExecutor(workers))
        self.stop = threading.Event()

    def submit(self, part: Sweep) -> Future[Block]:
        return self.executor.submit(compute, part, self.stop.is_set)


class _Processes(Pool):
    """Processes are spawned, so that none holds the store's lock when this one is killed."""

    def __init__(self, workers: int) -> None:
        context = get_context("spawn")
        # Nothing is ever sent: it is closed when this process leaves the pool, or dies.
        reader, self.lifeline = context.Pipe(duplex=False)
        super().__init__(
            ProcessPoolExecutor(workers, context, initializer=_follow, initargs=(reader,))
        )

    def submit(self, part: Sweep) -> Future[Block]:
        with undisturbed():  # processes are started when they are needed
            return super().submit(part)


@contextmanager
def pool_of(executor: str | Executor, workers: int) -> Iterator[Pool]:
    """The pool of a kind, or around an executor that is given and stays open.

    Left by an exception, such as an interrupt, it does not wait for the chunks under way: threads
    stop as soon as they can, processes at once.
    """
    if isinstance(executor, Executor):
        yield Pool(executor)
        return
    pool = _Threads(workers) if executor == "threads" else _Processes(workers)
    try:
        yield pool
    except BaseException:
        if isinstance(pool, _Threads):
            pool.stop.set()
        else:
            pool.lifeline.close()
        pool.executor.shutdown(wait=False, cancel_futures=True)
        raise
    pool.executor.shutdown()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Where processes are started: Ctrl-C is for this one, afterwards, and never for those."""
    came: list[Any] = []
    main = threading.current_thread() is threading.main_thread()
    # A blocked signal stays so in the processes that this thread starts. But another thread may
    # take the one that is for this process.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    handler = signal.getsignal(signal.SIGINT)
    if main and callable(handler):
        signal.signal(signal.SIGINT, lambda *at: came.append(at))
    try:
        yield
    finally:
        if main and callable(handler):
            signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    if came and callable(handler):
        handler(*came[0])


def _follow(lifeline: Connection) -> None:
    """A worker leaves Ctrl-C to its parent, and ends when the parent does, or wants it to."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        lifeline.poll(None)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
