"""Runs into a store: every executor, every interruption and every damage gives the same bytes."""

from __future__ import annotations

import errno
import json
import math
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, nullcontext
from multiprocessing import get_context
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from capsule_sym import CapsuleError, InvalidInput, inputs, run_basin, run_sweep
from capsule_sym._native import check_time, live, present
from capsule_sym._parameters import CAPSULE, Scene
from capsule_sym._sweeps import cells as cells_module
from capsule_sym._sweeps import execution as run_module
from capsule_sym._sweeps import store as store_module
from capsule_sym._sweeps.cells import compute
from capsule_sym._sweeps.execution import Lost
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._sweeps.results import Held
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


class Here(Executor):
    """Computes in the thread that submits, as a user's own executor may, and counts the chunks.

    It stops after so many, and fails under some, as where workers die. Like Dask, it would take two
    calls with equal arguments for one.
    """

    keys: ClassVar[set[bytes]] = set()

    def __init__(self, stop_after: int = 10**9, fails: tuple[int, ...] = ()) -> None:
        self.parts: list[inputs.Sweep] = []
        self.stop_after, self.fails = stop_after, fails

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if len(self.parts) == self.stop_after:
            raise KeyboardInterrupt
        future: Future[Any] = Future()
        key = pickle.dumps(args[1:])
        assert key not in self.keys
        self.keys.add(key)
        try:
            if len(self.parts) in self.fails:
                raise MemoryError("no room")
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        self.parts.append(pickle.loads(args[2]))
        return future


@contextmanager
def executor_of(kind: str) -> Iterator[Executor | None]:
    """Executor of each kind that a run may have."""
    with ExitStack() as stack:
        if kind == "dask":
            distributed: Any = pytest.importorskip("distributed")
            how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
            cluster = stack.enter_context(distributed.LocalCluster(**how))
            yield stack.enter_context(distributed.Client(cluster)).get_executor()
        elif kind == "processes":
            yield stack.enter_context(ProcessPoolExecutor(2, get_context("spawn")))
        else:
            yield stack.enter_context(ThreadPoolExecutor(1)) if kind == "own" else None


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize(
    "kind",
    ["threads", "own", *(pytest.param(k, marks=pytest.mark.long) for k in ("processes", "dask"))],
)
def test_executors_give_equal_results_also_after_their_time_is_over(kind, whole, tmp_path) -> None:
    told = []

    def stop(done: int, total: int) -> None:
        told.append(done)
        if done > 40:
            present().stop()

    store = tmp_path / "store"
    with executor_of(kind) as own:
        how: dict[str, Any] = {"executor": own, "workers": 2}
        found = run_sweep(SWEEP, store, progress=stop, max_seconds=1e9, **how)
        assert 40 < found.computed == sum(found.outcomes.values()) == told[-1] < 120
        assert (found.success, found.status) == (False, "time-limit")
        assert "continue with --resume" in found.message
        rest = run_sweep(SWEEP, store, resume=True, **how)
    assert (rest.success, rest.computed) == (True, 120 - found.computed)
    assert contents(store) == whole


def test_a_limit_of_time_fails_no_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slow = cells_module._Cells.slow

    def late(self: cells_module._Cells, i: int) -> None:
        if i == 3:
            present().stop()
        check_time()
        slow(self, i)

    monkeypatch.setattr(cells_module, "core_of", lambda *_: None)
    monkeypatch.setattr(cells_module._Cells, "slow", late)
    small = chart(4, 2, compute=("itinerary",), chunk=(4, 1))
    found = run_sweep(small, tmp_path / "store", executor=Here(), workers=1, max_seconds=1e9)
    assert (found.status, found.outcomes) == ("time-limit", {})


@pytest.mark.parametrize("run", [run_sweep, run_basin])
def test_what_is_no_sweep_or_cannot_run_is_refused(run: Callable[..., Any], tmp_path: Path) -> None:
    store = tmp_path / "store"
    for given in ("x", None):
        told = rf"^sweep = {given!r}: must be a Sweep, as load_sweep\(file\) gives$"
        with pytest.raises(InvalidInput, match=told):
            run(given, store)
    bad: list[tuple[str, Any]] = [("max_seconds", one) for one in (0.0, -1.0, math.nan, "1")]
    bad += [("workers", 0), ("workers", 1.5), ("executor", "fibres"), ("executor", "threads")]
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


@pytest.mark.parametrize("after", [0, 5, CHUNKS])
def test_a_run_goes_on_where_it_was_interrupted_and_a_finished_one_computes_nothing(
    after, whole, tmp_path
) -> None:
    store, rest = tmp_path / "store", Here()
    with pytest.raises(KeyboardInterrupt) if after < CHUNKS else nullcontext():
        run_sweep(SWEEP, store, executor=Here(after), workers=1)
    with open_results(store) as results:
        pending = int((results["outcome"] == CellOutcome.PENDING).sum())
    seen: list[tuple[int, int]] = []
    how: Any = {"resume": True, "progress": lambda *at: seen.append(at)}
    summary = run_sweep(SWEEP, store, executor=rest, workers=1, **how)
    assert len(rest.parts) == CHUNKS - after
    assert summary.computed == pending == sum(part.size for part in rest.parts)
    assert contents(store) == whole
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == ((120 - pending, 120), (120, 120))


def test_a_damaged_chunk_alone_is_computed_again(whole: dict[str, bytes], tmp_path: Path) -> None:
    for key, data in whole.items():
        (tmp_path / key).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / key).write_bytes(data)
    for name in ("outcome/c/1/2", "final/c/1/2/0"):
        data = whole[f"results.zarr/{name}"]
        (tmp_path / "results.zarr" / name).write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    again = Here()
    assert run_sweep(SWEEP, tmp_path, executor=again, resume=True).damaged == 1
    assert len(again.parts) == 1
    assert contents(tmp_path) == whole


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
    for name in ("sweep.json", "chunks/sweep.copy"):
        (tmp_path / "headless" / name).unlink()
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


def test_a_store_goes_on_with_another_core_only_if_that_is_wanted(tmp_path, monkeypatch) -> None:
    here = live()
    with pytest.raises(KeyboardInterrupt):
        run_sweep(SWEEP, tmp_path / "store", executor=Here(5), workers=1)
    for module in (cells_module, store_module):
        monkeypatch.setattr(module, "live", lambda *_: "c-other")
    before = contents(tmp_path / "store")
    with pytest.raises(InvalidInput, match=rf"core = 'c-other': must be '{here}', .*--any-core"):
        run_sweep(SWEEP, tmp_path / "store", resume=True)
    assert contents(tmp_path / "store") == before
    run_sweep(SWEEP, tmp_path / "store", resume=True, any_core=True)
    tally = Held(tmp_path / "store").tally()
    assert set(tally.cores) == {here, "c-other"}
    assert sum(tally.cores.values()) == 120
    with open_results(tmp_path / "store") as results:
        assert results.attrs["core"] == "; ".join(sorted([here, "c-other"]))


@pytest.mark.parametrize(
    ("change", "told"),
    [({"kernels": "x"}, "a worker has the kernels x"), ({"core": "c-x"}, "core = 'c-x'")],
)
def test_a_worker_with_another_core_is_told(change, told, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(run_module, "compute", lambda part: compute(part)._replace(**change))
    with pytest.raises(CapsuleError, match=told):
        run_sweep(SWEEP, tmp_path / "store", executor=Here())
    if "core" in change:
        run_sweep(SWEEP, tmp_path / "store", executor=Here(), resume=True, any_core=True)
        assert set(Held(tmp_path / "store").tally().cores) == {"c-x"}


def test_no_more_chunks_are_under_way_than_workers(tmp_path, monkeypatch) -> None:
    """A chunk is written before its worker has the next: what a kill loses is bounded."""
    lock, unwritten, most = threading.Lock(), 0, 0
    publish = store_module.Store.publish

    def started(part: inputs.Sweep) -> Any:
        nonlocal unwritten, most
        with lock:
            unwritten += 1
            most = max(most, unwritten)
        return compute(part)

    def published(self: Any, index: int, block: Any) -> None:
        nonlocal unwritten
        publish(self, index, block)
        with lock:
            unwritten -= 1

    monkeypatch.setattr(run_module, "compute", started)
    monkeypatch.setattr(store_module.Store, "publish", published)
    with ThreadPoolExecutor(8) as pool:
        run_sweep(SWEEP, tmp_path / "store", executor=pool, workers=3)
    assert (most, unwritten) == (3, 0)


@pytest.mark.parametrize(
    ("deadly", "done"), [((4,), 8), ((0, 7), 7), ((0, 1, 2, 3), 0), ((1, 3, 8), 6)]
)
def test_chunks_that_cannot_be_computed_are_named_after_all_others_or_three(
    deadly, done, tmp_path
) -> None:
    with pytest.raises(Lost) as told:
        run_sweep(SWEEP, tmp_path / "store", executor=Here(fails=deadly), workers=1)
    named = "; ".join(f"chunk {index}: MemoryError: no room" for index in deadly[:3])
    assert str(told.value) == named
    assert len(list((tmp_path / "store" / "chunks").rglob("*.json"))) == done


def test_the_record_of_a_chunk_holds_its_words_and_reasons(tmp_path, monkeypatch) -> None:
    def failing(part: inputs.Sweep) -> Any:
        return compute(part)._replace(reasons={"3": "no luck"})

    monkeypatch.setattr(run_module, "compute", failing)
    run_sweep(SWEEP, tmp_path / "store", executor=Here())
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
