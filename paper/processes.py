"""Worker processes: Ctrl-C goes to the parent alone, and they end with it."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.resource_tracker import ensure_running

from capsule_sym._processes import deferred


def spawning(workers: int) -> ProcessPoolExecutor:
    """Executor whose processes are started one by one as work is given, `undisturbed`.

    They are spawned, so that none inherits a lock if this process is killed.
    """
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=follow)


def end(executor: ProcessPoolExecutor) -> None:
    """End the processes of an executor at once, including work in progress."""
    for process in list((executor._processes or {}).values()):
        process.terminate()
    executor.shutdown(cancel_futures=True)  # they die at once


@contextmanager
def undisturbed() -> Iterator[None]:
    """Context in which to start processes: Ctrl-C waits, and never reaches them."""
    with deferred(), _blocked():
        yield


@contextmanager
def _blocked() -> Iterator[None]:
    """Ctrl-C is kept from the processes that this thread starts, until they `follow`."""
    if sys.platform == "win32":  # there signals are not inherited, and workers ignore them soon
        yield
        return
    ensure_running()  # which starts a process, and unblocks what is blocked here, if done later
    # A blocked signal stays so in the processes that this thread starts. But another thread may
    # take the one that is for this process.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def follow() -> None:
    """A worker leaves Ctrl-C to its parent, and ends when the parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
