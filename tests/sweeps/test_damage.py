"""Stores with any file damaged: each is repaired byte for byte, or one line gives the reason."""

from __future__ import annotations

import json
import os
import re
import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from capsule_sym import CapsuleError, InvalidInput, Parameters, run_basin, run_sweep
from capsule_sym._cli import main
from capsule_sym._sweeps.files import move, place, sealed
from capsule_sym._sweeps.results import info_record
from capsule_sym.inputs import Axis, Sweep
from capsule_sym.results import open_results
from tests.sampling import sampled, some
from tests.sweeps import chart, contents

SMALL = chart(4, 3, periods=5, compute=("itinerary",), chunk=(2, 3))
STARTS = (Axis.of("x_r", [-0.5, 0.5]), Axis.of("v_r", [0.0, 1.0, 2.0]))

Run = Callable[..., Any]


def run_small(path: Path, **how: Any) -> int:
    return run_sweep(SMALL, path, workers=1, **how).damaged


def run_small_basin(path: Path, **how: Any) -> int:
    sweep = Sweep(STARTS, Parameters(alpha=1.2), periods=100, chunk=(1, 3))
    return run_basin(sweep, path, workers=1, **how)[0].damaged


KINDS: dict[str, Run] = {"sweep": run_small, "basin": run_small_basin}


@pytest.fixture(scope="module")
def stores(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Finished stores by kind, which no test may change."""
    made: dict[str, Path] = {}

    def store(kind: str) -> Path:
        if kind not in made:
            made[kind] = tmp_path_factory.mktemp(kind) / "store"
            KINDS[kind](made[kind])
        return made[kind]

    return store


def copied(whole: Path, path: Path) -> Path:
    """A copy of a store."""
    shutil.copytree(whole, path)
    return path


def delete(path: Path) -> None:
    path.unlink()


def truncate(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] or b"x")


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes() or b"x")
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def folder(path: Path) -> None:
    path.unlink()
    (path / "thesis").mkdir(parents=True)


def link(path: Path) -> None:
    """Another file in its place, with the same bytes at that."""
    other = path.parents[1] / f"other {path.name}"
    path.rename(other)
    path.symlink_to(other)


DAMAGES = (delete, truncate, flip, folder, link)


def damaged_once(
    kind: str, whole: Path, path: Path, name: str, damage: Callable[[Path], None]
) -> None:
    """Damages one file of a copy and resumes: it is mended, or refused in one line."""
    run_again = KINDS[kind]
    before = contents(whole)
    damage(copied(whole, path) / name)
    lock = name.rsplit("/", 1)[-1] == "lock"
    if damage is folder or (damage is link and lock):
        with pytest.raises(CapsuleError) as refused:
            run_again(path, resume=True)
        assert "\n" not in str(refused.value)
        assert name in str(refused.value)
        assert damage is link or (path / name / "thesis").exists()
        return
    assert lock or info_record(path, check=True)["damaged_parts"]
    assert run_again(path, resume=True) > 0 or lock
    assert {k: v for k, v in contents(path).items() if "/other " not in f"/{k}"} == before
    assert not (path / name).is_symlink()
    assert not info_record(path, check=True)["damaged_parts"]


@sampled
def test_a_store_mends_whatever_file_is_damaged(stores, tmp_path) -> None:
    whole = stores("sweep")
    names = sorted(contents(whole))
    # coordinates, arrays, their chunks, records, what describes the store twice, the lock
    assert len(names) >= 1 + 2 * 2 + 3 + 3 * 2 + 2 + 2 + 1
    for i, name in enumerate(names):
        for j in some((i, i + 2), 1):
            damage = DAMAGES[j % len(DAMAGES)]
            damaged_once("sweep", whole, tmp_path / f"{i} {j}", name, damage)


@pytest.mark.long
def test_the_attractors_of_a_basin_are_made_again(stores, tmp_path) -> None:
    for name in ("zarr.json", "c/0/0"):
        for damage in (delete, flip):
            place = f"results.zarr/attractor/{name}"
            damaged_once(
                "basin", stores("basin"), tmp_path / (name[0] + damage.__name__), place, damage
            )


@pytest.mark.long
@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("kind", KINDS)
def test_stores_of_all_kinds_mend_whatever_file_is_damaged(kind, damage, stores, tmp_path) -> None:
    whole = stores(kind)
    for i, name in enumerate(sorted(contents(whole))):
        damaged_once(kind, whole, tmp_path / str(i), name, damage)


@sampled
@pytest.mark.parametrize("file", some([False, True], 1))
def test_folders_that_are_gone_are_made_again_and_files_in_their_place_told_in_one_line(
    file, stores, tmp_path
) -> None:
    whole = stores("sweep")
    names = ("results.zarr", "results.zarr/alpha", "results.zarr/itinerary/c", "chunks")
    for i, name in enumerate(names):
        path = copied(whole, tmp_path / str(i))
        shutil.rmtree(path / name)
        if file:
            (path / name).touch()
            with pytest.raises(CapsuleError) as refused:
                run_small(path, resume=True)
            assert "\n" not in str(refused.value)
            assert name in str(refused.value)
            continue
        assert info_record(path, check=True)["damaged_parts"]
        assert run_small(path, resume=True) > 0
        assert contents(path) == contents(whole)


def test_what_is_no_longer_the_result_is_not_opened(stores, tmp_path) -> None:
    names = ("alpha/c/0", "alpha/zarr.json", "itinerary/zarr.json", "zarr.json")
    cases = [
        *product(names, (delete, truncate, flip)),
        *(("itinerary/c/0/0", damage) for damage in (*DAMAGES[:3], link)),
    ]
    for i, (name, damage) in enumerate(cases):
        path = copied(stores("sweep"), tmp_path / str(i))
        damage(path / "results.zarr" / name)
        what = "chunk 0" if name.startswith("itinerary/c") else f"results.zarr/{name}"
        with pytest.raises(InvalidInput, match=rf"undamaged, but {what} is not: .* --resume mends"):
            open_results(path)


@sampled
@pytest.mark.parametrize("damage", some([delete, truncate, flip], 1))
def test_no_figure_shows_a_damaged_chunk(damage, stores, tmp_path, capsys) -> None:
    path = copied(stores("sweep"), tmp_path / "store")
    damage(path / "results.zarr/period_number/c/0/0")
    with pytest.raises(SystemExit) as done:
        main(["figure", str(path), "--out", str(tmp_path / "chart.svg")])
    assert done.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.fullmatch(
        rf"error: store = '{path}': must be undamaged, but a?.?chunk.* with --resume mends it", line
    )
    assert not (tmp_path / "chart.svg").exists()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("error")
def test_xarray_opens_a_finished_store(kind: str, stores: Callable[[str], Path]) -> None:
    with (
        xr.open_zarr(stores(kind) / "results.zarr", chunks=None) as plain,
        open_results(stores(kind)) as ours,
    ):
        assert plain.load().identical(ours.load())


def test_records_of_another_shape_are_damage(stores: Callable[[str], Path], tmp_path: Path) -> None:
    whole = stores("sweep")
    records = sorted((whole / "chunks").rglob("*.json"))
    shapes = [b"[]", b"3", b"null", b'"x"', b"{}", b"[" * 3000, b"\xff", b"1" * 5000, b'{"a": NaN}']
    # Records that are whole, but of another chunk, or not of a chunk at all.
    shapes += [records[1].read_bytes(), (whole / "sweep.json").read_bytes(), sealed({"files": {}})]
    names = [str(records[0].relative_to(whole)), "sweep.json", "chunks/sweep.copy"]
    for i, name in enumerate(names):
        for j, shape in enumerate(shapes):
            if (whole / name).read_bytes() == shape:
                continue
            path = copied(whole, tmp_path / f"{i} {j}")
            (path / name).write_bytes(shape)
            assert info_record(path, check=True)["damaged_parts"]
            if (i + j) % 5 == 0:
                assert run_small(path, resume=True) > 0
                assert contents(path) == contents(whole)


def test_a_store_of_which_nothing_tells_the_sweep_is_left_alone(stores, tmp_path) -> None:
    path = copied(stores("sweep"), tmp_path / "store")
    for name in ("sweep.json", "chunks/sweep.copy"):
        flip(path / name)
    before = contents(path)
    for act in (lambda: run_small(path, resume=True), lambda: info_record(path)):
        with pytest.raises(InvalidInput, match=r"with an undamaged sweep\.json"):
            act()
    assert contents(path) == before


@pytest.mark.long
def test_a_run_killed_at_its_end_is_not_taken_for_damaged(stores, tmp_path, monkeypatch) -> None:
    """Of the files that the end of a run writes, any number may have come to their places."""
    whole, replace = stores("basin"), os.replace
    count = 10**9

    def killed(*where: Any) -> None:
        nonlocal count
        # Not in the threads in which zarr writes.
        count -= threading.current_thread() is threading.main_thread()
        if count == 0:
            raise KeyboardInterrupt
        replace(*where)

    monkeypatch.setattr(os, "replace", killed)
    run_small_basin(tmp_path / "all")
    total = 10**9 - count
    for left in range(total, total - 18, -3):
        path = tmp_path / str(left)
        count = left
        with pytest.raises(KeyboardInterrupt):
            run_small_basin(path)
        count = 10**9
        assert run_small_basin(path, resume=True) == 0
        assert contents(path) == contents(whole)


def test_a_sweep_does_not_go_on_with_a_basin(stores: Callable[[str], Path], tmp_path: Path) -> None:
    path = copied(stores("basin"), tmp_path / "store")
    compute = ("itinerary", "progression", "final")
    sweep = Sweep(STARTS, Parameters(alpha=1.2), periods=100, chunk=(1, 3), compute=compute)
    with pytest.raises(InvalidInput, match="kind = 'sweep': must be 'basin'"):
        run_sweep(sweep, path, resume=True)


def test_links_are_not_written_through(stores: Callable[[str], Path], tmp_path: Path) -> None:
    path, mine = copied(stores("sweep"), tmp_path / "store"), tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis").write_text("all of it")
    (path / "partial").symlink_to(mine)
    for name in ("sweep.json", "results.zarr/itinerary/c/0/0", "chunks/000000/000000001.json"):
        (path / name).unlink()
        (path / name).symlink_to(mine / "thesis")
    run_small(path, resume=True)
    assert contents(mine) == {"thesis": b"all of it"}
    assert contents(path) == contents(stores("sweep"))


def test_folders_that_are_links_are_not_written_through(stores, tmp_path) -> None:
    names = ("results.zarr", "results.zarr/itinerary/c/0", "chunks", "chunks/000000")
    for i, name in enumerate((*names, "later")):
        path, mine = (
            copied(stores("sweep"), tmp_path / f"{i}" / "store"),
            tmp_path / f"{i}" / "mine",
        )
        if name == "later":  # during a run
            mine.mkdir()
            (path / "partial").mkdir()
            (path / "chunks" / "new").symlink_to(mine)
            with pytest.raises(InvalidInput, match="a folder in the store, not a link"):
                place(b"", path / "chunks" / "new" / "a", path / "partial")
            with pytest.raises(InvalidInput, match="a folder in the store, not a link"):
                move(["new/a"], path, path / "chunks")
            assert contents(mine) == {}
            continue
        (path / name).rename(mine)
        (path / name).symlink_to(mine)
        for record in mine.rglob("*.json"):
            if record.stem == "000000001":
                record.unlink()
        before = contents(mine)
        with pytest.raises(InvalidInput, match=f"{name}': must be a folder in the store, not a l"):
            run_small(path, resume=True)
        assert contents(mine) == before


def sealed_anew(path: Path, edit: Callable[[dict[str, Any]], Any]) -> None:
    """A record with its own checksum after an edit."""
    record = json.loads(path.read_bytes())
    del record["sha256"]
    edit(record)
    path.write_bytes(sealed(record))


HEADS: dict[str, tuple[Any, ...]] = {
    "format": (1, None),
    "kind": (None, 3, "other"),
    "provenance": (None, [], {}, {"command": "", "kernels": "", "core": "", "versions": None}),
    "files": (None, [], {"zarr.json": 1}),
    "ended": (None, [1]),
    "sweep": (None, {}, []),
    "sweep.chunk": ([0, 0], [], [2], ["a", "b"], [2.5, 1], [True, 1], [10**30, 1], None),
    "sweep.compute": (None, ["x"], "itinerary", [[]]),
    "sweep.axes": (None, [], [{}, {}], [3, 3]),
    "sweep.axes.0.count": (-1, 0, 10**30, "4", None),
    "sweep.axes.0.first": (None, ["a"]),
    "sweep.scene": (None, 3),
}
RECORDS: dict[str, tuple[Any, ...]] = {
    "outcomes": (None, {"periodic": "3"}, []),
    "itineraries": (None, {"a": 1}, {"a": [1]}, {"a": ["b", 2]}),
    "reasons": ([], {"0": 1}),
    "core": (None, 3),
    "checksums": ({}, None, {"itinerary": "0"}),
}


def changed(name: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """Edit of one entry of a record, by a path of names and numbers."""

    def edit(record: Any) -> None:
        *way, last = (int(part) if part.isdigit() else part for part in name.split("."))
        for part in way:
            record = record[part]
        record[last] = value

    return edit


def test_records_that_were_changed_and_sealed_anew_have_one_line(stores, tmp_path) -> None:
    path, of_chunk = copied(stores("sweep"), tmp_path / "store"), "chunks/000000/000000000.json"
    acts = open_results, info_record, lambda store: run_small(store, resume=True)
    held = {name: (path / name).read_bytes() for name in ("sweep.json", of_chunk)}
    for name, values in HEADS.items():
        for value in values:
            for file in ("sweep.json", "chunks/sweep.copy"):
                (path / file).write_bytes(held["sweep.json"])
                sealed_anew(path / file, changed(name, value))
            for act in acts:
                with pytest.raises(InvalidInput) as refused:
                    pytest.fail(f"{name} = {value!r}: {act(path)!r}")
                assert "\n" not in str(refused.value)
                assert len(str(refused.value)) < 300
    for file in ("sweep.json", "chunks/sweep.copy"):
        (path / file).write_bytes(held["sweep.json"])
    for name, values in RECORDS.items():
        for value in values:
            sealed_anew(path / of_chunk, changed(name, value))
            for act in acts[:2]:
                with pytest.raises(InvalidInput, match="undamaged, but chunk 0 is not: the same `"):
                    act(path)
            (path / of_chunk).write_bytes(held[of_chunk])


def test_chunks_in_each_others_places_are_damage(stores, tmp_path) -> None:
    whole = stores("basin")
    path = copied(whole, tmp_path / "store")
    one, two = (path / "results.zarr" / "final" / "c" / name for name in ("0/0/0", "1/0/0"))
    data = one.read_bytes()
    assert data != two.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(data)
    for act in (open_results, info_record):
        with pytest.raises(InvalidInput, match=r"but chunk 0 is not: .* with --resume mends it$"):
            act(path)
    assert info_record(path, check=True)["damaged_parts"] == ["chunk 0", "chunk 1"]
    assert run_small_basin(path, resume=True) == 2
    assert contents(path) == contents(whole)


def test_another_sweep_is_told_in_a_short_line(stores, tmp_path) -> None:
    path = copied(stores("sweep"), tmp_path / "s")
    many = [Axis.linear(name, 0.5, 0.7, 3) for name in ("alpha", "omega", "zeta", "beta", "f_b")]
    others = {
        "^axes = .5 values of alpha from 0.01 to 2.: must be .4 values": replace(
            SMALL, axes=(Axis.linear("alpha", 0.01, 2.0, 5), SMALL.axes[1])
        ),
        "^axes = .3 values of alpha .*; 3 values of omega .*; 3 more.": Sweep((*many,), periods=5),
        r"^parameters = {'zeta': 0.0123456789}: must be {'zeta': 0.05}, as": replace(
            SMALL, parameters=Parameters(zeta=0.0123456789)
        ),
        "^periods = 6": chart(4, 3, periods=6),
    }
    for said, other in others.items():
        with pytest.raises(InvalidInput, match=said) as refused:
            run_sweep(other, path, resume=True)
        assert len(str(refused.value).replace(str(path), "s")) < 200
        assert "did you mean" not in str(refused.value)
