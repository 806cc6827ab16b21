"""Dask clusters that fail: each failure is one line, and waiting is said."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from capsule_sym import InvalidInput
from capsule_sym._sweeps.pools import DaskPool, Lost, client_of
from tests.sweeps import chart

pytest.importorskip("distributed")


def test_an_address_that_refuses_is_given_up_in_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def refusing(address: str, timeout: float) -> None:
        asked.append(timeout)
        raise OSError(f"Timed out trying to connect to {address}")

    monkeypatch.setattr("distributed.Client", refusing)
    with (
        pytest.raises(InvalidInput, match=r"dask = 'tcp://127\.0\.0\.1:1': .* answers within 10 s"),
        client_of("tcp://127.0.0.1:1", None),
    ):
        pass
    assert asked == [10]


class FakeExecutor:
    """Executor of a client whose scheduler gives prescribed answers in turn."""

    def __init__(self, *answers: Any) -> None:
        self.answers = list(answers)
        self._client = SimpleNamespace(sync=self.sync, scheduler=SimpleNamespace(ncores=None))

    def sync(self, _: Any, callback_timeout: float) -> Any:
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def submit(self, *_: Any) -> None:
        raise RuntimeError("Tried sending message after closing")


def test_waiting_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    some, none = {"tcp://one": 1}, dict[str, int]()
    pool = DaskPool(FakeExecutor(some, none, none, some, none, TimeoutError(), OSError()))
    with caplog.at_level(logging.WARNING, "capsule_sym"):
        for _ in range(7):
            pool.waited()
    ends = "; Ctrl-C ends the run and keeps finished chunks"
    nobody = f"waiting: the Dask cluster has no workers{ends}"
    silence = f"waiting: the Dask scheduler does not answer{ends}"
    assert [record.getMessage() for record in caplog.records] == [nobody, nobody, silence]


def test_a_client_without_a_scheduler_has_lost_its_chunks() -> None:
    with pytest.raises(Lost, match="the connection to the Dask scheduler is lost"):
        DaskPool(FakeExecutor()).submit(chart())


FILE = """
periods = {periods}
chunk = [4]
[axes]
alpha = {{ from = 0.5, to = 2.0, count = 400 }}
"""
PATIENCE = 90  # seconds after which something stands still, however busy the machine is
SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main\nif __name__ == '__main__': main()"


def until(holds: Callable[[], object], *processes: subprocess.Popen[Any]) -> None:
    """Waits for a state that processes come to, and fails where one of them ends before."""
    over = time.monotonic() + PATIENCE
    while not holds():
        assert [process.poll() for process in processes] == [None] * len(processes)
        assert time.monotonic() < over
        time.sleep(0.05)


class Cluster:
    """A scheduler, at a port that it chooses, and one worker, as processes of their own."""

    def __init__(self, stack: ExitStack, folder: Path) -> None:
        self.stack, said = stack, folder / "scheduler.json"
        where = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(said))
        self.scheduler = self.start(SCHEDULER, *where)
        until(lambda: said.exists() and said.read_text().endswith("}"), self.scheduler)
        self.address: str = json.loads(said.read_text())["address"]
        self.workers = [self.worker()]

    def start(self, code: str, *arguments: str) -> subprocess.Popen[bytes]:
        silent = subprocess.DEVNULL
        command = [sys.executable, "-c", code, *arguments, "--no-dashboard"]
        process = subprocess.Popen(command, stdout=silent, stderr=silent)
        self.stack.callback(process.wait)
        self.stack.callback(process.kill)
        return process

    def worker(self) -> subprocess.Popen[bytes]:
        """Another worker."""
        return self.start(WORKER, self.address, "--nthreads", "1", "--no-nanny")


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    with ExitStack() as stack:
        yield Cluster(stack, tmp_path)


@contextmanager
def sweeping(
    cluster: Cluster, tmp_path: Path, periods: int
) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    path, store = tmp_path / "sweep.toml", tmp_path / "store"
    path.write_text(FILE.format(periods=periods))
    command = [sys.executable, "-m", "capsule_sym", "sweep", str(path), "--out", str(store)]
    with subprocess.Popen(
        [*command, "--dask", cluster.address],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        try:
            yield running, store
        finally:
            running.kill()


def chunks(store: Path) -> int:
    return len(list((store / "chunks").rglob("*.json")))


@pytest.mark.long
def test_a_scheduler_that_dies_is_told_in_one_line(cluster: Cluster, tmp_path: Path) -> None:
    with sweeping(cluster, tmp_path, 100_000) as (running, store):
        until(lambda: chunks(store) >= 2, running, cluster.scheduler)
        cluster.scheduler.kill()
        out, errors = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out) == (1, "")
    assert errors.startswith("error: the connection to the Dask scheduler is lost")
    assert errors.count("\n") == 1


@pytest.mark.long
def test_a_run_without_workers_waits_for_others_and_says_so(
    cluster: Cluster, tmp_path: Path
) -> None:
    with sweeping(cluster, tmp_path, 100_000) as (running, store):
        until(lambda: chunks(store) >= 2, running, cluster.scheduler)
        cluster.workers[0].kill()
        assert running.stderr is not None
        assert running.stderr.readline().startswith("waiting: the Dask cluster has no workers")
        done = chunks(store)
        cluster.workers.append(cluster.worker())
        until(lambda: chunks(store) >= done + 2, running, cluster.scheduler)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=PATIENCE)
    assert running.returncode == 130
    assert errors.startswith("error: interrupted: ")
    assert errors.count("\n") == 1


@pytest.mark.long
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_a_worker_is_free_again_when_nobody_waits_for_its_chunk(
    end: signal.Signals, cluster: Cluster, tmp_path: Path
) -> None:
    from distributed import Client

    with (
        sweeping(cluster, tmp_path, 10**10) as (running, _),
        Client(cluster.address, timeout=PATIENCE) as client,
    ):

        def begun() -> bool:
            # Without a limit a client waits for ever if its scheduler dies.
            stacks = client.sync(client.scheduler.call_stack, callback_timeout=PATIENCE)
            return any(stacks.values())

        until(begun, running, cluster.scheduler)
        running.send_signal(end)
        running.communicate(timeout=PATIENCE)
        assert client.submit(os.getpid).result(timeout=PATIENCE) == cluster.workers[0].pid
