"""Processes killed without warning: nothing is lost or done twice, and results are equal."""

from __future__ import annotations

import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from capsule_sym import run_sweep
from capsule_sym._sweeps.pools import Lost
from tests.sweeps import chart, contents, deadly_corner

ROOT = Path(__file__).parents[2]
SWEEPS = {
    "short": chart(40, 20, periods=500, chunk=(4, 4)),  # half a second of the core, in 50 chunks
    "long": chart(80, 40, periods=2000, chunk=(4, 4)),  # 10 seconds of the core, in 200 chunks
}

PROGRAM = """
import sys
from pathlib import Path
from tests.sweeps.test_kill import SWEEPS
from capsule_sym import run_sweep

if __name__ == "__main__":
    if sys.argv[2] == "dask":
        from distributed import Client, LocalCluster

        cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
        executor = Client(cluster).get_executor()
    else:
        executor = None
    print("begun", flush=True)
    run_sweep(SWEEPS[sys.argv[3]], sys.argv[1], executor=executor, workers=2, resume=True)
"""


def started(store: Path, executor: str, sweep: str) -> subprocess.Popen[str]:
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(store), executor, sweep],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert program.stdout is not None
    assert program.stdout.readline() == "begun\n"
    return program


def finished(store: Path) -> dict[str, float]:
    """The chunks that are finished, and when each was."""
    return {p.name: p.stat().st_mtime for p in (store / "chunks").rglob("*.json")}


def workers_of(process: int) -> list[int]:
    psutil = pytest.importorskip("psutil")
    found = []
    for child in psutil.Process(process).children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):  # it ended meanwhile, or waits to be reaped
            if "resource_tracker" not in " ".join(child.cmdline()):
                found.append(child.pid)
    return found


@cache
def uninterrupted(sweep: str) -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        run_sweep(SWEEPS[sweep], Path(folder) / "whole")
        return contents(Path(folder) / "whole")


def killed_at_random_moments(store: Path, executor: str, kills: int) -> int:
    """Kills runs, or clients alone with their process group left to itself, at some chunk."""
    chance = random.Random(2019)
    interrupted = 0
    for _ in range(kills):
        program = started(store, executor, "short")
        before = finished(store)
        least = len(before) + chance.randint(0, 40 // kills)
        while len(finished(store)) < least:
            assert program.poll() is None
            time.sleep(0.002)
        if chance.random() < 0.5:
            os.killpg(program.pid, signal.SIGKILL)
        else:
            program.kill()
        program.communicate()
        after = finished(store)
        # Finished chunks are unchanged: they are neither lost nor computed again.
        assert before.items() <= after.items()
        interrupted += len(after) < 50
    return interrupted


@pytest.mark.long
@pytest.mark.parametrize("executor", ["threads", "dask"])
def test_killed_runs_end_as_an_uninterrupted_one(executor: str, tmp_path: Path) -> None:
    assert killed_at_random_moments(tmp_path / "store", executor, 10) >= 5
    run_sweep(SWEEPS["short"], tmp_path / "store", resume=True)
    assert contents(tmp_path / "store") == uninterrupted("short")


def worker_deaths(store: Path, deaths: int) -> int:
    """Kill workers at random moments during one run; returns the number killed.

    Between two kills a chunk is finished: workers that only die are not replaced for ever.
    """
    chance = random.Random(2019)
    program = started(store, "dask", "long")
    killed = 0
    while killed < deaths and program.poll() is None:
        before = len(finished(store))
        while len(finished(store)) == before and program.poll() is None:
            time.sleep(0.01)
        time.sleep(chance.uniform(0.0, 0.5))
        workers = workers_of(program.pid) if program.poll() is None else []
        if workers:
            os.kill(chance.choice(workers), signal.SIGKILL)
            killed += 1
    _, said = program.communicate(timeout=300)
    assert program.returncode == 0, said
    return killed


@pytest.mark.long
def test_a_run_outlives_ten_of_its_workers(tmp_path: Path) -> None:
    assert worker_deaths(tmp_path / "store", 10) == 10
    assert contents(tmp_path / "store") == uninterrupted("long")


def test_a_chunk_under_which_a_process_of_a_given_pool_dies_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("capsule_sym._sweeps.pools.compute", deadly_corner)
        with (
            ProcessPoolExecutor(1, get_context("spawn")) as pool,
            pytest.raises(Lost, match=r"^chunk 8: BrokenProcessPool: A process .* terminated"),
        ):
            run_sweep(chart(), tmp_path / "store", executor=pool, workers=1)
    assert len(finished(tmp_path / "store")) == 8
    assert run_sweep(chart(), tmp_path / "store", resume=True).computed == 4
    run_sweep(chart(), tmp_path / "whole")
    assert contents(tmp_path / "store") == contents(tmp_path / "whole")


def test_a_file_that_may_not_grow_stops_the_run_clearly(tmp_path: Path) -> None:
    """The operating system itself refuses to write, as it does on a full disk."""
    limit = 4096

    def limited() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    sweep = chart(40, 40, periods=3, chunk=(40, 40))
    code = (
        "from tests.sweeps import chart\n"
        "from capsule_sym import run_sweep\n"
        f"run_sweep(chart(40, 40, periods=3, chunk=(40, 40)), {str(tmp_path / 'store')!r})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        preexec_fn=limited,
    )
    assert done.returncode == 1
    assert "NotWritten" in done.stderr.splitlines()[-1]
    assert "File too large" in done.stderr
    run_sweep(sweep, tmp_path / "store", resume=True)
    run_sweep(sweep, tmp_path / "other")
    assert contents(tmp_path / "store") == contents(tmp_path / "other")
