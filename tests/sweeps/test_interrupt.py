"""Sweeps that are interrupted: they end at once, with one line on the kept cells."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Timer

import pytest

from capsule_sym import inputs, run_sweep
from capsule_sym._native import Watch, core
from capsule_sym._sweeps import cells
from capsule_sym._sweeps.cells import Abandoned, Block, compute
from capsule_sym._sweeps.store import Store
from tests.sweeps import chart

DAYS = inputs.Sweep((inputs.Axis.linear("alpha", 0.5, 2.0, 16),), periods=10**10, chunk=(4,))
FILE = """
periods = 10_000_000_000
chunk = [4]
[axes]
alpha = { from = 0.5, to = 2.0, count = 16 }
"""


@pytest.mark.parametrize("compiled", [True, False])
def test_a_chunk_of_days_stops_when_it_is_not_wanted(compiled, monkeypatch) -> None:
    monkeypatch.setattr(cells, "core_of", lambda *_: core if compiled else None)
    watch = Watch()
    Timer(0.3, watch.stop).start()
    with pytest.raises(Abandoned):
        compute(DAYS, watch)


@pytest.mark.parametrize("at", [1, 3])
def test_a_chunk_that_is_written_is_counted_whenever_the_interrupt_comes(
    at, tmp_path, monkeypatch
) -> None:
    publish, written = Store.publish, []

    def published(self: Store, index: int, block: Block) -> None:
        publish(self, index, block)
        written.append(index)
        if len(written) == at:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Store, "publish", published)
    sweep = chart()
    with pytest.raises(KeyboardInterrupt) as told:
        run_sweep(sweep, tmp_path / "store", workers=1)
    cells = sum(map(sweep.cells_in, written))
    assert cells > 0
    assert str(told.value).startswith(f"{cells} of 120 cells kept in ")


@pytest.mark.parametrize("later", [0.0, pytest.param(6.0, marks=pytest.mark.long)])
def test_ctrl_c_ends_a_sweep_of_days_in_one_line(later: float, tmp_path: Path) -> None:
    """The terminal sends it to all processes at once, while they start and when they work."""
    path, store = tmp_path / "days.toml", tmp_path / "store"
    path.write_text(FILE)
    command = [sys.executable, "-m", "capsule_sym", "sweep", str(path), "--out", str(store)]
    program = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    while not (store / "sweep.json").exists():
        assert program.poll() is None
        time.sleep(0.01)
    time.sleep(later)
    os.killpg(program.pid, signal.SIGINT)
    try:
        out, errors = program.communicate(timeout=90)
    finally:
        program.kill()
    assert (program.returncode, out) == (130, "")
    kept = (f": 0 of 16 cells kept in {store};", f": no cell was started in {store}")
    assert errors.startswith("error: interrupted")
    assert errors.count("\n") == 1
    assert any(said in errors for said in kept)
