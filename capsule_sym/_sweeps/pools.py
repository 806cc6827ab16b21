"""What computes chunks: threads, processes, or an executor that is given; how it is stopped."""

from __future__ import annotations

from concurrent.futures import Executor, Future, ThreadPoolExecutor

from capsule_sym._errors import CapsuleError
from capsule_sym._native import Watch
from capsule_sym._processes import end, spawning, undisturbed
from capsule_sym._sweeps.cells import Block, compute
from capsule_sym._sweeps.sweep import Sweep

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

    def died(self, error: Exception) -> bool:
        """Whether a chunk failed because its worker died, and may be given again."""
        return False

    def waited(self) -> None:
        """Called when nothing was finished for some time."""

    def lost(self) -> CapsuleError:
        """What a future that nobody here cancelled means."""
        return Lost("the executor cancelled a chunk")

    def abandon(self) -> None:
        """Ends without what is under way, and without waiting for it."""
        self.executor.shutdown(wait=False, cancel_futures=True)


class Threads(Pool):
    def __init__(self, workers: int) -> None:
        super().__init__(ThreadPoolExecutor(workers))
        self.watch = Watch()

    def submit(self, part: Sweep) -> Future[Block]:
        return self.executor.submit(compute, part, self.watch)

    def abandon(self) -> None:
        self.watch.stop()
        super().abandon()


class Processes(Pool):
    def __init__(self, workers: int) -> None:
        self.processes = spawning(workers)
        super().__init__(self.processes)

    def submit(self, part: Sweep) -> Future[Block]:
        with undisturbed():  # processes are started when they are needed
            return super().submit(part)

    def abandon(self) -> None:
        end(self.processes)
