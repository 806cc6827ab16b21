"""Dask clusters that fail: each failure is one line, and waiting is said."""

from __future__ import annotations

import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from capsule_sym import InvalidInput
from capsule_sym._sweeps.cluster import DaskPool, client_of
from capsule_sym._sweeps.pools import Lost
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
    """The executor of a client whose scheduler answers in turn as it is told."""

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
    ends = "; Ctrl-C ends the run, and keeps what is finished"
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
SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main\nif __name__ == '__main__': main()"


def program(code: str, *arguments: str) -> subprocess.Popen[bytes]:
    silent = subprocess.DEVNULL
    command = [sys.executable, "-c", code, *arguments, "--no-dashboard"]
    return subprocess.Popen(command, stdout=silent, stderr=silent)


def worker_of(address: str) -> subprocess.Popen[bytes]:
    return program(WORKER, address, "--nthreads", "1", "--no-nanny")


class Cluster:
    """A scheduler and one worker, as processes of their own."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = str(free.getsockname()[1])
        self.address = f"tcp://127.0.0.1:{port}"
        self.scheduler = program(SCHEDULER, "--host", "127.0.0.1", "--port", port)
        self.workers = [worker_of(self.address)]

    def close(self) -> None:
        for process in (self.scheduler, *self.workers):
            process.kill()
            process.wait()


@pytest.fixture
def cluster() -> Iterator[Cluster]:
    made = Cluster()
    yield made
    made.close()


@contextmanager
def sweeping(
    cluster: Cluster, tmp_path: Path, periods: int
) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    from distributed import Client

    with Client(cluster.address, timeout=120) as client:
        client.wait_for_workers(1)
    path, store = tmp_path / "sweep.toml", tmp_path / "store"
    path.write_text(FILE.format(periods=periods))
    command = [sys.executable, "-m", "capsule_sym", "sweep", str(path), "--store", str(store)]
    running = subprocess.Popen(
        [*command, "--dask", cluster.address],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield running, store
    finally:
        running.kill()


def wait_for_chunks(running: subprocess.Popen[str], store: Path, count: int) -> None:
    while len(list((store / "chunks").rglob("*.json"))) < count:
        assert running.poll() is None
        time.sleep(0.05)


@pytest.mark.long
def test_a_scheduler_that_dies_is_told_in_one_line(cluster: Cluster, tmp_path: Path) -> None:
    with sweeping(cluster, tmp_path, 100_000) as (running, store):
        wait_for_chunks(running, store, 2)
        cluster.scheduler.kill()
        out, errors = running.communicate(timeout=90)
    assert (running.returncode, out) == (1, "")
    assert errors.startswith("error: the connection to the Dask scheduler is lost")
    assert errors.count("\n") == 1


@pytest.mark.long
def test_a_run_without_workers_waits_for_others_and_says_so(
    cluster: Cluster, tmp_path: Path
) -> None:
    with sweeping(cluster, tmp_path, 100_000) as (running, store):
        wait_for_chunks(running, store, 2)
        cluster.workers[0].kill()
        assert running.stderr is not None
        assert running.stderr.readline().startswith("waiting: the Dask cluster has no workers")
        done = len(list((store / "chunks").rglob("*.json")))
        cluster.workers.append(worker_of(cluster.address))
        wait_for_chunks(running, store, done + 2)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=90)
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
        Client(cluster.address, timeout=120) as client,
    ):
        while not any(client.processing().values()):
            time.sleep(0.1)
        time.sleep(1)
        running.send_signal(end)
        running.communicate(timeout=90)
        assert client.submit(os.getpid).result(timeout=90) == cluster.workers[0].pid
