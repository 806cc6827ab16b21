"""Processes killed without warning: nothing is lost or done twice, and results are equal."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from capsule_sym import run_sweep
from tests.sweeps import chart, contents

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
    print("begun", flush=True)
    run_sweep(SWEEPS[sys.argv[2]], sys.argv[1], workers=2, resume=True)
"""


def started(store: Path, sweep: str) -> subprocess.Popen[str]:
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(store), sweep],
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


@cache
def uninterrupted(sweep: str) -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        run_sweep(SWEEPS[sweep], Path(folder) / "whole")
        return contents(Path(folder) / "whole")


def killed_at_random_moments(store: Path, kills: int) -> int:
    """Kills runs at some chunk, alone or with their process group."""
    chance = random.Random(2019)
    interrupted = 0
    for _ in range(kills):
        program = started(store, "short")
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
def test_killed_runs_end_as_an_uninterrupted_one(tmp_path: Path) -> None:
    assert killed_at_random_moments(tmp_path / "store", 10) >= 5
    run_sweep(SWEEPS["short"], tmp_path / "store", resume=True)
    assert contents(tmp_path / "store") == uninterrupted("short")


@pytest.mark.long
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
        # -B: what Python compiles on its first import would be cut at the limit, and stay so.
        [sys.executable, "-B", "-c", code],
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
