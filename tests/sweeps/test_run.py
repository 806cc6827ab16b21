"""Runs into a store: every interruption gives the same bytes."""

from __future__ import annotations

import errno
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capsule_sym import InvalidInput, inputs, run_basin, run_sweep
from capsule_sym._native import Watch, live, present
from capsule_sym._parameters import CAPSULE, Scene
from capsule_sym._sweeps import cells as cells_module
from capsule_sym._sweeps import execution as run_module
from capsule_sym._sweeps import store as store_module
from capsule_sym._sweeps.cells import compute
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._sweeps.store import NotWritten, opened
from capsule_sym.results import open_results
from tests.sweeps import chart, contents

ROOT = Path(__file__).parents[2]
SWEEP = chart()
CHUNKS = 9


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The store of an uninterrupted run on one thread."""
    path = tmp_path_factory.mktemp("whole") / "store"
    run_sweep(SWEEP, path, workers=1)
    return contents(path)


def test_a_run_says_how_its_cells_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    summary = run_sweep(SWEEP, tmp_path / "whole")
    assert (summary.success, summary.status) == (True, "complete")
    assert sum(summary.statistics["outcomes"].values()) == 120
    slow = cells_module._Cells.slow

    def failing(self: cells_module._Cells, i: int) -> None:
        if i == 4:
            raise RuntimeError("no root")
        slow(self, i)

    monkeypatch.setattr(cells_module, "core_of", lambda *_: None)
    monkeypatch.setattr(cells_module._Cells, "slow", failing)
    small = chart(3, 3, compute=("itinerary",), chunk=(3, 3))
    summary = run_sweep(small, tmp_path / "failing", workers=1)
    assert (summary.success, summary.status) == (False, "failed")
    assert summary.statistics["outcomes"]["failed"] == 1
    assert "1 failed" in summary.message
    # Earlier cells count as well.
    again = run_sweep(small, tmp_path / "failing", workers=1, resume=True)
    assert (again.computed, again.status, again.message) == (0, "failed", summary.message)


def stopping(after: int, how: Callable[[], object]) -> Callable[[int, int], None]:
    """Progress that ends a run once so many cells are done."""

    def progress(done: int, total: int) -> None:
        if done >= after:
            how()

    return progress


def interrupt() -> None:
    raise KeyboardInterrupt


def test_a_run_goes_on_after_its_time_is_over(whole, tmp_path) -> None:
    store = tmp_path / "store"
    stop = stopping(40, lambda: present().stop())
    found = run_sweep(SWEEP, store, progress=stop, max_seconds=1e9, workers=2)
    assert 40 <= found.computed == sum(found.outcomes.values()) < 120
    assert (found.success, found.status) == (False, "time-limit")
    assert "continue with --resume" in found.message
    rest = run_sweep(SWEEP, store, resume=True)
    assert (rest.success, rest.computed) == (True, 120 - found.computed)
    assert contents(store) == whole


@pytest.mark.parametrize("after", [0, 60, 120])
def test_a_run_goes_on_where_it_was_interrupted_and_a_finished_one_computes_nothing(
    after, whole, tmp_path
) -> None:
    store = tmp_path / "store"
    with pytest.raises(KeyboardInterrupt):
        run_sweep(SWEEP, store, progress=stopping(after, interrupt), workers=1)
    with open_results(store) as results:
        pending = int((results["outcome"] == CellOutcome.PENDING).sum())
    assert pending <= 120 - after
    seen: list[tuple[int, int]] = []
    summary = run_sweep(SWEEP, store, resume=True, progress=lambda *at: seen.append(at))
    assert (summary.computed, summary.damaged) == (pending, 0)
    assert contents(store) == whole
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == ((120 - pending, 120), (120, 120))
    assert run_sweep(SWEEP, store, resume=True).computed == 0
    assert contents(store) == whole


def test_a_store_goes_on_with_its_own_core_alone(tmp_path, monkeypatch) -> None:
    run_sweep(SWEEP, tmp_path / "store")
    before = contents(tmp_path / "store")
    monkeypatch.setattr(store_module, "live", lambda *_: "c-other")
    with pytest.raises(InvalidInput, match=rf"core = 'c-other': must be '{live()}', as in "):
        run_sweep(SWEEP, tmp_path / "store", resume=True)
    assert contents(tmp_path / "store") == before


@pytest.mark.parametrize("run", [run_sweep, run_basin])
def test_what_is_no_sweep_or_cannot_run_is_refused(run: Callable[..., Any], tmp_path: Path) -> None:
    store = tmp_path / "store"
    for given in ("x", None):
        told = rf"^sweep = {given!r}: must be a Sweep, as read_plan\(file\) gives$"
        with pytest.raises(InvalidInput, match=told):
            run(given, store)
    bad: list[tuple[str, Any]] = [("max_seconds", one) for one in (0.0, -1.0, math.nan, "1")]
    bad += [("workers", 0), ("workers", 1.5)]
    sweep = inputs.Sweep((inputs.Axis.of("x_r", [0.0]),)) if run is run_basin else SWEEP
    for name, value in bad:
        with pytest.raises(InvalidInput, match=f"^{name} = "):
            run(sweep, store, **{name: value})
    assert not list(tmp_path.iterdir())


def test_results_are_labelled_and_say_where_they_come_from(tmp_path: Path) -> None:
    summary = run_sweep(SWEEP, tmp_path / "store", command="capsule-sym sweep")
    assert (summary.cells, summary.computed, summary.damaged) == (120, 120, 0)
    with open_results(tmp_path / "store") as results:
        direct = compute(inputs.Sweep(SWEEP.axes, periods=40, compute=SWEEP.compute))
        for name, column in direct.columns.items():
            assert results[name].dims[:2] == ("alpha", "gamma")
            np.testing.assert_array_equal(results[name].values.reshape(column.shape), column)
            assert results[name].attrs["units"] == "1"
            assert results[name].attrs["long_name"]
        np.testing.assert_array_equal(results["gamma"], SWEEP.axes[1].values[:, 0])
        one = results.sel(alpha=2.0, gamma=5.0)
        meanings = results["itinerary"].attrs["flag_meanings"].split()
        texts = dict(zip(results["itinerary"].attrs["flag_values"], meanings, strict=True))
        assert texts[int(one["itinerary"])].split("_")[0] in {"F4", "F5"}
        assert results.attrs["omega"] == 0.8
        assert results.attrs["command"] == "capsule-sym sweep"
        assert results.attrs["kernels"] == CAPSULE.digest
        assert results.attrs["core"] == live()
        assert "numpy" in results.attrs["versions"]
        assert not {"alpha", "gamma"} & set(results.attrs)


def test_a_random_design_has_its_points_as_coordinates(tmp_path: Path) -> None:
    axis = inputs.Axis.sobol({"alpha": (0.1, 2.0), "gamma": (1.0, 5.0)}, 8, seed=1)
    run_sweep(inputs.Sweep((axis,), periods=10, compute=("final",)), tmp_path / "store")
    with open_results(tmp_path / "store") as results:
        assert results["final"].dims == ("sample", "component")
        np.testing.assert_array_equal(results["alpha"], axis.values[:, 0])
        np.testing.assert_array_equal(results["gamma"], axis.values[:, 1])
        assert set(results.coords) == {"alpha", "gamma"}


def renames(patch: pytest.MonkeyPatch, most: int) -> list[int]:
    """Lets so many files be moved to their places, counting them, until the disk is full."""
    replace, moved = os.replace, [0]

    def limited(*args: Any) -> None:
        moved[0] += 1
        if moved[0] > most:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(*args)

    patch.setattr(os, "replace", limited)
    return moved


@pytest.mark.parametrize(
    "share", [0.6, *(pytest.param(s, marks=pytest.mark.long) for s in (0.1, 0.999))]
)
def test_a_full_disk_stops_the_run_and_leaves_a_store_that_goes_on(
    share, whole, tmp_path, monkeypatch
) -> None:
    with monkeypatch.context() as patch:
        moved = renames(patch, 10**9)
        run_sweep(SWEEP, tmp_path / "all")
    with monkeypatch.context() as patch:
        renames(patch, int(share * moved[0]))
        with pytest.raises(NotWritten, match=r"No space left on device.*--resume"):
            run_sweep(SWEEP, tmp_path / "store")
    run_sweep(SWEEP, tmp_path / "store", resume=True)
    assert contents(tmp_path / "store") == whole


def test_two_runs_on_one_store_are_refused(tmp_path: Path) -> None:
    with (
        opened(tmp_path / "store", SWEEP, resume=False, command=""),
        pytest.raises(InvalidInput, match="another run is writing"),
    ):
        run_sweep(SWEEP, tmp_path / "store", resume=True)
    run_sweep(SWEEP, tmp_path / "store", resume=True)


def test_a_store_is_not_mixed_with_anything_else(tmp_path, monkeypatch) -> None:
    run_sweep(SWEEP, tmp_path / "store")
    run_sweep(SWEEP, tmp_path / "headless")
    (tmp_path / "headless" / "sweep.json").unlink()
    before = contents(tmp_path / "headless")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").touch()
    for name, sweep, resume, told in (
        ("store", SWEEP, False, "--resume"),
        ("store", chart(periods=41), True, "periods = 41: must be 40"),
        ("other", SWEEP, True, "new, empty"),
        ("headless", SWEEP, True, "new, empty"),
    ):
        with pytest.raises(InvalidInput, match=told):
            run_sweep(sweep, tmp_path / name, resume=resume)
    assert contents(tmp_path / "headless") == before
    (tmp_path / "file").touch()
    with pytest.raises(InvalidInput, match="a directory"):
        run_sweep(SWEEP, tmp_path / "file")
    with pytest.raises(InvalidInput, match="a directory that holds a sweep"):
        open_results(tmp_path / "other")
    monkeypatch.setattr(Scene, "digest", "other kernels")
    with pytest.raises(InvalidInput, match="kernels = 'other kernels'"):
        run_sweep(SWEEP, tmp_path / "store", resume=True)


def test_the_record_of_a_chunk_holds_its_words_and_reasons(tmp_path, monkeypatch) -> None:
    def failing(part: inputs.Sweep, watch: Watch) -> Any:
        return compute(part, watch)._replace(reasons={"3": "no luck"})

    monkeypatch.setattr(run_module, "compute", failing)
    run_sweep(SWEEP, tmp_path / "store")
    record = json.loads((tmp_path / "store/chunks/000000/000000000.json").read_text())
    assert record["reasons"] == {"3": "no luck"}
    assert sum(cells for _, cells in record["itineraries"].values()) <= 20


@pytest.mark.long
def test_memory_does_not_grow_with_the_sweep() -> None:
    """Peak memory of a process is that of the chunks under way, however many there are."""
    code = (
        "import resource, sys, tempfile\n"
        "from capsule_sym import run_sweep\n"
        "from tests.sweeps import chart\n"
        "side = int(sys.argv[1])\n"
        "with tempfile.TemporaryDirectory() as store:\n"
        "    run_sweep(chart(side, side, periods=4, chunk=(32, 32)), store, workers=2)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
    )
    peak = {}
    for side in (64, 512):
        command = [sys.executable, "-c", code, str(side)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        peak[side] = int(done.stdout) / 1024  # from KiB
    # The results of 262,144 cells alone are 11 MB, and their states on the way 200 MB.
    assert peak[512] - peak[64] < 8
